//! Equations of motion of a grain with the impulse of the fluid (Eqs 4b, 4c, 5).
//!
//! Legend: m mass, I inertia, m_f and I_f mass and inertia of the displaced fluid, m_v and I_v
//! virtual mass and inertia, V and Omega velocities, J impulse on the fluid.

use glam::DVec3;

use super::Reference;
use crate::immersed::rigid_body::PreviousStep;
use crate::math::{Load, RigidVelocity};

impl Reference {
    /// Residual of the momentum [N s] and angular momentum [N m s] of grain `index` in a step from
    /// the previous velocities to `new`, under the `load` of weight, buoyancy and contact:
    ///
    /// (m - m_f)(V - V_old) - m dV + m_v (V - V_old - previous change) + J - dt F = 0 with the
    /// change dV that was set between the steps. The same with I, Omega and the previous
    /// acceleration times dt; I has the orientation at the start of the step where it multiplies
    /// Omega_old or dOmega, and that at its end elsewhere.
    pub fn momentum_residual(
        &self,
        index: usize,
        previous: &PreviousStep,
        new: RigidVelocity,
        [linear_impulse, angular_impulse]: [DVec3; 2],
        fluid_density: f64,
        load: Load,
    ) -> [DVec3; 2] {
        let (grain, dt) = (&self.grains[index], self.dt);
        let ratio = grain.density / fluid_density;
        // The virtual mass is the displaced mass below a density ratio of 0.8, and 0 above 1.
        let virtual_part = ((1.0 - ratio) / 0.2).clamp(0.0, 1.0) / ratio;
        let own_part = 1.0 - 1.0 / ratio;
        let (change, rate) = (new - previous.velocity, previous.acceleration);
        let (set, inertia, start) = (previous.set_change, grain.inertia(), previous.inertia);
        let linear = own_part * change.linear - set.linear
            + virtual_part * (change.linear - previous.change);
        let spin = inertia * new.angular - start * previous.velocity.angular;
        let angular = own_part * spin - start * set.angular
            + virtual_part * (inertia * (change.angular - dt * rate.angular));
        [
            grain.mass() * linear + linear_impulse - dt * load.force,
            angular + angular_impulse - dt * load.torque,
        ]
    }

    /// Hydrodynamic load (Eq. 5) from the momentum balance of the grain: mass times acceleration
    /// less all other loads.
    pub fn hydrodynamic_load(
        &self,
        index: usize,
        previous: &PreviousStep,
        new: RigidVelocity,
        load: Load,
    ) -> Load {
        let start = previous.start_velocity();
        let grain = &self.grains[index];
        let spin = grain.inertia() * new.angular - previous.inertia * start.angular;
        Load {
            force: grain.mass() * (new - start).linear / self.dt - load.force,
            torque: spin / self.dt - load.torque,
        }
    }
}
