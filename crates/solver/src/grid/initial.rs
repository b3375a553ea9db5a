//! Values of whole fields for the start of a run: from positions, from the rows of a checkpoint,
//! and on the boundary of the box.

use glam::DVec3;

use super::field::{FaceVector, Field, Location};
use super::{Layout, Mesh};
use crate::math::Real;

impl Layout {
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
}

impl<L: Location, R: Real> Field<L, R> {
    /// Sets every interior value from its position [m].
    pub fn fill_with(&mut self, mesh: &Mesh, f: impl Fn(DVec3) -> f64) {
        let [nx, ny, nz] = mesh.cells;
        for k in 1..=nz + 1 {
            for j in 1..=ny + 1 {
                for i in 1..=nx + 1 {
                    let value = f(mesh.position(L::OFFSET, [i, j, k]));
                    self[mesh.layout().index(i, j, k)] = R::of(value);
                }
            }
        }
    }
}

impl<R: Real> FaceVector<R> {
    /// Sets every value to one vector.
    pub fn fill(&mut self, value: DVec3) {
        for axis in 0..3 {
            self.component_mut(axis).fill(R::of(value[axis]));
        }
    }
    /// Sets every interior value to `component(axis, position)` [m].
    pub fn fill_with(&mut self, mesh: &Mesh, component: impl Fn(usize, DVec3) -> f64) {
        self.x.fill_with(mesh, |at| component(0, at));
        self.y.fill_with(mesh, |at| component(1, at));
        self.z.fill_with(mesh, |at| component(2, at));
    }
}
