//! Positions in memory of the cells and faces in a box around a grain, across periodic edges.

use std::ops::Range;

use glam::IVec3;

use crate::flow::Boundaries;
use crate::grid::Mesh;
use crate::math::Real;

/// Faces and cells of the grid that are unknowns, and their positions in memory.
#[derive(Clone, Copy)]
pub struct UnknownFaces {
    cells: IVec3,
    strides: [usize; 3],
    periodic: [bool; 3],
}

/// Width of the padding: cells on each side of the box for which positions are tabulated too.
pub const PAD: i32 = 3;
/// Offset of faces and cells that are not unknown: larger than any position, also in sums.
const NONE: usize = 1 << 60;

impl UnknownFaces {
    /// Unknowns of the grid `mesh`, periodic along the axes of the periodic `boundaries`.
    pub fn new(mesh: &Mesh, boundaries: &Boundaries) -> UnknownFaces {
        let [x, y, z] = mesh.cells.map(|n| n as i32);
        UnknownFaces {
            cells: IVec3::new(x, y, z),
            strides: mesh.layout().strides(),
            periodic: boundaries.periodic(),
        }
    }

    /// Returns whether the grid is periodic along an axis.
    pub fn is_periodic(&self, axis: usize) -> bool {
        self.periodic[axis]
    }

    /// Fills the index map of the box of `size` cells from cell `first` on (counted from 1).
    pub fn map(&self, first: IVec3, size: IVec3, map: &mut IndexMap) {
        for axis in 0..3 {
            let (n, stride) = (self.cells[axis], self.strides[axis]);
            let padded = first[axis] - PAD..first[axis] + size[axis] + PAD;
            for (normal, offsets) in map.unknown_offsets[axis].iter_mut().enumerate() {
                let offset = |i: i32| {
                    if self.periodic[axis] {
                        ((i - 1).rem_euclid(n) + 1) as usize * stride
                    } else if i > normal as i32 && i <= n {
                        i as usize * stride
                    } else {
                        NONE
                    }
                };
                offsets.clear();
                offsets.extend(padded.clone().map(offset));
            }
            let offset = |i: i32| {
                let i =
                    if self.periodic[axis] { (i - 1).rem_euclid(n) + 1 } else { i.clamp(0, n + 1) };
                i as usize * stride
            };
            map.offsets[axis].clear();
            map.offsets[axis].extend(padded.map(offset));
        }
    }
}

/// Positions in memory in the padded box of one grain, as sums of one offset per axis.
#[derive(Clone, Debug, Default)]
pub struct IndexMap {
    /// Offsets of unknowns by axis, `[0]` for cells and faces parallel to the axis, `[1]` for faces
    /// normal to it; `NONE` elsewhere. Entry 0 is the offset of cell `-PAD` of the box.
    unknown_offsets: [[Vec<usize>; 2]; 3],
    /// Offsets of all entries of a field by axis, ghost cells beyond walls included.
    offsets: [Vec<usize>; 3],
}

/// Unknown faces of one row that are adjacent in memory.
#[derive(Clone, Debug)]
pub struct RowPart {
    /// Indices along x, counted from the side of the box.
    pub range: Range<i32>,
    /// Position in memory of the first face, and of the cell above it.
    pub at: usize,
    /// Position in memory of the cell below the first face.
    pub below: usize,
}

impl IndexMap {
    /// Indices along `axis` of the unknown faces of `component` in the padded box. They are
    /// contiguous, since only the ends of the grid exclude faces.
    pub fn unknown_range(&self, component: usize, axis: usize) -> Range<i32> {
        let offsets = &self.unknown_offsets[axis][usize::from(axis == component)];
        let excluded = |offset: &&usize| **offset == NONE;
        let first = offsets.iter().take_while(excluded).count();
        let last = offsets.iter().rev().take_while(excluded).count();
        first as i32 - PAD..offsets.len() as i32 - last as i32 - PAD
    }

