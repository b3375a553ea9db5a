//! Fields on the staggered grid. The location is part of the type: a face field cannot be passed
//! for a centre field.
//!
//! Every field has one ghost layer on each side and the same shape (nx+2, ny+2, nz+2), x fastest.
//! In memory a row is padded to a multiple of eight entries, and i = 1 starts a cache line (half a
//! line in every other row of singles), so that a vector of neighbours does not straddle two lines.
//! Cell (i, j, k) of the interior has 1 <= i <= nx and so on. A face field stores the *lower* face
//! of each cell: face i of `FaceX` lies between cells i-1 and i, so a box with walls has its upper
//! boundary face at index nx+1.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use super::{Layout, Mesh};
use crate::math::{Aligned, Real};

/// Location on the staggered cell.
pub trait Location: Copy + Send + Sync + 'static {
    /// Offset from the cell's lower corner in units of the spacing.
    const OFFSET: [f64; 3];
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
}
impl Location for FaceX {
    const OFFSET: [f64; 3] = [0.0, 0.5, 0.5];
}
impl Location for FaceY {
    const OFFSET: [f64; 3] = [0.5, 0.0, 0.5];
}
impl Location for FaceZ {
    const OFFSET: [f64; 3] = [0.5, 0.5, 0.0];
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
    /// Field of zeros on the cells of `mesh`.
    pub fn zeros(mesh: &Mesh) -> Self {
        let layout = mesh.layout();
        Field { layout, values: Aligned::with_head(1, layout.len()), location: PhantomData }
    }
    /// Layout in memory.
    #[inline]
    pub(crate) fn layout(&self) -> Layout {
        self.layout
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
    /// Vector field of zeros on the cells of `mesh`.
    pub fn zeros(mesh: &Mesh) -> Self {
        FaceVector { x: Field::zeros(mesh), y: Field::zeros(mesh), z: Field::zeros(mesh) }
    }
    /// Copies all values of `other`, ghosts included.
    pub fn copy_from(&mut self, other: &FaceVector<R>) {
        for axis in 0..3 {
            self.component_mut(axis).copy_from_slice(other.component(axis));
        }
    }
    /// Mutable values of all components in memory.
    pub fn components_mut(&mut self) -> [&mut [R]; 3] {
        [&mut self.x, &mut self.y, &mut self.z]
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
mod tests;
