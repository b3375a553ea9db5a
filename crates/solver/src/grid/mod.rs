//! The uniform staggered (MAC) grid: cells of constant spacing, axis order x, y, z, x fastest.
//!
//! Positions depend on the index of a cell in the box ([`GlobalCell`]); fields are indexed by the
//! cells of their own slab ([`LocalCell`]). `field.rs` has the typed fields, `loops.rs` the loops
//! in a fixed order.

mod field;
mod loops;

pub use field::FieldView;
pub(crate) use field::{Centre, FACE_OFFSET, FaceVector, Field};
#[cfg(test)]
pub(crate) use field::{FaceZ, Location};
pub(crate) use loops::{
    BorrowedRow, Columns, PlaneRange, SharedRows, borrowed_rows, for_chunks, for_columns,
    for_plane_ranges, for_planes_of, for_slabs,
};

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
    /// Upper corner of the box [m].
    pub fn upper(&self) -> DVec3 {
        self.origin + self.extent()
    }
    /// All planes of the box as one slab.
    pub fn whole(&self) -> Slab {
        self.slab(0, self.cells[2])
    }
    /// Slab of `planes` planes of cells above the first `below` planes of the box.
    pub fn slab(&self, below: usize, planes: usize) -> Slab {
        assert!(planes > 0 && below + planes <= self.cells[2]);
        Slab { mesh: *self, below, planes }
    }
    /// Memory layout of the fields of the whole box.
    pub(crate) fn layout(&self) -> Layout {
        Layout { cells: self.cells }
    }
    /// Position [m] of the point `offset` (in spacings from the lower corner) of a cell.
    #[inline]
    pub fn position(&self, offset: [f64; 3], GlobalCell(index): GlobalCell) -> DVec3 {
        self.origin
            + self.spacing
                * DVec3::new(
                    index[0] as f64 - 1.0 + offset[0],
                    index[1] as f64 - 1.0 + offset[1],
                    index[2] as f64 - 1.0 + offset[2],
                )
    }
}

/// Index of a cell of the whole box, counted from 1 along each axis; 0 and n + 1 are ghost cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GlobalCell(pub [usize; 3]);

/// Index of a cell of a [`Slab`] and of its fields, counted from 1 along each axis; 0 and n + 1 are
/// ghost cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LocalCell(pub [usize; 3]);

/// Consecutive planes of the box along z, whose fields lie in one memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slab {
    mesh: Mesh,
    /// Planes of the box below the slab.
    below: usize,
    planes: usize,
}

impl Slab {
    /// Mesh of the whole box.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }
    /// Memory layout of the fields of the slab.
    pub(crate) fn layout(&self) -> Layout {
        let [nx, ny, _] = self.mesh.cells;
        Layout { cells: [nx, ny, self.planes] }
    }
    /// Index in the box of a cell of the slab.
    pub fn global(&self, LocalCell([i, j, k]): LocalCell) -> GlobalCell {
        GlobalCell([i, j, k + self.below])
    }
    /// Index in the slab of a cell of the box; none if neither the slab nor its ghosts hold the
    /// cell.
    pub fn local(&self, GlobalCell([i, j, k]): GlobalCell) -> Option<LocalCell> {
        let k = k.checked_sub(self.below)?;
        (k <= self.planes + 1).then_some(LocalCell([i, j, k]))
    }
    /// Position [m] of the point `offset` (in spacings from the lower corner) of a cell.
    #[inline]
    pub fn position(&self, offset: [f64; 3], cell: LocalCell) -> DVec3 {
        self.mesh.position(offset, self.global(cell))
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
    /// Entries of a field, ghosts included, padding excluded.
    pub fn entries(&self) -> usize {
        self.cells.iter().map(|n| n + 2).product()
    }
    /// Rows of a field, ghosts included, padding excluded.
    pub fn rows<'a, T>(
        &self,
        values: &'a [T],
    ) -> impl ExactSizeIterator<Item = &'a [T]> + use<'a, T> {
        let entries = self.cells[0] + 2;
        values.chunks_exact(self.row()).map(move |row| &row[..entries])
    }
    /// Mutable rows of a field, ghosts included, padding excluded.
    pub fn rows_mut<'a, T>(
        &self,
        values: &'a mut [T],
    ) -> impl ExactSizeIterator<Item = &'a mut [T]> + use<'a, T> {
        let entries = self.cells[0] + 2;
        values.chunks_exact_mut(self.row()).map(move |row| &mut row[..entries])
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
    /// Distance in memory between neighbours along each axis.
    #[inline]
    pub fn strides(&self) -> [usize; 3] {
        [1, self.row(), self.plane()]
    }
    /// Copies both outermost interior layers of a periodic axis onto the ghosts across the box.
    pub fn wrap<T: Copy>(&self, values: &mut [T], axis: usize) {
        let n = self.cells[axis];
        self.map_layer(values, axis, n, 0, |value| value);
        self.map_layer(values, axis, 1, n + 1, |value| value);
    }
    /// Sets layer `to` to `f` of layer `from`, both of `axis`, ghosts of the other axes included.
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
        let mut set = |at: usize| values[at] = f(values[at.wrapping_add_signed(shift)]);
        match axis {
            0 => (0..self.len() / row).for_each(|line| set(line * row + to)),
            1 => (0..self.len() / plane)
                .for_each(|k| (0..row).for_each(|i| set(k * plane + to * row + i))),
            _ => (0..plane).for_each(|at| set(to * plane + at)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use super::{FACE_OFFSET, FaceZ, Field};

    #[test]
    fn the_faces_of_a_slab_lie_where_those_of_the_box_lie() {
        let mesh = Mesh {
            cells: [3, 2, 12],
            spacing: DVec3::new(0.1, 0.2, 0.3),
            origin: DVec3::new(-0.7, 0.0, 1.1),
        };
        let slab = mesh.slab(5, 4);
        assert_eq!(slab.layout().cells, [3, 2, 4]);
        for k in 0..=5 {
            let (local, global) = (LocalCell([3, 1, k]), GlobalCell([3, 1, k + 5]));
            assert_eq!(slab.global(local), global);
            assert_eq!(slab.local(global), Some(local));
            for offset in FACE_OFFSET {
                assert_eq!(slab.position(offset, local), mesh.position(offset, global));
            }
        }
        assert_eq!(slab.local(GlobalCell([1, 1, 4])), None);
        assert_eq!(slab.local(GlobalCell([1, 1, 11])), None);
        let value = |x: DVec3| x.x + 3.0 * x.y + 7.0 * x.z;
        let (mut part, mut all) =
            (Field::<FaceZ>::zeros(&slab), Field::<FaceZ, f64>::zeros(&mesh.whole()));
        part.fill_with(&slab, value);
        all.fill_with(&mesh.whole(), value);
        let (part, all) = (part.view(&slab), all.view(&mesh.whole()));
        for k in 0..=4 {
            assert_eq!(part.row(k, 1), all.row(k + 5, 1));
            let [here, there] = [part.position([k, 1, 2]), all.position([k + 5, 1, 2])];
            assert_eq!(here, there);
        }
    }
}
