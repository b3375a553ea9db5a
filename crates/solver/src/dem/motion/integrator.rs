//! Leapfrog integration of one grain over a sub-step, in kick-drift-kick form (Eqs 19-36).
//!
//! v^(n+1/2) = v^n + dt/2 (F^n/m - xi v^n), x^(n+1) = x^n + dt v^(n+1/2) and
//! v^(n+1) = (v^(n+1/2) + dt/2 F^(n+1)/m) / (1 + xi dt/2) are Eqs 21-23 split at integer times; the
//! two half steps in sequence give Eq. 22.

use glam::DVec3;

use super::response::GrainResponse;
use super::rotation::{half_step_explicit, half_step_implicit, rotate_by_cayley, rotate_exactly};
use crate::dem::grain::{Grain, MotionConstraint};
use crate::math::Load;

/// Velocities in the middle of a sub-step, space frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HalfStepVelocity {
    /// v^(n+1/2) [m/s].
    pub velocity: DVec3,
    /// omega^(n+1/2) [rad/s].
    pub angular_velocity: DVec3,
    /// v^(n+1) predicted with the load at n [m/s].
    pub predicted_velocity: DVec3,
    /// omega^(n+1) predicted with the load at n [rad/s].
    pub predicted_angular_velocity: DVec3,
}

/// Inertia against a load.
#[derive(Clone, Copy)]
pub(super) enum EffectiveInertia<'a> {
    /// Inverse mass [1/kg], and the grain's own moments of inertia.
    Grain(f64),
    /// Response with the fluid; the load is the contact load only.
    WithFluid(&'a GrainResponse),
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
    let mut mid = HalfStepVelocity::default();
    match grain.translation {
        MotionConstraint::Free => {
            let acceleration = match inertia {
                EffectiveInertia::Grain(inverse_mass) => load.force * inverse_mass,
                EffectiveInertia::WithFluid(response) => response.acceleration(load)[0],
            };
            let change = half * (acceleration - damping * grain.velocity);
            mid.velocity = grain.velocity + change;
            mid.predicted_velocity = mid.velocity + change;
        }
        MotionConstraint::Prescribed(velocity) => {
            grain.velocity = velocity;
            mid.velocity = velocity;
            mid.predicted_velocity = velocity;
        }
    }
    grain.pose.position += step * mid.velocity;
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
            mid.angular_velocity = grain.pose.orientation * omega_mid;
            mid.predicted_angular_velocity = 2.0 * mid.angular_velocity - grain.angular_velocity;
        }
        MotionConstraint::Prescribed(omega) => {
            grain.angular_velocity = omega;
            grain.pose.orientation = rotate_exactly(grain.pose.orientation, omega, step);
            mid.angular_velocity = omega;
            mid.predicted_angular_velocity = omega;
        }
    }
    mid
}

/// Second half step, with the load at n+1: velocities to n+1.
pub(super) fn second_half_step(
    grain: &mut Grain,
    mid: &HalfStepVelocity,
    load: &Load,
    inertia: EffectiveInertia,
    damping: f64,
    step: f64,
) {
    let half = 0.5 * step;
    let damping_factor = 1.0 + damping * half;
    let (force, torque) = (load.force, load.torque);
    if grain.translation == MotionConstraint::Free {
        let acceleration = match inertia {
            EffectiveInertia::Grain(inverse_mass) => force * inverse_mass,
            EffectiveInertia::WithFluid(response) => response.acceleration(load)[0],
        };
        grain.velocity = (mid.velocity + half * acceleration) / damping_factor;
    }
    if grain.rotation == MotionConstraint::Free {
        grain.angular_velocity = match inertia {
            EffectiveInertia::Grain(_) => {
                let to_body = grain.pose.orientation.conjugate();
                let omega = half_step_implicit(
                    grain.principal_inertia(),
                    to_body * mid.angular_velocity,
                    to_body * torque,
                    damping,
                    half,
                );
                grain.pose.orientation * omega
            }
            EffectiveInertia::WithFluid(response) => {
                (mid.angular_velocity + half * response.acceleration(load)[1]) / damping_factor
            }
        };
    }
}
