//! Signed distances at the faces in a box about a grain, and the list of those that its rigidity may
//! act on.

use std::ops::Range;

use glam::{DMat3, DVec3, IVec3};

use super::Scheme;
use super::forced::Run;
use super::hold::{Faces, Holding};
use super::locate::{Body, PushRow};
use super::near::NearShape;
use super::rivals::Rival;
use crate::dem::Grain;
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::lanes::{Kernel, MOST, RAMP, Vector};

/// What one thread needs to locate grains.
#[derive(Default)]
pub struct Scratch {
    /// Faces that the grain may force.
    pub faces: Faces,
    /// Which of them other grains may hold as well, and where they are [m].
    pub shared: Vec<(usize, DVec3)>,
    normals: Normals,
}

/// Unit normals, in the space frame, of a row of faces.
#[derive(Default)]
struct Normals([Vec<f64>; 3]);

impl Normals {
    /// Finds them and the distances of the faces in `range`. In the frame of the shape, which is turned
    /// by `turn`, the face 0 is at `first` and the others follow by `step`. Some entries beyond the range
    /// are overwritten.
    #[inline(always)]
    fn fill<V: Vector<Number = f64>>(
        &mut self,
        distances: &mut [f64],
        shape: &NearShape,
        turn: DMat3,
        [first, step]: [DVec3; 2],
        range: Range<i32>,
    ) {
        let columns = turn.to_cols_array_2d();
        for i in range.step_by(V::WIDTH) {
            let count = V::constant(f64::from(i)) + V::load(&RAMP);
            let mut x = [count; 3];
            for n in 0..3 {
                x[n] = V::constant(first[n]) + count * V::constant(step[n]);
            }
            let (distance, [x, y, z]) = shape.lanes(x);
            let length = (x * x + y * y + z * z).root();
            let inverse = V::constant(1.0).over(length.larger(V::constant(f64::MIN_POSITIVE)));
            let unit = [x * inverse, y * inverse, z * inverse];
            let at = i as usize;
            distance.store(&mut distances[at..]);
            for (axis, list) in self.0.iter_mut().enumerate() {
                let normal = V::constant(columns[0][axis]) * unit[0]
                    + V::constant(columns[1][axis]) * unit[1]
                    + V::constant(columns[2][axis]) * unit[2];
                normal.store(&mut list[at..]);
            }
        }
    }
}

/// The measurement of one grain; `reach` as in [`super::locate::Locator`].
pub struct Measure<'a> {
    pub mesh: &'a Mesh,
    pub holding: &'a Holding,
    pub reach: f64,
    pub grain: &'a Grain,
    pub shape: &'a NearShape,
    pub rivals: &'a [Rival<'a>],
    pub body: &'a mut Body,
    pub scratch: &'a mut Scratch,
}

