//! Access to single values for tests, and the layout in memory.

use super::*;
use glam::DVec3;

impl<L: Location, R: Real> Field<L, R> {
    /// Value at (i, j, k); ghosts at 0 and n+1.
    pub fn at(&self, i: usize, j: usize, k: usize) -> R {
        self.values[self.layout.index(i, j, k)]
    }
    /// Sets the value at (i, j, k).
    pub fn set(&mut self, i: usize, j: usize, k: usize, value: R) {
        let at = self.layout.index(i, j, k);
        self.values[at] = value;
    }
    /// One row, ghosts included.
    pub fn row(&self, j: usize, k: usize) -> &[R] {
        let start = self.layout.index(0, j, k);
        &self.values[start..start + self.layout.row()]
    }
    /// Copies the interior across the box on a periodic axis (the upper boundary face included).
    pub fn wrap(&mut self, axis: usize) {
        self.layout.wrap(&mut self.values, axis);
    }
    /// Copies the layer `from` of an axis onto the layer `to`.
    pub fn copy_layer(&mut self, axis: usize, from: usize, to: usize) {
        self.layout.map_layer(&mut self.values, axis, from, to, |value| value);
    }
}

impl<L, R: Real> Clone for Field<L, R> {
    fn clone(&self) -> Self {
        let mut values = Aligned::with_head(1, self.values.len());
        values.copy_from_slice(&self.values);
        Field { layout: self.layout, values, location: PhantomData }
    }
}

impl<R: Real> Clone for FaceVector<R> {
    fn clone(&self) -> Self {
        FaceVector { x: self.x.clone(), y: self.y.clone(), z: self.z.clone() }
    }
}

#[test]
fn rows_start_on_cache_lines_and_have_their_entries() {
    let mesh = Mesh { cells: [5, 3, 2], spacing: DVec3::ONE, origin: DVec3::ZERO };
    let layout = mesh.layout();
    let mut field = Field::<Centre>::zeros(&mesh);
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
