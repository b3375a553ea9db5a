//! The time step, in the order of section 2 of the paper.

use super::stages::{Start, weight_less_buoyancy};
use super::timing::timed;
use super::{Simulation, StepError};

impl Simulation {
    /// Advances the simulation by one time step; `limit` [s] caps it so that output times are met
    /// exactly.
    ///
    /// # Errors
    /// [`StepError::Unstable`] if the state is no longer finite or the CFL number has jumped.
    pub fn step(&mut self, limit: f64) -> Result<(), StepError> {
        let rate = (self.fluid.as_ref()).map_or(0.0, |fluid| fluid.measures().max_rate);
        let dt = self.clock.choose(rate, limit);
        match Start::new(self, dt) {
            Some(start) => {
                // u* of the momentum equation (Eqs 1b to 3), without the grains.
                let predicted = start.predict();
                // Contact sub-steps (Eqs 6 to 36) under the last hydrodynamic load.
                let moved = predicted.move_grains();
                // Faces forced at the new poses; Eqs 4 and 5 as a 6 x 6 system of each grain.
                let coupled = moved.couple();
                // The sub-steps again with the fluid's response, if grains touch (decision 0014).
                let resolved = coupled.resolve_contact();
                // New velocities of the grains on the forced faces (Eq. 4), loads (Eq. 5).
                let rigid = resolved.impose_rigidity();
                // Poisson solve: velocity without divergence (Eq. 1a), and pressure.
                let projected = rigid.project();
                projected.finish();
            }
            None => self.step_without_fluid(dt),
        }
        self.clock.advance(dt);
        self.check_stability()
    }

    /// Contact sub-steps alone (Eqs 6 to 36).
    fn step_without_fluid(&mut self, dt: f64) {
        let (grains, prescription) = (&mut self.setup.grains, &self.setup.prescription);
        for (load, grain) in self.data.applied.iter_mut().zip(&*grains) {
            *load = weight_less_buoyancy(grain, self.setup.gravity, 0.0);
        }
        prescription.drive(grains, self.clock.time + 0.5 * dt);
        let (dynamics, data) = (&mut self.dynamics, &mut self.data);
        timed(&mut self.times.contact, || {
            dynamics.advance(grains, &data.applied, dt, &mut data.contact)
        });
        prescription.drive(grains, self.clock.time + dt);
    }
}
