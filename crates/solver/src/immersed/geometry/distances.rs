//! Signed distances at the faces in a box around a grain, and the list of those it may force.
//!
//! Plane by plane: bound the candidate faces of each row, evaluate the distance of all of them in
//! full registers, then keep the faces within reach. `immersed::reference` has the scalar form.

use std::ops::Range;

use glam::{DMat3, DVec3, IVec3};

use super::index_map::RowPart;
use super::lists::{BandFaces, FaceRow, FaceRun, LocatedBody, RowSpan};
use super::narrow_band::{NarrowBandShapes, SampleScratch};
use super::neighbours::NeighbourGrain;
use super::row_bounds::RowBounds;
use super::samples::{load_all, store_all};
use crate::dem::Grain;
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::Aligned;
use grainwake_simd::{Kernel, MAX_LANES, Vector};

/// Buffers of one thread.
#[derive(Default)]
pub struct DistanceScratch {
    points: FacePoints,
    parts: Vec<RowPart>,
}

/// Candidate faces of a plane, one row after the other so that registers are full: first their
/// positions in the frame of the grain, then the unit normals in the space frame. `MAX_LANES` more
/// entries follow the last.
#[derive(Default)]
struct FacePoints {
    lists: [Aligned<f32>; 3],
    samples: SampleScratch,
}

impl FacePoints {
    fn reserve(&mut self, count: usize) {
        for list in &mut self.lists {
            list.make_room(count + MAX_LANES);
        }
    }
    /// Writes the positions of the faces of a `span`, those of the row being `first` + i `step` [m].
    #[inline(always)]
    fn write_positions<V: Vector<Number = f32>>(
        &mut self,
        span: RowSpan,
        first: [f32; 3],
        step: DVec3,
    ) {
        let [x, y, z] = &mut self.lists;
        let mut lists = [&mut x[..], &mut y[..], &mut z[..]];
        for i in (span.start..span.end).step_by(V::WIDTH) {
            let index = V::constant(f64::from(i)) + V::ramp();
            let mut position = [V::constant(0.0); 3];
            for n in 0..3 {
                position[n] = V::splat(first[n]) + index * V::constant(step[n]);
            }
            store_all(position, &mut lists, span.entry(i));
        }
    }
    /// Fills the distances of the first `count` faces and replaces their positions by the normals.
    #[inline(always)]
    fn fill_distances<V: Vector<Number = f32>>(
        &mut self,
        distances: &mut [f32],
        shapes: &NarrowBandShapes,
        index: usize,
        to_space: DMat3,
        count: usize,
    ) {
        let columns = to_space.to_cols_array_2d();
        let [x, y, z] = &mut self.lists;
        let mut lists = [&mut x[..], &mut y[..], &mut z[..]];
        let shape = shapes.of(index);
        shape.fill_distances::<V>(&mut lists, distances, count, &mut self.samples);
        for at in (0..count).step_by(V::WIDTH) {
            let [x, y, z] = load_all::<V>(&lists, at);
            let inverse = (x * x + y * y + z * z).rsqrt();
            let unit = [x * inverse, y * inverse, z * inverse];
            let mut normal = unit;
            for axis in 0..3 {
                normal[axis] = V::constant(columns[0][axis]) * unit[0]
                    + V::constant(columns[1][axis]) * unit[1]
                    + V::constant(columns[2][axis]) * unit[2];
            }
            store_all(normal, &mut lists, at);
        }
    }
}

/// Kernel that fills the lists of one grain.
pub struct FillLists<'a> {
    pub mesh: &'a Mesh,
    /// Half-width of the band [m].
    pub eps: f64,
    /// Distance up to which faces are listed [m].
    pub reach: f64,
    pub grain: &'a Grain,
    /// Index of the grain.
    pub index: usize,
    pub shapes: &'a NarrowBandShapes,
    pub neighbours: &'a [NeighbourGrain],
    pub body: &'a mut LocatedBody,
    pub runs: &'a mut [Vec<FaceRun>; 3],
    pub band: &'a mut BandFaces,
    pub scratch: &'a mut DistanceScratch,
}

