//! Time of the passes of a step.

use crate::math::TimeSpent;
use crate::poisson::PoissonTimes;

use super::Simulation;

/// Time spent in each pass since the start.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PassTimes {
    /// Prediction of the flow without the grains.
    pub predict: TimeSpent,
    /// Contact sub-steps.
    pub contact: TimeSpent,
    /// Location of the grains, impulse and rigidity.
    pub coupling: TimeSpent,
    /// Projection, with the Poisson solver.
    pub project: TimeSpent,
    /// Time of the Poisson solver before the first step.
    pub initial: PoissonTimes,
}

impl Simulation {
    /// Time spent in each pass of the step since the start, by name. The projection has four
    /// passes: right-hand side and forward transforms, tridiagonal columns, inverse transforms and
    /// correction, ghost cells and sums. Without fluid, contact is the only pass.
    pub fn pass_times(&self) -> Vec<(&'static str, TimeSpent)> {
        let times = &self.data.times;
        let Some(fluid) = &self.fluid else {
            return vec![("contact", times.contact)];
        };
        let (now, before) = (fluid.poisson_times(), times.initial);
        let [forward, columns, inverse] = [
            now.forward - before.forward,
            now.columns - before.columns,
            now.inverse - before.inverse,
        ];
        vec![
            ("predict", times.predict),
            ("contact", times.contact),
            ("coupling", times.coupling),
            ("divergence", forward),
            ("columns", columns),
            ("correct", inverse),
            ("ghosts", times.project - (forward + columns + inverse)),
        ]
    }
}
