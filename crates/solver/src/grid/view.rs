//! Views of the values of a field for users of the library.

use glam::DVec3;

use super::{Axis, Mesh};

/// All values of one field without ghosts, indexed by [k, j, i] (z, y, x order), counted from 0.
///
/// A component on faces has one more entry along its own axis than there are cells: the first and
/// the last lie on the boundary of the box. On a periodic axis these two are equal.
#[derive(Clone, Copy, Debug)]
pub struct FieldView<'a, R> {
    values: &'a [R],
    shape: [usize; 3],
    mesh: Mesh,
    normal: Option<Axis>,
}

impl<'a, R: Copy> FieldView<'a, R> {
    /// View of the padded `field` on the faces `normal` to an axis, or on the cell centres.
    pub(crate) fn new(field: &'a [R], mesh: &Mesh, normal: Option<Axis>) -> FieldView<'a, R> {
        let layout = mesh.layout();
        assert_eq!(field.len(), layout.len());
        let mut entries = layout.cells;
        if let Some(axis) = normal {
            entries[axis as usize] += 1;
        }
        let [nx, ny, nz] = entries;
        FieldView {
            values: &field[layout.index(1, 1, 1)..=layout.index(nx, ny, nz)],
            shape: [nz, ny, nx],
            mesh: *mesh,
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
        let [x, y, z] = self.mesh.layout().strides();
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
        self.mesh.spacing
    }
    /// Position of entry [k, j, i] [m].
    pub fn position(&self, [k, j, i]: [usize; 3]) -> DVec3 {
        let mut offset = [0.5; 3];
        if let Some(axis) = self.normal {
            offset[axis as usize] = 0.0;
        }
        self.mesh.position(offset, [i + 1, j + 1, k + 1])
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
    use super::super::{FaceZ, Field, Location};
    use super::*;

    #[test]
    fn a_view_has_the_values_of_its_positions() {
        let mesh = Mesh {
            cells: [5, 3, 2],
            spacing: DVec3::new(0.1, 0.2, 0.3),
            origin: DVec3::new(-1.0, 2.0, 0.0),
        };
        let mut field = Field::<FaceZ>::zeros(&mesh);
        field.fill_with(&mesh, |x| x.x + 10.0 * x.y + 100.0 * x.z);
        let view = FieldView::new(&field, &mesh, Some(Axis::Z));
        assert_eq!(view.shape(), [3, 3, 5]);
        assert_eq!(view.normal(), Some(Axis::Z));
        assert_eq!(view.origin(), mesh.position(FaceZ::OFFSET, [1; 3]));
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
