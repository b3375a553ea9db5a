//! Grain as a body of the contact sub-steps, and its response to contact in a fluid.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use grainwake_shape::Shape;

use crate::dem::contact::{BodyState, SubstepVelocity};
use crate::dem::grain::{Grain, Material, MotionConstraint};
use crate::dem::search::{PatchTree, PosedShape};
use crate::math::{Load, Matrix6, RigidVelocity, Vector6};

/// State of one grain in the contact sub-steps.
#[derive(Clone, Debug)]
pub(super) struct ContactBody {
    pub shape: Arc<Shape>,
    pub tree: Arc<PatchTree>,
    pub material: Material,
    /// State at the last evaluation. The inverse mass is that in a contact, added mass included.
    pub state: BodyState,
    /// Upper bound of the displacement of any surface point since the last evaluation [m].
    pub displacement: f64,
    /// Velocities in the present sub-step; both are those of the grain before the first one.
    pub velocity: SubstepVelocity,
    /// Known load, constant over the step.
    pub load: Load,
    /// Contact load at the last evaluation.
    pub contact: Load,
    /// Impulse of contact in the step so far, as a mean load over the step.
    pub mean_contact: Load,
    /// Response to contact with the fluid of the present step, if known.
    pub response: Option<GrainResponse>,
    /// Inverse of the grain's mass [1/kg].
    pub own_inverse_mass: f64,
    /// Largest speed gained from the known loads in the rest of the step [m/s].
    pub speed_gain: f64,
    /// Position at the last search of pairs [m].
    pub search_position: DVec3,
    /// Displacement after which the pairs are searched again [m].
    pub search_margin: f64,
}

impl ContactBody {
    /// Updates the list to one body a grain, reusing bodies of equal shape and material.
    pub fn synchronise(bodies: &mut Vec<ContactBody>, grains: &[Grain]) {
        bodies.truncate(grains.len());
        let is_current = |(i, grain): &(usize, &Grain)| {
            bodies.get(*i).is_some_and(|body| {
                Arc::ptr_eq(&body.shape, &grain.shape) && body.material == grain.material
            })
        };
        let outdated = grains.iter().enumerate().filter(|entry| !is_current(entry));
        let outdated: Vec<(usize, &Grain)> = outdated.collect();
        if outdated.is_empty() {
            return;
        }
        let trees = ContactBody::trees(bodies, grains);
        for (i, grain) in outdated {
            let body = ContactBody::new(grain, trees[&Arc::as_ptr(&grain.shape)].clone());
            match bodies.get_mut(i) {
                Some(former) => *former = body,
                None => bodies.push(body),
            }
        }
    }

    /// Begins a step of `grain` with the known load and response. Only quantities of the checkpoint
    /// may affect the step, so contact loads are cleared.
    pub fn begin_step(&mut self, grain: &Grain, load: Load, response: Option<GrainResponse>) {
        let velocity = grain.rigid_velocity();
        self.velocity = SubstepVelocity { middle: velocity, end: velocity };
        (self.load, self.response) = (load, response);
        (self.contact, self.mean_contact) = (Load::default(), Load::default());
    }

    /// Upper bound of the relative speed of the surfaces of the body and its partner [m/s]; a
    /// partner of `None` is at rest.
    pub fn surface_speed_relative_to(&self, partner: Option<&ContactBody>) -> f64 {
        let spin = |body: &ContactBody| {
            body.state.velocity.end.angular.length() * body.shape.bounding_radius()
        };
        let velocity = partner.map_or(DVec3::ZERO, |partner| partner.state.velocity.end.linear);
        (self.state.velocity.end.linear - velocity).length()
            + spin(self)
            + partner.map_or(0.0, spin)
    }

    /// Takes pose and velocities of the grain and clears the contact load; `step` [s] is the time
    /// since the last evaluation.
    pub fn update_kinematics(&mut self, grain: &Grain, step: f64) {
        self.contact = Load::default();
        let RigidVelocity { linear, angular } = self.velocity.middle;
        self.displacement =
            step * (linear.length() + grain.shape.bounding_radius() * angular.length());
        self.state.velocity = self.velocity;
        self.state.rotation = DMat3::from_quat(grain.pose.orientation);
        self.state.moments = match grain.rotation {
            MotionConstraint::Free => grain.principal_inertia(),
            MotionConstraint::Prescribed(_) => DVec3::INFINITY,
        };
    }

    /// Shape at its orientation, with the centroid at `position` [m].
    pub fn posed_shape(&self, position: DVec3) -> PosedShape<'_> {
        PosedShape { shape: &self.shape, tree: &self.tree, rotation: self.state.rotation, position }
    }
}

/// Acceleration of a grain in a fluid as an affine function of the contact load, over one step.
#[derive(Clone, Copy, Debug)]
pub struct GrainResponse {
    /// Velocities at the start, space frame.
    pub(super) start: RigidVelocity,
    /// Velocities at the end if no contact acts; only in the step after a contact, whose trial step
    /// begins with other velocities.
    pub(super) end_without_contact: Option<RigidVelocity>,
    /// Acceleration [m/s^2] and angular acceleration [rad/s^2] without contact, space frame.
    free: [DVec3; 2],
    /// Columns of the inverse 6 x 6 mass of grain and entrained fluid: accelerations under a unit
    /// force along x, y, z and a unit torque about x, y, z.
    inverse: Matrix6,
}

impl GrainResponse {
    /// Response from the velocities at the start, the loads without contact [N] and [N m], and the
    /// columns of the inverse 6 x 6 mass.
    pub fn new(start: RigidVelocity, load: Vector6, inverse: Matrix6) -> GrainResponse {
        let free = Default::default();
        let mut response = GrainResponse { start, end_without_contact: None, free, inverse };
        response.free = response.acceleration(&Load {
            force: DVec3::from_slice(&load[..3]),
            torque: DVec3::from_slice(&load[3..]),
        });
        response
    }

    /// Response in the step after a contact, with the velocities at the end if no contact acts.
    pub fn after_contact(self, end: RigidVelocity) -> GrainResponse {
        GrainResponse { end_without_contact: Some(end), ..self }
    }

    /// Acceleration [m/s^2] and angular acceleration [rad/s^2] under a contact load.
    pub(super) fn acceleration(&self, contact: &Load) -> [DVec3; 2] {
        let mut sum = self.free;
        let loads = [contact.force, contact.torque];
        for (n, column) in self.inverse.iter().enumerate() {
            let load = loads[n / 3][n % 3];
            sum[0] += load * DVec3::from_slice(&column[..3]);
            sum[1] += load * DVec3::from_slice(&column[3..]);
        }
        sum
    }

    /// Inverse of the mass against a force, averaged over the directions in which the grain moves
    /// [1/kg].
    pub(super) fn inverse_mass(&self) -> f64 {
        let all = [0, 1, 2].map(|n| self.inverse[n][n]);
        let free = all.iter().filter(|inverse| **inverse != 0.0).count();
        (all[0] + all[1] + all[2]) / free.max(1) as f64
    }
}
