//! Detection of unstable runs.

use std::fmt;

use super::Simulation;

/// Remedy of an unstable run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// A smaller time step or a softer contact.
    StepOrContact,
    /// A smaller time step or a finer grid.
    StepOrGrid,
    /// A finer grid or a smaller time step; the last slices may show the cause.
    GridOrStepOrSlices,
}

impl Remedy {
    /// Returns the advice; `smaller_step` names the means of a smaller time step.
    pub fn advice(self, smaller_step: &str) -> String {
        match self {
            Remedy::StepOrContact => format!("{smaller_step} or a softer contact"),
            Remedy::StepOrGrid => format!("{smaller_step} or a finer grid"),
            Remedy::GridOrStepOrSlices => {
                format!("a finer grid, {smaller_step}, or a look at the last slices")
            }
        }
    }
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.advice("a smaller time step"))
    }
}

/// Failure of a step.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The state is not finite or changes too fast.
    #[error("{}; try {remedy}", symptom(*time, *step, what))]
    Unstable {
        /// Time [s].
        time: f64,
        /// Number of the step.
        step: u64,
        /// Observed symptom.
        what: String,
        /// Suggested remedy.
        remedy: Remedy,
    },
}

impl StepError {
    /// Returns the message with an advice that names the means of a smaller time step.
    pub fn message(&self, smaller_step: &str) -> String {
        let StepError::Unstable { time, step, what, remedy } = self;
        let advice = remedy.advice(smaller_step);
        format!("{}; try {advice}", symptom(*time, *step, what))
    }
}

fn symptom(time: f64, step: u64, what: &str) -> String {
    format!("the run became unstable at t = {time:.6e} s (step {step}): {what}")
}

/// CFL number above which a step counts as unstable.
const MAX_CFL: f64 = 10.0;

impl Simulation {
    /// Checks that the state is finite and the CFL number below its bound.
    pub(super) fn check_stability(&self) -> Result<(), StepError> {
        let unstable = |what: String, remedy: Remedy| {
            Err(StepError::Unstable { time: self.clock.time, step: self.clock.steps, what, remedy })
        };
        for (i, grain) in self.setup.grains.iter().enumerate() {
            let finite = (grain.pose.position.is_finite() || grain.has_left())
                && grain.velocity.is_finite()
                && grain.angular_velocity.is_finite()
                && grain.pose.orientation.is_finite();
            if !finite {
                return unstable(
                    format!("the motion of grain {i} is not finite"),
                    Remedy::StepOrContact,
                );
            }
        }
        if let Some(fluid) = &self.fluid {
            let measures = fluid.measures();
            if !(measures.kinetic_energy.is_finite() && measures.max_divergence.is_finite()) {
                return unstable("the velocity is not finite".into(), Remedy::StepOrGrid);
            }
            let cfl = self.cfl();
            if cfl > MAX_CFL {
                return unstable(format!("the CFL number jumped to {cfl:.1}"), Remedy::StepOrGrid);
            }
        }
        Ok(())
    }
}
