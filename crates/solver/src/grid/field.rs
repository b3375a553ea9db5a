//! Fields on the staggered grid. The location is part of the type: a face field cannot be passed
//! for a centre field.
//!
//! Every field has one ghost layer on each side and the same shape (nx+2, ny+2, nz+2), x fastest.
//! In memory a row is padded to a multiple of eight entries, and i = 1 starts a cache line (half a
//! line in every other row of singles), so that a vector of neighbours does not straddle two lines.
//! Cell (i, j, k) of the interior has 1 <= i <= nx and so on. A face field stores the *lower* face
//! of each cell: face i of `FaceX` lies between cells i-1 and i, so a box with walls has its upper
//! boundary face at index nx+1. [`FieldView`] shows the values without ghosts to users of the
//! library.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use glam::DVec3;

use super::{Axis, Layout, LocalCell, Slab};
use crate::math::{Aligned, Real};

/// Location on the staggered cell.
pub trait Location: Copy + Send + Sync + 'static {
    /// Offset from the cell's lower corner in units of the spacing.
    const OFFSET: [f64; 3];
    /// Axis normal to the faces; none for cell centres.
    const NORMAL: Option<Axis>;
}

/// Cell centres.
#[derive(Clone, Copy, Debug)]
pub struct Centre;
/// Faces normal to x (lower face of each cell).
#[derive(Clone, Copy, Debug)]
pub struct FaceX;
/// Faces normal to y.
#[derive(Clone, Copy, Debug)]
pub struct FaceY;
/// Faces normal to z.
#[derive(Clone, Copy, Debug)]
pub struct FaceZ;

impl Location for Centre {
    const OFFSET: [f64; 3] = [0.5, 0.5, 0.5];
    const NORMAL: Option<Axis> = None;
}
impl Location for FaceX {
    const OFFSET: [f64; 3] = [0.0, 0.5, 0.5];
    const NORMAL: Option<Axis> = Some(Axis::X);
}
impl Location for FaceY {
    const OFFSET: [f64; 3] = [0.5, 0.0, 0.5];
    const NORMAL: Option<Axis> = Some(Axis::Y);
}
impl Location for FaceZ {
    const OFFSET: [f64; 3] = [0.5, 0.5, 0.0];
    const NORMAL: Option<Axis> = Some(Axis::Z);
}

/// Offsets of the three face locations, indexed by axis.
pub const FACE_OFFSET: [[f64; 3]; 3] = [FaceX::OFFSET, FaceY::OFFSET, FaceZ::OFFSET];

/// Values at one location of every cell.
#[derive(Debug)]
pub struct Field<L, R = f64> {
    layout: Layout,
    values: Aligned<R>,
    location: PhantomData<L>,
}

impl<L: Location, R: Real> Field<L, R> {
    /// Field of zeros on the cells of `slab`.
    pub fn zeros(slab: &Slab) -> Self {
        let layout = slab.layout();
        Field { layout, values: Aligned::with_head(1, layout.len()), location: PhantomData }
    }
    /// Layout in memory.
    #[inline]
    pub(crate) fn layout(&self) -> Layout {
        self.layout
    }
    /// Read-only view of all values without ghosts.
    pub fn view<'a>(&'a self, slab: &Slab) -> FieldView<'a, R> {
        FieldView::new(self, slab, L::NORMAL)
    }
    /// Value at (i, j, k); ghosts at 0 and n+1.
    #[cfg(test)]
    #[inline]
    pub fn at(&self, i: usize, j: usize, k: usize) -> R {
        self.values[self.layout.index(i, j, k)]
    }
    /// Sets the value at (i, j, k).
    #[inline]
    pub fn set(&mut self, i: usize, j: usize, k: usize, value: R) {
        let at = self.layout.index(i, j, k);
        self.values[at] = value;
    }
    /// One row, ghosts included.
    #[cfg(test)]
    #[inline]
    pub fn row(&self, j: usize, k: usize) -> &[R] {
        let start = self.layout.index(0, j, k);
        &self.values[start..start + self.layout.row()]
    }
    /// Sets every interior value from its position [m].
    pub fn fill_with(&mut self, slab: &Slab, f: impl Fn(DVec3) -> f64) {
        let [nx, ny, nz] = self.layout.cells;
        for k in 1..=nz + 1 {
            for j in 1..=ny + 1 {
                for i in 1..=nx + 1 {
                    let value = f(slab.position(L::OFFSET, LocalCell([i, j, k])));
                    self.set(i, j, k, R::of(value));
                }
            }
        }
    }
    /// Copies the interior across the box on a periodic axis (the upper boundary face included).
    #[cfg(test)]
    pub fn wrap(&mut self, axis: usize) {
        self.layout.wrap(&mut self.values, axis);
    }
    /// Copies the layer `from` of an axis onto the layer `to`.
    #[cfg(test)]
    pub fn copy_layer(&mut self, axis: usize, from: usize, to: usize) {
        self.layout.map_layer(&mut self.values, axis, from, to, |value| value);
    }
}

