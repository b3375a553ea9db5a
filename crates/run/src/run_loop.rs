//! The run loop: step a case to its end, and report the progress.

use std::path::Path;

use grainwake_formats::events::Event;
use grainwake_formats::summary::Summary;
use grainwake_solver::sim::Simulation;
use grainwake_solver::sim::events::Phase;

use crate::error::RunError;
use crate::job::{Job, Options};
use crate::memory;
use crate::recording::{Opened, Recording};

/// Progress of a run.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Simulated time [s].
    pub time: f64,
    /// End of the run [s].
    pub end: f64,
    /// Time steps taken in all sessions.
    pub steps: u64,
    /// Time steps taken in this session.
    pub session_steps: u64,
    /// Wall-clock time of this session [s].
    pub wall_s: f64,
    /// Simulated time at the start of this session [s].
    pub from: f64,
    /// Length of the last time step [s].
    pub dt: f64,
    /// Gap between the surfaces of a pair [m].
    pub gap: Option<f64>,
    /// Phase of a pair.
    pub phase: Option<Phase>,
    /// Number of contacts.
    pub contacts: usize,
}

/// Receiver of progress and events, which may interrupt a run.
pub trait Observer {
    /// Called after every time step.
    fn progress(&mut self, _: &Progress) {}
    /// Called for every event.
    fn event(&mut self, _: &Event) {}
    /// Called with messages: start of a resumed run, damaged checkpoints.
    fn note(&mut self, _: &str) {}
    /// Returns whether to write a checkpoint and stop; called after every time step.
    fn interrupted(&self) -> bool {
        false
    }
}

/// Observer that does nothing.
pub struct Silent;
impl Observer for Silent {}

/// End of a run.
#[derive(Clone, Debug)]
pub enum Ending {
    /// The end time or a stop condition was reached.
    Finished(Summary),
    /// The run had finished before.
    AlreadyFinished(Summary),
    /// The observer interrupted the run; a checkpoint was written at this time [s].
    Interrupted(f64),
}

/// Runs a job in the folder `out`.
///
/// Tables, VTK files and the final state are bitwise identical for any number of threads, and after
/// any number of interruptions and resumptions.
///
/// # Errors
/// [`RunError`]; if the numerics or the disk fail, the last valid checkpoint is kept.
pub fn run(
    job: Job,
    out: &Path,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Ending, RunError> {
    let job = &job;
    memory::admit_memory(&job.setup, Some(&job.plan))?;
    let opened = Opened::new(job, out, options)?;
    if let Some(summary) = opened.finished(job, &mut |text| observer.note(text))? {
        return Ok(Ending::AlreadyFinished(summary));
    }
    let mut sim = Simulation::new(job.setup.clone())?;
    let recording = opened.begin(job, options, &mut sim, &mut |text| observer.note(text))?;
    advance(sim, recording, observer)
}

/// Steps the simulation until the end of the case or an interruption.
fn advance(
    mut sim: Simulation,
    mut recording: Recording,
    observer: &mut dyn Observer,
) -> Result<Ending, RunError> {
    let (from, first_step) = (sim.time(), sim.steps());
    loop {
        if recording.ended(&sim).is_some() {
            return recording.finish(&sim).map(Ending::Finished);
        }
        for event in recording.step(&mut sim, f64::INFINITY)? {
            observer.event(&event);
        }
        let tracker = &recording.recorder.watch.tracker;
        observer.progress(&Progress {
            time: sim.time(),
            end: recording.plan.end,
            steps: sim.steps(),
            session_steps: sim.steps() - first_step,
            wall_s: recording.meter.wall_s(),
            from,
            dt: sim.time_step(),
            gap: tracker.gap(),
            phase: tracker.phase(),
            contacts: sim.contacts().len(),
        });
        if observer.interrupted() {
            recording.checkpoint(&sim)?;
            return Ok(Ending::Interrupted(sim.time()));
        }
    }
}
