//! Values of whole fields for the start of a run: from positions, or from the rows of a checkpoint.

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
