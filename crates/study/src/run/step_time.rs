//! Times the first steps of a run in memory, as a basis for the expected cost.

use std::sync::Barrier;
use std::time::{Duration, Instant};

use grainwake_run::{FailureKind, RunError, admit_memory};
use grainwake_solver::sim::{Simulation, StepError};
use rayon::ThreadPool;

use super::pools;
use crate::error::StudyError;
use crate::plan::Run;

/// Steps before the measurement; the first ones fill the caches.
const WARM_UP: usize = 2;
/// Least number of steps in the measurement.
const LEAST_STEPS: u32 = 5;
/// Least duration of the measurement.
const DURATION: Duration = Duration::from_secs(5);

/// Time of a step of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct StepTime {
    /// Estimated memory of the run [bytes].
    pub memory_bytes: u64,
    /// Mean of the measured wall-clock times times threads [s].
    pub measured_s: f64,
    /// Value on one thread that follows from the case file alone [s].
    pub estimated_s: f64,
}

/// Times the first steps of as many copies of a run as there are jobs, all at the same time. Writes
/// nothing.
///
/// # Errors
/// If the case is invalid, the copies do not fit into memory, or a step fails.
pub fn time_steps(run: &Run, jobs: usize, threads: usize) -> Result<StepTime, StudyError> {
    let not_timed = |what: String, kind: FailureKind| {
        let run = run.name.clone();
        StudyError::NotTimed { run, what, kind }
    };
    let case = run.case()?;
    let pools =
        pools(jobs, threads).map_err(|e| not_timed(e.to_string(), FailureKind::InputOutput))?;
    // One after the other, since each reduces the free memory.
    let copy = |pool: &ThreadPool| {
        pool.install(|| {
            admit_memory(&case.setup, None)?;
            Ok(Simulation::new(case.setup.clone())?)
        })
    };
    let copies: Result<Vec<Simulation>, RunError> = pools.iter().map(copy).collect();
    let copies = copies.map_err(|error| not_timed(error.to_string(), error.kind()))?;
    let start = Barrier::new(jobs);
    let times: Vec<Result<f64, StepError>> = std::thread::scope(|scope| {
        let timed = pools.iter().zip(copies).map(|(pool, copy)| {
            let start = &start;
            scope.spawn(move || pool.install(|| mean_step(copy, start)))
        });
        let timed: Vec<_> = timed.collect();
        // A panic in a step is a defect of the program and is passed on.
        timed
            .into_iter()
            .map(|job| job.join().unwrap_or_else(|e| std::panic::resume_unwind(e)))
            .collect()
    });
    let times: Result<Vec<f64>, StepError> = times.into_iter().collect();
    let times = times.map_err(|e| not_timed(e.to_string(), FailureKind::Computation))?;
    let estimate = case.estimate(1);
    Ok(StepTime {
        memory_bytes: run.memory_bytes,
        measured_s: threads as f64 * times.iter().sum::<f64>() / jobs as f64,
        estimated_s: estimate.wall_s / estimate.steps as f64,
    })
}

/// Returns the mean wall-clock time of a step [s] from the moment at which all copies are ready.
fn mean_step(mut copy: Simulation, start: &Barrier) -> Result<f64, StepError> {
    let warm: Result<Vec<()>, StepError> = (0..WARM_UP).map(|_| copy.step(f64::INFINITY)).collect();
    // A copy that failed must not keep the others waiting.
    start.wait();
    warm?;
    let clock = Instant::now();
    let mut steps = 0;
    while steps < LEAST_STEPS || clock.elapsed() < DURATION {
        copy.step(f64::INFINITY)?;
        steps += 1;
    }
    Ok(clock.elapsed().as_secs_f64() / f64::from(steps))
}
