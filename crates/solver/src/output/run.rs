//! The run loop: step, record, checkpoint, until the end.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::checkpoint;
use super::compare::differing;
use super::error::{Context, RunError};
use super::file::write_whole;
use super::folder::{self, Existing, Found, RESOLVED, SUMMARY};
use super::plan::RunPlan;
use super::provenance::{Provenance, Session};
use super::recorder::Recorder;
use super::summary::Summary;
use crate::sim::events::{Event, Phase, StopWhen};
use crate::sim::{Setup, Simulation, StepError, StepRule};

/// What is to be run.
#[derive(Clone, Debug)]
pub struct Job {
    /// What is simulated.
    pub setup: Setup,
    /// What is written, and when it ends.
    pub plan: RunPlan,
    /// Text of `case.resolved.toml`.
    pub resolved: String,
    /// Hash of everything that decides the results.
    pub digest: String,
    /// Files that the resolved case refers to: name in the run folder, contents.
    pub files: Vec<(String, Arc<Vec<u8>>)>,
}

/// How to run it.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// What to do with a run that is already there.
    pub existing: Existing,
    /// Command, for the provenance.
    pub command: Vec<String>,
    /// Threads, for the provenance; the caller sets them.
    pub threads: usize,
}

/// Where a run is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Simulated time [s].
    pub time: f64,
    /// End of the run [s].
    pub end: f64,
    /// Steps taken, all sessions.
    pub steps: u64,
    /// Steps taken in this session.
    pub session_steps: u64,
    /// Wall-clock time of this session [s].
    pub wall_s: f64,
    /// Time at which this session began [s].
    pub from: f64,
    /// Last step [s].
    pub dt: f64,
    /// Gap between the surfaces of a pair [m].
    pub gap: Option<f64>,
    /// Phase of a pair.
    pub phase: Option<Phase>,
    /// Contacts.
    pub contacts: usize,
}

/// Is told how a run goes on, and asked whether it should.
pub trait Observer {
    /// After every step.
    fn progress(&mut self, _: &Progress) {}
    /// When something has happened.
    fn event(&mut self, _: &Event) {}
    /// Something worth knowing: where a run goes on, a damaged checkpoint.
    fn note(&mut self, _: &str) {}
    /// Whether to write a checkpoint and stop; asked after every step.
    fn interrupted(&self) -> bool {
        false
    }
}

/// An observer that does nothing.
pub struct Silent;
impl Observer for Silent {}

/// How a run ended.
#[derive(Clone, Debug)]
pub enum Ending {
    /// At its end, or because a stop rule was met.
    Finished(Summary),
    /// It had finished before.
    AlreadyFinished(Summary),
    /// On request; a checkpoint was written at this time [s].
    Interrupted(f64),
}

