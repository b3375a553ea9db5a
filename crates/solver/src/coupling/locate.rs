//! Where the grains lie on the grid: signed distances at the faces near each grain, and the list
//! of faces that its rigidity acts on.

use glam::{DMat3, DVec3, IVec3};
use rayon::prelude::*;

use super::Scheme;
use super::hold::{Faces, Hold, Holding};
use super::near::{NearShape, NearShapes};
use super::places::{Places, Unknowns};
use super::rivals::{Rival, rivals};
use crate::dem::Grain;
use crate::flow::Boundaries;
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::lanes::MOST;

/// Asks [`Places`] for cells: no axis is normal to them.
const CELL: usize = 3;

/// A face that a grain's rigidity acts on.
#[derive(Clone, Copy, Debug)]
pub struct ForcedFace {
    /// Component of the velocity.
    pub axis: usize,
    /// Position in memory, also that of the cell above it.
    pub at: usize,
    /// Position of the cell below it, across a periodic edge if need be.
    pub below: usize,
    /// From the grain's centroid to the face [m].
    pub arm: DVec3,
    /// Share by which the face takes the rigid velocity, 0 to 1.
    pub share: f64,
    /// Part of the face that the grain closes to the pressure gradient, 0 to 1.
    pub closed: f64,
    /// Part that all grains together close.
    pub closed_by_all: f64,
    /// What the pressure takes from the face in the step, given back to its closed part [m/s]. Known
    /// once the impulse is, like `free`.
    pub back: f64,
    /// Velocity there without the drag of the grains [m/s].
    pub free: f64,
}

/// One grain on the grid.
#[derive(Clone, Debug, Default)]
pub struct Body {
    /// Lower corner of the box of cells about the grain; counted from 1, may lie across a periodic edge.
    pub first: IVec3,
    /// Cells of the box.
    pub size: IVec3,
    /// Signed distance [m] at the faces of the box for each component; infinite where another grain
    /// is nearer, or where it does not matter. Some entries more follow the last.
    pub distance: [Vec<f64>; 3],
    /// Which faces of each row along x the distance matters at, for each component.
    pub spans: [Vec<[i32; 2]>; 3],
    /// Where the box lies in memory.
    pub places: Places,
    /// What is added to the tendency at the faces of the box for each component [m/s^2].
    pub push: [Vec<f64>; 3],
    /// Faces under its rigidity.
    pub forced: Vec<ForcedFace>,
}

impl Body {
    /// Position of cell `(i, j, k)` of the box (from 0) in `distance`.
    #[inline]
    pub fn local(&self, i: i32, j: i32, k: i32) -> usize {
        (i + self.size.x * (j + self.size.y * k)) as usize
    }

    /// The forced faces of one component: they are listed component by component.
    pub fn forced_along(&self, axis: usize) -> &[ForcedFace] {
        let end = |axis: usize| self.forced.partition_point(|face| face.axis < axis);
        &self.forced[end(axis)..end(axis + 1)]
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let values = self.distance.iter().chain(&self.push);
        let spans: usize = self.spans.iter().map(Vec::capacity).sum();
        values
            .map(|v| size_of::<f64>() * v.capacity())
            .sum::<usize>()
            + self.places.bytes()
            + size_of::<[i32; 2]>() * spans
            + size_of::<ForcedFace>() * self.forced.capacity()
    }
}

/// A face near a grain, on its way to the list of forced faces.
struct Candidate {
    axis: usize,
    at: usize,
    below: usize,
    /// Where it is [m].
    x: DVec3,
    /// Its number among the faces whose hold is to be found; none deep inside.
    near: Option<usize>,
    /// Distance from another grain [m].
    rival: f64,
}

/// What one thread needs to locate grains.
#[derive(Default)]
struct Scratch {
    candidates: Vec<Candidate>,
    faces: Faces,
}

/// Where to look for grains and how.
pub struct Locator {
    mesh: Mesh,
    unknowns: Unknowns,
    scheme: Scheme,
    kinematic_viscosity: f64,
    /// Half-width of the band [m].
    eps: f64,
    /// How far from its surface a grain matters [m].
    reach: f64,
    shapes: NearShapes,
}

