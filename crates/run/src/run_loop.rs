//! The run loop: step, record, checkpoint.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use grainwake_formats::disk::{self, write_atomically};
use grainwake_formats::events::Event;
use grainwake_formats::summary::{self, EndReason, Summary};
use grainwake_solver::sim::events::{Phase, StopWhen};
use grainwake_solver::sim::{
    Remedy, RemedyTerms, SAME_TIME, Setup, Simulation, StepError, StepRule,
};

use crate::error::{Context, RunError};
use crate::memory;
use crate::meter::Meter;
use crate::plan::RunPlan;
use crate::recorder::Recorder;
use crate::run_folder::ExtraTable;
use crate::run_folder::checkpoint::Record;
use crate::run_folder::provenance::{ParentRun, Provenance, Session};
use crate::run_folder::{self, Content, Existing, Parent, RESOLVED, checkpoint, differing};

/// Simulation to run, with its outputs.
#[derive(Clone, Debug)]
pub struct Job {
    /// Set-up of the simulation.
    pub setup: Setup,
    /// Outputs and end.
    pub plan: RunPlan,
    /// Text of `case.resolved.toml`.
    pub resolved: String,
    /// Hash of everything that affects the results.
    pub digest: String,
    /// Files of the resolved case: path in the run folder, and content.
    pub files: Vec<(String, Arc<Vec<u8>>)>,
}

/// Options of [`run()`].
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Treatment of an existing run in the folder.
    pub existing: Existing,
    /// Command line, for the provenance.
    pub command: Vec<String>,
    /// Number of threads, for the provenance; the caller configures the thread pool.
    pub threads: usize,
    /// Checkpoint that a new run starts from; none for a start at t = 0. The case is valid for it
    /// ([`Case::check_parent`](crate::case::Case::check_parent)).
    pub parent: Option<Parent>,
}

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
/// Tables, VTK files and the final state have the same bits for any number of threads, and after
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
    memory::admit(&job.setup)?;
    let parent = options.parent.as_ref();
    run_folder::admit_parent(out, parent)?;
    // The folder is checked before the lock file is created in it, and again under the lock.
    run_folder::admit(out, options.existing.resolve(out, &job.digest))?;
    let _lock = run_folder::lock_folder(out)?;
    let existing = options.existing.resolve(out, &job.digest);
    let content = run_folder::admit(out, existing)?;
    let mut provenance = Provenance::new(&job.digest);
    provenance.parent = parent.map(Parent::described);
    let resuming = existing == Existing::Resume;
    if resuming {
        provenance = Provenance::read(out).unwrap_or(provenance);
        if provenance.case_sha256 != job.digest {
            let what = differing(out, &job.resolved);
            return Err(RunError::OtherCase { folder: out.into(), what });
        }
        run_folder::same_parent(out, &provenance, parent)?;
    }
    if content == Content::Finished && resuming {
        let summary = Summary::read(out).context("read", &out.join(summary::FILE))?;
        if summary.end_time_s >= job.plan.end * (1.0 - SAME_TIME)
            || summary.ended_by != EndReason::End
        {
            return Ok(Ending::AlreadyFinished(summary));
        }
        observer.note(&format!(
            "the run had ended at t = {:.6e} s; going on to {:.6e} s",
            summary.end_time_s, job.plan.end
        ));
    }
    let mut sim = Simulation::new(job.setup)?;
    let own = if resuming {
        let tables = ExtraTable::all(&job.plan);
        checkpoint::restore(out, &job.digest, &tables, &mut sim, &mut |text| observer.note(text))?
    } else {
        None
    };
    let begin = begin(own, resuming, parent, &mut sim, observer)?;
    if let (None, Some(lost)) = (parent, &provenance.parent)
        && matches!(begin, Begin::Fresh)
    {
        return Err(run_folder::start_lost(out, lost));
    }
    if !matches!(begin, Begin::Resumed(_)) && content != Content::Empty {
        run_folder::clear(out)?;
    }
    run_folder::create(out)?;
    provenance.sessions.push(Session::now(&options.command, options.threads, sim.steps()));
    provenance.write(out)?;
    let started_from = provenance.parent.as_ref().map_or(String::new(), ParentRun::comment);
    write(&out.join(RESOLVED), (started_from + &job.resolved).as_bytes())?;
    for (name, bytes) in &job.files {
        write(&out.join(name), bytes)?;
    }
    let summary_path = out.join(summary::FILE);
    if summary_path.exists() {
        disk::remove_file(&summary_path).context("remove", &summary_path)?;
    }
    let recorder = match begin {
        Begin::Fresh => Recorder::start(out, &job.digest, &job.plan, &sim)?,
        Begin::Resumed(record) => Recorder::resume(out, *record, &job.plan, &sim)?,
        Begin::Branched(record) => Recorder::branch(out, &job.digest, *record, &job.plan, &sim)?,
    };
    Running { out: out.into(), plan: job.plan, sim, recorder, provenance, meter: Meter::start() }
        .advance(observer)
}

/// State that a run begins with.
enum Begin {
    /// State at t = 0.
    Fresh,
    /// Checkpoint of the same run.
    Resumed(Box<Record>),
    /// Checkpoint of the parent run.
    Branched(Box<Record>),
}

