//! Where the cells and faces of a box about a grain lie in memory, across periodic edges.

use std::ops::Range;

use glam::IVec3;

use crate::flow::Boundaries;
use crate::grid::Mesh;
use crate::math::Real;
use grainwake_simd::{prefetch, prefetch_ahead};

/// Which faces and cells are unknowns, and where.
#[derive(Clone, Copy)]
pub struct Unknowns {
    cells: IVec3,
    strides: [usize; 3],
    periodic: [bool; 3],
}

/// Cells beyond the box that may be asked for.
pub const PAD: i32 = 3;
/// How many rows ahead memory is asked for.
const AHEAD: usize = 4;
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
            let entry = |i: i32| {
                let i = if self.periodic[axis] {
                    (i - 1).rem_euclid(n) + 1
                } else {
                    i.clamp(0, n + 1)
                };
                i as usize * stride
            };
            let lines = &mut places.lines[axis];
            lines.clear();
            lines.extend((first[axis] - PAD..first[axis] + size[axis] + PAD).map(entry));
        }
    }
}

/// The box of one grain in memory.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// For each axis the parts of the positions, of what is not normal to the axis and of faces
    /// that are.
    tables: [[Vec<usize>; 2]; 3],
    /// The same of all entries of a field, unknown or not; beyond a wall the ghosts.
    lines: [Vec<usize>; 3],
}

impl Places {
    /// Positions along `axis` of the faces of `component` that are unknowns, off the box too: they
    /// have no gaps, as only the ends of the grid take some away.
    pub fn unknowns(&self, component: usize, axis: usize) -> Range<i32> {
        let table = &self.tables[axis][usize::from(axis == component)];
        let first = table.iter().take_while(|part| **part == NONE).count();
        let last = table.iter().rev().take_while(|part| **part == NONE).count();
        first as i32 - PAD..table.len() as i32 - last as i32 - PAD
    }

    /// Calls `found(part, at, below)` for the parts of `range` of row (j, k) of component `component` that
    /// are unknowns and lie in memory without a gap: positions of the first face (and of the cell
    /// above it) and of the cell below it.
    #[inline]
    pub fn runs(
        &self,
        component: usize,
        [j, k]: [i32; 2],
        range: Range<i32>,
        mut found: impl FnMut(Range<i32>, usize, usize),
    ) {
        if range.is_empty() {
            return;
        }
        let part = |axis: usize, normal: bool, place: i32| {
            self.tables[axis][usize::from(normal)][(place + PAD) as usize]
        };
        let down = IVec3::AXES[component];
        let line = part(1, component == 1, j) + part(2, component == 2, k);
        let line_below = part(1, false, j - down.y) + part(2, false, k - down.z);
        let pair = |i: i32| {
            let at = part(0, component == 0, i) + line;
            let below = part(0, false, i - down.x) + line_below;
            (at < NONE && below < NONE).then_some((at, below))
        };
        // Places only follow each other or jump back, and end where the grid does.
        if let (Some(first), Some(last)) = (pair(range.start), pair(range.end - 1)) {
            let ahead = range.len() - 1;
            if last == (first.0 + ahead, first.1 + ahead) {
                return found(range, first.0, first.1);
            }
        }
        let mut i = range.start;
        while i < range.end {
            let Some((at, below)) = pair(i) else {
                i += 1;
                continue;
            };
            let from = i;
            i += 1;
            while i < range.end {
                let ahead = (i - from) as usize;
                if pair(i) != Some((at + ahead, below + ahead)) {
                    break;
                }
                i += 1;
            }
            found(from..i, at, below);
        }
    }

    /// From the first to the last plane in memory that the box has faces or cells in.
    pub fn planes(&self) -> Range<usize> {
        let tables = self.tables[2].iter();
        let parts = tables.flat_map(|table| &table[PAD as usize..table.len() - PAD as usize]);
        let parts = parts.copied().filter(|part| *part != NONE);
        let (first, last) = parts.fold((usize::MAX, 0), |(first, last), part| {
            (first.min(part), last.max(part))
        });
        first..last + 1
    }

