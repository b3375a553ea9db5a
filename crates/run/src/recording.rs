//! Simulation whose states are written into a run folder: outputs, checkpoints, provenance, lock.

use std::path::{Path, PathBuf};
use std::time::Instant;

use grainwake_formats::disk::{self, write_atomically};
use grainwake_formats::events::Event;
use grainwake_formats::summary::{self, EndReason, Summary};
use grainwake_solver::sim::{Remedy, RemedyTerms, SAME_TIME, Simulation, StepError, StepRule};

use crate::error::{Context, RunError};
use crate::job::{Job, Options};
use crate::meter::Meter;
use crate::number_format::quantity;
use crate::plan::RunPlan;
use crate::recorder::Recorder;
use crate::run_folder::checkpoint::Record;
use crate::run_folder::lock::Lock;
use crate::run_folder::provenance::{ParentRun, Provenance, Session};
use crate::run_folder::{
    self, Content, Existing, ExtraTable, Parent, RESOLVED, checkpoint, differing, remove_if_there,
};

/// Run folder that is locked and may be written.
pub(crate) struct Opened {
    out: PathBuf,
    lock: Lock,
    resuming: bool,
    content: Content,
    provenance: Provenance,
}

impl Opened {
    /// Checks and locks the folder.
    pub fn new(job: &Job, out: &Path, options: &Options) -> Result<Opened, RunError> {
        let parent = options.parent.as_ref();
        run_folder::admit_parent(out, parent)?;
        // The folder is checked before the lock file is created in it, and again under the lock.
        run_folder::admit(out, options.existing.resolve(out, &job.digest))?;
        let lock = run_folder::lock_folder(out)?;
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
            if let (Some(program), None) = (&provenance.controlled_from, &options.controlled_from) {
                let (folder, program) = (out.into(), program.clone());
                return Err(RunError::Controlled { folder, program });
            }
        }
        provenance.controlled_from = options.controlled_from.clone().or(provenance.controlled_from);
        Ok(Opened { out: out.into(), lock, resuming, content, provenance })
    }

    /// Returns the summary of a run to be resumed that has finished; none if the case ends later
    /// now.
    pub fn finished(
        &self,
        job: &Job,
        note: &mut dyn FnMut(&str),
    ) -> Result<Option<Summary>, RunError> {
        if self.content != Content::Finished || !self.resuming {
            return Ok(None);
        }
        let file = self.out.join(summary::FILE);
        let summary = Summary::read(&self.out).context("read", &file)?;
        let (from, to) = (summary.end_time_s, job.plan.end);
        if from >= to * (1.0 - SAME_TIME) || summary.ended_by != EndReason::End {
            if from > to * (1.0 + SAME_TIME) && summary.ended_by == EndReason::End {
                note(&format!("the run went on to t = {from} s; an end at {to} s changes nothing"));
            }
            return Ok(Some(summary));
        }
        note(&format!("the run had ended at t = {from} s; going on to {to} s"));
        Ok(None)
    }

    /// Brings the simulation to the state that the run begins with and writes the first files.
    pub fn begin(
        mut self,
        job: &Job,
        options: &Options,
        sim: &mut Simulation,
        note: &mut dyn FnMut(&str),
    ) -> Result<Recording, RunError> {
        let (out, parent) = (self.out, options.parent.as_ref());
        let own = if self.resuming {
            let tables = ExtraTable::all(&job.plan);
            checkpoint::restore(&out, &job.digest, &tables, sim, note)?
        } else {
            None
        };
        let begin = begin(own, self.resuming, parent, sim, note)?;
        if let (Begin::Resumed(_), end) = (&begin, job.plan.end)
            && sim.time() > end * (1.0 + SAME_TIME)
        {
            let [reached, end] = [sim.time(), end].map(|time| quantity(time, "s"));
            let what = format!("has reached t = {reached}, after the end at {end}");
            let remedy = "give a later time.end, or another folder with -o";
            return Err(RunError::occupied(&out, what, remedy));
        }
        if let (None, Some(lost)) = (parent, &self.provenance.parent)
            && matches!(begin, Begin::Fresh)
        {
            return Err(run_folder::start_lost(&out, lost));
        }
        if !matches!(begin, Begin::Resumed(_)) && self.content != Content::Empty {
            run_folder::clear(&out)?;
        }
        run_folder::create(&out)?;
        remove_if_there(&out.join(checkpoint::REMOVAL), disk::remove_file)?;
        let session = Session::now(&options.command, options.threads, sim.steps());
        self.provenance.sessions.push(session);
        self.provenance.write(&out)?;
        let parent_run = self.provenance.parent.as_ref();
        let started_from = parent_run.map_or(String::new(), ParentRun::comment);
        write(&out.join(RESOLVED), (started_from + &job.resolved).as_bytes())?;
        for (name, bytes) in &job.files {
            write(&out.join(name), bytes)?;
        }
        // The outcome of an earlier session.
        for file in [summary::FILE, "failure.json"] {
            remove_if_there(&out.join(file), disk::remove_file)?;
        }
        let recorder = match begin {
            Begin::Fresh => Recorder::start(&out, job, sim)?,
            Begin::Resumed(record) => Recorder::resume(&out, job, *record, sim)?,
            Begin::Branched(record) => Recorder::branch(&out, job, *record, sim)?,
        };
        Ok(Recording {
            plan: job.plan.clone(),
            recorder,
            provenance: self.provenance,
            meter: Meter::start(),
            saved: Saved { at: Instant::now(), time: sim.time(), step: None },
            broken: false,
            out,
            _lock: self.lock,
        })
    }
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
    note: &mut dyn FnMut(&str),
) -> Result<Begin, RunError> {
    if let Some(record) = own {
        if record.steps == record.first_step {
            sim.limit_next_step();
        }
        let (time, steps) = (record.time, record.steps);
        note(&format!("resuming at t = {}, step {steps}", quantity(time, "s")));
        return Ok(Begin::Resumed(Box::new(record)));
    }
    let Some(parent) = parent else {
        if resuming {
            note("there is no checkpoint: starting from the beginning");
        }
        return Ok(Begin::Fresh);
    };
    let record = parent.restore(sim)?;
    sim.limit_next_step();
    let (folder, time, steps) = (parent.folder().display(), record.time, record.steps);
    note(&format!("starting from {folder} at t = {}, step {steps}", quantity(time, "s")));
    Ok(Begin::Branched(Box::new(record)))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    write_atomically(path, true, |out| out.write_all(bytes)).context("write", path)
}