impl Locator {
    pub fn new(
        mesh: &Mesh,
        boundaries: &Boundaries,
        scheme: Scheme,
        kinematic_viscosity: f64,
        grains: &[Grain],
    ) -> Locator {
        let flat = mesh.cells.map(|n| n == 1);
        let resolved: Vec<f64> = (0..3)
            .filter(|&axis| !flat[axis])
            .map(|axis| mesh.spacing[axis])
            .collect();
        let eps = resolved.iter().sum::<f64>() / resolved.len().max(1) as f64;
        // Links run along axes of more than one cell.
        let reach = 2.0 * eps + 0.5 * resolved.iter().copied().fold(0.0, f64::max);
        Locator {
            mesh: *mesh,
            unknowns: Unknowns::new(mesh, boundaries),
            scheme,
            kinematic_viscosity,
            eps,
            reach,
            shapes: NearShapes::new(grains, eps, reach),
        }
    }

    /// Half-width of the band about the surface [m].
    pub fn band(&self) -> f64 {
        self.eps
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        self.shapes.bytes()
    }

    /// Finds all grains for a step of length `dt` [s].
    pub fn locate(&self, grains: &[Grain], dt: f64, bodies: &mut [Body]) {
        let holding = Holding {
            scheme: self.scheme,
            eps: self.eps,
            spacing: self.mesh.spacing,
            diffusion: dt * self.kinematic_viscosity,
        };
        let each = bodies.par_iter_mut().enumerate();
        each.for_each_init(Scratch::default, |scratch, (index, body)| {
            let (mesh, unknowns, shapes) = (&self.mesh, &self.unknowns, &self.shapes);
            let rivals = rivals(mesh, unknowns, shapes, self.reach, grains, index);
            let grain = &grains[index];
            self.place(grain, body);
            self.measure(grain, shapes.of(index), &rivals, body, scratch);
            self.list(grain, &rivals, &holding, body, scratch);
        });
    }

    /// The box of cells about a grain.
    fn place(&self, grain: &Grain, body: &mut Body) {
        let mesh = &self.mesh;
        let turn = DMat3::from_quat(grain.pose.orientation);
        let (lower, upper) = (grain.shape.lower(), grain.shape.upper());
        let middle = grain.pose.position + turn * (0.5 * (lower + upper));
        let half = 0.5 * (upper - lower);
        let span =
            turn.x_axis.abs() * half.x + turn.y_axis.abs() * half.y + turn.z_axis.abs() * half.z;
        for axis in 0..3 {
            let (h, n) = (mesh.spacing[axis], mesh.cells[axis] as i32);
            if n == 1 {
                (body.first[axis], body.size[axis]) = (1, 1);
                continue;
            }
            let from = (middle[axis] - span[axis] - self.reach - mesh.origin[axis]) / h;
            let to = (middle[axis] + span[axis] + self.reach - mesh.origin[axis]) / h;
            body.first[axis] = from.floor() as i32 + 1;
            body.size[axis] = to.floor() as i32 + 2 - body.first[axis];
        }
        self.unknowns.map(body.first, body.size, &mut body.places);
    }

