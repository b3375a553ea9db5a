//! Signed distances at the faces in the box around a grain, and the lists of these faces.
//!
//! Plane by plane:
//!
//! 1. list the candidate faces of each row, which lie in a sphere around the grain;
//! 2. evaluate the distances and normals of all candidates in full registers;
//! 3. keep the faces within reach, and of these list the faces in the forcing band.
//!
//! `immersed::reference` has the scalar form.

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::Locator;
use super::aperture::forcing_reach;
use super::lists::{BandFaces, FaceRow, FaceRun, LocatedBody, RowPart, RowSpan, SharedFace};
use super::narrow_band::{load_all, store_all};
use crate::dem::Grain;
use crate::grid::FACE_OFFSET;
use crate::math::Aligned;
use grainwake_simd::{Kernel, MAX_LANES, Vector};

/// Buffers of one thread.
#[derive(Default)]
pub struct LocateScratch {
    /// Faces in the forcing band of the grain located last.
    pub band: BandFaces,
    /// Candidate faces of a plane, row after row, by axis: first their positions in the frame of
    /// the grain [m], then their unit normals in the space frame. `MAX_LANES` unused entries
    /// follow the last.
    points: [Aligned<f32>; 3],
    /// Mean distances of the candidates [m].
    mean_distances: Aligned<f32>,
    parts: Vec<RowPart>,
    /// Neighbours near a row.
    near_row: Vec<usize>,
}

/// Kernel that fills the lists of one grain.
pub struct FillLists<'a> {
    pub locator: &'a Locator,
    /// Index of the grain.
    pub index: usize,
    /// Grain at its new pose.
    pub grain: &'a Grain,
    /// Receives the faces within reach; its box is set.
    pub body: &'a mut LocatedBody,
    /// Receives the faces in the forcing band, by component.
    pub runs: &'a mut [Vec<FaceRun>; 3],
    pub scratch: &'a mut LocateScratch,
}

impl Kernel for FillLists<'_> {
    type Number = f32;
    #[inline(always)]
    fn run<V: Vector<Number = f32>>(mut self) {
        self.scratch.band.clear();
        let (mesh, size) = (&self.locator.mesh, self.body.size);
        for list in &mut self.scratch.points {
            list.make_room((size.x * size.y) as usize + MAX_LANES);
        }
        self.scratch.mean_distances.make_room((size.x * size.y) as usize + MAX_LANES);
        for component in 0..3 {
            self.body.spans[component].clear();
            self.body.rows[component].clear();
            self.runs[component].clear();
            let offset = DVec3::from_array(FACE_OFFSET[component]);
            let cell = self.body.lowest.as_dvec3() - 1.0;
            let corner = mesh.origin + mesh.spacing * (cell + offset);
            let mut plane_entry = 0;
            for k in 0..size.z {
                let count = self.list_candidates::<V>(component, corner, k);
                let distances = &mut self.body.distance[component];
                let needed = plane_entry + count + MAX_LANES;
                distances.resize(distances.len().max(needed), f32::INFINITY);
                self.evaluate::<V>(component, plane_entry, count);
                self.scratch.band.reserve(count);
                for j in 0..size.y {
                    self.list_row::<V>(component, corner, [j, k], plane_entry);
                }
                plane_entry += count;
            }
        }
    }
}

