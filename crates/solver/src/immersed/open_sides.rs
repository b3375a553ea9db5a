//! Grains at the open sides of the box: outflows and inflows, through which they leave, and free
//! surfaces, from which they emerge.
//!
//! - **Leaving.** Close to an open side the hydrodynamic load is no longer that of an unbounded
//!   fluid. From [`MARGIN`] cells before the side on, a grain moves under its last load, which
//!   changes with its velocity ([`departing_load`]). Once it is beyond the side it has left
//!   ([`Grain::leave`]).
//! - **Emerging.** The part beyond a free surface has no buoyancy and displaces no fluid
//!   (`emerged.rs`). The pressure that acts on the grain is relative to that at the open surface.
//!   A grain that is more than [`MARGIN`] cells beyond the surface moves as without fluid.
//!
//! The boundary faces that a grain covers move with it (`flow/open_boundary.rs`).

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{BVec3, DVec3};

use super::emerged::{EmergedPart, Subvolumes};
use super::rigid_body::{PreviousStep, RigidBodySystem};
use super::rigidity::Impulse;
use crate::dem::Grain;
use crate::flow::{Boundaries, Boundary, BoxSide, CoveredFace, FluidParams};
use crate::grid::Mesh;
use crate::math::{Load, RigidVelocity, multiply6};

/// Cells before an open side from which on a grain moves under its last hydrodynamic load, and
/// cells between a grain beyond a free surface and the fluid from which on it moves without fluid.
const MARGIN: f64 = 2.0;

/// Distance from a side up to which a grain is close to it, in bounding radii.
const CLOSE: f64 = 4.0;

/// Location of a grain relative to the open sides.
#[derive(Clone, Debug, Default)]
pub enum Crossing {
    /// The grain crosses no open side and is not about to.
    #[default]
    Inside,
    /// A part of the grain is beyond a free surface.
    Emerged(Box<EmergedPart>),
    /// The whole grain is beyond a free surface and far from the fluid, which it does not feel.
    Airborne(Box<EmergedPart>),
    /// The grain is about to leave and moves under its last hydrodynamic load; the normals of the
    /// sides, and its part beyond a free surface, if there is one.
    Departing(BVec3, Option<Box<EmergedPart>>),
    /// The grain has left the box.
    Left,
}

/// Face that a grain covers.
#[derive(Clone, Copy)]
struct GrainFace {
    grain: usize,
    /// Vector from the centroid [m].
    lever_arm: DVec3,
    face: CoveredFace,
}

/// Open sides of a box and the grains that cross them.
pub struct OpenSides {
    mesh: Mesh,
    periodic: [bool; 3],
    sides: Vec<(BoxSide, Boundary)>,
    /// By grain; empty without a free surface.
    subvolumes: Vec<Arc<Subvolumes>>,
    /// By grain.
    crossings: Vec<Crossing>,
    /// Impulses of the grains on the fluid in the last step [N s].
    pub fluid_impulses: Vec<DVec3>,
    /// Accelerations of the grains over the step before the last; part of a checkpoint.
    pub earlier_accelerations: Vec<RigidVelocity>,
    faces: Vec<GrainFace>,
}

impl OpenSides {
    /// Open sides of a box; none if it has only walls and periodic sides.
    pub fn new(mesh: &Mesh, boundaries: &Boundaries, grains: &[Grain]) -> Option<OpenSides> {
        let sides = BoxSide::all().map(|side| (side, side.boundary(boundaries)));
        let sides: Vec<_> = sides
            .filter(|(_, boundary)| *boundary != Boundary::Periodic && !boundary.is_solid())
            .collect();
        let has_surface = sides.iter().any(|(_, side)| *side == Boundary::FreeSurface);
        (!sides.is_empty()).then(|| OpenSides {
            mesh: *mesh,
            periodic: boundaries.periodic(),
            sides,
            subvolumes: if has_surface { Subvolumes::of_all(grains) } else { Vec::new() },
            crossings: vec![Crossing::Inside; grains.len()],
            fluid_impulses: vec![DVec3::ZERO; grains.len()],
            earlier_accelerations: vec![RigidVelocity::default(); grains.len()],
            faces: Vec::new(),
        })
    }

    /// Crossings of the grains.
    pub fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// First grain with a part beyond a free surface.
    pub fn emerged(&self) -> Option<usize> {
        self.crossings.iter().position(|crossing| crossing.emerged_part().is_some())
    }

    /// Impulse on the fluid in the last step [N s] of a grain that crosses a side; none of another.
    pub fn impulse_across(&self, grain: usize) -> Option<DVec3> {
        let crosses = !matches!(self.crossings[grain], Crossing::Inside);
        crosses.then(|| self.fluid_impulses[grain])
    }

