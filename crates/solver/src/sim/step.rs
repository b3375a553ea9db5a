//! The time step: the equations of section 2 of the paper, in the order of decision 0014.

use super::stages::Start;
use super::{AdvanceError, Simulation, StepError};

/// Relative difference below which two times count as equal.
pub const SAME_TIME: f64 = 1e-9;

impl Simulation {
    /// Advances the simulation to `time` [s], in steps of which the last ends there. A time less
    /// than [`Self::least_horizon`] away counts as reached.
    ///
    /// # Errors
    /// [`AdvanceError::NotFinite`] if `time` is not finite; [`AdvanceError::Step`] as in
    /// [`Simulation::step`].
    pub fn advance_to(&mut self, time: f64) -> Result<(), AdvanceError> {
        if !time.is_finite() {
            return Err(AdvanceError::NotFinite { time });
        }
        while let Some(left) = self.time_left(time) {
            self.step(left)?;
        }
        Ok(())
    }

    /// Time from now until `end` [s]; none if it has passed, or is too near for a step.
    pub fn time_left(&self, end: f64) -> Option<f64> {
        let left = end - self.clock.time;
        (left > SAME_TIME * end && left >= self.least_horizon()).then_some(left)
    }

    /// Shortest horizon of a step [s], a thousandth of the last step: a shorter step disturbs the
    /// pressure and the loads, since the velocity that the last step left in the grains is removed
    /// in a shorter time.
    pub fn least_horizon(&self) -> f64 {
        1e-3 * self.clock.last_step
    }

    /// Advances the simulation by one time step. Its length is chosen by the
    /// [`StepRule`](super::StepRule) and such that a whole number of equal steps ends `horizon` [s]
    /// from now, which makes output times exact; an infinite horizon imposes no such condition. A
    /// horizon should be at least [`Self::least_horizon`].
    ///
    /// # Panics
    /// If `horizon` is not positive.
    ///
    /// # Errors
    /// [`StepError`] if the state is no longer finite, the CFL number has jumped, grains
    /// overlap beyond their limit, or a grain of a run with a refined box reaches a free surface.
    /// The simulation cannot be continued from such a state.
    pub fn step(&mut self, horizon: f64) -> Result<(), StepError> {
        assert!(horizon > 0.0, "a step ends after the present time, not {horizon} s from it");
        let rate = (self.fluid.as_ref())
            .map_or(0.0, |fluid| fluid.measures().max_rate.max(self.rate_of_set_velocities()));
        let dt = self.clock.next_step(rate, horizon);
        match Start::prepare(self, dt) {
            Start::Coupled(start) => {
                // u* of the momentum equation (Eqs 1b to 3), without the grains.
                let predicted = start.predict();
                // Contact sub-steps (Eqs 6 to 36) under the last hydrodynamic load.
                let moved = predicted.move_grains();
                // Faces forced at the new poses; Eqs 4 and 5 as a 6 x 6 system of each grain,
                // solved at once for isolated grains.
                let coupled = moved.couple();
                // The sub-steps again, with the 6 x 6 mass of grain and fluid, if a contact load
                // acts or acted in the last step (decisions 0014, 0022).
                let resolved = coupled.resolve_contact();
                // New velocities of the other grains on the forced faces (Eq. 4), loads (Eq. 5).
                let rigid = resolved.impose_rigidity();
                // Poisson solve: velocity without divergence (Eq. 1a), and pressure.
                let projected = rigid.project();
                projected.finish();
            }
            // Contact sub-steps alone (Eqs 6 to 36).
            Start::Dry(start) => start.move_grains(),
        }
        self.clock.advance(dt, horizon);
        self.check_stability()
    }
}
