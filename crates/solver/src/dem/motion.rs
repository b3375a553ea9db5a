//! Kick-drift-kick form of the motion of one grain (Eqs 19-36).
//!
//! v^(n+1/2) = v^n + dt/2 (F^n/m - xi v^n), x^(n+1) = x^n + dt v^(n+1/2) and
//! v^(n+1) = (v^(n+1/2) + dt/2 F^(n+1)/m) / (1 + xi dt/2) are Eqs 21-23 cut at integer times;
//! chaining the two kicks gives Eq. 22 back.

use glam::DVec3;

use super::grain::{Dof, Grain};
use super::response::Response;
use super::rotation::{half_kick_explicit, half_kick_implicit, turn_by_cayley, turn_exactly};
use crate::math::Load;

/// Velocities in the middle of a sub-step, space frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MidStep {
    /// v^(n+1/2) [m/s].
    pub velocity: DVec3,
    /// omega^(n+1/2) [rad/s].
    pub spin: DVec3,
    /// Velocity expected at n+1: the kick repeated.
    pub predicted_velocity: DVec3,
    /// Angular velocity expected at n+1.
    pub predicted_spin: DVec3,
}

/// What resists a load.
#[derive(Clone, Copy)]
pub(super) enum Inertia<'a> {
    /// The grain's own inertia, and a mass, given by one over it [1/kg].
    Own(f64),
    /// The grain in a fluid; the load is that of contact alone.
    InFluid(&'a Response),
}

/// First half kick and drift: moves the pose to n+1.
pub(super) fn kick_and_drift(
    grain: &mut Grain,
    load: &Load,
    inertia: Inertia,
    damping: f64,
    step: f64,
) -> MidStep {
    let half = 0.5 * step;
    let mut mid = MidStep::default();
    match grain.translation {
        Dof::Free => {
            let acceleration = match inertia {
                Inertia::Own(inverse_mass) => load.force * inverse_mass,
                Inertia::InFluid(response) => response.to(load)[0],
            };
            let change = half * (acceleration - damping * grain.velocity);
            mid.velocity = grain.velocity + change;
            mid.predicted_velocity = mid.velocity + change;
        }
        Dof::Prescribed(velocity) => {
            grain.velocity = velocity;
            mid.velocity = velocity;
            mid.predicted_velocity = velocity;
        }
    }
    grain.pose.position += step * mid.velocity;
    match grain.rotation {
        Dof::Free => {
            let to_body = grain.pose.orientation.conjugate();
            let omega = to_body * grain.angular_velocity;
            let omega_mid = match inertia {
                Inertia::Own(_) => {
                    let torque = to_body * load.torque;
                    half_kick_explicit(grain.principal_inertia(), omega, torque, damping, half)
                }
                Inertia::InFluid(response) => {
                    omega + half * (to_body * response.to(load)[1] - damping * omega)
                }
            };
            grain.pose.orientation = turn_by_cayley(grain.pose.orientation, omega_mid, step);
            // The turn is about omega_mid itself, so its space components are the same before and after.
            mid.spin = grain.pose.orientation * omega_mid;
            mid.predicted_spin = 2.0 * mid.spin - grain.angular_velocity;
        }
        Dof::Prescribed(omega) => {
            grain.angular_velocity = omega;
            grain.pose.orientation = turn_exactly(grain.pose.orientation, omega, step);
            mid.spin = omega;
            mid.predicted_spin = omega;
        }
    }
    mid
}

/// Second half kick, with the load at n+1: brings the velocities to n+1.
pub(super) fn kick(
    grain: &mut Grain,
    mid: &MidStep,
    load: &Load,
    inertia: Inertia,
    damping: f64,
    step: f64,
) {
    let half = 0.5 * step;
    let shrink = 1.0 + damping * half;
    let (force, torque) = (load.force, load.torque);
    if grain.translation == Dof::Free {
        let acceleration = match inertia {
            Inertia::Own(inverse_mass) => force * inverse_mass,
            Inertia::InFluid(response) => response.to(load)[0],
        };
        grain.velocity = (mid.velocity + half * acceleration) / shrink;
    }
    if grain.rotation == Dof::Free {
        grain.angular_velocity = match inertia {
            Inertia::Own(_) => {
                let to_body = grain.pose.orientation.conjugate();
                let omega = half_kick_implicit(
                    grain.principal_inertia(),
                    to_body * mid.spin,
                    to_body * torque,
                    damping,
                    half,
                );
                grain.pose.orientation * omega
            }
            Inertia::InFluid(response) => (mid.spin + half * response.to(load)[1]) / shrink,
        };
    }
}
