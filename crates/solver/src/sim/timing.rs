//! Wall time of the passes of a step.

use std::time::{Duration, Instant};

use crate::poisson::PoissonTimes;

use super::Simulation;

/// Wall time spent in each pass since the start.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PassTimes {
    /// Prediction of the flow without the grains.
    pub predict: Duration,
    /// Contact sub-steps.
    pub contact: Duration,
    /// Location of the grains, impulse and rigidity.
    pub coupling: Duration,
    /// Projection, with the Poisson solver.
    pub project: Duration,
    /// Wall time of the Poisson solver before the first step.
    pub initial: PoissonTimes,
}

/// Runs `work` and adds its wall time to `total`.
pub(super) fn timed<T>(total: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *total += start.elapsed();
    result
}

impl Simulation {
    /// Wall time spent in each pass of the step since the start [s]. The projection has four
    /// passes: right-hand side and forward transforms, tridiagonal columns, inverse transforms and
    /// correction, ghost cells and sums.
    pub fn pass_times(&self) -> [(&'static str, f64); 7] {
        let times = &self.times;
        let poisson = (self.fluid.as_ref()).map_or(times.initial, |fluid| fluid.poisson_times());
        let [forward, columns, inverse] = [
            poisson.forward - times.initial.forward,
            poisson.columns - times.initial.columns,
            poisson.inverse - times.initial.inverse,
        ];
        let solve = forward + columns + inverse;
        [
            ("predict", times.predict),
            ("contact", times.contact),
            ("coupling", times.coupling),
            ("divergence", forward),
            ("columns", columns),
            ("correct", inverse),
            ("ghosts", times.project.saturating_sub(solve)),
        ]
        .map(|(name, time)| (name, time.as_secs_f64()))
    }
}
