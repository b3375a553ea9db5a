//! Index lists of the faces near a grain: plain data, filled by [`super::Locator`].
//!
//! `at` is a position in the memory of a field, `entry` an index into the lists of one grain. Lists
//! that vector registers read have at least `MAX_LANES` unused entries at the end.

use std::ops::Range;

use glam::{DVec3, IVec3};

use super::index_map::IndexMap;
use crate::grid::Layout;
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

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let distances: usize = self.distance.iter().map(Vec::capacity).sum();
        let spans: usize = self.spans.iter().map(Vec::capacity).sum();
        let rows: usize = self.rows.iter().map(Vec::capacity).sum();
        size_of::<f32>() * distances
            + self.index_map.bytes()
            + size_of::<RowSpan>() * spans
            + size_of::<FaceRow>() * rows
    }
}

/// Distances and normals of the faces in the forcing band of one grain, in the order of the
/// [`FaceRun`]s.
#[derive(Debug, Default)]
pub struct BandFaces {
    count: usize,
    /// Signed distances [m].
    pub distance: Vec<f32>,
    /// Unit normals out of the grain, space frame, by axis.
    pub normal: [Vec<f32>; 3],
    /// Faces in the bands of other grains as well: entry and position [m].
    pub shared: Vec<(usize, DVec3)>,
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
    }
    /// Makes room for `count` more faces.
    pub(super) fn reserve(&mut self, count: usize) {
        let needed = self.count + count + MAX_LANES;
        for list in [&mut self.distance].into_iter().chain(&mut self.normal) {
            list.resize(list.len().max(needed), 0.0);
        }
    }
    /// Appends `count` faces, for which [`Self::reserve`] made room; reads whole registers.
    #[inline(always)]
    pub(super) fn extend<V: Vector<Number = f32>>(
        &mut self,
        count: usize,
        distance: &[f32],
        normal: [&[f32]; 3],
    ) {
        let first = self.count;
        self.count += count;
        let [x, y, z] = &mut self.normal;
        for n in (0..count).step_by(V::WIDTH) {
            V::load(&distance[n..]).store(&mut self.distance[first + n..]);
            V::load(&normal[0][n..]).store(&mut x[first + n..]);
            V::load(&normal[1][n..]).store(&mut y[first + n..]);
            V::load(&normal[2][n..]).store(&mut z[first + n..]);
        }
    }
    /// Signed distance [m] and unit normal of a face.
    pub fn face(&self, entry: usize) -> (f64, DVec3) {
        let normal = self.normal.each_ref().map(|list| f64::from(list[entry]));
        (f64::from(self.distance[entry]), DVec3::from_array(normal))
    }
    /// Distance outside the forcing band [m].
    pub(super) fn outside(eps: f64) -> f64 {
        4.0 * eps
    }
    /// Fills the lists up to a whole number of registers with faces outside the band of half-width
    /// `eps` [m]; returns that length.
    pub fn pad(&mut self, eps: f64) -> usize {
        let padded = self.count.next_multiple_of(MAX_LANES);
        for list in [&mut self.distance].into_iter().chain(&mut self.normal) {
            list.resize(padded.max(list.len()), 0.0);
        }
        self.distance[self.count..padded].fill(Self::outside(eps) as f32);
        padded
    }
}
