//! Signed distances at the faces in a box about a grain, and the list of those that its rigidity may
//! act on.

use std::ops::Range;

use glam::{DMat3, DVec3, IVec3};

use super::Scheme;
use super::forced::{Forced, Run};
use super::hold::{Faces, Holding};
use super::locate::{Body, PushRow, Span};
use super::near::{NearShape, Spare};
use super::rivals::Rival;
use super::samples::{load_all, store_all};
use crate::dem::Grain;
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::Aligned;
use grainwake_simd::{Kernel, MOST, Vector};

/// What one thread needs to locate grains.
#[derive(Default)]
pub struct Scratch {
    /// Faces that the grain may force.
    pub faces: Faces,
    /// Which of them other grains may hold as well, and where they are [m].
    pub shared: Vec<(usize, DVec3)>,
    points: Points,
    parts: Vec<Part>,
}

/// Part of a row with no gap in memory: places along x, positions of the first face and of the cell
/// below it.
struct Part {
    range: Range<i32>,
    at: usize,
    below: usize,
}

/// Faces near a grain, one row after the other so that registers are full: first where they are, in its
/// frame, then the unit normals, in the space frame. Some entries more follow the last.
#[derive(Default)]
struct Points {
    faces: [Aligned<f32>; 3],
    spare: Spare,
}

impl Points {
    /// Makes room for `count` faces.
    fn reserve(&mut self, count: usize) {
        for list in &mut self.faces {
            list.make_room(count + MOST);
        }
    }
    /// Writes the faces of a `span`; the face 0 of the row is at `first`, the others follow by `step`.
    #[inline(always)]
    fn place<V: Vector<Number = f32>>(&mut self, span: Span, first: [f32; 3], step: DVec3) {
        let [x, y, z] = &mut self.faces;
        let mut faces = [&mut x[..], &mut y[..], &mut z[..]];
        for i in (span.start..span.end).step_by(V::WIDTH) {
            let count = V::constant(f64::from(i)) + V::ramp();
            let mut place = [V::constant(0.0); 3];
            for n in 0..3 {
                place[n] = V::splat(first[n]) + count * V::constant(step[n]);
            }
            store_all(place, &mut faces, span.place(i));
        }
    }
    /// Finds the distances of the first `count` faces and puts the normals in the place of the points.
    #[inline(always)]
    fn measure<V: Vector<Number = f32>>(
        &mut self,
        distances: &mut [f32],
        shape: &NearShape,
        turn: DMat3,
        count: usize,
    ) {
        let columns = turn.to_cols_array_2d();
        let [x, y, z] = &mut self.faces;
        let mut faces = [&mut x[..], &mut y[..], &mut z[..]];
        shape.measure::<V>(&mut faces, distances, count, &mut self.spare);
        for at in (0..count).step_by(V::WIDTH) {
            let [x, y, z] = load_all::<V>(&faces, at);
            let inverse = (x * x + y * y + z * z).inverse_root();
            let unit = [x * inverse, y * inverse, z * inverse];
            let mut normal = unit;
            for axis in 0..3 {
                normal[axis] = V::constant(columns[0][axis]) * unit[0]
                    + V::constant(columns[1][axis]) * unit[1]
                    + V::constant(columns[2][axis]) * unit[2];
            }
            store_all(normal, &mut faces, at);
        }
    }
}

/// The measurement of one grain; `reach` as in [`super::locate::Locator`].
pub struct Measure<'a, A> {
    pub mesh: &'a Mesh,
    pub holding: &'a Holding,
    pub reach: f64,
    pub grain: &'a Grain,
    pub shape: &'a NearShape,
    pub rivals: &'a [Rival<'a>],
    pub body: &'a mut Body,
    pub forced: &'a mut Forced,
    pub scratch: &'a mut Scratch,
    /// Called for every component and plane k of so many.
    pub ahead: A,
}

