//! Where the grains lie on the grid: signed distances at the faces near each grain, and the list
//! of faces that its rigidity acts on.

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use super::Scheme;
use super::advection::Link;
use super::aperture::{aperture, drag};
use super::near::{NearShape, NearShapes};
use super::places::{Places, Unknowns};
use crate::dem::Grain;
use crate::flow::Boundaries;
use crate::grid::{FACE_OFFSET, Mesh};

/// Asks [`Places`] for cells: no axis is normal to them.
const CELL: usize = 3;
/// Distances that differ by less than this part of the band are equal: of two copies of a link
/// across a periodic edge just one must count.
const TIE: f64 = 1e-9;

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
    /// Signed distance [m] at the faces of the box for each component; infinite where it does not
    /// matter.
    pub distance: [Vec<f64>; 3],
    /// Smallest distance from another grain there [m]; infinite where it does not matter.
    rival_distance: [Vec<f64>; 3],
    /// Where the box lies in memory.
    pub places: Places,
    /// Corrections of the advection of each component.
    pub links: [Vec<Link>; 3],
    /// Faces under its rigidity.
    pub forced: Vec<ForcedFace>,
}

impl Body {
    /// Position of cell `(i, j, k)` of the box (from 0) in `distance`.
    #[inline]
    pub fn local(&self, i: i32, j: i32, k: i32) -> usize {
        (i + self.size.x * (j + self.size.y * k)) as usize
    }

    /// Distance from the grain at position `at`, where no other grain is nearer.
    #[inline]
    pub fn own_distance(&self, component: usize, at: usize) -> f64 {
        let d = self.distance[component][at];
        if d <= self.rival_distance[component][at] {
            d
        } else {
            f64::INFINITY
        }
    }

