//! Execution of the runs of a study: several at once, each resumed from its last checkpoint.

pub mod state;
pub mod step_time;

use std::ops::ControlFlow;
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use grainwake_formats::disk;
use grainwake_formats::events::Event;
use grainwake_formats::summary::Summary;
use grainwake_run::checkpoint;
use grainwake_run::lock::{self, Attempt};
use grainwake_run::{Ending, Existing, FailureKind, Observer, Progress, RunError, queue};

use self::state::{Archive, RunState, run_state};
use crate::error::{At, StudyError};
use crate::plan::Run;

/// Options of the execution.
#[derive(Clone, Debug)]
pub struct Options {
    /// Number of concurrent runs.
    pub jobs: usize,
    /// Threads per run.
    pub threads: usize,
    /// Whether failed runs are restarted.
    pub retry: bool,
    /// Whether checkpoints of finished runs are kept.
    pub keep_checkpoints: bool,
    /// Command line, for the provenance.
    pub command: Vec<String>,
}

/// Advice about [`RunState::Damaged`].
pub const RESTORE: &str = "restore the file; to repeat the run, remove its folder and its row in \
                           table.json";

/// Result of one run.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The run reached its end in this session.
    Finished(Box<Summary>),
    /// The run had finished in an earlier session.
    AlreadyFinished,
    /// The run failed, with the reason.
    Failed(String, FailureKind),
    /// The run was interrupted, or not started because the study was interrupted.
    Interrupted,
    /// Another program holds the lock of the run.
    Locked,
}

/// Callbacks during the execution; `run` is the index of the run in the plan.
pub trait StudyObserver: Sync {
    /// A run starts or resumes.
    fn started(&self, _run: usize) {}
    /// A run has completed a time step.
    fn progress(&self, _run: usize, _: &Progress) {}
    /// An event occurred in a run.
    fn event(&self, _run: usize, _: &Event) {}
    /// A run emits a note or a warning.
    fn note(&self, _run: usize, _: &str) {}
    /// A run has ended.
    fn ended(&self, _run: usize, _: &Outcome) {}
    /// Returns whether to write checkpoints and stop.
    fn interrupted(&self) -> bool {
        false
    }
}

/// Executes the chosen runs in a study folder and returns their outcomes, sorted by index.
///
/// A run that fails or panics does not stop the others; a full disk does. Finished runs are not
/// repeated, even if only their rows in `table.json` are left, and interrupted ones resume from
/// their last checkpoints. A finished run with a damaged case is a failure and stays as it is.
///
/// # Errors
/// If threads cannot be started, or `table.json` is damaged.
pub fn execute(
    runs: &[Run],
    chosen: &[usize],
    study: &Path,
    options: &Options,
    observer: &dyn StudyObserver,
) -> Result<Vec<(usize, Outcome)>, StudyError> {
    let jobs = options.jobs.clamp(1, chosen.len().max(1));
    let pools = pools(jobs, options.threads).at("start threads for", study)?;
    let ended: Mutex<Vec<(usize, Outcome)>> = Mutex::new(Vec::new());
    let disk_full = AtomicBool::new(false);
    let archive = Archive::read(study)?;
    queue::for_each(jobs, chosen, |pool, _, &index| {
        let job = Job { run: &runs[index], index, study, archive: &archive, options, observer };
        let outcome = if observer.interrupted() || disk_full.load(Ordering::Relaxed) {
            Outcome::Interrupted
        } else {
            let guarded = AssertUnwindSafe(|| pools[pool].install(|| job.outcome(&disk_full)));
            std::panic::catch_unwind(guarded).unwrap_or_else(|_| {
                let what = "internal error of the program: please report it with the case";
                Outcome::Failed(what.into(), FailureKind::Computation)
            })
        };
        observer.ended(index, &outcome);
        if let Ok(mut ended) = ended.lock() {
            ended.push((index, outcome));
        }
        ControlFlow::Continue(())
    });
    let mut ended = ended.into_inner().unwrap_or_default();
    ended.sort_by_key(|(index, _)| *index);
    Ok(ended)
}

/// Starts the threads of each of the concurrent runs.
fn pools(jobs: usize, threads: usize) -> std::io::Result<Vec<rayon::ThreadPool>> {
    let pool = |_| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    (0..jobs).map(pool).collect::<Result<_, _>>().map_err(std::io::Error::other)
}