impl<A: Fn(usize, [i32; 2])> Kernel for Measure<'_, A> {
    type Number = f32;
    #[inline(always)]
    fn run<V: Vector<Number = f32>>(self) {
        let Measure {
            mesh,
            holding,
            reach,
            grain,
            shape,
            rivals,
            body,
            forced,
            scratch,
            ahead,
        } = self;
        let eps = holding.eps;
        let turn = DMat3::from_quat(grain.pose.orientation);
        let step = DVec3::X * mesh.spacing.x;
        let around = Around::new(grain, reach, mesh.spacing, turn.transpose());
        let size = body.size;
        let Scratch {
            faces,
            shared,
            points,
            parts,
        } = scratch;
        faces.clear();
        shared.clear();
        points.reserve((size.x * size.y) as usize);
        forced.runs.iter_mut().for_each(Vec::clear);
        for (axis, offset) in FACE_OFFSET.iter().enumerate() {
            let (distance, spans) = (&mut body.distance[axis], &mut body.spans[axis]);
            let (rows, runs) = (&mut body.rows[axis], &mut forced.runs[axis]);
            spans.clear();
            rows.clear();
            let corner = position(mesh, offset, body.first);
            let arm = corner - grain.pose.position;
            let mut known = 0;
            for k in 0..size.z {
                ahead(axis, [k, size.z]);
                let mut count = 0;
                for from in (0..size.y).step_by(V::WIDTH) {
                    let near = around.rows::<V>(arm, [from, k], size.x);
                    for n in 0..V::WIDTH.min((size.y - from) as usize) {
                        let (span, first) = near.of(n, count);
                        points.place::<V>(span, first, around.step);
                        count = span.place(span.end);
                        spans.push(span);
                    }
                }
                distance.resize(distance.len().max(known + count + MOST), f32::INFINITY);
                points.measure::<V>(&mut distance[known..], shape, turn, count);
                faces.reserve(count);
                let plane = (size.y * k) as usize;
                for (j, span) in spans[plane..].iter_mut().enumerate() {
                    let normals = span.first;
                    span.first += known;
                    let all = *span;
                    let close;
                    [*span, close] = within::<V>(distance, all, [reach, 2.0 * eps]);
                    let j = j as i32;
                    let up = DVec3::new(0.0, f64::from(j), f64::from(k));
                    let start = corner + mesh.spacing * up;
                    parts.clear();
                    let range = span.start..span.end;
                    (body.places).runs(axis, [j, k], range, |range, at, below| {
                        parts.push(Part { range, at, below });
                    });
                    for part in &*parts {
                        let range = part.range.clone();
                        let first = span.place(range.start);
                        rows.push(PushRow {
                            at: part.at,
                            first,
                            count: range.len(),
                        });
                        let held = range.start.max(close.start)..range.end.min(close.end);
                        let number = faces.count();
                        if !held.is_empty() {
                            let ahead = (held.start - range.start) as usize;
                            runs.push(Run {
                                at: part.at + ahead,
                                below: part.below + ahead,
                                arm: start - grain.pose.position + f64::from(held.start) * step,
                                first: number,
                                count: held.len(),
                            });
                            let from = normals + (held.start - all.start) as usize;
                            let normal = points.faces.each_ref().map(|list| &list[from..]);
                            faces.extend::<V>(held.len(), &distance[known + from..], normal);
                        }
                        if !rivals.is_empty() {
                            let contest = Contest {
                                rivals,
                                holding,
                                reach,
                                start,
                                step,
                            };
                            let distance = &mut distance[first..];
                            contest.settle(range, held, distance, number, faces, shared);
                        }
                    }
                }
                known += count;
            }
        }
    }
}

/// A row of faces that other grains may take; the first is at `start` [m].
struct Contest<'a> {
    rivals: &'a [Rival<'a>],
    holding: &'a Holding,
    reach: f64,
    start: DVec3,
    step: DVec3,
}

impl Contest<'_> {
    /// Gives the faces in `range`, at these distances, to the grain that is nearest; those of them that are
    /// `held` are in the list `faces` from `number` on.
    #[inline(always)]
    fn settle(
        &self,
        range: Range<i32>,
        held: Range<i32>,
        distance: &mut [f32],
        number: usize,
        faces: &mut Faces,
        shared: &mut Vec<(usize, DVec3)>,
    ) {
        let (eps, blended) = (self.holding.eps, self.holding.scheme == Scheme::Paper);
        for (i, d) in range.zip(distance) {
            let x = self.start + f64::from(i) * self.step;
            let own = f64::from(*d);
            let others = self.rivals.iter();
            let rival = others
                .map(|rival| rival.distance(x, self.reach) + rival.handicap)
                .fold(f64::INFINITY, f64::min);
            if held.contains(&i) {
                let face = number + (i - held.start) as usize;
                if rival <= -eps && rival < own {
                    faces.forgo(face, self.holding);
                } else if rival < 2.0 * eps && (own > -eps || blended) {
                    shared.push((face, x));
                }
            }
            if own > rival {
                *d = f32::INFINITY;
            }
        }
    }
}

