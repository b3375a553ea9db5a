//! The runs of the validations, several at once.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use grainwake_run::case::Case;
use grainwake_run::{Ending, Existing, Observer, Options, RunError};
use grainwake_validation::{Suite, SuiteRun};

use crate::args::ValidateArgs;
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
    mut ended: impl FnMut(&ChosenRun, Result<(), String>),
) -> Result<(), Exit> {
    let (jobs, threads) = match args.jobs.min(runs.len()) {
        0 | 1 => (1, threads::resolve(args.threads)),
        jobs => threads::share(jobs, args.threads),
    };
    let next = AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                while let Some((n, run)) = next_of(runs, next) {
                    let execute = || execute_one(args, run, threads, jobs > 1, stop);
                    let ending = catch_unwind(AssertUnwindSafe(execute)).unwrap_or_else(|panic| {
                        stop.store(true, Ordering::Relaxed);
                        resume_unwind(panic)
                    });
                    let is_last = ending.is_err();
                    let sent = sender.send((n, ending));
                    if is_last {
                        // After the message, which thus comes before those of the other runs.
                        stop.store(true, Ordering::Relaxed);
                    }
                    if is_last || sent.is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let (mut waiting, mut following) = (BTreeMap::new(), 0);
        for (n, ending) in receiver {
            waiting.insert(n, ending?);
            while let Some(ending) = waiting.remove(&following) {
                ended(&runs[following], ending);
                following += 1;
            }
        }
        Ok(())
    })
}

/// Takes the next run of the list with its index.
fn next_of<'a, 'b>(
    runs: &'a [ChosenRun<'b>],
    next: &AtomicUsize,
) -> Option<(usize, &'a ChosenRun<'b>)> {
    let n = next.fetch_add(1, Ordering::Relaxed);
    runs.get(n).map(|run| (n, run))
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
    let command = std::env::args().collect();
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