/// One run in the queue.
struct Job<'a> {
    run: &'a Run,
    index: usize,
    study: &'a Path,
    archive: &'a Archive,
    options: &'a Options,
    observer: &'a dyn StudyObserver,
}

impl Job<'_> {
    fn outcome(&self, disk_full: &AtomicBool) -> Outcome {
        match self.execute() {
            Ok(outcome) => outcome,
            // `grainwake run` uses the run folder.
            Err(RunError::InUse { .. }) => Outcome::Locked,
            Err(error) => {
                if let RunError::Io { source, .. } = &error
                    && source.kind() == std::io::ErrorKind::StorageFull
                {
                    disk_full.store(true, Ordering::Relaxed);
                }
                Outcome::Failed(error.to_string(), error.kind())
            }
        }
    }

    fn execute(&self) -> Result<Outcome, RunError> {
        let Attempt::Acquired(_lock) = self.lock()? else {
            return Ok(Outcome::Locked);
        };
        let folder = self.run.folder(self.study);
        let existing = match run_state(self.run, self.study, self.archive) {
            RunState::Finished => {
                self.remove_checkpoints(&folder);
                return Ok(Outcome::AlreadyFinished);
            }
            RunState::Failed(why) if !self.options.retry => {
                let reason = format!("failed before: {why}");
                return Ok(Outcome::Failed(reason, FailureKind::Computation));
            }
            // The results may be sound: only the user removes them.
            RunState::Damaged(why) => {
                let reason = format!("{why}; {RESTORE}");
                return Ok(Outcome::Failed(reason, FailureKind::Input));
            }
            RunState::Missing => Existing::Refuse,
            RunState::Unfinished => Existing::Resume,
            RunState::Failed(_) => Existing::Replace,
            RunState::Stale(why) => {
                self.note(&format!("restarting: {why}"));
                Existing::Replace
            }
        };
        let case = match self.run.case() {
            Ok(case) => case,
            Err(error) => return Ok(Outcome::Failed(error.to_string(), FailureKind::Input)),
        };
        if case.digest != self.run.case_sha256 {
            let what = "the files of the case have changed since the study was started; \
                        start the study again";
            return Ok(Outcome::Failed(what.into(), FailureKind::Input));
        }
        self.observer.started(self.index);
        let simulate = |existing: Existing| {
            let options = grainwake_run::Options {
                existing,
                command: self.options.command.clone(),
                threads: self.options.threads,
                ..Default::default()
            };
            grainwake_run::run(case.job(), &folder, &options, &mut Forward(self))
        };
        let ending = match simulate(existing) {
            Err(error @ RunError::NoCheckpoint { .. }) => {
                self.note(&format!("restarting: {error}"));
                simulate(Existing::Replace)
            }
            other => other,
        }?;
        Ok(match ending {
            Ending::Finished(summary) => {
                self.remove_checkpoints(&folder);
                Outcome::Finished(Box::new(summary))
            }
            Ending::AlreadyFinished(_) => Outcome::AlreadyFinished,
            Ending::Interrupted(_) => Outcome::Interrupted,
        })
    }

    fn note(&self, text: &str) {
        self.observer.note(self.index, text);
    }

    /// Locks the run for this program; the lock ends with the process at the latest.
    fn lock(&self) -> Result<Attempt, RunError> {
        let folder = self.study.join("locks");
        let path = folder.join(format!("{}.lock", self.run.name));
        let taken = disk::create_folder(&folder).and_then(|()| lock::acquire(&path));
        taken.map_err(|source| RunError::Io { action: "lock", path, source })
    }

    /// Removes the checkpoints of a finished run, its largest files, unless they are to be kept.
    fn remove_checkpoints(&self, folder: &Path) {
        if !self.options.keep_checkpoints {
            // A failure costs disk space only.
            let _ = disk::remove_folder(&folder.join(checkpoint::FOLDER));
        }
    }
}

/// Forwards the callbacks of a run to the observer of the study.
struct Forward<'a>(&'a Job<'a>);

impl Observer for Forward<'_> {
    fn progress(&mut self, progress: &Progress) {
        self.0.observer.progress(self.0.index, progress);
    }
    fn event(&mut self, event: &Event) {
        self.0.observer.event(self.0.index, event);
    }
    fn note(&mut self, text: &str) {
        self.0.note(text);
    }
    fn interrupted(&self) -> bool {
        self.0.observer.interrupted()
    }
}