/// The parts of a span from the first to the last face that is no farther than each limit.
#[inline(always)]
fn within<V: Vector<Number = f32>>(distance: &[f32], all: Span, limits: [f64; 2]) -> [Span; 2] {
    let count = (all.end - all.start) as usize;
    let [far, close] = [V::constant(limits[0]), V::constant(limits[1])];
    let (mut far_part, mut close_part) = ([count, count], [count, count]);
    for at in (0..count).step_by(V::WIDTH) {
        let d = V::load(&distance[all.first + at..]);
        let here = u32::MAX >> (32 - (count - at).min(V::WIDTH));
        widen(&mut far_part, at, here & !far.mask_below(d));
        widen(&mut close_part, at, here & !close.mask_below(d));
    }
    let span = |[start, end]: [usize; 2]| Span {
        start: all.start + start as i32,
        end: all.start + end as i32,
        first: all.first + start,
    };
    [span(far_part), span(close_part)]
}

/// Makes a part, from the first place to the one after the last, reach over those `near` of the places from `at` on.
#[inline(always)]
fn widen([start, end]: &mut [usize; 2], at: usize, near: u32) {
    if near != 0 {
        *start = (*start).min(at + near.trailing_zeros() as usize);
        *end = at + 32 - near.leading_zeros() as usize;
    }
}

/// What lies about a grain.
struct Around {
    /// Square of the radius of a ball about its centroid that holds all of it [m^2].
    far: f64,
    /// A box in its own frame that does [m].
    lower: DVec3,
    upper: DVec3,
    spacing: DVec3,
    to_body: DMat3,
    /// From a face of a row to the next in the frame of the grain [m], and one over that.
    step: DVec3,
    per_step: DVec3,
}

impl Around {
    fn new(grain: &Grain, reach: f64, spacing: DVec3, to_body: DMat3) -> Around {
        let far = grain.shape.bounding_radius() + reach;
        let step = to_body * (DVec3::X * spacing.x);
        // Singles hold it where a row runs along a side of the box.
        let least = 1e-8 * spacing.x;
        let per_step = step.map(|s| 1.0 / if s.abs() > least { s } else { least });
        Around {
            far: far * far,
            lower: grain.shape.lower() - reach,
            upper: grain.shape.upper() + reach,
            spacing,
            to_body,
            step,
            per_step,
        }
    }

    /// The rows (j, k) and above of `count` faces each; face (0, 0, 0) is at `arm` from the centroid.
    #[inline(always)]
    fn rows<V: Vector<Number = f32>>(&self, arm: DVec3, [j, k]: [i32; 2], count: i32) -> Rows {
        let zero = V::constant(0.0);
        let z = V::constant(arm.z + self.spacing.z * f64::from(k));
        let step = V::constant(f64::from(j)) + V::ramp();
        let y = V::constant(arm.y) + V::constant(self.spacing.y) * step;
        let square = V::constant(self.far) - y * y - z * z;
        let half = square.larger(zero).root();
        let per_step = V::constant(1.0 / self.spacing.x);
        let x = V::constant(arm.x);
        let (mut from, mut to) = ((zero - half - x) * per_step, (half - x) * per_step);
        let mut rows = Rows::default();
        let [a, b, c] = [
            self.to_body.x_axis,
            self.to_body.y_axis,
            self.to_body.z_axis,
        ];
        for axis in 0..3 {
            let first =
                V::constant(a[axis]) * x + V::constant(b[axis]) * y + V::constant(c[axis]) * z;
            let per_step = V::constant(self.per_step[axis]);
            let low = (V::constant(self.lower[axis]) - first) * per_step;
            let high = (V::constant(self.upper[axis]) - first) * per_step;
            from = from.larger(low.smaller(high));
            to = to.smaller(low.larger(high));
            first.store(&mut rows.first[axis]);
        }
        // From the first face not before to the one after the last not behind, if the ball is met.
        let end = V::constant(f64::from(count));
        let start = (zero - (zero - from).floor()).larger(zero).smaller(end);
        let stop = (to.floor() + V::constant(1.0)).larger(start).smaller(end);
        start.store(&mut rows.start);
        zero.where_below(square, stop, start).store(&mut rows.end);
        rows
    }
}

/// Which faces may matter of as many rows as a register has lanes.
#[derive(Default)]
struct Rows {
    /// Face 0 in the frame of the grain [m].
    first: [[f32; MOST]; 3],
    start: [f32; MOST],
    end: [f32; MOST],
}

impl Rows {
    /// Of row `n` the faces, listed from place `first` on, and where face 0 is.
    #[inline(always)]
    fn of(&self, n: usize, first: usize) -> (Span, [f32; 3]) {
        let [start, end] = [self.start[n] as i32, self.end[n] as i32];
        let span = Span { start, end, first };
        let [x, y, z] = &self.first;
        (span, [x[n], y[n], z[n]])
    }
}

#[inline]
fn position(mesh: &Mesh, offset: &[f64; 3], cell: IVec3) -> DVec3 {
    let offset = DVec3::from_array(*offset);
    mesh.origin + mesh.spacing * (cell.as_dvec3() - 1.0 + offset)
}
