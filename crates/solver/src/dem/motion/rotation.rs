//! Rotation of a rigid body in its principal frame (Eqs 24-36).
//!
//! The orientation is a unit quaternion that rotates body vectors into the space frame. The paper's
//! (q1, q2, q3, q4) are Evans's parameters of the inverse matrix A, space to body (Eq. 30), with
//! x = q2, y = -q1, z = q3, w = q4. Angular velocities and torques are components along the
//! principal axes unless a name says `space`.
//!
//! Eqs 25-29 use half-integer velocities. The two half steps here are this scheme split at integer
//! times: omega^n = omega^(n-1/2) + dt/2 f(omega^n) (implicit, Eqs 27-28) and
//! omega^(n+1/2) = omega^n + dt/2 f(omega^n) (Eq. 29). Together they are the implicit midpoint
//! rule, which conserves the energy and the length of the angular momentum of a free body.

use glam::{DMat3, DQuat, DVec3};

/// Angular acceleration [rad/s^2] by Euler's equations (Eq. 24), body frame.
///
/// `inertia` are the principal moments [kg m^2], `omega` is in [rad/s], `torque` in [N m] and
/// `damping` is the global damping constant xi [1/s].
pub fn angular_acceleration(inertia: DVec3, omega: DVec3, torque: DVec3, damping: f64) -> DVec3 {
    (torque + (inertia * omega).cross(omega)) / inertia - damping * omega
}

/// Explicit half step: omega + half_step * f(omega) (Eq. 29), body frame.
pub fn half_step_explicit(
    inertia: DVec3,
    omega: DVec3,
    torque: DVec3,
    damping: f64,
    half_step: f64,
) -> DVec3 {
    omega + half_step * angular_acceleration(inertia, omega, torque, damping)
}

/// Implicit half step: w = omega + half_step * f(w) (Eqs 26-28) by Newton's method, body frame.
pub fn half_step_implicit(
    inertia: DVec3,
    omega: DVec3,
    torque: DVec3,
    damping: f64,
    half_step: f64,
) -> DVec3 {
    let ratio =
        DVec3::new(inertia.y - inertia.z, inertia.z - inertia.x, inertia.x - inertia.y) / inertia;
    let mut guess = omega;
    for _ in 0..20 {
        let rate = angular_acceleration(inertia, guess, torque, damping);
        let residual = guess - omega - half_step * rate;
        let w = guess * half_step;
        let jacobian = DMat3::from_cols(
            DVec3::new(1.0 + half_step * damping, -ratio.y * w.z, -ratio.z * w.y),
            DVec3::new(-ratio.x * w.z, 1.0 + half_step * damping, -ratio.z * w.x),
            DVec3::new(-ratio.x * w.y, -ratio.y * w.x, 1.0 + half_step * damping),
        );
        let change = jacobian.inverse() * residual;
        guess -= change;
        if change.length_squared() <= 1e-30 * guess.length_squared() {
            break;
        }
    }
    guess
}

/// Rotates an orientation over `step` [s] at the mid-step angular velocity `omega` [rad/s, body
/// frame] by the time-centred rule of Eqs 34-36, B^-1 B^T q.
///
/// This is the Cayley map: a rotation by 4 atan(|omega| step / 4) about omega with |q| = 1.
pub fn rotate_by_cayley(orientation: DQuat, omega: DVec3, step: f64) -> DQuat {
    let beta = omega * (0.25 * step);
    let square = beta.length_squared();
    let rotation = DQuat::from_xyzw(2.0 * beta.x, 2.0 * beta.y, 2.0 * beta.z, 1.0 - square)
        * (1.0 / (1.0 + square));
    (orientation * rotation).normalize()
}

/// Rotates an orientation over `step` [s] at a constant, prescribed angular velocity
/// [rad/s, space frame], without time-step error. Without rotation no bit changes.
pub fn rotate_exactly(orientation: DQuat, omega_space: DVec3, step: f64) -> DQuat {
    if omega_space == DVec3::ZERO {
        return orientation;
    }
    (DQuat::from_scaled_axis(omega_space * step) * orientation).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_implicit_half_step_satisfies_its_equation() {
        let inertia = DVec3::new(1.0, 2.0, 3.0);
        let torque = DVec3::new(0.1, -0.2, 0.3);
        for half_step in [1e-3, 0.05, 0.4] {
            for damping in [0.3, 200.0] {
                let omega = DVec3::new(0.9, -2.0, 1.4);
                let w = half_step_implicit(inertia, omega, torque, damping, half_step);
                let rate = angular_acceleration(inertia, w, torque, damping);
                let residual = w - omega - half_step * rate;
                assert!(residual.length() < 1e-13 * omega.length(), "{half_step}: {residual}");
            }
        }
        let at_rest = half_step_implicit(inertia, DVec3::ZERO, DVec3::ZERO, 0.0, 0.02);
        assert_eq!(at_rest, DVec3::ZERO);
    }

    #[test]
    fn small_rotations_of_both_kinds_agree() {
        let q = DQuat::from_scaled_axis(DVec3::new(0.3, -1.0, 0.5));
        let omega = DVec3::new(0.2, 0.5, -0.7);
        let cayley = rotate_by_cayley(q, omega, 1e-3);
        let exact = rotate_exactly(q, q * omega, 1e-3);
        assert!((cayley - exact).length() < 1e-10);
    }
}
