//! Virtual mass of grains lighter than the fluid.
//!
//! The fluid around a grain responds by the projection, one step late. A light grain and this
//! response amplify each other. The inertia of the displaced fluid is therefore added to both sides
//! of the equations of motion, times the new acceleration on the left and the previous one on the
//! right (`docs/decisions/0013-light-grains.md`).

use glam::{DMat3, DVec3};

use crate::dem::{Grain, MotionConstraint};
use crate::immersed::kinematics::PreviousStep;

/// Inertia of the fluid that a light grain accelerates with itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct VirtualMass {
    /// Virtual mass [kg].
    pub mass: f64,
    /// Virtual inertia about the centroid, space frame [kg m^2].
    pub inertia: DMat3,
    /// Momentum of the virtual mass after a step with the previous acceleration [kg m/s].
    pub momentum: DVec3,
    /// Angular momentum of the virtual inertia after such a step [kg m^2/s].
    pub angular_momentum: DVec3,
}

/// Density ratio below which the virtual mass is the displaced mass. Above it the virtual mass
/// decreases linearly to 0 at a density ratio of 1.
const FULL_BELOW: f64 = 0.8;

impl VirtualMass {
    /// Virtual mass of a grain in a step of `dt` [s]; 0 along prescribed degrees of freedom.
    pub fn new(grain: &Grain, previous: &PreviousStep, fluid_density: f64, dt: f64) -> VirtualMass {
        let ratio = grain.density / fluid_density;
        let part = ((1.0 - ratio) / (1.0 - FULL_BELOW)).clamp(0.0, 1.0) / ratio;
        let free = |constraint: MotionConstraint| {
            if constraint == MotionConstraint::Free { part } else { 0.0 }
        };
        let mass = grain.mass() * free(grain.translation);
        let inertia = grain.inertia() * free(grain.rotation);
        let PreviousStep { velocity, acceleration, .. } = previous;
        VirtualMass {
            mass,
            inertia,
            momentum: mass * (velocity.linear + dt * acceleration.linear),
            angular_momentum: inertia * (velocity.angular + dt * acceleration.angular),
        }
    }
}