impl Kernel for Measure<'_> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let Measure {
            mesh,
            holding,
            reach,
            grain,
            shape,
            rivals,
            body,
            scratch,
        } = self;
        let (eps, blended) = (holding.eps, holding.scheme == Scheme::Paper);
        let turn = DMat3::from_quat(grain.pose.orientation);
        let to_body = turn.transpose();
        let step = DVec3::X * mesh.spacing.x;
        let body_step = to_body * step;
        let around = Around {
            far: grain.shape.bounding_radius() + reach,
            lower: grain.shape.lower() - reach,
            upper: grain.shape.upper() + reach,
            h: mesh.spacing.x,
            per_step: 1.0 / body_step,
        };
        let size = body.size;
        let count = (size.x * size.y * size.z) as usize;
        let Scratch {
            faces,
            shared,
            normals,
        } = scratch;
        faces.clear();
        shared.clear();
        let wide = size.x as usize + MOST;
        normals.0.iter_mut().for_each(|n| n.resize(wide, 0.0));
        body.forced.runs.iter_mut().for_each(Vec::clear);
        let nearest = |x: DVec3| {
            let others = rivals.iter();
            others
                .map(|rival| rival.distance(x, reach) + rival.handicap * eps)
                .fold(f64::INFINITY, f64::min)
        };
        for (axis, offset) in FACE_OFFSET.iter().enumerate() {
            let distance = &mut body.distance[axis];
            distance.resize(count + MOST, f64::INFINITY);
            body.spans[axis].clear();
            body.rows[axis].clear();
            for (k, j) in (0..size.z).flat_map(|k| (0..size.y).map(move |j| (k, j))) {
                let start = position(mesh, offset, body.first + IVec3::new(0, j, k));
                let arm = start - grain.pose.position;
                let row = [to_body * arm, body_step];
                let range = around.row(arm, row[0], size.x);
                let first = (size.x * (j + size.y * k)) as usize;
                let distance = &mut distance[first..];
                normals.fill::<V>(distance, shape, turn, row, range.clone());
                let span = within(distance, range, reach);
                let forced = within(distance, span.clone(), 2.0 * eps);
                body.spans[axis].push([span.start, span.end]);
                let (rows, runs) = (&mut body.rows[axis], &mut body.forced.runs[axis]);
                body.places.runs(axis, [j, k], span, |part, at, below| {
                    rows.push(PushRow {
                        at,
                        first: first + part.start as usize,
                        count: part.len(),
                    });
                    let held = part.start.max(forced.start)..part.end.min(forced.end);
                    let number = faces.count();
                    if !held.is_empty() {
                        let from = held.start as usize;
                        let ahead = (held.start - part.start) as usize;
                        runs.push(Run {
                            at: at + ahead,
                            below: below + ahead,
                            arm: arm + f64::from(held.start) * step,
                            first: number,
                            count: held.len(),
                        });
                        let normal = normals.0.each_ref().map(|list| &list[from..]);
                        faces.extend::<V>(held.len(), &distance[from..], normal);
                    }
                    if rivals.is_empty() {
                        return;
                    }
                    for i in part {
                        let (x, d) = (start + f64::from(i) * step, &mut distance[i as usize]);
                        let rival = nearest(x);
                        if held.contains(&i) {
                            let face = number + (i - held.start) as usize;
                            if rival <= -eps && rival < *d {
                                faces.forgo(face, holding);
                            } else if rival < 2.0 * eps && (*d > -eps || blended) {
                                shared.push((face, x));
                            }
                        }
                        if *d > rival {
                            *d = f64::INFINITY;
                        }
                    }
                });
            }
        }
    }
}

/// The part of `range` from the first to the last place that is no farther than `limit`.
fn within(distance: &[f64], range: Range<i32>, limit: f64) -> Range<i32> {
    let near = |i: &i32| distance[*i as usize] <= limit;
    let Some(start) = range.clone().find(near) else {
        return 0..0;
    };
    let last = range.rev().find(near).unwrap_or(start);
    start..last + 1
}

/// What lies about a grain.
struct Around {
    /// Radius of a ball about its centroid that holds all of it [m].
    far: f64,
    /// A box in its own frame that does [m].
    lower: DVec3,
    upper: DVec3,
    /// Spacing of the faces of a row [m]; one over a step along it, in the grain's frame [1/m].
    h: f64,
    per_step: DVec3,
}

impl Around {
    /// Which of the `count` faces of a row may matter; the first is at `arm` from the centroid and at
    /// `first` in the frame of the grain.
    fn row(&self, arm: DVec3, first: DVec3, count: i32) -> Range<i32> {
        let square = self.far * self.far - arm.y * arm.y - arm.z * arm.z;
        if square <= 0.0 {
            return 0..0;
        }
        let half = square.sqrt();
        let [a, b] = [self.lower, self.upper].map(|side| (side - first) * self.per_step);
        let (from, to) = (a.min(b).max_element(), a.max(b).min_element());
        let from = from.max((-half - arm.x) / self.h).ceil() as i32;
        let to = to.min((half - arm.x) / self.h).floor() as i32;
        from.clamp(0, count)..(to.saturating_add(1)).clamp(0, count)
    }
}

#[inline]
fn position(mesh: &Mesh, offset: &[f64; 3], cell: IVec3) -> DVec3 {
    let offset = DVec3::from_array(*offset);
    mesh.origin + mesh.spacing * (cell.as_dvec3() - 1.0 + offset)
}
