//! Virtual mass of grains lighter than the fluid.
//!
//! The fluid around a grain responds by the projection, one step late; without a virtual mass a
//! light grain and this response amplify each other. The displaced fluid is therefore added to both
//! sides of the grain's equations, with the new acceleration on the left and the previous one on the
//! right (`docs/decisions/0013-light-grains.md`).

use glam::{DMat3, DVec3};

use crate::dem::{Dof, Grain};
use crate::immersed::kinematics::PreviousStep;

/// Fluid that a light grain accelerates with itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct VirtualMass {
    /// [kg]
    pub mass: f64,
    /// [kg m^2]
    pub inertia: DMat3,
    /// Momentum it would have after a step of the previous acceleration [kg m/s].
    pub momentum: DVec3,
    /// Angular momentum likewise [kg m^2/s].
    pub angular_momentum: DVec3,
}

/// Density ratio below which the virtual mass is the whole displaced mass. It decreases linearly to
/// none at 1.
const FULL_BELOW: f64 = 0.8;

impl VirtualMass {
    pub fn new(grain: &Grain, previous: &PreviousStep, fluid_density: f64, dt: f64) -> VirtualMass {
        let ratio = grain.density / fluid_density;
        let part = ((1.0 - ratio) / (1.0 - FULL_BELOW)).clamp(0.0, 1.0) / ratio;
        let free = |dof: Dof| if dof == Dof::Free { part } else { 0.0 };
        let mass = grain.mass() * free(grain.translation);
        let inertia = grain.inertia() * free(grain.rotation);
        let PreviousStep {
            velocity,
            acceleration,
            ..
        } = previous;
        VirtualMass {
            mass,
            inertia,
            momentum: mass * (velocity.linear + dt * acceleration.linear),
            angular_momentum: inertia * (velocity.angular + dt * acceleration.angular),
        }
    }
}