    /// Number of planes in the box and about it.
    pub fn planes_about(&self) -> usize {
        self.lines[2].len()
    }

    /// Asks for some planes of a field in the box and about it, which is read soon, but for its corners.
    #[inline]
    pub fn ask_ahead<R>(&self, field: &[R], planes: Range<usize>) {
        let [x, y, z] = &self.lines;
        // From 0 in the middle to 1 at the end.
        let [per_row, per_plane] = [y.len(), z.len()].map(|of| 1.0 / of as f32);
        for k in planes {
            let w = ((2 * k + 1) as f32 * per_plane - 1.0).abs();
            for (j, line) in y.iter().enumerate() {
                // About what faces within a ball need, with three on each side in line.
                let away = w + ((2 * j + 1) as f32 * per_row - 1.0).abs();
                if away > 1.2 {
                    continue;
                }
                let part = (1.02 - 0.6 * away).min(1.0);
                let count = (part * x.len() as f32) as usize;
                let first = x[0] + (x.len() - count) / 2 + line + z[k];
                prefetch_ahead(field, first, count);
            }
        }
    }

    /// Copies a field in the box and three cells about it, x fastest.
    pub fn copy<R: Real>(&self, field: &[R], to: &mut Vec<R>) {
        to.clear();
        let [x, y, z] = &self.lines;
        let lines = y;
        let whole = x[x.len() - 1] == x[0] + x.len() - 1;
        for z in z {
            for (row, y) in y.iter().enumerate() {
                if let Some(y) = lines.get(row + AHEAD) {
                    prefetch(field, x[0] + y + z, x.len());
                }
                if whole {
                    let line = &field[x[0] + y + z..][..x.len()];
                    to.extend_from_slice(line);
                } else {
                    to.extend(x.iter().map(|x| field[x + y + z]));
                }
            }
        }
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let tables = self.tables.iter().flatten().chain(&self.lines);
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
        // Memory position of a face, of the cell where the component is 3.
        let at = |component, i, j| {
            let part = |axis: usize, place: i32| {
                places.tables[axis][usize::from(axis == component)][(place + PAD) as usize]
            };
            let at = part(0, i) + part(1, j) + part(2, 0);
            (at < NONE).then_some(at)
        };
        // Cell 6 + 4 is cell 2 across the edge.
        assert_eq!(at(3, 4, 0), Some(2 + 10 + 80));
        assert_eq!(at(0, 3, 2), Some(1 + 30 + 80));
        // The face on the wall is none, the cell above it is one; below the wall is nothing.
        assert_eq!(at(1, 0, 0), None);
        assert_eq!(at(0, 0, 0), Some(6 + 10 + 80));
        assert_eq!(at(3, 0, -1), None);
        assert_eq!(at(3, 0, 5), Some(6 + 60 + 80));
        assert_eq!(at(3, -3, 5), Some(3 + 60 + 80));
        assert_eq!(places.unknowns(1, 0), -3..8);
        assert_eq!([places.unknowns(1, 1), places.unknowns(0, 1)], [1..6, 0..6]);
        // A field of memory positions: what lies where, ghosts beyond the wall included.
        let field: Vec<f64> = (0..240).map(f64::from).collect();
        let mut copy = Vec::new();
        places.copy(&field, &mut copy);
        let copied = |i: usize, j: usize, k: usize| copy[i + 3 + 11 * (j + 3 + 9 * (k + 3))];
        assert_eq!(copied(4, 0, 0), 2.0 + 10.0 + 80.0);
        assert_eq!(copied(0, 2, 0), 6.0 + 30.0 + 80.0);
        assert_eq!(copy[3 + 11 * (2 + 27)], 6.0 + 80.0, "the ghost below");
    }
}
