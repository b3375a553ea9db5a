//! Detection of unstable runs.

use super::Simulation;

/// Failure of a step.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The state is not finite or changes too fast.
    #[error("the run became unstable at t = {time:.6e} s (step {step}): {what}; try {remedy}")]
    Unstable {
        /// Time [s].
        time: f64,
        /// Number of the step.
        step: u64,
        /// Observed symptom.
        what: String,
        /// Suggested remedy.
        remedy: String,
    },
}

/// CFL number above which a step counts as unstable.
const MAX_CFL: f64 = 10.0;

impl Simulation {
    /// Checks that the state is finite and the CFL number below its bound.
    pub(super) fn check_stability(&self) -> Result<(), StepError> {
        let unstable = |what: String, remedy: &str| {
            Err(StepError::Unstable {
                time: self.clock.time,
                step: self.clock.steps,
                what,
                remedy: remedy.into(),
            })
        };
        for (i, grain) in self.setup.grains.iter().enumerate() {
            let finite = grain.pose.position.is_finite()
                && grain.velocity.is_finite()
                && grain.angular_velocity.is_finite()
                && grain.pose.orientation.is_finite();
            if !finite {
                return unstable(
                    format!("the motion of grain {i} is not finite"),
                    "a smaller time step or a softer contact",
                );
            }
        }
        if let Some(fluid) = &self.fluid {
            let measures = fluid.measures();
            if !(measures.kinetic_energy.is_finite() && measures.max_divergence.is_finite()) {
                return unstable(
                    "the velocity is not finite".into(),
                    "a smaller [time] cfl or a finer grid",
                );
            }
            let cfl = self.cfl();
            if cfl > MAX_CFL {
                return unstable(
                    format!("the CFL number jumped to {cfl:.1}"),
                    "a smaller [time] cfl, a smaller fixed step or a finer grid",
                );
            }
        }
        Ok(())
    }
}
