//! Index lists of the faces near a grain: plain data, filled by [`super::Locator`]. Positions in
//! memory of the cells and faces in the box around a grain, across periodic edges.
//!
//! `at` is a position in the memory of a field, `entry` an index into the lists of one grain. Lists
//! that vector registers read have at least `MAX_LANES` unused entries at the end.

use std::ops::Range;

use glam::{DVec3, IVec3};

use crate::grid::{Layout, Mesh};
use crate::math::Real;
use grainwake_simd::{MAX_LANES, Vector};

/// Faces of one component in a row along x that lie within reach of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct RowSpan {
    /// First index along x, counted from the side of the box.
    pub start: i32,
    /// Index after the last.
    pub end: i32,
    /// Entry of the first face in [`LocatedBody::distance`].
    pub first: usize,
}

impl RowSpan {
    /// Entry of the face with index `i` in [`LocatedBody::distance`].
    #[inline(always)]
    pub fn entry(&self, i: i32) -> usize {
        self.first + (i - self.start) as usize
    }
}

/// Unknown faces of a span that are adjacent in memory.
#[derive(Clone, Copy, Debug)]
pub struct FaceRow {
    /// Position in memory of the first face.
    pub at: usize,
    /// Entry of the first face in [`LocatedBody::distance`].
    pub first: usize,
    /// Number of faces.
    pub count: usize,
}

/// Faces of a row within the forcing band that are adjacent in memory.
#[derive(Clone, Copy, Debug)]
pub struct FaceRun {
    /// Position in memory of the first face, and of the cell above it.
    pub at: usize,
    /// Position in memory of the cell below the first face, across a periodic edge if need be.
    pub below: usize,
    /// Vector from the grain's centroid to the first face, space frame [m].
    pub lever_arm: DVec3,
    /// Entry of the first face in [`BandFaces`] and in the lists made from it.
    pub first: usize,
    /// Number of faces.
    pub count: usize,
}

/// Location of a grain on the grid and the faces near it.
#[derive(Clone, Debug, Default)]
pub struct LocatedBody {
    /// Centroid [m].
    pub position: DVec3,
    /// Lowest cell of the box of cells around the grain, counted from 1; may lie across a periodic
    /// edge.
    pub lowest: IVec3,
    /// Cells of the box along each axis.
    pub size: IVec3,
    /// Signed distances [m] by component, row by row; infinite where another grain is nearer.
    pub distance: [Vec<f32>; 3],
    /// Spans by component, one for each row of the box, y fastest.
    pub spans: [Vec<RowSpan>; 3],
    /// Positions in memory of the cells and faces of the box.
    pub index_map: IndexMap,
    /// Positions in memory from the first plane of the box to the last.
    pub planes: Range<usize>,
    /// Faces of the spans by component, in parts adjacent in memory.
    pub rows: [Vec<FaceRow>; 3],
}

impl LocatedBody {
    /// Returns whether faces of the box may lie in a part of a field.
    pub fn overlaps(&self, part: &Range<usize>, layout: Layout) -> bool {
        self.planes.start < part.end && part.start < self.planes.end + layout.plane()
    }
}

/// Distances and normals of the faces in the forcing band of one grain, in the order of the
/// [`FaceRun`]s.
#[derive(Debug, Default)]
pub struct BandFaces {
    count: usize,
    /// Signed distances [m].
    pub distance: Vec<f32>,
    /// Distances averaged over the kernel of the band [m].
    pub mean_distance: Vec<f32>,
    /// Unit normals out of the grain, space frame, by axis.
    pub normal: [Vec<f32>; 3],
    /// Faces in the bands of other grains as well.
    pub shared: Vec<SharedFace>,
    /// Surfaces of these grains near the shared faces: entry in the list of the neighbours of the
    /// grain, signed distance [m], and its gradient in the frame of the neighbour.
    pub near: Vec<(usize, f64, DVec3)>,
}

/// A face in the forcing band of one grain and in those of other grains.
#[derive(Clone, Debug)]
pub struct SharedFace {
    /// Entry in [`BandFaces`].
    pub entry: usize,
    /// Position [m].
    pub position: DVec3,
    /// Distance to the nearest of the other grains, tie breaker included [m].
    pub nearest: f64,
    /// The other grains whose bands hold the face, in [`BandFaces::near`].
    pub near: Range<usize>,
}