impl FillLists<'_> {
    /// Appends the candidate spans of the rows in plane `k`, with entries counted from the start of
    /// the plane, and the positions of their faces; returns the number of faces.
    #[inline(always)]
    fn list_candidates<V: Vector<Number = f32>>(
        &mut self,
        component: usize,
        corner: DVec3,
        k: i32,
    ) -> usize {
        let h = self.locator.mesh.spacing;
        let to_body = DMat3::from_quat(self.grain.pose.orientation).transpose();
        let step = to_body * (h.x * DVec3::X);
        let radius = self.grain.shape.bounding_radius() + self.locator.reach;
        let mut points = self.scratch.points.each_mut().map(|list| &mut list[..]);
        let mut count = 0;
        for j in 0..self.body.size.y {
            let row = h * DVec3::new(0.0, f64::from(j), f64::from(k));
            let lever_arm = corner - self.grain.pose.position + row;
            let in_body = to_body * lever_arm;
            let near = indices_in_sphere(lever_arm, h.x, radius, self.body.size.x);
            let in_box = self.grain.shape.box_crossing(self.locator.reach, in_body, step);
            let start = (in_box[0].ceil() as i32).clamp(near.start, near.end);
            let end = (in_box[1].floor() as i32).saturating_add(1).clamp(start, near.end);
            let span = RowSpan { start, end, first: count };
            let first = in_body.as_vec3();
            for i in (start..end).step_by(V::WIDTH) {
                let index = V::constant(f64::from(i)) + V::ramp();
                let mut x = [V::constant(0.0); 3];
                for n in 0..3 {
                    x[n] = V::splat(first[n]) + index * V::constant(step[n]);
                }
                store_all(x, &mut points, span.entry(i));
            }
            count = span.entry(end);
            self.body.spans[component].push(span);
        }
        count
    }

    /// Evaluates the distances of the `count` candidates of a plane, whose entries begin at
    /// `plane_entry`, and replaces the positions by the normals.
    #[inline(always)]
    fn evaluate<V: Vector<Number = f32>>(
        &mut self,
        component: usize,
        plane_entry: usize,
        count: usize,
    ) {
        let mut points = self.scratch.points.each_mut().map(|list| &mut list[..]);
        let distances = &mut self.body.distance[component][plane_entry..];
        let shape = self.locator.shapes.of(self.index);
        let mean_distances = &mut self.scratch.mean_distances[..];
        shape.fill_distances::<V>(&mut points, [distances, mean_distances], count);
        let [a, b, c] = DMat3::from_quat(self.grain.pose.orientation).to_cols_array_2d();
        for at in (0..count).step_by(V::WIDTH) {
            let [x, y, z] = load_all::<V>(&points, at);
            let inverse = (x * x + y * y + z * z).rsqrt();
            let [x, y, z] = [x * inverse, y * inverse, z * inverse];
            let mut normal = [x; 3];
            for n in 0..3 {
                normal[n] = V::constant(a[n]) * x + V::constant(b[n]) * y + V::constant(c[n]) * z;
            }
            store_all(normal, &mut points, at);
        }
    }

    /// Shortens the span of row (j, k) to the faces within reach and lists these faces.
    #[inline(always)]
    fn list_row<V: Vector<Number = f32>>(
        &mut self,
        component: usize,
        corner: DVec3,
        [j, k]: [i32; 2],
        plane_entry: usize,
    ) {
        let row = (j + self.body.size.y * k) as usize;
        let mut candidates = self.body.spans[component][row];
        candidates.first += plane_entry;
        let distances = &mut self.body.distance[component];
        let limits = [self.locator.reach, forcing_reach(self.locator.eps)];
        let [span, in_band] = shorten::<V>(distances, candidates, limits);
        self.body.spans[component][row] = span;
        let h = self.locator.mesh.spacing;
        let start = corner + h * DVec3::new(0.0, f64::from(j), f64::from(k));
        let step = h.x * DVec3::X;
        let LocateScratch { band, points, mean_distances, parts, near_row } = &mut *self.scratch;
        parts.clear();
        (self.body.index_map).contiguous_parts(component, [j, k], span.start..span.end, parts);
        for part in &*parts {
            let range = part.range.clone();
            let first = span.entry(range.start);
            self.body.rows[component].push(FaceRow { at: part.at, first, count: range.len() });
            let forced = range.start.max(in_band.start)..range.end.min(in_band.end);
            if !forced.is_empty() {
                let skipped = (forced.start - range.start) as usize;
                self.runs[component].push(FaceRun {
                    at: part.at + skipped,
                    below: part.below + skipped,
                    lever_arm: start - self.grain.pose.position + f64::from(forced.start) * step,
                    first: band.count(),
                    count: forced.len(),
                });
                let entry = candidates.entry(forced.start);
                let normal = points.each_ref().map(|list| &list[entry - plane_entry..]);
                let distances = [&distances[entry..], &mean_distances[entry - plane_entry..]];
                band.extend::<V>(forced.len(), distances, normal);
            }
            if !self.locator.neighbours(self.index).is_empty() {
                let distances = &mut distances[first..];
                let lists = (&mut *band, &mut *near_row);
                self.locator.assign(self.index, [start, step], [range, forced], distances, lists);
            }
        }
    }
}

