//! Velocities of a rigid grain.

use std::ops::{Div, Sub};

use glam::DVec3;

use crate::dem::Grain;
use crate::math::Vector6;

/// Velocity and angular velocity of a grain in the space frame, or a change or rate of change of
/// both.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigidVelocity {
    /// Velocity of the centroid [m/s].
    pub linear: DVec3,
    /// Angular velocity [rad/s].
    pub angular: DVec3,
}

impl RigidVelocity {
    /// Present velocities of a grain.
    pub fn of(grain: &Grain) -> RigidVelocity {
        RigidVelocity { linear: grain.velocity, angular: grain.angular_velocity }
    }
    /// Velocity V + Omega x r [m/s] at the vector `lever_arm` r [m] from the centroid.
    #[inline(always)]
    pub fn at(self, lever_arm: DVec3) -> DVec3 {
        self.linear + self.angular.cross(lever_arm)
    }
    /// Vector (V, Omega) of the six unknowns of the equations of motion.
    pub fn to_vector(self) -> Vector6 {
        let ([a, b, c], [d, e, f]) = (self.linear.to_array(), self.angular.to_array());
        [a, b, c, d, e, f]
    }
    /// Inverse of [`Self::to_vector`].
    pub fn from_vector(x: &Vector6) -> RigidVelocity {
        RigidVelocity { linear: DVec3::from_slice(&x[..3]), angular: DVec3::from_slice(&x[3..]) }
    }
}

impl Sub for RigidVelocity {
    type Output = RigidVelocity;
    fn sub(self, other: RigidVelocity) -> RigidVelocity {
        RigidVelocity { linear: self.linear - other.linear, angular: self.angular - other.angular }
    }
}

impl Div<f64> for RigidVelocity {
    type Output = RigidVelocity;
    fn div(self, dt: f64) -> RigidVelocity {
        RigidVelocity { linear: self.linear / dt, angular: self.angular / dt }
    }
}

/// Position at the last time level, and velocities that the grain has during the step: a prescribed
/// velocity is set before the flow is predicted.
#[derive(Clone, Copy, Debug, Default)]
pub struct GrainKinematics {
    /// Centroid [m].
    pub position: DVec3,
    /// Velocities during the step.
    pub velocity: RigidVelocity,
}

impl GrainKinematics {
    /// Present kinematics of a grain.
    pub fn of(grain: &Grain) -> GrainKinematics {
        GrainKinematics { position: grain.pose.position, velocity: RigidVelocity::of(grain) }
    }
    /// Velocity [m/s] of the grain's material point at `x` [m].
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        self.velocity.at(x - self.position)
    }
}

/// State that a grain carries over from the previous step.
#[derive(Clone, Copy, Debug, Default)]
pub struct PreviousStep {
    /// Velocities at the start of the step.
    pub velocity: RigidVelocity,
    /// Mean acceleration over the previous step [m/s^2, rad/s^2]; zero after contact.
    pub acceleration: RigidVelocity,
    /// Part of `velocity` that contact caused in the previous step and that the added mass takes up
    /// in this step (`docs/decisions/0014-contact-with-the-fluid-response.md`).
    pub pending_added_mass_velocity: RigidVelocity,
}