/// Last checkpoint of this session.
struct Saved {
    /// Moment.
    at: Instant,
    /// Simulated time [s].
    time: f64,
    /// Step; none before the first checkpoint after a step.
    step: Option<u64>,
}

/// Run folder of a simulation that the caller steps. The folder is locked during its life.
///
/// [`run`](crate::run()) uses it until the end of the case. A program that controls grains between
/// steps uses it directly.
pub struct Recording {
    out: PathBuf,
    pub(crate) plan: RunPlan,
    pub(crate) recorder: Recorder,
    provenance: Provenance,
    pub(crate) meter: Meter,
    saved: Saved,
    /// Whether a step has failed.
    broken: bool,
    _lock: Lock,
}

impl Recording {
    /// Opens the folder `out`, builds the simulation, and writes its first state, or restores it if
    /// the options say so. `note` receives messages.
    ///
    /// # Errors
    /// [`RunError`]; a finished run cannot be resumed.
    pub fn start(
        job: &Job,
        out: &Path,
        options: &Options,
        note: &mut dyn FnMut(&str),
    ) -> Result<(Simulation, Recording), RunError> {
        crate::memory::admit_memory(&job.setup, Some(&job.plan))?;
        let opened = Opened::new(job, out, options)?;
        if opened.finished(job, note)?.is_some() {
            let remedy = "give another folder or a later end, or replace it (force)";
            return Err(RunError::occupied(out, "holds a finished run", remedy));
        }
        let mut sim = Simulation::new(job.setup.clone())?;
        let recording = opened.begin(job, options, &mut sim, note)?;
        Ok((sim, recording))
    }

    /// Folder.
    pub fn folder(&self) -> &Path {
        &self.out
    }

    /// Takes one time step, writes the outputs and the checkpoint that are due, and returns the new
    /// events. A whole number of equal steps ends at the next output or `horizon` [s] from now,
    /// whichever is earlier; if they are less than a tenth of a step apart, at the later of both.
    ///
    /// # Errors
    /// [`RunError`]; the last valid checkpoint is kept.
    pub fn step(&mut self, sim: &mut Simulation, horizon: f64) -> Result<Vec<Event>, RunError> {
        let wanted = sim.time() + horizon;
        let limit = self.recorder.until_next(wanted, sim.time(), sim.time_step());
        let stepped = sim.step(limit).and_then(|()| self.collapsed(sim, limit));
        if let Err(source) = stepped {
            return Err(self.failed(sim, source));
        }
        let events = self.meter.output(|| self.recorder.after_step(sim))?;
        let (every, interval) = (self.plan.checkpoint_steps, self.plan.checkpoint_interval);
        let by_steps = every > 0 && sim.steps().is_multiple_of(every);
        let by_clock = interval > 0.0 && self.saved.at.elapsed().as_secs_f64() >= interval;
        if by_steps || by_clock {
            self.checkpoint(sim)?;
        }
        Ok(events)
    }