    /// Distances in the box about a grain, and the faces that its rigidity may act on.
    fn measure(
        &self,
        grain: &Grain,
        shape: &NearShape,
        rivals: &[Rival],
        body: &mut Body,
        scratch: &mut Scratch,
    ) {
        let Scratch { candidates, faces } = scratch;
        candidates.clear();
        faces.clear();
        let (mesh, eps, reach) = (&self.mesh, self.eps, self.reach);
        let centre = grain.pose.position;
        let turn = DMat3::from_quat(grain.pose.orientation);
        let to_body = turn.transpose();
        // One face further along x, in the frame of the grain.
        let stride = to_body * (DVec3::X * mesh.spacing.x);
        let far = grain.shape.bounding_radius() + reach;
        let count = (body.size.x * body.size.y * body.size.z) as usize;
        for (axis, offset) in FACE_OFFSET.iter().enumerate() {
            let mut distance = std::mem::take(&mut body.distance[axis]);
            distance.clear();
            distance.resize(count + MOST, f64::INFINITY);
            body.spans[axis].clear();
            for k in 0..body.size.z {
                for j in 0..body.size.y {
                    let start = self.position(offset, body.first + IVec3::new(0, j, k));
                    let own = to_body * (start - centre);
                    let row = body.local(0, j, k);
                    let mut span = [body.size.x, 0];
                    for i in self.chord(start - centre, far, body.size.x) {
                        let (d, slope) = shape.distance_and_gradient(own + f64::from(i) * stride);
                        if d > reach {
                            continue;
                        }
                        span = [span[0].min(i), i + 1];
                        let x = start + DVec3::X * (f64::from(i) * mesh.spacing.x);
                        let rival = rivals
                            .iter()
                            .map(|rival| rival.distance(x, reach) + rival.handicap * eps)
                            .fold(f64::INFINITY, f64::min);
                        if d <= rival {
                            distance[row + i as usize] = d;
                        }
                        let inside_rival = rival <= -eps && rival < d;
                        if d >= 2.0 * eps || inside_rival {
                            continue;
                        }
                        let place = IVec3::new(i, j, k);
                        let at = body.places.at(axis, place);
                        let below = body.places.at(CELL, place - IVec3::AXES[axis]);
                        if let (Some(at), Some(below)) = (at, below) {
                            let normal = || turn * slope.normalize_or_zero();
                            candidates.push(Candidate {
                                axis,
                                at,
                                below,
                                x,
                                near: (d > -eps).then(|| faces.push(d, normal())),
                                rival,
                            });
                        }
                    }
                    body.spans[axis].push(span);
                }
            }
            body.distance[axis] = distance;
        }
    }

    /// Which of the `count` places of a row of faces, that begins at `start` from the centre of a ball of
    /// radius `far`, lie in the ball.
    fn chord(&self, start: DVec3, far: f64, count: i32) -> std::ops::Range<i32> {
        let square = far * far - start.y * start.y - start.z * start.z;
        if square <= 0.0 {
            return 0..0;
        }
        let (half, h) = (square.sqrt(), self.mesh.spacing.x);
        let from = ((-half - start.x) / h).ceil() as i32;
        let to = ((half - start.x) / h).floor() as i32;
        from.clamp(0, count)..(to + 1).clamp(0, count)
    }

    /// Lists the faces under the rigidity of a grain.
    fn list(
        &self,
        grain: &Grain,
        rivals: &[Rival],
        holding: &Holding,
        body: &mut Body,
        Scratch { candidates, faces }: &mut Scratch,
    ) {
        let eps = self.eps;
        faces.hold(holding);
        body.forced.clear();
        for face in candidates {
            let own = face
                .near
                .map_or(Hold::whole(self.scheme), |number| faces.at(number));
            let mut all = own;
            if face.rival < 2.0 * eps && face.near.is_some() {
                for rival in rivals {
                    let (there, slope) = rival.distance_and_gradient(face.x, 2.0 * eps);
                    if there < 2.0 * eps {
                        let normal = rival.grain.pose.orientation * slope.normalize_or_zero();
                        all = all + holding.of(there, normal);
                    }
                }
            }
            let share = if own.strength.is_finite() {
                own.strength / (1.0 + all.strength)
            } else {
                1.0
            };
            if share > 0.0 || own.closed > 0.0 {
                body.forced.push(ForcedFace {
                    axis: face.axis,
                    at: face.at,
                    below: face.below,
                    arm: face.x - grain.pose.position,
                    share,
                    closed: own.closed / all.closed.max(1.0),
                    closed_by_all: all.closed.min(1.0),
                    back: 0.0,
                    free: 0.0,
                });
            }
        }
    }

    #[inline]
    fn position(&self, offset: &[f64; 3], cell: IVec3) -> DVec3 {
        let offset = DVec3::from_array(*offset);
        self.mesh.origin + self.mesh.spacing * (cell.as_dvec3() - 1.0 + offset)
    }
}
