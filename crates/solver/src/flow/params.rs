//! Parameters of the fluid.

use glam::DVec3;

/// Properties of the fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidParams {
    /// Density [kg/m^3].
    pub density: f64,
    /// Kinematic viscosity [m^2/s].
    pub kinematic_viscosity: f64,
    /// Uniform acceleration that drives the flow (a mean pressure gradient over density) [m/s^2].
    pub body_acceleration: DVec3,
    /// Uniform velocity at the start [m/s].
    pub initial_velocity: DVec3,
}

impl FluidParams {
    /// Fluid at rest of `density` [kg/m^3] and `kinematic_viscosity` [m^2/s].
    pub fn new(density: f64, kinematic_viscosity: f64) -> FluidParams {
        FluidParams {
            density,
            kinematic_viscosity,
            body_acceleration: DVec3::ZERO,
            initial_velocity: DVec3::ZERO,
        }
    }
}
