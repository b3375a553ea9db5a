//! Signed distances at the faces in a box about a grain, and the list of those that its rigidity may
//! act on.

use std::ops::Range;

use glam::{DMat3, DVec3, IVec3};

use super::Scheme;
use super::forced::Run;
use super::hold::Faces;
use super::locate::{Body, PushRow};
use super::near::NearShape;
use super::rivals::Rival;
use crate::dem::Grain;
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::lanes::{Kernel, MOST, RAMP, Vector};

/// What one thread needs to locate grains.
#[derive(Default)]
pub struct Scratch {
    /// Faces near the surface, whose hold is to be found.
    pub faces: Faces,
    /// Place of each of them in the list of forced ones.
    pub places: Vec<usize>,
    /// Which of them other grains may hold as well, and where they are [m].
    pub shared: Vec<(usize, DVec3)>,
    row: Row,
}

/// A row of faces: distances, unit normals in the space frame, and what the grain does to each.
#[derive(Default)]
struct Row {
    distance: Vec<f64>,
    normal: [Vec<f64>; 3],
    role: Vec<Role>,
}

#[derive(Clone, Copy, Default)]
enum Role {
    /// Nothing.
    #[default]
    Free,
    /// Takes all of it: the face is deep inside (the paper's coupling asks its shares themselves).
    Whole,
    /// Holds it, perhaps with others; that far is it from them [m].
    Near(f64),
}

impl Row {
    fn resize(&mut self, count: usize) {
        self.distance.resize(count, 0.0);
        self.normal.iter_mut().for_each(|n| n.resize(count, 0.0));
        self.role.resize(count, Role::Free);
    }

    /// Distances and normals of the faces in `range`. In the frame of the shape, which is turned by
    /// `turn`, the face 0 is at `first` and the others follow by `step`.
    #[inline(always)]
    fn fill<V: Vector<Number = f64>>(
        &mut self,
        shape: &NearShape,
        turn: DMat3,
        first: DVec3,
        step: DVec3,
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
            distance.store(&mut self.distance[at..]);
            for (axis, list) in self.normal.iter_mut().enumerate() {
                let normal = V::constant(columns[0][axis]) * unit[0]
                    + V::constant(columns[1][axis]) * unit[1]
                    + V::constant(columns[2][axis]) * unit[2];
                normal.store(&mut list[at..]);
            }
        }
    }
}

/// The measurement of one grain; `eps` and `reach` as in [`super::locate::Locator`].
pub struct Measure<'a> {
    pub mesh: &'a Mesh,
    pub scheme: Scheme,
    pub eps: f64,
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
            scheme,
            eps,
            reach,
            grain,
            shape,
            rivals,
            body,
            scratch,
        } = self;
        let turn = DMat3::from_quat(grain.pose.orientation);
        let to_body = turn.transpose();
        let step = DVec3::X * mesh.spacing.x;
        let far = grain.shape.bounding_radius() + reach;
        let size = body.size;
        let count = (size.x * size.y * size.z) as usize;
        let Scratch {
            faces,
            places,
            shared,
            row,
        } = scratch;
        faces.clear();
        places.clear();
        shared.clear();
        row.resize(size.x as usize + MOST);
        body.forced.clear();
        let nearest = |x: DVec3| {
            let others = rivals.iter();
            others
                .map(|rival| rival.distance(x, reach) + rival.handicap * eps)
                .fold(f64::INFINITY, f64::min)
        };
        for (axis, offset) in FACE_OFFSET.iter().enumerate() {
            let distance = &mut body.distance[axis];
            distance.clear();
            distance.resize(count + MOST, f64::INFINITY);
            body.spans[axis].clear();
            body.rows[axis].clear();
            for (k, j) in (0..size.z).flat_map(|k| (0..size.y).map(move |j| (k, j))) {
                let start = position(mesh, offset, body.first + IVec3::new(0, j, k));
                let arm = start - grain.pose.position;
                let range = chord(arm, far, mesh.spacing.x, size.x);
                row.fill::<V>(shape, turn, to_body * arm, to_body * step, range.clone());
                let distance = &mut distance[(size.x * (j + size.y * k)) as usize..];
                let (mut span, mut forced) = ([size.x, 0], [size.x, 0]);
                for i in range {
                    let at = i as usize;
                    let d = row.distance[at];
                    row.role[at] = Role::Free;
                    if d > reach {
                        continue;
                    }
                    span = [span[0].min(i), i + 1];
                    let rival = nearest(start + f64::from(i) * step);
                    if d <= rival {
                        distance[at] = d;
                    }
                    let inside_rival = rival <= -eps && rival < d;
                    if d < 2.0 * eps && !inside_rival {
                        forced = [forced[0].min(i), i + 1];
                        row.role[at] = if d > -eps || scheme == Scheme::Paper {
                            Role::Near(rival)
                        } else {
                            Role::Whole
                        };
                    }
                }
                body.spans[axis].push(span);
                let (rows, list) = (&mut body.rows[axis], &mut body.forced);
                body.places
                    .runs(axis, [j, k], span[0]..span[1], |part, at, below| {
                        rows.push(PushRow {
                            at,
                            first: (part.start + size.x * (j + size.y * k)) as usize,
                            count: part.len(),
                        });
                        let faces_in = part.start.max(forced[0])..part.end.min(forced[1]);
                        if faces_in.is_empty() {
                            return;
                        }
                        let ahead = (faces_in.start - part.start) as usize;
                        list.runs[axis].push(Run {
                            at: at + ahead,
                            below: below + ahead,
                            arm: arm + f64::from(faces_in.start) * step,
                            first: list.share.len(),
                            count: faces_in.len(),
                        });
                        for i in faces_in {
                            let at = i as usize;
                            match row.role[at] {
                                Role::Free => _ = list.push(0.0, 0.0),
                                Role::Whole => _ = list.push(1.0, 1.0),
                                Role::Near(rival) => {
                                    places.push(list.push(0.0, 0.0));
                                    let normal = [0, 1, 2].map(|axis| row.normal[axis][at]);
                                    let number = faces.push(row.distance[at], normal);
                                    if rival < 2.0 * eps {
                                        shared.push((number, start + f64::from(i) * step));
                                    }
                                }
                            }
                        }
                    });
            }
        }
    }
}

/// Which of the `count` places of a row, `h` apart, lie in the ball of radius `far` about a centre from
/// which the first is at `start`.
fn chord(start: DVec3, far: f64, h: f64, count: i32) -> Range<i32> {
    let square = far * far - start.y * start.y - start.z * start.z;
    if square <= 0.0 {
        return 0..0;
    }
    let half = square.sqrt();
    let from = ((-half - start.x) / h).ceil() as i32;
    let to = ((half - start.x) / h).floor() as i32;
    from.clamp(0, count)..(to + 1).clamp(0, count)
}

#[inline]
fn position(mesh: &Mesh, offset: &[f64; 3], cell: IVec3) -> DVec3 {
    let offset = DVec3::from_array(*offset);
    mesh.origin + mesh.spacing * (cell.as_dvec3() - 1.0 + offset)
}
