//! Runs what is missing, several runs at once, each alone in what befalls it.

pub mod state;

use std::collections::VecDeque;
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use grainwake_solver::output::checkpoint;
use grainwake_solver::output::lock::{self, Asked};
use grainwake_solver::output::{self, Ending, Existing, Observer, Progress, RunError, Summary};
use grainwake_solver::sim::events::Event;

use crate::error::{At, StudyError};
use crate::plan::Run;
use crate::run::state::{RunState, run_state};

/// How a study is run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Runs at once.
    pub jobs: usize,
    /// Threads of each.
    pub threads: usize,
    /// Start failed runs over.
    pub retry: bool,
    /// Keep the checkpoints of finished runs.
    pub keep_checkpoints: bool,
    /// Command, for the provenance.
    pub command: Vec<String>,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// It came to its end now.
    Finished(Box<Summary>),
    /// It had been finished before.
    Before,
    /// It could not be carried out; why, and the exit code that stands for it.
    Failed(String, u8),
    /// It was interrupted, or not begun because the study was.
    Interrupted,
    /// Another program has it in hand.
    Elsewhere,
}

/// Is told how the runs of a study go on; the number is that of the run in the plan.
pub trait StudyObserver: Sync {
    /// A run begins or goes on.
    fn started(&self, _run: usize) {}
    /// After every step of a run.
    fn progress(&self, _run: usize, _: &Progress) {}
    /// Something happened in a run.
    fn event(&self, _run: usize, _: &Event) {}
    /// Something worth knowing about a run.
    fn note(&self, _run: usize, _: &str) {}
    /// A run has ended.
    fn ended(&self, _run: usize, _: &Outcome) {}
    /// Whether to write checkpoints and stop.
    fn interrupted(&self) -> bool {
        false
    }
}

/// Carries out the chosen runs in a study folder, in order; returns how each ended.
///
/// A run that fails or panics does not stop the others; a full disk does. Killed at any moment
/// and called again, it goes on from the last checkpoints and repeats nothing that is finished.
///
/// # Errors
/// If threads cannot be started.
pub fn execute(
    runs: &[Run],
    chosen: &[usize],
    study: &Path,
    options: &Options,
    watcher: &dyn StudyObserver,
) -> Result<Vec<(usize, Outcome)>, StudyError> {
    let queue: Mutex<VecDeque<usize>> = Mutex::new(chosen.iter().copied().collect());
    let ended: Mutex<Vec<(usize, Outcome)>> = Mutex::new(Vec::new());
    let full = AtomicBool::new(false);
    let jobs = options.jobs.clamp(1, chosen.len().max(1));
    let pools: Vec<rayon::ThreadPool> = (0..jobs)
        .map(|_| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(options.threads)
                .build()
        })
        .collect::<Result<_, _>>()
        .map_err(std::io::Error::other)
        .at("start threads for", study)?;
    std::thread::scope(|scope| {
        for pool in &pools {
            scope.spawn(|| {
                loop {
                    let next = queue.lock().ok().and_then(|mut q| q.pop_front());
                    let Some(index) = next else { return };
                    let outcome = if watcher.interrupted() || full.load(Ordering::Relaxed) {
                        Outcome::Interrupted
                    } else {
                        let whole = || {
                            pool.install(|| {
                                one(&runs[index], index, study, options, watcher, &full)
                            })
                        };
                        std::panic::catch_unwind(AssertUnwindSafe(whole)).unwrap_or_else(|_| {
                            Outcome::Failed(
                                "a fault of the program: please report it with the case".into(),
                                3,
                            )
                        })
                    };
                    watcher.ended(index, &outcome);
                    if let Ok(mut ended) = ended.lock() {
                        ended.push((index, outcome));
                    }
                }
            });
        }
    });
    let mut ended = ended.into_inner().unwrap_or_default();
    ended.sort_by_key(|(index, _)| *index);
    Ok(ended)
}

