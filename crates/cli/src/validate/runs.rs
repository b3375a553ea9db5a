//! The runs of the validations, several at once.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use grainwake_run::case::Case;
use grainwake_run::{Ending, Existing, Observer, Options, RunError, queue};
use grainwake_validation::{Suite, SuiteRun};

use crate::args::{self, ValidateArgs};
use crate::exit::{Exit, INTERRUPTED};
use crate::{progress, tell, threads};

/// A run of a suite, and its folder.
pub struct ChosenRun<'a> {
    pub suite: &'a Suite,
    pub run: &'a SuiteRun,
    pub folder: PathBuf,
}

/// Executes the runs, as many at once as the arguments say. Calls `ended` with each run and its
/// ending, in the order of the runs.
///
/// # Errors
/// The first error that ends the command; the other runs write a checkpoint before. A run that
/// becomes unstable ends with a message and does not end the command.
pub fn execute(
    args: &ValidateArgs,
    runs: &[ChosenRun],
    stop: &Arc<AtomicBool>,
    ended: impl FnMut(&ChosenRun, Result<(), String>) + Send,
) -> Result<(), Exit> {
    let (jobs, threads) = match args.jobs.min(runs.len()) {
        0 | 1 => (1, threads::resolve(args.threads, false)),
        jobs => threads::share(jobs, args.threads),
    };
    let done = Mutex::new(InOrder { runs, ended, waiting: BTreeMap::new(), following: 0 });
    let failure = Mutex::new(None);
    queue::for_each(jobs, runs, |_, n, run| {
        let execute = || execute_one(args, run, threads, jobs > 1, stop);
        let ending = catch_unwind(AssertUnwindSafe(execute)).unwrap_or_else(|panic| {
            stop.store(true, Ordering::Relaxed);
            resume_unwind(panic)
        });
        match ending {
            Ok(ending) => {
                locked(&done).add(n, ending);
                ControlFlow::Continue(())
            }
            Err(exit) => {
                // The first one; those of the other runs follow from it.
                locked(&failure).get_or_insert(exit);
                stop.store(true, Ordering::Relaxed);
                ControlFlow::Break(())
            }
        }
    });
    locked(&failure).take().map_or(Ok(()), Err)
}

/// Passes the endings of runs on in the order of the runs.
struct InOrder<'a, F> {
    runs: &'a [ChosenRun<'a>],
    ended: F,
    /// Endings of runs that follow one still in progress.
    waiting: BTreeMap<usize, Result<(), String>>,
    following: usize,
}

impl<F: FnMut(&ChosenRun, Result<(), String>)> InOrder<'_, F> {
    fn add(&mut self, n: usize, ending: Result<(), String>) {
        self.waiting.insert(n, ending);
        while let Some(ending) = self.waiting.remove(&self.following) {
            (self.ended)(&self.runs[self.following], ending);
            self.following += 1;
        }
    }
}

/// Locks a value, also after a panic of another run.
fn locked<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Executes one run, with its progress unless there are `others` at the same time. The outer error
/// ends the command, the inner one only this run.
fn execute_one(
    args: &ValidateArgs,
    ChosenRun { suite, run, folder }: &ChosenRun,
    threads: usize,
    others: bool,
    stop: &Arc<AtomicBool>,
) -> Result<Result<(), String>, Exit> {
    let interrupted = |message| {
        let help = "continue with the same command and --resume";
        Exit::with_help(INTERRUPTED, message, help)
    };
    let between_runs = || interrupted("interrupted between two runs");
    if stop.load(Ordering::Relaxed) {
        return Err(between_runs());
    }
    let case = Case::load(&run.case, &run.set)?;
    let name = format!("{}/{}", suite.name, run.name);
    if !args.quiet {
        let cells = case.setup.mesh.cells;
        tell!("{name}: {} x {} x {} cells", cells[0], cells[1], cells[2]);
    }
    let existing = if args.resume { Existing::Reuse } else { Existing::Replace };
    let command = args::words();
    let options = Options { existing, command, threads, ..Options::default() };
    let ending = if others {
        let mut notes = Notes { name, quiet: args.quiet, stop };
        threads::on(threads, || grainwake_run::run(case.job(), folder, &options, &mut notes))?
    } else {
        progress::run(case.job(), folder, &options, args.quiet, stop.clone())?
    };
    match ending {
        Ok(Ending::Interrupted(_)) => Err(interrupted("interrupted; a checkpoint was written")),
        Ok(_) if stop.load(Ordering::Relaxed) => Err(between_runs()),
        Ok(_) => Ok(Ok(())),
        Err(error @ RunError::Unstable { .. }) => Ok(Err(error.to_string())),
        Err(error) => Err(error.into()),
    }
}

/// Messages of one run among others, with its name.
struct Notes<'a> {
    name: String,
    quiet: bool,
    stop: &'a AtomicBool,
}

impl Observer for Notes<'_> {
    fn note(&mut self, text: &str) {
        if !self.quiet || text.starts_with("warning") {
            tell!("{}: {text}", self.name);
        }
    }
    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