    /// Finds the crossings in a step of `dt` [s] that begins at the present poses; grains beyond an
    /// open side leave.
    pub fn update(&mut self, grains: &mut [Grain], dt: f64) {
        for (index, grain) in grains.iter_mut().enumerate() {
            let crossing = self.crossing(index, grain, dt);
            if let Crossing::Left = crossing {
                grain.leave();
            }
            self.crossings[index] = crossing;
        }
    }

    /// Extrapolates the accelerations in `previous` of emerged grains to the step about to be
    /// taken. With the last acceleration the virtual mass would add energy to the heave. The
    /// acceleration of a step with an impact counts as zero and is not extrapolated.
    pub fn extrapolate_accelerations(&mut self, previous: &mut [PreviousStep]) {
        let all = previous.iter_mut().zip(&mut self.earlier_accelerations).zip(&self.crossings);
        for ((previous, earlier), crossing) in all {
            let last = std::mem::replace(earlier, previous.acceleration);
            let impact = [last, previous.acceleration].contains(&RigidVelocity::default());
            if let (Crossing::Emerged(_), false) = (crossing, impact) {
                previous.acceleration = previous.acceleration + (previous.acceleration - last);
            }
        }
    }

    /// Momentum [kg m/s] that fluid of `density` [kg/m^3] in the part of a grain beyond a free
    /// surface would have.
    pub fn emerged_momentum(&self, index: usize, grain: &Grain, density: f64) -> DVec3 {
        self.crossing(index, grain, 0.0).emerged_part().map_or(DVec3::ZERO, |part| {
            let momentum = multiply6(&part.inertia, &grain.rigid_velocity().to_vector());
            density * DVec3::from_slice(&momentum[..3])
        })
    }

    fn crossing(&self, index: usize, grain: &Grain, dt: f64) -> Crossing {
        if grain.has_left() {
            return Crossing::Left;
        }
        let (mut departing, mut emerged, mut airborne) = (BVec3::FALSE, None, false);
        for &(side, boundary) in &self.sides {
            let spacing = self.mesh.spacing[side.axis];
            let margin = MARGIN * spacing;
            let coordinate = side.coordinate(&self.mesh);
            let beyond = |x: DVec3| side.outward() * (x[side.axis] - coordinate);
            if beyond(grain.pose.position) + grain.shape.bounding_radius() < -margin {
                continue;
            }
            let nodes = grain.shape.nodes().iter();
            let nodes = nodes.map(|node| beyond(grain.pose.to_space(node.position)));
            let (lowest, highest) = nodes.fold((f64::INFINITY, f64::NEG_INFINITY), |range, x| {
                (range.0.min(x), range.1.max(x))
            });
            if boundary == Boundary::FreeSurface {
                airborne = lowest > MARGIN * self.mesh.spacing.max_element();
                if highest > 0.0 {
                    let (subvolumes, direction) =
                        (&self.subvolumes[index], (side.axis, side.outward()));
                    // Buoyancy at the start of the step would add energy to the heave.
                    let middle = grain.rigid_velocity().advance(grain.pose, 0.5 * dt);
                    let part = EmergedPart::new(subvolumes, middle, direction, coordinate, spacing);
                    emerged = Some(Box::new(part));
                }
            } else if lowest > 0.0 {
                return Crossing::Left;
            } else {
                departing.set(side.axis, departing.test(side.axis) || highest > -margin);
            }
        }
        match emerged {
            _ if departing.any() => Crossing::Departing(departing, emerged),
            Some(part) if airborne => Crossing::Airborne(part),
            Some(part) => Crossing::Emerged(part),
            None => Crossing::Inside,
        }
    }

    /// Outward speed [m/s] of the fastest grain close to each side, by axis and side. The flow
    /// around the grain moves with it, so that this is the speed of convection at an outflow.
    pub fn speeds(&self, grains: &[Grain]) -> [[f64; 2]; 3] {
        let mut speeds = [[0.0; 2]; 3];
        for (grain, crossing) in grains.iter().zip(&self.crossings) {
            if !matches!(crossing, Crossing::Left) {
                for (side, _) in self.near(grain, CLOSE * grain.shape.bounding_radius()) {
                    let fastest: &mut f64 = &mut speeds[side.axis][side.side];
                    *fastest = fastest.max(side.outward() * grain.velocity[side.axis]);
                }
            }
        }
        speeds
    }