/// Runs a job in `out`.
///
/// The same job gives the same tables, pictures and final state bit for bit, for any number of
/// threads, and however often it was interrupted and resumed.
///
/// # Errors
/// [`RunError`]; where the numerics or the disk fail, the last good checkpoint is kept.
pub fn run(
    job: Job,
    out: &Path,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Ending, RunError> {
    // First without a trace in a folder that is not ours, then for good: another program may have
    // come between.
    folder::admit(out, options.existing.settle(out, &job.digest))?;
    let _lock = folder::take(out)?;
    let existing = options.existing.settle(out, &job.digest);
    let found = folder::admit(out, existing)?;
    let mut provenance = Provenance::new(&job.digest);
    let resuming = existing == Existing::Resume;
    if resuming {
        provenance = Provenance::read(out).unwrap_or(provenance);
        if provenance.case_sha256 != job.digest {
            let what = differing(out, &job.resolved);
            return Err(RunError::OtherCase {
                folder: out.into(),
                what,
            });
        }
    }
    if found == Found::Finished && resuming {
        let summary = folder::read_summary(out)?;
        if summary.end_time_s >= job.plan.end * (1.0 - 1e-9) || summary.ended_by != "end" {
            return Ok(Ending::AlreadyFinished(summary));
        }
        observer.note(&format!(
            "the run had ended at t = {:.6e} s; going on to {:.6e} s",
            summary.end_time_s, job.plan.end
        ));
    }
    let mut sim = Simulation::new(job.setup)?;
    let record = if resuming {
        checkpoint::restore(out, &job.digest, &mut sim, &mut |text| observer.note(text))?
    } else {
        None
    };
    match &record {
        Some(record) => observer.note(&format!(
            "resuming at t = {:.6e} s, step {}",
            record.time, record.steps
        )),
        None if resuming => observer.note("there is no checkpoint: starting from the beginning"),
        None => {}
    }
    if record.is_none() && found != Found::Empty {
        folder::clear(out)?;
    }
    folder::create(out)?;
    provenance
        .sessions
        .push(Session::now(&options.command, options.threads, sim.steps()));
    provenance.write(out)?;
    write(&out.join(RESOLVED), job.resolved.as_bytes())?;
    for (name, bytes) in &job.files {
        write(&out.join(name), bytes)?;
    }
    let summary_path = out.join(SUMMARY);
    if summary_path.exists() {
        std::fs::remove_file(&summary_path).context("remove", &summary_path)?;
    }
    let recorder = match record {
        Some(record) => Recorder::resume(out, record, &job.plan, &sim)?,
        None => Recorder::start(out, &job.digest, &job.plan, &sim)?,
    };
    Running {
        out: out.into(),
        plan: job.plan,
        sim,
        recorder,
        provenance,
        started: Instant::now(),
    }
    .drive(observer)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    write_whole(path, false, |out| out.write_all(bytes)).context("write", path)
}

struct Running {
    out: PathBuf,
    plan: RunPlan,
    sim: Simulation,
    recorder: Recorder,
    provenance: Provenance,
    started: Instant,
}

impl Running {
    fn drive(mut self, observer: &mut dyn Observer) -> Result<Ending, RunError> {
        let (from, first_step) = (self.sim.time(), self.sim.steps());
        let mut saved = Instant::now();
        let mut saved_time = self.sim.time();
        loop {
            if let Some(why) = self.ended() {
                return self.finish(why);
            }
            let limit = self
                .recorder
                .until_next(self.sim.time(), self.sim.time_step());
            let stepped = self.sim.step(limit).and_then(|()| self.collapsed(limit));
            if let Err(source) = stepped {
                return Err(self.failed(source, saved_time));
            }
            for event in self.recorder.after_step(&self.sim)? {
                observer.event(&event);
            }
            let tracker = self.recorder.tracker();
            observer.progress(&Progress {
                time: self.sim.time(),
                end: self.plan.end,
                steps: self.sim.steps(),
                session_steps: self.sim.steps() - first_step,
                wall_s: self.started.elapsed().as_secs_f64(),
                from,
                dt: self.sim.time_step(),
                gap: tracker.gap(),
                phase: tracker.phase(),
                contacts: self.sim.contacts().len(),
            });
            let (every, interval) = (self.plan.checkpoint_steps, self.plan.checkpoint_interval);
            let by_steps = every > 0 && self.sim.steps().is_multiple_of(every);
            let by_clock = interval > 0.0 && saved.elapsed().as_secs_f64() >= interval;
            let interrupted = observer.interrupted();
            if by_steps || by_clock || interrupted {
                self.checkpoint()?;
                (saved, saved_time) = (Instant::now(), self.sim.time());
            }
            if interrupted {
                return Ok(Ending::Interrupted(saved_time));
            }
        }
    }

    /// An error if the step has become absurdly short, though an output is far away.
    fn collapsed(&self, limit: f64) -> Result<(), StepError> {
        let dt = self.sim.time_step();
        if dt >= self.plan.smallest_step || 2.0 * dt > limit {
            return Ok(());
        }
        Err(StepError::Unstable {
            time: self.sim.time(),
            step: self.sim.steps(),
            what: format!(
                "the time step has collapsed to {dt:.1e} s: somewhere the fluid is far faster than any grain should settle"
            ),
            remedy: "a finer grid, a smaller [time] cfl, or a look at the last slices".into(),
        })
    }

    /// Why the run is at its end, if it is.
    fn ended(&self) -> Option<&'static str> {
        let time = self.sim.time();
        if time >= self.plan.end * (1.0 - 1e-9) {
            return Some("end");
        }
        let stop = self.plan.stop?;
        let since = self
            .recorder
            .tracker()
            .holds_since(stop.when, self.sim.grains())?;
        (time - since >= stop.hold).then_some(match stop.when {
            StopWhen::Landing => "landing",
            StopWhen::Rest => "rest",
            StopWhen::Separation => "separation",
        })
    }

    fn note_wall(&mut self) -> Result<(), RunError> {
        if let Some(session) = self.provenance.sessions.last_mut() {
            session.wall_s = self.started.elapsed().as_secs_f64();
        }
        self.provenance.write(&self.out)
    }

    fn checkpoint(&mut self) -> Result<(), RunError> {
        self.recorder.checkpoint(&self.sim)?;
        self.note_wall()
    }

    fn finish(mut self, why: &str) -> Result<Ending, RunError> {
        self.recorder.finish(&self.sim)?;
        self.checkpoint()?;
        let summary = self
            .recorder
            .summary(&self.sim, self.provenance.wall_s(), why);
        let path = self.out.join(SUMMARY);
        write_whole(&path, true, |out| {
            serde_json::to_writer_pretty(&mut *out, &summary)?;
            writeln!(out)
        })
        .context("write", &path)?;
        // The last one is enough to go on to a later end.
        checkpoint::keep(&self.out, 1)?;
        Ok(Ending::Finished(summary))
    }

    /// What to try, by the key that the case has for its steps.
    fn advice(&self, remedy: &str) -> String {
        let own = match self.sim.setup().step {
            StepRule::Fixed(_) => "a smaller [time] step",
            StepRule::Limits { .. } => "a smaller [time] cfl",
        };
        remedy
            .replace("a smaller [time] cfl, a smaller fixed step", own)
            .replace("a smaller [time] cfl", own)
            .replace("a smaller time step", own)
    }

    /// Notes what was seen; the last good checkpoint stays as it is.
    fn failed(&mut self, mut source: StepError, time: f64) -> RunError {
        let StepError::Unstable {
            time: at,
            step,
            what,
            remedy,
        } = &mut source;
        *remedy = self.advice(remedy);
        let failure = serde_json::json!({ "time": at, "step": step, "what": what, "remedy": remedy, "checkpoint_time": time });
        let path = self.out.join("failure.json");
        let kept =
            write(&path, format!("{failure:#}\n").as_bytes()).and_then(|()| self.note_wall());
        match kept {
            Ok(()) => RunError::Unstable {
                source,
                time,
                folder: self.out.join(checkpoint::FOLDER),
            },
            Err(error) => error,
        }
    }
}
