//! Where the cells and faces of a box about a grain lie in memory, across periodic edges.

use glam::IVec3;

use crate::flow::Boundaries;
use crate::grid::Mesh;

/// Which faces and cells are unknowns, and where.
#[derive(Clone, Copy)]
pub struct Unknowns {
    cells: IVec3,
    strides: [usize; 3],
    periodic: [bool; 3],
}

/// Cells beyond the box that may be asked for.
const PAD: i32 = 3;
/// Stands for "no unknown": more than any position, and so are sums with it.
const NONE: usize = 1 << 60;

impl Unknowns {
    pub fn new(mesh: &Mesh, boundaries: &Boundaries) -> Unknowns {
        let [x, y, z] = mesh.cells.map(|n| n as i32);
        Unknowns {
            cells: IVec3::new(x, y, z),
            strides: mesh.layout().strides(),
            periodic: [0, 1, 2].map(|axis| boundaries.is_periodic(axis)),
        }
    }

    pub fn is_periodic(&self, axis: usize) -> bool {
        self.periodic[axis]
    }

    /// Fills the tables for the box of `size` cells from `first` (counted from 1).
    pub fn map(&self, first: IVec3, size: IVec3, places: &mut Places) {
        for axis in 0..3 {
            let (n, stride) = (self.cells[axis], self.strides[axis]);
            for (normal, table) in places.tables[axis].iter_mut().enumerate() {
                let place = |i: i32| {
                    if self.periodic[axis] {
                        ((i - 1).rem_euclid(n) + 1) as usize * stride
                    } else if i > normal as i32 && i <= n {
                        i as usize * stride
                    } else {
                        NONE
                    }
                };
                table.clear();
                table.extend((first[axis] - PAD..first[axis] + size[axis] + PAD).map(place));
            }
        }
    }
}

/// The box of one grain in memory.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// For each axis the parts of the positions, of what is not normal to the axis and of faces
    /// that are.
    tables: [[Vec<usize>; 2]; 3],
}

impl Places {
    /// Memory position of face `(i, j, k)` of the box (from 0, up to three cells off it) of component
    /// `component`; of the cell, where that is 3. None where it is no unknown.
    #[inline]
    pub fn at(&self, component: usize, cell: IVec3) -> Option<usize> {
        let part = |axis: usize| {
            self.tables[axis][usize::from(axis == component)][(cell[axis] + PAD) as usize]
        };
        let at = part(0) + part(1) + part(2);
        (at < NONE).then_some(at)
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let tables = self.tables.iter().flatten();
        tables.map(|t| size_of::<usize>() * t.capacity()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_end_the_unknowns_and_periodic_edges_wrap() {
        let unknowns = Unknowns {
            cells: IVec3::new(8, 6, 1),
            strides: [1, 10, 80],
            periodic: [true, false, true],
        };
        let mut places = Places::default();
        unknowns.map(IVec3::new(6, 1, 1), IVec3::new(5, 3, 1), &mut places);
        let at = |component, i, j| places.at(component, IVec3::new(i, j, 0));
        // Cell 6 + 4 is cell 2 across the edge.
        assert_eq!(at(3, 4, 0), Some(2 + 10 + 80));
        assert_eq!(at(0, 3, 2), Some(1 + 30 + 80));
        // The face on the wall is none, the cell above it is one; below the wall is nothing.
        assert_eq!(at(1, 0, 0), None);
        assert_eq!(at(0, 0, 0), Some(6 + 10 + 80));
        assert_eq!(at(3, 0, -1), None);
        assert_eq!(at(3, 0, 5), Some(6 + 60 + 80));
        assert_eq!(at(3, -3, 5), Some(3 + 60 + 80));
    }
}
