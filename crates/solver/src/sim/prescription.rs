//! Quantities prescribed by formulas: initial velocity, body acceleration, motion of grains.

use glam::DVec3;

use crate::dem::{Grain, MotionConstraint};
use crate::math::Formula;

/// Formulas of a set-up; a formula overrides the constant of the same name.
#[derive(Clone, Debug, Default)]
pub struct Prescription {
    /// Initial velocity of the fluid [m/s], a function of x, y, z [m].
    pub initial_velocity: Option<Formula>,
    /// Body acceleration of the fluid [m/s^2], a function of t [s].
    pub body_acceleration: Option<Formula>,
    /// Prescribed motions of grains, functions of t [s].
    pub motions: Vec<PrescribedMotion>,
}

/// Prescribed motion of one grain; components without a formula keep their [`MotionConstraint`].
#[derive(Clone, Debug)]
pub struct PrescribedMotion {
    /// Index of the grain.
    pub grain: usize,
    /// Velocity of the centroid [m/s].
    pub velocity: Option<Formula>,
    /// Angular velocity, space frame [rad/s].
    pub angular_velocity: Option<Formula>,
}

impl Prescription {
    /// Prescribes the velocities at `time` [s] to the grains: as their degrees of freedom over the
    /// next step, and as their present velocities.
    pub fn prescribe_motion(&self, grains: &mut [Grain], time: f64) {
        self.set_velocities(grains, time);
        for motion in &self.motions {
            let grain = &mut grains[motion.grain];
            if grain.has_left() {
                continue;
            }
            if motion.velocity.is_some() {
                grain.translation = MotionConstraint::Prescribed(grain.velocity);
            }
            if motion.angular_velocity.is_some() {
                grain.rotation = MotionConstraint::Prescribed(grain.angular_velocity);
            }
        }
    }

    /// Sets the present velocities of the grains with prescribed motion to those at `time` [s].
    pub(super) fn set_velocities(&self, grains: &mut [Grain], time: f64) {
        for motion in &self.motions {
            let grain = &mut grains[motion.grain];
            if grain.has_left() {
                continue;
            }
            if let Some(formula) = &motion.velocity {
                grain.velocity = formula.at(&[time]);
            }
            if let Some(formula) = &motion.angular_velocity {
                grain.angular_velocity = formula.at(&[time]);
            }
        }
    }

    /// Body acceleration of the fluid at `time` [s] if a formula prescribes it [m/s^2].
    pub fn body_acceleration(&self, time: f64) -> Option<DVec3> {
        let formula = self.body_acceleration.as_ref()?;
        Some(formula.at(&[time]))
    }
}