#[cfg(test)]
impl<L, R: Real> Clone for Field<L, R> {
    fn clone(&self) -> Self {
        let mut values = Aligned::with_head(1, self.values.len());
        values.copy_from_slice(&self.values);
        Field { layout: self.layout, values, location: PhantomData }
    }
}

impl<L, R> Deref for Field<L, R> {
    type Target = [R];
    #[inline]
    fn deref(&self) -> &[R] {
        &self.values
    }
}
impl<L, R> DerefMut for Field<L, R> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [R] {
        &mut self.values
    }
}

/// The three components of a vector field, each on its own faces.
#[derive(Debug)]
pub struct FaceVector<R = f64> {
    /// x component on x faces.
    pub x: Field<FaceX, R>,
    /// y component on y faces.
    pub y: Field<FaceY, R>,
    /// z component on z faces.
    pub z: Field<FaceZ, R>,
}

impl<R: Real> FaceVector<R> {
    /// Vector field of zeros on the cells of `slab`.
    pub fn zeros(slab: &Slab) -> Self {
        FaceVector { x: Field::zeros(slab), y: Field::zeros(slab), z: Field::zeros(slab) }
    }
    /// Copies all values of `other`, ghosts included.
    pub fn copy_from(&mut self, other: &FaceVector<R>) {
        for axis in 0..3 {
            self.component_mut(axis).copy_from_slice(other.component(axis));
        }
    }
    /// Sets every value to one vector.
    pub fn fill(&mut self, value: DVec3) {
        for axis in 0..3 {
            self.component_mut(axis).fill(R::of(value[axis]));
        }
    }
    /// Sets every interior value to `component(axis, position)` [m].
    pub fn fill_with(&mut self, slab: &Slab, component: impl Fn(usize, DVec3) -> f64) {
        self.x.fill_with(slab, |at| component(0, at));
        self.y.fill_with(slab, |at| component(1, at));
        self.z.fill_with(slab, |at| component(2, at));
    }
    /// Read-only view of one component without ghosts.
    pub fn view<'a>(&'a self, axis: Axis, slab: &Slab) -> FieldView<'a, R> {
        FieldView::new(self.component(axis as usize), slab, Some(axis))
    }
    /// Values of one component in memory.
    #[inline]
    pub fn component(&self, axis: usize) -> &[R] {
        match axis {
            0 => &self.x,
            1 => &self.y,
            _ => &self.z,
        }
    }
    /// Mutable values of one component in memory.
    #[inline]
    pub fn component_mut(&mut self, axis: usize) -> &mut [R] {
        match axis {
            0 => &mut self.x,
            1 => &mut self.y,
            _ => &mut self.z,
        }
    }
}

#[cfg(test)]
impl<R: Real> Clone for FaceVector<R> {
    fn clone(&self) -> Self {
        FaceVector { x: self.x.clone(), y: self.y.clone(), z: self.z.clone() }
    }
}

/// All values of one field without ghosts, indexed by [k, j, i] (z, y, x order), counted from 0.
///
/// A component on faces has one more entry along its own axis than there are cells: the first and
/// the last lie on the boundary of the box. On a periodic axis these two are equal.
#[derive(Clone, Copy, Debug)]
pub struct FieldView<'a, R> {
    values: &'a [R],
    shape: [usize; 3],
    slab: Slab,
    normal: Option<Axis>,
}

