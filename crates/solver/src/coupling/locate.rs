//! Where the grains lie on the grid: signed distances at the faces near each grain, and the list
//! of faces that its rigidity acts on.

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use super::Scheme;
use super::aperture::{aperture, drag};
use crate::dem::Grain;
use crate::flow::Boundaries;
use crate::grid::{FACE_OFFSET, Mesh};

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

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let distances: usize = self
            .distance
            .iter()
            .chain(&self.rival_distance)
            .map(|values| size_of::<f64>() * values.capacity())
            .sum();
        distances + size_of::<ForcedFace>() * self.forced.capacity()
    }
}

/// Maps box indices to memory, across periodic edges; `None` where the face is no unknown.
#[derive(Clone, Copy)]
pub struct Unknowns {
    cells: IVec3,
    strides: [usize; 3],
    periodic: [bool; 3],
}

impl Unknowns {
    pub fn new(mesh: &Mesh, boundaries: &Boundaries) -> Unknowns {
        let [x, y, z] = mesh.cells.map(|n| n as i32);
        Unknowns {
            cells: IVec3::new(x, y, z),
            strides: mesh.layout().strides(),
            periodic: [0, 1, 2].map(|axis| boundaries.is_periodic(axis)),
        }
    }
    /// Memory position of cell `cell` (counted from 1).
    #[inline]
    pub fn cell(&self, cell: IVec3) -> Option<usize> {
        // No axis is normal to a cell.
        self.at(3, cell)
    }
    /// Memory position of face `cell` (counted from 1) of component `component`.
    #[inline]
    pub fn at(&self, component: usize, cell: IVec3) -> Option<usize> {
        let mut at = 0;
        for axis in 0..3 {
            let (i, n) = (cell[axis], self.cells[axis]);
            let i = if self.periodic[axis] {
                (i - 1).rem_euclid(n) + 1
            } else if i > i32::from(axis == component) && i <= n {
                i
            } else {
                return None;
            };
            at += i as usize * self.strides[axis];
        }
        Some(at)
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
}

impl Locator {
    pub fn new(
        mesh: &Mesh,
        boundaries: &Boundaries,
        scheme: Scheme,
        kinematic_viscosity: f64,
    ) -> Locator {
        let flat = mesh.cells.map(|n| n == 1);
        let resolved: Vec<f64> = (0..3)
            .filter(|&axis| !flat[axis])
            .map(|axis| mesh.spacing[axis])
            .collect();
        let eps = resolved.iter().sum::<f64>() / resolved.len().max(1) as f64;
        Locator {
            mesh: *mesh,
            unknowns: Unknowns::new(mesh, boundaries),
            scheme,
            kinematic_viscosity,
            eps,
        }
    }

    /// Half-width of the band about the surface [m].
    pub fn band(&self) -> f64 {
        self.eps
    }
    pub fn unknowns(&self) -> &Unknowns {
        &self.unknowns
    }

    /// Finds all grains for a step of length `dt` [s].
    pub fn locate(&self, grains: &[Grain], dt: f64, bodies: &mut [Body]) {
        bodies.par_iter_mut().enumerate().for_each(|(index, body)| {
            let rivals = self.rivals(grains, index);
            self.measure(grains, index, &rivals, body);
            self.list(grains, index, &rivals, dt, body);
        });
    }

    /// How far from its surface a grain matters [m].
    fn reach(&self) -> f64 {
        2.0 * self.eps + 0.5 * self.mesh.spacing.max_element()
    }

    /// Distances in the box about grain `index`.
    fn measure(&self, grains: &[Grain], index: usize, rivals: &[Rival], body: &mut Body) {
        let (mesh, grain) = (&self.mesh, &grains[index]);
        let centre = grain.pose.position;
        let reach = self.reach();
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
                    for i in 0..body.size.x {
                        let x = self.position(offset, body.first + IVec3::new(i, j, k));
                        if (x - centre).length_squared() > far * far {
                            continue;
                        }
                        let d = grain.shape.distance_within(grain.pose.to_body(x), reach);
                        if d > reach {
                            continue;
                        }
                        let at = body.local(i, j, k);
                        distance[at] = d;
                        rival_distance[at] = rivals
                            .iter()
                            .map(|rival| {
                                rival.distance_within(grains, x, reach) + rival.handicap * self.eps
                            })
                            .fold(f64::INFINITY, f64::min);
                    }
                }
            }
            body.distance[component] = distance;
            body.rival_distance[component] = rival_distance;
        }
    }

    /// Grains, and periodic images of them and of the grain itself, whose band may meet that of
    /// grain `index`.
    fn rivals(&self, grains: &[Grain], index: usize) -> Vec<Rival> {
        let (grain, extent, reach) = (&grains[index], self.mesh.extent(), self.reach());
        let mut rivals = Vec::new();
        for (other, rival) in grains.iter().enumerate() {
            let radii = grain.shape.bounding_radius() + rival.shape.bounding_radius();
            let limit = radii + 2.0 * reach;
            let apart = grain.pose.position - rival.pose.position;
            // Images along each axis that may be near enough: first, last.
            let range = |axis: usize| match self.unknowns.periodic[axis] {
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
                            index: other,
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

    /// Lists the faces under the rigidity of grain `index`.
    fn list(&self, grains: &[Grain], index: usize, rivals: &[Rival], dt: f64, body: &mut Body) {
        let grain = &grains[index];
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
                        let cell = body.first + IVec3::new(i, j, k);
                        let Some(at) = self.unknowns.at(component, cell) else {
                            continue;
                        };
                        let lower = cell - IVec3::AXES[component];
                        let Some(below) = self.unknowns.cell(lower) else {
                            continue;
                        };
                        if inside_rival {
                            continue;
                        }
                        let x = self.position(offset, cell);
                        let own = self.hold(grain, x, d, dt);
                        let mut all = own;
                        if rival < 2.0 * self.eps && d > -self.eps {
                            for rival in rivals {
                                let there = rival.distance_within(grains, x, 2.0 * self.eps);
                                if there < 2.0 * self.eps {
                                    let other = &grains[rival.index];
                                    all = all + self.hold(other, x - rival.shift, there, dt);
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
    fn hold(&self, grain: &Grain, x: DVec3, d: f64, dt: f64) -> Hold {
        let normal = || {
            let (_, gradient) = grain.shape.distance_and_gradient(grain.pose.to_body(x));
            grain.pose.orientation * gradient.normalize_or_zero()
        };
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
struct Rival {
    index: usize,
    /// From the grain to the image in question [m].
    shift: DVec3,
    /// Added to its distance, as a part of the band, so that it has the faces as far from both or
    /// has not.
    handicap: f64,
}

impl Rival {
    /// Distance of `x` from its surface [m] where that is at most `limit`.
    fn distance_within(&self, grains: &[Grain], x: DVec3, limit: f64) -> f64 {
        let grain = &grains[self.index];
        let y = grain.pose.to_body(x - self.shift);
        grain.shape.distance_within(y, limit)
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