impl BandFaces {
    /// Number of faces.
    pub fn count(&self) -> usize {
        self.count
    }
    /// Removes all faces.
    pub(super) fn clear(&mut self) {
        self.count = 0;
        self.shared.clear();
        self.near.clear();
    }
    /// Makes room for `count` more faces.
    pub(super) fn reserve(&mut self, count: usize) {
        let needed = self.count + count + MAX_LANES;
        for list in self.lists() {
            list.resize(list.len().max(needed), 0.0);
        }
    }
    /// Appends `count` faces, for which [`Self::reserve`] made room; reads whole registers.
    #[inline(always)]
    pub(super) fn extend<V: Vector<Number = f32>>(
        &mut self,
        count: usize,
        [distance, mean_distance]: [&[f32]; 2],
        normal: [&[f32]; 3],
    ) {
        let first = self.count;
        self.count += count;
        let [x, y, z] = &mut self.normal;
        for n in (0..count).step_by(V::WIDTH) {
            V::load(&distance[n..]).store(&mut self.distance[first + n..]);
            V::load(&mean_distance[n..]).store(&mut self.mean_distance[first + n..]);
            V::load(&normal[0][n..]).store(&mut x[first + n..]);
            V::load(&normal[1][n..]).store(&mut y[first + n..]);
            V::load(&normal[2][n..]).store(&mut z[first + n..]);
        }
    }
    /// Signed distance and mean distance [m], and unit normal of a face.
    pub fn face(&self, entry: usize) -> ([f64; 2], DVec3) {
        let normal = self.normal.each_ref().map(|list| f64::from(list[entry]));
        let distances = [&self.distance, &self.mean_distance].map(|list| f64::from(list[entry]));
        (distances, DVec3::from_array(normal))
    }
    /// Moves a face out of the forcing band of half-width `eps` [m]: the grain does not force it.
    pub(super) fn set_outside(&mut self, entry: usize, eps: f64) {
        self.distance[entry] = Self::outside(eps);
        self.mean_distance[entry] = Self::outside(eps);
    }
    /// Distance outside the forcing band [m].
    fn outside(eps: f64) -> f32 {
        4.0 * eps as f32
    }
    /// Fills the lists up to a whole number of registers with faces outside the band of half-width
    /// `eps` [m]; returns that length.
    pub fn pad(&mut self, eps: f64) -> usize {
        let padded = self.count.next_multiple_of(MAX_LANES);
        for list in self.lists() {
            list.resize(padded.max(list.len()), 0.0);
        }
        for list in [&mut self.distance, &mut self.mean_distance] {
            list[self.count..padded].fill(Self::outside(eps));
        }
        padded
    }
    /// All lists with one entry per face.
    fn lists(&mut self) -> impl Iterator<Item = &mut Vec<f32>> {
        [&mut self.distance, &mut self.mean_distance].into_iter().chain(&mut self.normal)
    }
}

/// Width of the padding: cells on each side of the box for which positions are tabulated too.
pub const PAD: i32 = 3;
/// Offset of faces and cells that are not unknown: larger than any position, also in sums.
const NONE: usize = 1 << 60;

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
    /// Fills the map of the box of `size` cells from cell `first` on (counted from 1).
    pub fn fill(&mut self, mesh: &Mesh, periodic: [bool; 3], first: IVec3, size: IVec3) {
        let strides = mesh.layout().strides();
        for axis in 0..3 {
            let (n, stride, periodic) = (mesh.cells[axis] as i32, strides[axis], periodic[axis]);
            let padded = first[axis] - PAD..first[axis] + size[axis] + PAD;
            let offset = |i: i32| {
                let i = if periodic { (i - 1).rem_euclid(n) + 1 } else { i.clamp(0, n + 1) };
                i as usize * stride
            };
            for (lowest, offsets) in (1..).zip(&mut self.unknown_offsets[axis]) {
                let is_unknown = |i: i32| periodic || (lowest..=n).contains(&i);
                let unknown = |i: i32| if is_unknown(i) { offset(i) } else { NONE };
                offsets.clear();
                offsets.extend(padded.clone().map(unknown));
            }
            self.offsets[axis].clear();
            self.offsets[axis].extend(padded.map(offset));
        }
    }

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

    /// All tables of offsets.
    pub fn tables(&self) -> impl Iterator<Item = &Vec<usize>> {
        self.unknown_offsets.iter().flatten().chain(&self.offsets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_bound_the_unknowns_and_periodic_edges_wrap() {
        let mesh = Mesh::cubic([8, 6, 1], 1.0);
        let [_, row, plane] = mesh.layout().strides();
        let mut map = IndexMap::default();
        map.fill(&mesh, [true, false, true], IVec3::new(6, 1, 1), IVec3::new(5, 3, 1));
        // Position in memory of a face, or of a cell if the component is 3.
        let at = |component, i, j| {
            let offset = |axis: usize, index: i32| {
                map.unknown_offsets[axis][usize::from(axis == component)][(index + PAD) as usize]
            };
            let at = offset(0, i) + offset(1, j) + offset(2, 0);
            (at < NONE).then_some(at)
        };
        // Cell 6 + 4 is cell 2 across the periodic edge.
        assert_eq!(at(3, 4, 0), Some(2 + row + plane));
        assert_eq!(at(0, 3, 2), Some(1 + 3 * row + plane));
        // The face on the wall is no unknown, the cell above it is; below the wall there are none.
        assert_eq!(at(1, 0, 0), None);
        assert_eq!(at(0, 0, 0), Some(6 + row + plane));
        assert_eq!(at(3, 0, -1), None);
        assert_eq!(at(3, 0, 5), Some(6 + 6 * row + plane));
        assert_eq!(at(3, -3, 5), Some(3 + 6 * row + plane));
        assert_eq!(map.unknown_range(1, 0), -3..8);
        assert_eq!([map.unknown_range(1, 1), map.unknown_range(0, 1)], [1..6, 0..6]);
        // A field whose values are its memory positions; ghost cells beyond the wall included.
        let field: Vec<f64> = (0..mesh.layout().len()).map(|at| at as f64).collect();
        let mut copy = Vec::new();
        map.copy(&field, &mut copy);
        let copied = |i: usize, j: usize, k: usize| copy[i + 3 + 11 * (j + 3 + 9 * (k + 3))];
        assert_eq!(copied(4, 0, 0), (2 + row + plane) as f64);
        assert_eq!(copied(0, 2, 0), (6 + 3 * row + plane) as f64);
        assert_eq!(copy[3 + 11 * (2 + 27)], (6 + plane) as f64, "the ghost below");
    }
}
