//! Leapfrog integration of one grain over a sub-step, in kick-drift-kick form (Eqs 19-36).
//!
//! v^(n+1/2) = v^n + dt/2 (F^n/m - xi v^n), x^(n+1) = x^n + dt v^(n+1/2) and v^(n+1) = (v^(n+1/2) +
//! dt/2 F^(n+1)/m) / (1 + xi dt/2) are Eqs 21-23 split at integer times; the two half steps in
//! sequence give Eq. 22. The mass is that of the grain, or the 6 x 6 mass of grain and fluid
//! ([`GrainResponse`](super::GrainResponse)).

use glam::DVec3;

use super::contact_body::ContactBody;
use super::rotation::{half_step_explicit, half_step_implicit, rotate_by_cayley, rotate_exactly};
use crate::dem::contact::SubstepVelocity;
use crate::dem::grain::{Grain, MotionConstraint};
use crate::math::{Load, RigidVelocity};

impl ContactBody {
    /// Acceleration of the centroid under `load` [m/s^2]. Added mass counts only in a contact.
    fn acceleration(&self, load: &Load) -> DVec3 {
        match &self.response {
            Some(response) => response.acceleration(load)[0],
            None if self.contact.force == DVec3::ZERO => load.force * self.own_inverse_mass,
            None => load.force * self.state.properties.inverse_mass,
        }
    }

    /// Angular acceleration under `load` [rad/s^2, space frame]; none if Euler's equations in the
    /// body frame give it.
    fn angular_acceleration(&self, grain: &Grain, load: &Load) -> Option<DVec3> {
        match (&self.response, grain.plane_normal) {
            (Some(response), _) => Some(response.acceleration(load)[1]),
            (None, Some(_)) => Some(grain.angular_response(load.torque)),
            (None, None) => None,
        }
    }

    /// First half step of the body's grain: velocities to n+1/2 and pose to n+1.
    pub fn first_half_step(&mut self, grain: &mut Grain, damping: f64, step: f64) {
        let (load, half) = (self.load + self.contact, 0.5 * step);
        let start = grain.rigid_velocity();
        let (mut middle, mut end) = (start, start);
        if grain.translation == MotionConstraint::Free {
            let change = half * (grain.in_plane(self.acceleration(&load)) - damping * start.linear);
            middle.linear = start.linear + change;
            end.linear = middle.linear + change;
        }
        grain.pose.position += step * middle.linear;
        if grain.rotation == MotionConstraint::Free {
            let to_body = grain.pose.orientation.conjugate();
            let omega = to_body * start.angular;
            let omega_mid = match self.angular_acceleration(grain, &load) {
                None => {
                    let torque = to_body * load.torque;
                    half_step_explicit(grain.principal_inertia(), omega, torque, damping, half)
                }
                Some(angular) => omega + half * (to_body * angular - damping * omega),
            };
            grain.pose.orientation = rotate_by_cayley(grain.pose.orientation, omega_mid, step);
            // The rotation axis is omega_mid, so its space components do not change.
            middle.angular = grain.spin_in_plane(grain.pose.orientation * omega_mid);
            end.angular = 2.0 * middle.angular - start.angular;
        } else {
            grain.pose.orientation = rotate_exactly(grain.pose.orientation, start.angular, step);
        }
        self.velocity = SubstepVelocity { middle, end };
    }

    /// Second half step of the body's grain, with the load at n+1: velocities to n+1.
    pub fn second_half_step(&self, grain: &mut Grain, damping: f64, step: f64) {
        let (load, half, middle) = (self.load + self.contact, 0.5 * step, self.velocity.middle);
        let damping_factor = 1.0 + damping * half;
        if grain.translation == MotionConstraint::Free {
            let change = half * grain.in_plane(self.acceleration(&load));
            grain.velocity = (middle.linear + change) / damping_factor;
        }
        if grain.rotation == MotionConstraint::Free {
            grain.angular_velocity = match self.angular_acceleration(grain, &load) {
                None => {
                    let to_body = grain.pose.orientation.conjugate();
                    let (omega, torque) = (to_body * middle.angular, to_body * load.torque);
                    let inertia = grain.principal_inertia();
                    let omega = half_step_implicit(inertia, omega, torque, damping, half);
                    grain.pose.orientation * omega
                }
                Some(angular) => (middle.angular + half * angular) / damping_factor,
            };
        }
    }
}

/// Moves a grain over `dt` [s] with velocities that change at a constant rate, from the first to
/// the second.
pub(super) fn move_at_constant_acceleration(
    grain: &mut Grain,
    [from, to]: [RigidVelocity; 2],
    dt: f64,
) {
    let free = (from + to) / 2.0;
    grain.pose.position += dt * grain.translation.velocity(free.linear);
    let omega = grain.rotation.velocity(free.angular);
    grain.pose.orientation = rotate_exactly(grain.pose.orientation, omega, dt);
}