/// Returns the state that the run begins with: its own restored checkpoint, or that of the parent,
/// which is restored here.
fn begin(
    own: Option<Record>,
    resuming: bool,
    parent: Option<&Parent>,
    sim: &mut Simulation,
    observer: &mut dyn Observer,
) -> Result<Begin, RunError> {
    if let Some(record) = own {
        let (time, steps) = (record.time, record.steps);
        observer.note(&format!("resuming at t = {time:.6e} s, step {steps}"));
        return Ok(Begin::Resumed(Box::new(record)));
    }
    let Some(parent) = parent else {
        if resuming {
            observer.note("there is no checkpoint: starting from the beginning");
        }
        return Ok(Begin::Fresh);
    };
    let record = parent.restore(sim)?;
    let (folder, time, steps) = (parent.folder().display(), record.time, record.steps);
    observer.note(&format!("starting from {folder} at t = {time:.6e} s, step {steps}"));
    Ok(Begin::Branched(Box::new(record)))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    write_atomically(path, true, |out| out.write_all(bytes)).context("write", path)
}

/// Run in progress.
struct Running {
    out: PathBuf,
    plan: RunPlan,
    sim: Simulation,
    recorder: Recorder,
    provenance: Provenance,
    meter: Meter,
}

impl Running {
    fn advance(mut self, observer: &mut dyn Observer) -> Result<Ending, RunError> {
        let (from, first_step) = (self.sim.time(), self.sim.steps());
        let mut saved = Instant::now();
        let mut saved_time = self.sim.time();
        loop {
            if let Some(why) = self.ended() {
                return self.finish(why);
            }
            let limit = self.recorder.until_next(self.sim.time(), self.sim.time_step());
            let stepped = self.sim.step(limit).and_then(|()| self.collapsed(limit));
            if let Err(source) = stepped {
                return Err(self.failed(source, saved_time));
            }
            for event in self.meter.output(|| self.recorder.after_step(&self.sim))? {
                observer.event(&event);
            }
            let tracker = self.recorder.tracker();
            observer.progress(&Progress {
                time: self.sim.time(),
                end: self.plan.end,
                steps: self.sim.steps(),
                session_steps: self.sim.steps() - first_step,
                wall_s: self.meter.wall_s(),
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

    /// Returns an error if the time step has collapsed although no output is near.
    fn collapsed(&self, limit: f64) -> Result<(), StepError> {
        let dt = self.sim.time_step();
        if dt >= self.plan.smallest_step || 2.0 * dt > limit {
            return Ok(());
        }
        let symptom = format!(
            "the time step has collapsed to {dt:.1e} s: somewhere the fluid is far faster than any \
             grain should settle"
        );
        let (what, remedy) = self.sim.with_cause(symptom, Remedy::GridOrStepOrSlices);
        let (time, step) = (self.sim.time(), self.sim.steps());
        Err(StepError::Unstable { time, step, what, remedy })
    }

    /// Returns the reason of the end, if the run is at its end.
    fn ended(&self) -> Option<EndReason> {
        let time = self.sim.time();
        if time >= self.plan.end * (1.0 - SAME_TIME) {
            return Some(EndReason::End);
        }
        let stop = self.plan.stop?;
        let since = self.recorder.tracker().holds_since(stop.when, self.sim.grains())?;
        (time - since >= stop.hold).then_some(match stop.when {
            StopWhen::Landing => EndReason::Landing,
            StopWhen::Rest => EndReason::Rest,
            StopWhen::Separation => EndReason::Separation,
        })
    }

    fn write_cost(&mut self) -> Result<(), RunError> {
        if let Some(session) = self.provenance.sessions.last_mut() {
            session.cost = self.meter.cost(&self.sim);
        }
        self.provenance.write(&self.out)
    }

    fn checkpoint(&mut self) -> Result<(), RunError> {
        self.meter.output(|| self.recorder.checkpoint(&self.sim))?;
        self.write_cost()
    }

    fn finish(mut self, why: EndReason) -> Result<Ending, RunError> {
        self.meter.output(|| self.recorder.finish(&self.sim))?;
        self.checkpoint()?;
        checkpoint::keep(&self.out, self.plan.kept_after_end())?;
        // The summary is written last: it marks a finished run.
        let summary = self.recorder.summary(&self.sim, self.provenance.cost(), why);
        (summary.write(&self.out)).context("write", &self.out.join(summary::FILE))?;
        Ok(Ending::Finished(summary))
    }

    /// Returns the terms of a remedy as keys of the case.
    fn terms(&self) -> RemedyTerms {
        RemedyTerms {
            smaller_step: match self.sim.setup().step {
                StepRule::Fixed(_) => "a smaller [time] step",
                StepRule::Limits { .. } => "a smaller [time] cfl",
            },
            stiffness: "a [contact] stiffness",
            youngs_modulus: "a youngs_modulus",
        }
    }

    /// Writes `failure.json`; the last valid checkpoint is kept.
    fn failed(&mut self, source: StepError, time: f64) -> RunError {
        let StepError::Unstable { time: at, step, what, remedy } = &source;
        let terms = self.terms();
        let remedy = remedy.advice(&terms);
        let failure = serde_json::json!({
            "time": at, "step": step, "what": what, "remedy": remedy, "checkpoint_time": time
        });
        let path = self.out.join("failure.json");
        let kept =
            write(&path, format!("{failure:#}\n").as_bytes()).and_then(|()| self.write_cost());
        match kept {
            Ok(()) => RunError::Unstable {
                source,
                terms: Box::new(terms),
                time,
                folder: self.out.join(checkpoint::FOLDER),
            },
            Err(error) => error,
        }
    }
}