    /// Sides closer than `distance` [m] to the centroid of a grain, or which it has crossed.
    fn near(&self, grain: &Grain, distance: f64) -> impl Iterator<Item = (BoxSide, Boundary)> {
        self.sides.iter().copied().filter(move |(side, _)| {
            let along = grain.pose.position[side.axis] - side.coordinate(&self.mesh);
            side.outward() * along > -distance
        })
    }

    /// Lists the boundary faces that the grains cover at their present poses. The normal velocity
    /// at an inflow is prescribed, covered or not.
    pub fn list_covered_faces(&mut self, grains: &[Grain]) {
        self.faces.clear();
        for (index, grain) in grains.iter().enumerate() {
            if matches!(self.crossings[index], Crossing::Inside | Crossing::Left) {
                continue;
            }
            let reach = grain.shape.bounding_radius() + self.mesh.spacing.max_element();
            let sides: Vec<_> = self.near(grain, reach).collect();
            for (side, boundary) in sides {
                if !matches!(boundary, Boundary::Inflow { .. }) {
                    self.list_faces_of(index, grain, side);
                }
            }
        }
    }

    fn list_faces_of(&mut self, index: usize, grain: &Grain, side: BoxSide) {
        let (mesh, pose, radius) = (self.mesh, grain.pose, grain.shape.bounding_radius());
        let [a, b] = [(side.axis + 1) % 3, (side.axis + 2) % 3];
        let [columns, rows] = [a, b]
            .map(|axis| mesh.cells_near(axis, self.periodic[axis], pose.position[axis], radius));
        let width = 0.5 * (mesh.spacing[a] + mesh.spacing[b]);
        let mut lever_arm = DVec3::ZERO;
        lever_arm[side.axis] = side.coordinate(&mesh) - pose.position[side.axis];
        for (j, along_b) in rows {
            for (i, along_a) in columns.clone() {
                (lever_arm[a], lever_arm[b]) = (along_a, along_b);
                let distance = grain.shape.distance(pose.orientation.conjugate() * lever_arm);
                let fraction = (0.5 - distance / width).clamp(0.0, 1.0);
                if fraction > 0.0 {
                    let indices = [i + 1, j + 1];
                    let face = CoveredFace { side, indices, fraction, velocity: 0.0 };
                    self.faces.push(GrainFace { grain: index, lever_arm, face });
                }
            }
        }
    }

    /// Covered faces with the velocities of their grains.
    pub fn covered_faces(&self, grains: &[Grain]) -> Vec<CoveredFace> {
        let velocity = |face: &GrainFace| {
            grains[face.grain].rigid_velocity().at(face.lever_arm)[face.face.side.axis]
        };
        let each = self.faces.iter();
        each.map(|face| CoveredFace { velocity: velocity(face), ..face.face }).collect()
    }

    /// Load of the pressure at the free surface on each grain, per density of the fluid: the
    /// impulse on the fluid is relative to the pressure under the covered faces, but the pressure
    /// at the surface vanishes. `pressure_below` returns the kinematic pressure below faces of one
    /// side, relative to the open surface.
    pub fn surface_loads(&self, pressure_below: impl Fn(&[CoveredFace]) -> Vec<f64>) -> Vec<Load> {
        let mut loads = vec![Load::default(); self.crossings.len()];
        for &(side, boundary) in &self.sides {
            if boundary != Boundary::FreeSurface {
                continue;
            }
            let of_side = || self.faces.iter().filter(|face| face.face.side == side);
            let faces: Vec<_> = of_side().map(|face| face.face).collect();
            let area = self.mesh.cell_volume() / self.mesh.spacing[side.axis];
            let outward = side.outward() * DVec3::AXES[side.axis];
            for (face, pressure) in of_side().zip(pressure_below(&faces)) {
                let force = area * face.face.fraction * pressure * outward;
                loads[face.grain] += Load { force, torque: face.lever_arm.cross(force) };
            }
        }
        loads
    }
}

impl RigidBodySystem {
    /// Impulse on the fluid [N s] of the grain, which has its new velocities.
    pub fn fluid_impulse(&self, grain: &Grain) -> DVec3 {
        DVec3::from_slice(&self.impulse.at(grain.rigid_velocity())[..3])
    }

    /// Assembles the equations of a grain that leaves the box or is airborne under the `applied`
    /// load and the hydrodynamic load of the last step, `last_load`, over `dt` [s], without
    /// contact.
    pub fn departing(
        grain: &Grain,
        previous: &PreviousStep,
        impulse: Impulse,
        [applied, last_load]: [Load; 2],
        dt: f64,
    ) -> RigidBodySystem {
        let last_load = previous.uptake_load(grain).map_or(last_load, |load| last_load + load);
        let (none, load) = (Impulse::default(), applied + last_load);
        let mut system = RigidBodySystem::new(grain, previous, none, 0.0, load, None, dt);
        (system.impulse, system.last_load) = (impulse, Some(last_load));
        system
    }
}