    /// Writes a checkpoint, unless there is one of this step.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn checkpoint(&mut self, sim: &Simulation) -> Result<(), RunError> {
        if self.saved.step == Some(sim.steps()) {
            return Ok(());
        }
        self.meter.output(|| self.recorder.checkpoint(sim))?;
        self.saved = Saved { at: Instant::now(), time: sim.time(), step: Some(sim.steps()) };
        self.write_cost(sim)
    }

    /// Writes the last outputs, a checkpoint, and the summary with the reason of the end.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn finish(mut self, sim: &Simulation) -> Result<Summary, RunError> {
        let why = self.ended(sim).unwrap_or(EndReason::End);
        self.meter.output(|| self.recorder.finish(sim))?;
        // The checkpoint holds the lengths of the tables with their last rows.
        self.saved.step = None;
        self.checkpoint(sim)?;
        checkpoint::keep(&self.out, self.plan.kept_after_end())?;
        // The summary is written last: it marks a finished run.
        let summary = self.recorder.summary(sim, self.provenance.cost(), why);
        summary.write(&self.out).context("write", &self.out.join(summary::FILE))?;
        Ok(summary)
    }

    fn write_cost(&mut self, sim: &Simulation) -> Result<(), RunError> {
        if let Some(session) = self.provenance.sessions.last_mut() {
            session.cost = self.meter.cost(sim);
        }
        self.meter.output(|| self.provenance.write(&self.out))
    }

    /// Returns an error if the time step has collapsed although no output is near.
    fn collapsed(&self, sim: &Simulation, limit: f64) -> Result<(), StepError> {
        let dt = sim.time_step();
        if dt >= self.plan.smallest_step || 2.0 * dt > limit {
            return Ok(());
        }
        let symptom = format!(
            "the time step has collapsed to {dt:.1e} s: somewhere the fluid is far faster than any \
             grain should settle"
        );
        let (what, remedy) = sim.with_cause(symptom, Remedy::GridOrStepOrSlices);
        let (time, step) = (sim.time(), sim.steps());
        Err(StepError { time, step, what, remedy })
    }

    /// Returns whether a step has failed. After another error, such as that of a full disk, the
    /// state of the simulation is sound.
    pub fn step_failed(&self) -> bool {
        self.broken
    }

    /// Returns whether the end of the case is reached.
    pub fn at_end(&self, sim: &Simulation) -> bool {
        self.plan.at_end(sim.time())
    }

    /// Returns the stop condition of the case, if it has held for its time.
    pub fn stopped(&self, sim: &Simulation) -> Option<EndReason> {
        self.recorder.watch.stopped(sim)
    }

    /// Returns the reason why the run is over: its end is reached, or its stop condition holds.
    pub fn ended(&self, sim: &Simulation) -> Option<EndReason> {
        if self.at_end(sim) { Some(EndReason::End) } else { self.stopped(sim) }
    }

    /// Writes `failure.json`; the last valid checkpoint is kept.
    fn failed(&mut self, sim: &Simulation, source: StepError) -> RunError {
        self.broken = true;
        let StepError { time: at, step, what, remedy } = &source;
        let terms = terms(sim);
        let (remedy, time) = (remedy.advice(&terms), self.saved.time);
        let failure = serde_json::json!({
            "time": at, "step": step, "what": what, "remedy": remedy, "checkpoint_time": time
        });
        let path = self.out.join("failure.json");
        let kept =
            write(&path, format!("{failure:#}\n").as_bytes()).and_then(|()| self.write_cost(sim));
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

/// Returns the terms of a remedy as keys of the case.
fn terms(sim: &Simulation) -> RemedyTerms {
    RemedyTerms {
        smaller_step: match sim.setup().step {
            StepRule::Fixed(_) => "a smaller [time] step",
            StepRule::Limits { .. } => "a smaller [time] cfl",
        },
        stiffness: "a [contact] stiffness",
        youngs_modulus: "a youngs_modulus",
    }
}
