//! Conservation checks and other measures of the state.

use glam::DVec3;

use super::Simulation;
use crate::math::RigidVelocity;

/// Measures of the state at the end of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Diagnostics {
    /// Largest |div u| after projection [1/s].
    pub max_divergence: f64,
    /// Square root of the largest u^2 + v^2 + w^2 of a cell, with the velocities of its three lower
    /// faces [m/s].
    pub max_velocity: f64,
    /// CFL number dt * max(sum |u_a| / h_a) of the last step.
    pub cfl: f64,
    /// Root mean square slip velocity at the surface nodes [m/s].
    pub slip: f64,
    /// Kinetic energy of the fluid in the box [J], the fluid inside grains included: the sum over
    /// the lower faces of all cells.
    pub fluid_kinetic_energy: f64,
    /// Kinetic energy of the grains with [`Simulation::grain_velocity`] [J].
    pub grain_kinetic_energy: f64,
    /// Momentum of the box [kg m/s]: fluid at all faces but those of the sides that are not
    /// periodic, plus that of the grains beyond the displaced fluid.
    pub momentum: DVec3,
    /// Change of momentum of fluid, grains and walls in the last step that no force explains,
    /// relative to fluid density times box volume times the largest velocity.
    pub momentum_residual: f64,
}

impl Simulation {
    /// Largest |div u| after the last projection [1/s]; zero without fluid.
    pub fn max_divergence(&self) -> f64 {
        self.fluid.as_ref().map_or(0.0, |fluid| fluid.measures().max_divergence)
    }
    /// Measures the state at the end of the last step.
    pub fn diagnostics(&self) -> Diagnostics {
        let grains = &self.setup.grains;
        let mut d = Diagnostics::default();
        let fluid_density = self.setup.fluid.map_or(0.0, |fluid| fluid.density);
        for (index, grain) in grains.iter().enumerate() {
            let RigidVelocity { linear, angular: spin } = self.grain_velocity(index);
            d.grain_kinetic_energy +=
                0.5 * (grain.mass() * linear.length_squared() + spin.dot(grain.inertia() * spin));
            d.momentum += (grain.density - fluid_density) * grain.shape.volume() * grain.velocity;
            if let Some(open_sides) = &self.data.open_sides {
                d.momentum += open_sides.emerged_momentum(index, grain, fluid_density);
            }
        }
        if let (Some(fluid), Some(params)) = (&self.fluid, &self.setup.fluid) {
            d.max_divergence = fluid.measures().max_divergence;
            d.max_velocity = fluid.measures().max_velocity;
            d.cfl = fluid.measures().max_rate * self.clock.last_step;
            d.fluid_kinetic_energy = params.density * fluid.measures().kinetic_energy;
            d.slip = self.slip();
            d.momentum += params.density * fluid.measures().momentum;
            let volume = self.setup.mesh.cell_volume() * self.setup.mesh.cell_count() as f64;
            let scale = params.density * volume * d.max_velocity;
            d.momentum_residual =
                if scale > 0.0 { self.data.momentum_residual.length() / scale } else { 0.0 };
        }
        d
    }

    /// Root mean square of the velocity of the fluid relative to the grain over all surface nodes
    /// in the box [m/s].
    fn slip(&self) -> f64 {
        let (mut sum, mut area) = (0.0, 0.0);
        for (index, grain) in self.setup.grains.iter().enumerate() {
            let velocity = self.grain_velocity(index);
            for node in grain.shape.nodes() {
                let x = grain.pose.to_space(node.position);
                if let Some(u) = self.interpolate_velocity(x) {
                    let relative = u - velocity.at(x - grain.pose.position);
                    sum += node.area * relative.length_squared();
                    area += node.area;
                }
            }
        }
        if area > 0.0 { (sum / area).sqrt() } else { 0.0 }
    }
}