impl Locator {
    /// Assigns faces of a row near several grains to the nearest grain: sets the `distances` from
    /// grain `index` of faces in `range` that are nearer to another grain to infinity. Of the
    /// `forced` faces, the last of `band`, those deep inside a nearer neighbour get a distance
    /// outside the band, and those in its band are recorded as shared. `start` is the position of
    /// face 0 and `step` the vector from a face to the next, along x [m].
    fn assign(
        &self,
        index: usize,
        [start, step]: [DVec3; 2],
        [range, forced]: [Range<i32>; 2],
        distances: &mut [f32],
        (band, near_row): (&mut BandFaces, &mut Vec<usize>),
    ) {
        let first_forced = band.count() - forced.len();
        let position = |i| start + f64::from(i) * step;
        let ends = [position(range.start), position(range.end - 1)];
        let neighbours = self.neighbours(index);
        let is_near = |n: &usize| neighbours[*n].is_near_row(ends, self.reach);
        near_row.clear();
        near_row.extend((0..neighbours.len()).filter(is_near));
        for (i, distance) in range.zip(distances) {
            let (x, d) = (position(i), f64::from(*distance));
            let mut nearest = f64::INFINITY;
            let first_near = band.near.len();
            for &neighbour in &*near_row {
                let other = &neighbours[neighbour];
                let (to_other, gradient) = other.distance_and_gradient(&self.shapes, x, self.reach);
                nearest = nearest.min(to_other + other.tie_breaker);
                if to_other < forcing_reach(self.eps) {
                    band.near.push((neighbour, to_other, gradient));
                }
            }
            let entry = forced.contains(&i).then(|| first_forced + (i - forced.start) as usize);
            match entry {
                Some(entry) if nearest <= -self.eps && nearest < d => {
                    band.set_outside(entry, self.eps);
                    band.near.truncate(first_near);
                }
                Some(entry) if nearest < forcing_reach(self.eps) => {
                    let near = first_near..band.near.len();
                    band.shared.push(SharedFace { entry, position: x, nearest, near });
                }
                _ => band.near.truncate(first_near),
            }
            if d > nearest {
                *distance = f32::INFINITY;
            }
        }
    }
}

/// Indices, less than `count`, of the faces of a row along x that lie in a sphere around the grain.
/// `lever_arm` [m] leads from the centroid to face 0; `spacing` and `radius` in [m].
fn indices_in_sphere(lever_arm: DVec3, spacing: f64, radius: f64, count: i32) -> Range<i32> {
    let square = radius * radius - lever_arm.y * lever_arm.y - lever_arm.z * lever_arm.z;
    if square < 0.0 {
        return 0..0;
    }
    let half_chord = square.sqrt();
    let start = ((-half_chord - lever_arm.x) / spacing).ceil() as i32;
    let end = ((half_chord - lever_arm.x) / spacing).floor() as i32;
    let start = start.clamp(0, count);
    // Saturating: a damaged checkpoint may have a grain far away.
    start..end.saturating_add(1).clamp(start, count)
}

/// Shortens a span to the faces from the first to the last within each limit [m].
#[inline(always)]
fn shorten<V: Vector<Number = f32>>(
    distances: &[f32],
    span: RowSpan,
    limits: [f64; 2],
) -> [RowSpan; 2] {
    let count = (span.end - span.start) as usize;
    let [wide, narrow] = [V::constant(limits[0]), V::constant(limits[1])];
    let (mut wide_part, mut narrow_part) = ([count, count], [count, count]);
    for at in (0..count).step_by(V::WIDTH) {
        let d = V::load(&distances[span.first + at..]);
        let valid = u32::MAX >> (32 - (count - at).min(V::WIDTH));
        extend(&mut wide_part, at, valid & !wide.mask_below(d));
        extend(&mut narrow_part, at, valid & !narrow.mask_below(d));
    }
    let part = |[start, end]: [usize; 2]| RowSpan {
        start: span.start + start as i32,
        end: span.start + end as i32,
        first: span.first + start,
    };
    [part(wide_part), part(narrow_part)]
}

/// Extends the range [start, end) over the set bits of `lanes`, which stand for the indices from
/// `at` on.
#[inline(always)]
fn extend([start, end]: &mut [usize; 2], at: usize, lanes: u32) {
    if lanes != 0 {
        *start = (*start).min(at + lanes.trailing_zeros() as usize);
        *end = at + 32 - lanes.leading_zeros() as usize;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grain_far_away_has_no_faces() {
        for x in [-1e30, -2147483648.0, 2147483647.0, 1e30] {
            assert!(indices_in_sphere(DVec3::new(x, 0.0, 0.0), 1.0, 2.0, 100).is_empty(), "{x}");
        }
        assert_eq!(indices_in_sphere(DVec3::new(-5.0, 0.0, 0.0), 1.0, 2.0, 100), 3..8);
    }
}
