//! The uniform staggered (MAC) grid: cells of constant spacing, axis order x, y, z, x fastest.
//!
//! Cells are counted from 1 along each axis; 0 and n + 1 are ghost cells. `field.rs` has the typed
//! fields, `loops.rs` the loops in a fixed order, `initial.rs` the start of a run, `view.rs` the
//! values without ghosts, `near.rs` the cells near a coordinate.

mod borrowed;
mod field;
mod initial;
mod loops;
mod near;
mod view;

pub(crate) use borrowed::{BorrowedRow, ROWS_RECORDED, borrowed_rows};
pub(crate) use field::{Centre, FACE_OFFSET, FaceVector, Field};
#[cfg(test)]
pub(crate) use field::{FaceZ, Location};
pub(crate) use loops::{Columns, SharedRows, columns_of, for_slabs, planes_of};
pub use view::FieldView;

use glam::DVec3;

/// Axis of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// First axis, fastest in memory.
    X = 0,
    /// Second axis.
    Y = 1,
    /// Third axis, slowest in memory.
    Z = 2,
}

/// Cells, spacing and lower corner of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Cells along x, y, z; 1 makes a flat (two-dimensional) axis.
    pub cells: [usize; 3],
    /// Cell edge along x, y, z [m].
    pub spacing: DVec3,
    /// Lower corner of the box [m].
    pub origin: DVec3,
}

impl Mesh {
    /// Mesh of cubic cells of edge `spacing` [m] with its lower corner at the origin.
    pub fn cubic(cells: [usize; 3], spacing: f64) -> Mesh {
        Mesh { cells, spacing: DVec3::splat(spacing), origin: DVec3::ZERO }
    }
    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }
    /// Volume of one cell [m^3].
    pub fn cell_volume(&self) -> f64 {
        self.spacing.element_product()
    }
    /// Edge lengths of the box [m].
    pub fn extent(&self) -> DVec3 {
        self.spacing * DVec3::new(self.cells[0] as f64, self.cells[1] as f64, self.cells[2] as f64)
    }
    /// Axes that are not flat: more than one cell.
    pub fn resolved_axes(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        let mesh = *self;
        (0..3).filter(move |&axis| mesh.is_resolved(axis))
    }
    /// Whether the grid has more than one cell along `axis`.
    pub fn is_resolved(&self, axis: usize) -> bool {
        self.cells[axis] > 1
    }
    /// 1/h along each axis [1/m]; zero along an axis of one cell, along which nothing changes.
    pub fn per_spacing(&self) -> DVec3 {
        let along = |axis| if self.is_resolved(axis) { 1.0 / self.spacing[axis] } else { 0.0 };
        DVec3::from_array([0, 1, 2].map(along))
    }
    /// Upper corner of the box [m].
    pub fn upper(&self) -> DVec3 {
        self.origin + self.extent()
    }
    /// Indices [i, j, k] of all cells, from 1 on.
    #[cfg(test)]
    pub(crate) fn indices(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let [nx, ny, nz] = self.cells;
        (1..=nz).flat_map(move |k| (1..=ny).flat_map(move |j| (1..=nx).map(move |i| [i, j, k])))
    }
    /// Memory layout of the fields of the whole box.
    pub(crate) fn layout(&self) -> Layout {
        Layout { cells: self.cells }
    }
    /// Position [m] of the point `offset` (in spacings from the lower corner) of a cell.
    #[inline]
    pub fn position(&self, offset: [f64; 3], cell: [usize; 3]) -> DVec3 {
        let along = |axis: usize| cell[axis] as f64 - 1.0 + offset[axis];
        self.origin + self.spacing * DVec3::new(along(0), along(1), along(2))
    }
}

/// Memory layout shared by all fields of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Interior cells along x, y, z.
    pub cells: [usize; 3],
}

impl Layout {
    /// Length of a row in memory: entries, ghosts and padding to a multiple of eight.
    #[inline]
    pub fn row(&self) -> usize {
        (self.cells[0] + 2).next_multiple_of(8)
    }
    /// Length of a plane in memory, ghosts and padding included.
    #[inline]
    pub fn plane(&self) -> usize {
        self.row() * (self.cells[1] + 2)
    }
    /// Length of a field in memory, ghosts and padding included.
    #[inline]
    pub fn len(&self) -> usize {
        self.plane() * (self.cells[2] + 2)
    }
    /// Position of (i, j, k) in memory.
    #[inline]
    pub fn index(&self, i: usize, j: usize, k: usize) -> usize {
        i + self.row() * (j + (self.cells[1] + 2) * k)
    }
    /// Plane `k` of a field, ghosts included.
    #[inline(always)]
    pub fn plane_of<'a, T>(&self, values: &'a [T], k: usize) -> &'a [T] {
        &values[k * self.plane()..][..self.plane()]
    }
    /// Row `j` of a plane: its entries 0 to n + 1.
    #[inline(always)]
    pub fn row_of<'a, T>(&self, plane: &'a [T], j: usize) -> &'a [T] {
        &plane[j * self.row()..][..self.cells[0] + 2]
    }
    /// Mutable row `j` of a plane.
    #[inline(always)]
    pub fn row_of_mut<'a, T>(&self, plane: &'a mut [T], j: usize) -> &'a mut [T] {
        &mut plane[j * self.row()..][..self.cells[0] + 2]
    }
    /// Row `j` of three planes.
    #[inline(always)]
    pub fn rows_of<'a, T>(&self, [x, y, z]: [&'a [T]; 3], j: usize) -> [&'a [T]; 3] {
        [self.row_of(x, j), self.row_of(y, j), self.row_of(z, j)]
    }
    /// Mutable row `j` of three planes.
    #[inline(always)]
    pub fn rows_of_mut<'a, T>(
        &self,
        [x, y, z]: &'a mut [&mut [T]; 3],
        j: usize,
    ) -> [&'a mut [T]; 3] {
        [self.row_of_mut(x, j), self.row_of_mut(y, j), self.row_of_mut(z, j)]
    }
    /// Copies both outermost interior layers of a periodic axis onto the ghosts across the box.
    pub fn wrap<T: Copy>(&self, values: &mut [T], axis: usize) {
        let n = self.cells[axis];
        self.map_layer(values, axis, n, 0, |value| value);
        self.map_layer(values, axis, 1, n + 1, |value| value);
    }
    /// Sets layer `to` to `f` of layer `from`, both of `axis`, ghosts of the other axes included.
    /// `values` are a field, or a plane for the axes x and y.
    pub fn map_layer<T: Copy>(
        &self,
        values: &mut [T],
        axis: usize,
        from: usize,
        to: usize,
        f: impl Fn(T) -> T,
    ) {
        let [_, row, plane] = self.strides();
        let shift = (from as isize - to as isize) * self.strides()[axis] as isize;
        let len = values.len();
        let mut set = |at: usize| values[at] = f(values[at.wrapping_add_signed(shift)]);
        match axis {
            0 => (0..len / row).for_each(|line| set(line * row + to)),
            1 => {
                (0..len / plane).for_each(|k| (0..row).for_each(|i| set(k * plane + to * row + i)))
            }
            _ => (0..plane).for_each(|at| set(to * plane + at)),
        }
    }
    /// Distance in memory between neighbours along each axis.
    #[inline]
    pub fn strides(&self) -> [usize; 3] {
        [1, self.row(), self.plane()]
    }
}