impl<'a, R: Copy> FieldView<'a, R> {
    /// View of the padded `field` on the faces `normal` to an axis, or on the cell centres.
    pub(crate) fn new(field: &'a [R], slab: &Slab, normal: Option<Axis>) -> FieldView<'a, R> {
        let layout = slab.layout();
        assert_eq!(field.len(), layout.len());
        let mut entries = layout.cells;
        if let Some(axis) = normal {
            entries[axis as usize] += 1;
        }
        let [nx, ny, nz] = entries;
        FieldView {
            values: &field[layout.index(1, 1, 1)..=layout.index(nx, ny, nz)],
            shape: [nz, ny, nx],
            slab: *slab,
            normal,
        }
    }

    /// Values in memory: entry [k, j, i] lies at the sum of its indices times the strides.
    pub fn values(&self) -> &'a [R] {
        self.values
    }
    /// Number of entries along z, y, x.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }
    /// Distance in memory between neighbours along z, y, x [entries]; rows are padded.
    pub fn strides(&self) -> [usize; 3] {
        let [x, y, z] = self.slab.layout().strides();
        [z, y, x]
    }
    /// Axis normal to the faces that hold the values; none for values at cell centres.
    pub fn normal(&self) -> Option<Axis> {
        self.normal
    }
    /// Position of entry [0, 0, 0] [m].
    pub fn origin(&self) -> DVec3 {
        self.position([0; 3])
    }
    /// Distance between neighbours along x, y, z [m].
    pub fn spacing(&self) -> DVec3 {
        self.slab.mesh().spacing
    }
    /// Position of entry [k, j, i] [m].
    pub fn position(&self, [k, j, i]: [usize; 3]) -> DVec3 {
        let mut offset = [0.5; 3];
        if let Some(axis) = self.normal {
            offset[axis as usize] = 0.0;
        }
        self.slab.position(offset, LocalCell([i + 1, j + 1, k + 1]))
    }
    /// Row of entries along x at plane `k` and line `j`. Panics outside the shape.
    pub fn row(&self, k: usize, j: usize) -> &'a [R] {
        let [nz, ny, nx] = self.shape;
        assert!(k < nz && j < ny, "row [{k}, {j}] of a view of {nz} x {ny} rows");
        let [z, y, _] = self.strides();
        &self.values[k * z + j * y..][..nx]
    }
    /// All rows in memory order: j fastest, then k.
    pub fn rows(self) -> impl Iterator<Item = &'a [R]> {
        let [nz, ny, _] = self.shape;
        (0..nz).flat_map(move |k| (0..ny).map(move |j| self.row(k, j)))
    }
    /// Value of entry [k, j, i]. Panics outside the shape.
    pub fn get(&self, [k, j, i]: [usize; 3]) -> R {
        self.row(k, j)[i]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{FaceZ, Field, Location, Mesh};
    use super::*;

    #[test]
    fn rows_start_on_cache_lines_and_have_their_entries() {
        let mesh = Mesh { cells: [5, 3, 2], spacing: DVec3::ONE, origin: DVec3::ZERO };
        let layout = mesh.layout();
        let mut field = Field::<Centre>::zeros(&mesh.whole());
        for (n, row) in layout.rows_mut(&mut field).enumerate() {
            assert_eq!(row.len(), 7);
            assert!(row[1..].as_ptr().addr().is_multiple_of(64));
            row.fill(n as f64);
        }
        assert_eq!(layout.rows(&field).len(), 5 * 4);
        assert_eq!(layout.entries(), 7 * 5 * 4);
        assert_eq!(field.at(6, 2, 1), 7.0);
        assert_eq!(field.at(0, 3, 1), 8.0);
    }

    #[test]
    fn a_view_has_the_values_of_its_positions() {
        let mesh = Mesh {
            cells: [5, 3, 2],
            spacing: DVec3::new(0.1, 0.2, 0.3),
            origin: DVec3::new(-1.0, 2.0, 0.0),
        };
        let slab = mesh.whole();
        let mut field = Field::<FaceZ>::zeros(&slab);
        field.fill_with(&slab, |x| x.x + 10.0 * x.y + 100.0 * x.z);
        let view = field.view(&slab);
        assert_eq!(view.shape(), [3, 3, 5]);
        assert_eq!(view.normal(), Some(Axis::Z));
        assert_eq!(view.origin(), slab.position(FaceZ::OFFSET, LocalCell([1; 3])));
        assert_eq!((view.get([0; 3]), view.spacing()), (view.values()[0], mesh.spacing));
        let mut rows = 0;
        for (n, row) in view.rows().enumerate() {
            for (i, value) in row.iter().enumerate() {
                let at = [n / 3, n % 3, i];
                let x = view.position(at);
                assert_eq!(*value, x.x + 10.0 * x.y + 100.0 * x.z);
                let place: usize = (0..3).map(|a| at[a] * view.strides()[a]).sum();
                assert_eq!((view.get(at), view.values()[place]), (*value, *value));
            }
            rows += 1;
        }
        assert_eq!(rows, 9);
    }
}