impl Kernel for FillLists<'_> {
    type Number = f32;
    #[inline(always)]
    fn run<V: Vector<Number = f32>>(self) {
        let FillLists {
            mesh,
            eps,
            reach,
            grain,
            index,
            shapes,
            neighbours,
            body,
            runs,
            band,
            scratch: DistanceScratch { points, parts },
        } = self;
        let to_space = DMat3::from_quat(grain.pose.orientation);
        let step = DVec3::X * mesh.spacing.x;
        let bounds = RowBounds::new(grain, reach, mesh.spacing, to_space.transpose());
        let size = body.size;
        band.clear();
        points.reserve((size.x * size.y) as usize);
        for (axis, offset) in FACE_OFFSET.iter().enumerate() {
            let (distance, spans) = (&mut body.distance[axis], &mut body.spans[axis]);
            let (rows, runs) = (&mut body.rows[axis], &mut runs[axis]);
            spans.clear();
            rows.clear();
            runs.clear();
            let corner = position(mesh, offset, body.first);
            let arm = corner - grain.pose.position;
            // Entry of the first face of the plane.
            let mut first_entry = 0;
            for k in 0..size.z {
                let mut count = 0;
                for from in (0..size.y).step_by(V::WIDTH) {
                    let candidates = bounds.rows::<V>(arm, [from, k], size.x);
                    for n in 0..V::WIDTH.min((size.y - from) as usize) {
                        let (span, face_0) = candidates.of(n, count);
                        points.write_positions::<V>(span, face_0, bounds.step);
                        count = span.entry(span.end);
                        spans.push(span);
                    }
                }
                let entries = first_entry + count + MAX_LANES;
                distance.resize(distance.len().max(entries), f32::INFINITY);
                let in_plane = &mut distance[first_entry..];
                points.fill_distances::<V>(in_plane, shapes, index, to_space, count);
                band.reserve(count);
                let plane = (size.y * k) as usize;
                for (j, span) in spans[plane..].iter_mut().enumerate() {
                    let first_point = span.first;
                    span.first += first_entry;
                    let candidates = *span;
                    let in_band;
                    [*span, in_band] = within::<V>(distance, candidates, [reach, 2.0 * eps]);
                    let j = j as i32;
                    let start = corner + mesh.spacing * DVec3::new(0.0, f64::from(j), f64::from(k));
                    parts.clear();
                    (body.index_map).contiguous_parts(axis, [j, k], span.start..span.end, parts);
                    for part in &*parts {
                        let range = part.range.clone();
                        let first = span.entry(range.start);
                        rows.push(FaceRow {
                            at: part.at,
                            first,
                            count: range.len(),
                        });
                        let forced = range.start.max(in_band.start)..range.end.min(in_band.end);
                        let first_forced = band.count();
                        if !forced.is_empty() {
                            let skipped = (forced.start - range.start) as usize;
                            runs.push(FaceRun {
                                at: part.at + skipped,
                                below: part.below + skipped,
                                arm: start - grain.pose.position + f64::from(forced.start) * step,
                                first: first_forced,
                                count: forced.len(),
                            });
                            let point = first_point + (forced.start - candidates.start) as usize;
                            let normal = points.lists.each_ref().map(|list| &list[point..]);
                            let distance = &distance[first_entry + point..];
                            band.extend::<V>(forced.len(), distance, normal);
                        }
                        if !neighbours.is_empty() {
                            let contest = Contest {
                                neighbours,
                                shapes,
                                eps,
                                reach,
                                start,
                                step,
                            };
                            let distance = &mut distance[first..];
                            contest.assign(range, forced, distance, first_forced, band);
                        }
                    }
                }
                first_entry += count;
            }
        }
    }
}

/// Faces of a row near several grains, of which the closest one owns each face.
struct Contest<'a> {
    neighbours: &'a [NeighbourGrain],
    shapes: &'a NarrowBandShapes,
    eps: f64,
    reach: f64,
    /// Position of face 0 [m].
    start: DVec3,
    step: DVec3,
}

impl Contest<'_> {
    /// Sets the distances of faces in `range` that another grain owns to infinity. Of the `forced`
    /// faces, listed from `first_forced` on, those deep inside a closer neighbour are excluded, and
    /// those in its band are recorded as contested.
    #[inline(always)]
    fn assign(
        &self,
        range: Range<i32>,
        forced: Range<i32>,
        distance: &mut [f32],
        first_forced: usize,
        band: &mut BandFaces,
    ) {
        for (i, d) in range.zip(distance) {
            let x = self.start + f64::from(i) * self.step;
            let own = f64::from(*d);
            let neighbours = self.neighbours.iter();
            let other = neighbours
                .map(|other| other.distance(self.shapes, x, self.reach) + other.tie_breaker)
                .fold(f64::INFINITY, f64::min);
            if forced.contains(&i) {
                let entry = first_forced + (i - forced.start) as usize;
                if other <= -self.eps && other < own {
                    band.distance[entry] = BandFaces::far(self.eps) as f32;
                } else if other < 2.0 * self.eps {
                    band.contested.push((entry, x));
                }
            }
            if own > other {
                *d = f32::INFINITY;
            }
        }
    }
}

/// Shortens a span to the faces between the first and the last within each limit [m].
#[inline(always)]
fn within<V: Vector<Number = f32>>(
    distance: &[f32],
    all: RowSpan,
    limits: [f64; 2],
) -> [RowSpan; 2] {
    let count = (all.end - all.start) as usize;
    let [wide, narrow] = [V::constant(limits[0]), V::constant(limits[1])];
    let (mut wide_part, mut narrow_part) = ([count, count], [count, count]);
    for at in (0..count).step_by(V::WIDTH) {
        let d = V::load(&distance[all.first + at..]);
        let valid = u32::MAX >> (32 - (count - at).min(V::WIDTH));
        extend(&mut wide_part, at, valid & !wide.mask_below(d));
        extend(&mut narrow_part, at, valid & !narrow.mask_below(d));
    }
    let span = |[start, end]: [usize; 2]| RowSpan {
        start: all.start + start as i32,
        end: all.start + end as i32,
        first: all.first + start,
    };
    [span(wide_part), span(narrow_part)]
}

/// Extends the range [start, end) over the set bits of `lanes`, which stand for the indices from `at` on.
#[inline(always)]
fn extend([start, end]: &mut [usize; 2], at: usize, lanes: u32) {
    if lanes != 0 {
        *start = (*start).min(at + lanes.trailing_zeros() as usize);
        *end = at + 32 - lanes.leading_zeros() as usize;
    }
}

/// Position of the face or centre at `offset` in a cell counted from 1 [m].
#[inline]
fn position(mesh: &Mesh, offset: &[f64; 3], cell: IVec3) -> DVec3 {
    let offset = DVec3::from_array(*offset);
    mesh.origin + mesh.spacing * (cell.as_dvec3() - 1.0 + offset)
}