fn one(
    run: &Run,
    index: usize,
    study: &Path,
    options: &Options,
    watcher: &dyn StudyObserver,
    full: &AtomicBool,
) -> Outcome {
    match attempt(run, index, study, options, watcher) {
        Ok(outcome) => outcome,
        // `grainwake run` has it.
        Err(RunError::InUse { .. }) => Outcome::Elsewhere,
        Err(error) => {
            if let RunError::Io { source, .. } = &error
                && source.kind() == std::io::ErrorKind::StorageFull
            {
                full.store(true, Ordering::Relaxed);
            }
            Outcome::Failed(error.to_string(), error.exit_code())
        }
    }
}

fn attempt(
    run: &Run,
    index: usize,
    study: &Path,
    options: &Options,
    watcher: &dyn StudyObserver,
) -> Result<Outcome, RunError> {
    let Asked::Taken(_lock) = lock(run, study)? else {
        return Ok(Outcome::Elsewhere);
    };
    let folder = run.folder(study);
    let existing = match run_state(run, study) {
        RunState::Finished => {
            tidy(&folder, options);
            return Ok(Outcome::Before);
        }
        RunState::Failed(why) if !options.retry => {
            return Ok(Outcome::Failed(format!("failed before: {why}"), 3));
        }
        RunState::Missing => Existing::Refuse,
        RunState::Unfinished => Existing::Resume,
        RunState::Failed(_) => Existing::Replace,
        RunState::Stale(why) => {
            watcher.note(index, &format!("starting over: {why}"));
            Existing::Replace
        }
    };
    let case = match run.case() {
        Ok(case) => case,
        Err(error) => return Ok(Outcome::Failed(error.to_string(), 2)),
    };
    if case.digest != run.case_sha256 {
        let what = "its files have changed since the study was started; start it again";
        return Ok(Outcome::Failed(what.into(), 2));
    }
    watcher.started(index);
    let go = |existing: Existing| {
        let options = output::Options {
            existing,
            command: options.command.clone(),
            threads: options.threads,
        };
        output::run(case.job(), &folder, &options, &mut Told { index, watcher })
    };
    let ending = match go(existing) {
        Err(error @ RunError::NoCheckpoint { .. }) => {
            watcher.note(index, &format!("starting over: {error}"));
            go(Existing::Replace)
        }
        other => other,
    }?;
    Ok(match ending {
        Ending::Finished(summary) => {
            tidy(&folder, options);
            Outcome::Finished(Box::new(summary))
        }
        Ending::AlreadyFinished(_) => Outcome::Before,
        Ending::Interrupted(_) => Outcome::Interrupted,
    })
}

/// Takes a run for this program; the lock goes with it, however it ends.
fn lock(run: &Run, study: &Path) -> Result<Asked, RunError> {
    let folder = study.join("locks");
    let path = folder.join(format!("{}.lock", run.name));
    let taken = std::fs::create_dir_all(&folder).and_then(|()| lock::take(&path));
    taken.map_err(|source| RunError::Io {
        action: "lock",
        path,
        source,
    })
}

/// Removes the checkpoints of a finished run: they are by far the largest of its files.
fn tidy(folder: &Path, options: &Options) {
    if !options.keep_checkpoints {
        // What cannot be removed costs room, not results.
        let _ = std::fs::remove_dir_all(folder.join(checkpoint::FOLDER));
    }
}

struct Told<'a> {
    index: usize,
    watcher: &'a dyn StudyObserver,
}

impl Observer for Told<'_> {
    fn progress(&mut self, p: &Progress) {
        self.watcher.progress(self.index, p);
    }
    fn event(&mut self, event: &Event) {
        self.watcher.event(self.index, event);
    }
    fn note(&mut self, text: &str) {
        self.watcher.note(self.index, text);
    }
    fn interrupted(&self) -> bool {
        self.watcher.interrupted()
    }
}
