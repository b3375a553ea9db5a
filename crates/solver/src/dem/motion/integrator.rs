//! Leapfrog integration of one grain over a sub-step, in kick-drift-kick form (Eqs 19-36).
//!
//! v^(n+1/2) = v^n + dt/2 (F^n/m - xi v^n), x^(n+1) = x^n + dt v^(n+1/2) and v^(n+1) = (v^(n+1/2) +
//! dt/2 F^(n+1)/m) / (1 + xi dt/2) are Eqs 21-23 split at integer times; the two half steps in
//! sequence give Eq. 22. The mass is that of the grain, or the 6 x 6 mass of grain and fluid
//! ([`GrainResponse`]).

use glam::DVec3;

use super::rotation::{half_step_explicit, half_step_implicit, rotate_by_cayley, rotate_exactly};
use crate::dem::grain::{Grain, MotionConstraint};
use crate::math::{Load, Matrix6, RigidVelocity, Vector6};

/// Velocities in a sub-step, space frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HalfStepVelocity {
    /// v^(n+1/2) and omega^(n+1/2).
    pub middle: RigidVelocity,
    /// v^(n+1) and omega^(n+1), predicted with the load at n.
    pub end: RigidVelocity,
}

/// Inertia against a load.
#[derive(Clone, Copy)]
pub(super) enum EffectiveInertia<'a> {
    /// Inverse mass [1/kg], and the grain's own moments of inertia.
    Grain(f64),
    /// Response with the fluid; the load is the contact load only.
    WithFluid(&'a GrainResponse),
}

impl EffectiveInertia<'_> {
    /// Acceleration of the centroid under `load` [m/s^2].
    fn acceleration(&self, load: &Load) -> DVec3 {
        match self {
            EffectiveInertia::Grain(inverse_mass) => load.force * *inverse_mass,
            EffectiveInertia::WithFluid(response) => response.acceleration(load)[0],
        }
    }
}

/// First half step: velocities to n+1/2 and pose to n+1.
pub(super) fn first_half_step(
    grain: &mut Grain,
    load: &Load,
    inertia: EffectiveInertia,
    damping: f64,
    step: f64,
) -> HalfStepVelocity {
    let half = 0.5 * step;
    let HalfStepVelocity { mut middle, mut end } = HalfStepVelocity::default();
    match grain.translation {
        MotionConstraint::Free => {
            let change = half * (inertia.acceleration(load) - damping * grain.velocity);
            middle.linear = grain.velocity + change;
            end.linear = middle.linear + change;
        }
        MotionConstraint::Prescribed(velocity) => {
            grain.velocity = velocity;
            middle.linear = velocity;
            end.linear = velocity;
        }
    }
    grain.pose.position += step * middle.linear;
    match grain.rotation {
        MotionConstraint::Free => {
            let to_body = grain.pose.orientation.conjugate();
            let omega = to_body * grain.angular_velocity;
            let omega_mid = match inertia {
                EffectiveInertia::Grain(_) => {
                    let torque = to_body * load.torque;
                    half_step_explicit(grain.principal_inertia(), omega, torque, damping, half)
                }
                EffectiveInertia::WithFluid(response) => {
                    omega + half * (to_body * response.acceleration(load)[1] - damping * omega)
                }
            };
            grain.pose.orientation = rotate_by_cayley(grain.pose.orientation, omega_mid, step);
            // The rotation axis is omega_mid, so its space components do not change.
            middle.angular = grain.pose.orientation * omega_mid;
            end.angular = 2.0 * middle.angular - grain.angular_velocity;
        }
        MotionConstraint::Prescribed(omega) => {
            grain.angular_velocity = omega;
            grain.pose.orientation = rotate_exactly(grain.pose.orientation, omega, step);
            middle.angular = omega;
            end.angular = omega;
        }
    }
    HalfStepVelocity { middle, end }
}

/// Second half step, with the load at n+1: velocities to n+1.
pub(super) fn second_half_step(
    grain: &mut Grain,
    middle: RigidVelocity,
    load: &Load,
    inertia: EffectiveInertia,
    damping: f64,
    step: f64,
) {
    let half = 0.5 * step;
    let damping_factor = 1.0 + damping * half;
    if grain.translation == MotionConstraint::Free {
        grain.velocity = (middle.linear + half * inertia.acceleration(load)) / damping_factor;
    }
    if grain.rotation == MotionConstraint::Free {
        grain.angular_velocity = match inertia {
            EffectiveInertia::Grain(_) => {
                let to_body = grain.pose.orientation.conjugate();
                let omega = half_step_implicit(
                    grain.principal_inertia(),
                    to_body * middle.angular,
                    to_body * load.torque,
                    damping,
                    half,
                );
                grain.pose.orientation * omega
            }
            EffectiveInertia::WithFluid(response) => {
                (middle.angular + half * response.acceleration(load)[1]) / damping_factor
            }
        };
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
    let of = |constraint: MotionConstraint, free: DVec3| match constraint {
        MotionConstraint::Free => free,
        MotionConstraint::Prescribed(velocity) => velocity,
    };
    grain.pose.position += dt * of(grain.translation, free.linear);
    let omega = of(grain.rotation, free.angular);
    grain.pose.orientation = rotate_exactly(grain.pose.orientation, omega, dt);
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

    /// Inverse of the mass against a force, averaged over directions [1/kg].
    pub(super) fn inverse_mass(&self) -> f64 {
        (self.inverse[0][0] + self.inverse[1][1] + self.inverse[2][2]) / 3.0
    }
}