    /// The forced faces of one component: they are listed component by component.
    pub fn forced_along(&self, axis: usize) -> &[ForcedFace] {
        let end = |axis: usize| self.forced.partition_point(|face| face.axis < axis);
        &self.forced[end(axis)..end(axis + 1)]
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let distances: usize = self
            .distance
            .iter()
            .chain(&self.rival_distance)
            .map(|values| size_of::<f64>() * values.capacity())
            .sum();
        let links: usize = self.links.iter().map(Vec::capacity).sum();
        distances
            + self.places.bytes()
            + size_of::<Link>() * links
            + size_of::<ForcedFace>() * self.forced.capacity()
    }
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
        bodies.par_iter_mut().enumerate().for_each(|(index, body)| {
            let rivals = self.rivals(grains, index);
            self.measure(&grains[index], self.shapes.of(index), &rivals, body);
            self.unknowns.map(body.first, body.size, &mut body.places);
            self.list(&grains[index], self.shapes.of(index), &rivals, dt, body);
        });
    }

    /// Distances in the box about a grain.
    fn measure(&self, grain: &Grain, shape: &NearShape, rivals: &[Rival], body: &mut Body) {
        let mesh = &self.mesh;
        let centre = grain.pose.position;
        let reach = self.reach;
        let turn = glam::DMat3::from_quat(grain.pose.orientation);
        let (lower, upper) = (grain.shape.lower(), grain.shape.upper());
        let middle = centre + turn * (0.5 * (lower + upper));
        let half = 0.5 * (upper - lower);
        let span =
            turn.x_axis.abs() * half.x + turn.y_axis.abs() * half.y + turn.z_axis.abs() * half.z;
        for axis in 0..3 {
            let (h, n) = (mesh.spacing[axis], mesh.cells[axis] as i32);
            if n == 1 {
                (body.first[axis], body.size[axis]) = (1, 1);
                continue;
            }
            let from = (middle[axis] - span[axis] - reach - mesh.origin[axis]) / h;
            let to = (middle[axis] + span[axis] + reach - mesh.origin[axis]) / h;
            body.first[axis] = from.floor() as i32 + 1;
            body.size[axis] = to.floor() as i32 + 2 - body.first[axis];
        }
        let far = grain.shape.bounding_radius() + reach;
        let count = (body.size.x * body.size.y * body.size.z) as usize;
        for (component, offset) in FACE_OFFSET.iter().enumerate() {
            let mut distance = std::mem::take(&mut body.distance[component]);
            let mut rival_distance = std::mem::take(&mut body.rival_distance[component]);
            for values in [&mut distance, &mut rival_distance] {
                values.clear();
                values.resize(count, f64::INFINITY);
            }
            for k in 0..body.size.z {
                for j in 0..body.size.y {
                    let start = self.position(offset, body.first + IVec3::new(0, j, k));
                    for i in self.chord(start - centre, far, body.size.x) {
                        let x = start + DVec3::X * (f64::from(i) * mesh.spacing.x);
                        let d = shape.distance(grain.pose.to_body(x));
                        if d > reach {
                            continue;
                        }
                        let at = body.local(i, j, k);
                        distance[at] = d;
                        rival_distance[at] = rivals
                            .iter()
                            .map(|rival| rival.distance(x, reach) + rival.handicap * self.eps)
                            .fold(f64::INFINITY, f64::min);
                    }
                }
            }
            body.distance[component] = distance;
            body.rival_distance[component] = rival_distance;
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

    /// Grains, and periodic images of them and of the grain itself, whose band may meet that of
    /// grain `index`.
    fn rivals<'a>(&'a self, grains: &'a [Grain], index: usize) -> Vec<Rival<'a>> {
        let (grain, extent, reach) = (&grains[index], self.mesh.extent(), self.reach);
        let mut rivals = Vec::new();
        for (other, rival) in grains.iter().enumerate() {
            let radii = grain.shape.bounding_radius() + rival.shape.bounding_radius();
            let limit = radii + 2.0 * reach;
            let apart = grain.pose.position - rival.pose.position;
            // Images along each axis that may be near enough: first, last.
            let range = |axis: usize| match self.unknowns.is_periodic(axis) {
                true if self.mesh.cells[axis] > 1 => (
                    ((apart[axis] - limit) / extent[axis]).ceil() as i32,
                    ((apart[axis] + limit) / extent[axis]).floor() as i32,
                ),
                _ => (0, 0),
            };
            let [(ax, bx), (ay, by), (az, bz)] = [range(0), range(1), range(2)];
            for z in az..=bz {
                for y in ay..=by {
                    for x in ax..=bx {
                        let image = IVec3::new(x, y, z);
                        let shift = image.as_dvec3() * extent;
                        let own = other == index;
                        if own && image == IVec3::ZERO
                            || (apart - shift).length_squared() > limit * limit
                        {
                            continue;
                        }
                        rivals.push(Rival {
                            grain: rival,
                            shape: self.shapes.of(other),
                            shift,
                            handicap: match own {
                                true if image.to_array() > [0; 3] => -TIE,
                                false if other < index => -TIE,
                                _ => TIE,
                            },
                        });
                    }
                }
            }
        }
        rivals
    }

    /// Lists the faces under the rigidity of a grain.
    fn list(&self, grain: &Grain, shape: &NearShape, rivals: &[Rival], dt: f64, body: &mut Body) {
        let mut forced = std::mem::take(&mut body.forced);
        forced.clear();
        for (component, offset) in FACE_OFFSET.iter().enumerate() {
            for k in 0..body.size.z {
                for j in 0..body.size.y {
                    for i in 0..body.size.x {
                        let local = body.local(i, j, k);
                        let d = body.distance[component][local];
                        if d >= 2.0 * self.eps {
                            continue;
                        }
                        let rival = body.rival_distance[component][local];
                        let inside_rival = rival <= -self.eps && rival < d;
                        if inside_rival {
                            continue;
                        }
                        let place = IVec3::new(i, j, k);
                        let Some(at) = body.places.at(component, place) else {
                            continue;
                        };
                        let lower = place - IVec3::AXES[component];
                        let Some(below) = body.places.at(CELL, lower) else {
                            continue;
                        };
                        let x = self.position(offset, body.first + place);
                        let own = self.hold(grain, shape, x, d, dt);
                        let mut all = own;
                        if rival < 2.0 * self.eps && d > -self.eps {
                            for rival in rivals {
                                let there = rival.distance(x, 2.0 * self.eps);
                                if there < 2.0 * self.eps {
                                    let x = x - rival.shift;
                                    all = all + self.hold(rival.grain, rival.shape, x, there, dt);
                                }
                            }
                        }
                        let closed_by_all = all.closed.min(1.0);
                        let share = if own.strength.is_finite() {
                            own.strength / (1.0 + all.strength)
                        } else {
                            1.0
                        };
                        if share > 0.0 || own.closed > 0.0 {
                            forced.push(ForcedFace {
                                axis: component,
                                at,
                                below,
                                arm: x - grain.pose.position,
                                share,
                                closed: own.closed / all.closed.max(1.0),
                                closed_by_all,
                                back: 0.0,
                                free: 0.0,
                            });
                        }
                    }
                }
            }
        }
        body.forced = forced;
    }

    /// How a surface at distance `d` holds the face at `x` for a step of `dt`.
    fn hold(&self, grain: &Grain, shape: &NearShape, x: DVec3, d: f64, dt: f64) -> Hold {
        let normal = || grain.pose.orientation * shape.normal(grain.pose.to_body(x));
        match self.scheme {
            Scheme::Aperture if d <= -self.eps => Hold {
                strength: f64::INFINITY,
                closed: 1.0,
            },
            Scheme::Aperture => Hold {
                strength: dt
                    * self.kinematic_viscosity
                    * drag(d, normal(), self.mesh.spacing, self.eps),
                closed: 1.0 - aperture(d, self.eps),
            },
            Scheme::Paper => {
                let width = normal().abs().dot(self.mesh.spacing);
                let share = (0.5 - d / width).clamp(0.0, 1.0);
                Hold {
                    strength: share / (1.0 - share),
                    closed: 0.0,
                }
            }
        }
    }

    #[inline]
    fn position(&self, offset: &[f64; 3], cell: IVec3) -> DVec3 {
        let offset = DVec3::from_array(*offset);
        self.mesh.origin + self.mesh.spacing * (cell.as_dvec3() - 1.0 + offset)
    }
}

/// Another grain nearby, or an image of the grain itself.
struct Rival<'a> {
    grain: &'a Grain,
    shape: &'a NearShape,
    /// From the grain to the image in question [m].
    shift: DVec3,
    /// Added to its distance, as a part of the band, so that it has the faces as far from both or
    /// has not.
    handicap: f64,
}

impl Rival<'_> {
    /// Distance of `x` from its surface [m] where that is at most `limit`, else that or infinity.
    fn distance(&self, x: DVec3, limit: f64) -> f64 {
        let (pose, x) = (&self.grain.pose, x - self.shift);
        let far = self.grain.shape.bounding_radius() + limit;
        if x.distance_squared(pose.position) > far * far {
            return f64::INFINITY;
        }
        self.shape.distance(pose.to_body(x))
    }
}

/// How surfaces hold a face.
#[derive(Clone, Copy)]
struct Hold {
    /// Drag times the step: the face takes strength / (1 + strength) of the rigid velocity.
    strength: f64,
    /// Part closed to the pressure gradient.
    closed: f64,
}

impl std::ops::Add for Hold {
    type Output = Hold;
    fn add(self, other: Hold) -> Hold {
        Hold {
            strength: self.strength + other.strength,
            closed: self.closed + other.closed,
        }
    }
}