    /// Appends to `parts` the parts, contiguous in memory, of the faces `range` in row (j, k) of
    /// `component`.
    #[inline]
    pub fn contiguous_parts(
        &self,
        component: usize,
        [j, k]: [i32; 2],
        range: Range<i32>,
        parts: &mut Vec<RowPart>,
    ) {
        if range.is_empty() {
            return;
        }
        let offset = |axis: usize, normal: bool, index: i32| {
            self.unknown_offsets[axis][usize::from(normal)][(index + PAD) as usize]
        };
        let down = IVec3::AXES[component];
        let row = offset(1, component == 1, j) + offset(2, component == 2, k);
        let row_below = offset(1, false, j - down.y) + offset(2, false, k - down.z);
        let positions = |i: i32| {
            let at = offset(0, component == 0, i) + row;
            let below = offset(0, false, i - down.x) + row_below;
            (at < NONE && below < NONE).then_some((at, below))
        };
        let mut i = range.start;
        while i < range.end {
            let Some((at, below)) = positions(i) else {
                i += 1;
                continue;
            };
            let start = i;
            let next = |i: i32| Some((at + (i - start) as usize, below + (i - start) as usize));
            while i < range.end && positions(i) == next(i) {
                i += 1;
            }
            let range = start..i;
            parts.push(RowPart { range, at, below });
        }
    }

    /// Positions in memory from the first plane of the box to the last.
    pub fn plane_range(&self) -> Range<usize> {
        let offsets = self.unknown_offsets[2].iter();
        let offsets = offsets.flat_map(|table| &table[PAD as usize..table.len() - PAD as usize]);
        let offsets = offsets.copied().filter(|offset| *offset != NONE);
        let (first, last) = offsets
            .fold((usize::MAX, 0), |(first, last), offset| (first.min(offset), last.max(offset)));
        first..last + 1
    }

    /// Copies the values of a field in the padded box, x fastest.
    pub fn copy<R: Real>(&self, field: &[R], to: &mut Vec<R>) {
        to.clear();
        let [x, y, z] = &self.offsets;
        let contiguous = x[x.len() - 1] == x[0] + x.len() - 1;
        for plane in z {
            for row in y {
                if contiguous {
                    to.extend_from_slice(&field[x[0] + row + plane..][..x.len()]);
                } else {
                    to.extend(x.iter().map(|x| field[x + row + plane]));
                }
            }
        }
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let tables = self.unknown_offsets.iter().flatten().chain(&self.offsets);
        tables.map(|table| size_of::<usize>() * table.capacity()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_bound_the_unknowns_and_periodic_edges_wrap() {
        let unknown_faces = UnknownFaces {
            cells: IVec3::new(8, 6, 1),
            strides: [1, 10, 80],
            periodic: [true, false, true],
        };
        let mut map = IndexMap::default();
        unknown_faces.map(IVec3::new(6, 1, 1), IVec3::new(5, 3, 1), &mut map);
        // Position in memory of a face, or of a cell if the component is 3.
        let at = |component, i, j| {
            let offset = |axis: usize, index: i32| {
                map.unknown_offsets[axis][usize::from(axis == component)][(index + PAD) as usize]
            };
            let at = offset(0, i) + offset(1, j) + offset(2, 0);
            (at < NONE).then_some(at)
        };
        // Cell 6 + 4 is cell 2 across the periodic edge.
        assert_eq!(at(3, 4, 0), Some(2 + 10 + 80));
        assert_eq!(at(0, 3, 2), Some(1 + 30 + 80));
        // The face on the wall is no unknown, the cell above it is; below the wall there are none.
        assert_eq!(at(1, 0, 0), None);
        assert_eq!(at(0, 0, 0), Some(6 + 10 + 80));
        assert_eq!(at(3, 0, -1), None);
        assert_eq!(at(3, 0, 5), Some(6 + 60 + 80));
        assert_eq!(at(3, -3, 5), Some(3 + 60 + 80));
        assert_eq!(map.unknown_range(1, 0), -3..8);
        assert_eq!([map.unknown_range(1, 1), map.unknown_range(0, 1)], [1..6, 0..6]);
        // A field whose values are its memory positions; ghost cells beyond the wall included.
        let field: Vec<f64> = (0..240).map(f64::from).collect();
        let mut copy = Vec::new();
        map.copy(&field, &mut copy);
        let copied = |i: usize, j: usize, k: usize| copy[i + 3 + 11 * (j + 3 + 9 * (k + 3))];
        assert_eq!(copied(4, 0, 0), 2.0 + 10.0 + 80.0);
        assert_eq!(copied(0, 2, 0), 6.0 + 30.0 + 80.0);
        assert_eq!(copy[3 + 11 * (2 + 27)], 6.0 + 80.0, "the ghost below");
    }
}