/// Load at the end of a step on a grain that departs along `normals`, from the `load` during the
/// step and the velocity `before` it.
///
/// The load changes with the velocity as the drag of the sphere of equal volume in fluid at rest
/// (Schiller and Naumann 1935; torque of slow rotation). Towards a side a load against the motion
/// only decreases, at most to zero: it stops the grain, and does not drive it back.
pub fn departing_load(
    load: Load,
    grain: &Grain,
    normals: BVec3,
    before: RigidVelocity,
    fluid: &FluidParams,
) -> Load {
    let (d, nu) = (grain.shape.equivalent_diameter(), fluid.kinematic_viscosity);
    let drag = |velocity: DVec3| {
        let reynolds = velocity.length() * d / nu;
        3.0 * PI * fluid.density * nu * d * (1.0 + 0.15 * reynolds.powf(0.687)) * velocity
    };
    let changed = load.force + drag(before.linear) - drag(grain.velocity);
    let slows_down = grain.velocity.abs().cmplt(before.linear.abs());
    let is_against = (load.force * before.linear).cmplt(DVec3::ZERO);
    let reversed = (load.force * changed).cmplt(DVec3::ZERO);
    let reduced = DVec3::select(reversed, DVec3::ZERO, changed);
    let along_normal = DVec3::select(slows_down & is_against, reduced, load.force);
    let change = before.angular - grain.angular_velocity;
    Load {
        force: DVec3::select(normals, along_normal, changed),
        torque: load.torque + PI * fluid.density * nu * d.powi(3) * change,
    }
}

impl Crossing {
    /// Part of the grain beyond a free surface.
    fn emerged_part(&self) -> Option<&EmergedPart> {
        match self {
            Crossing::Emerged(part)
            | Crossing::Airborne(part)
            | Crossing::Departing(_, Some(part)) => Some(part),
            _ => None,
        }
    }

    /// Weight of the fluid of density `fluid_density` [kg/m^3] that the part of a grain beyond a
    /// free surface does not displace; none if the whole grain is in the fluid.
    pub fn lost_buoyancy(&self, gravity: DVec3, fluid_density: f64) -> Option<Load> {
        let part = self.emerged_part()?;
        let weight = fluid_density * gravity;
        Some(Load { force: part.volume * weight, torque: part.moment.cross(weight) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_shape::Shape;

    #[test]
    fn a_face_of_a_flat_box_is_covered_once() {
        let mesh = Mesh::cubic([32, 1, 32], 0.125);
        let boundaries = Boundaries([
            [Boundary::WALL; 2],
            [Boundary::Periodic; 2],
            [Boundary::WALL, Boundary::FreeSurface],
        ]);
        let position = DVec3::new(2.0, 0.0625, 3.9);
        let mut grains = [Grain::new(Shape::sphere(0.5, 600), 0.5).with_position(position)];
        let mut sides = OpenSides::new(&mesh, &boundaries, &grains).expect("an open side");
        sides.update(&mut grains, 0.01);
        sides.list_covered_faces(&grains);
        let mut faces: Vec<_> = sides.faces.iter().map(|face| face.face.indices).collect();
        let count = faces.len();
        faces.sort_unstable();
        faces.dedup();
        assert_eq!(faces.len(), count);
        assert!((8..=9).contains(&count), "{count}");
    }

    #[test]
    fn an_impact_in_a_free_surface_is_not_extrapolated() {
        let mesh = Mesh::cubic([32; 3], 0.125);
        let mut boundaries = Boundaries([[Boundary::WALL; 2]; 3]);
        boundaries.0[2][1] = Boundary::FreeSurface;
        let position = DVec3::new(2.0, 2.0, 3.9);
        let mut grains = [Grain::new(Shape::sphere(0.5, 600), 0.5).with_position(position)];
        let mut sides = OpenSides::new(&mesh, &boundaries, &grains).expect("an open side");
        sides.update(&mut grains, 0.01);
        let mut extrapolated = Vec::new();
        // Accelerations of four steps; the second is one with an impact.
        for acceleration in [3.0, 0.0, 2.0, 2.5] {
            let mut previous = [PreviousStep::default()];
            previous[0].acceleration.linear.z = acceleration;
            sides.extrapolate_accelerations(&mut previous);
            extrapolated.push(previous[0].acceleration.linear.z);
        }
        assert_eq!(extrapolated, [3.0, 0.0, 2.0, 3.0]);
    }
}
