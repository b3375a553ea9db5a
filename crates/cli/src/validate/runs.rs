//! The runs of the validations, several at once.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use grainwake_run::case::Case;
use grainwake_run::{Ending, Existing, Options, RunError};
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

/// Executes the runs, as many at once as the arguments say, and calls `ended` with each run and its
/// ending, in the order of the runs. The error ends the command; that of an ending only its run.
pub fn execute(
    args: &ValidateArgs,
    runs: &[ChosenRun],
    stop: &Arc<AtomicBool>,
    mut ended: impl FnMut(&ChosenRun, Result<(), String>),
) -> Result<(), Exit> {
    let (jobs, threads) = threads::share(args.jobs.clamp(1, runs.len().max(1)), args.threads);
    // Bars and events of several runs would get mixed up.
    let quiet = args.quiet || jobs > 1;
    let next = AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                while let Some((n, run)) = next_of(runs, next) {
                    let ending = execute_one(args, run, threads, quiet, stop);
                    if sender.send((n, ending)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let (mut waiting, mut following) = (BTreeMap::new(), 0);
        for (n, ending) in receiver {
            // The other runs write a checkpoint and end.
            waiting.insert(n, ending.inspect_err(|_| stop.store(true, Ordering::Relaxed))?);
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

/// Executes one run. The outer error ends the command, the inner one only this run.
fn execute_one(
    args: &ValidateArgs,
    ChosenRun { suite, run, folder }: &ChosenRun,
    threads: usize,
    quiet: bool,
    stop: &Arc<AtomicBool>,
) -> Result<Result<(), String>, Exit> {
    let between_runs = || Exit::new(INTERRUPTED, "interrupted between two runs");
    if stop.load(Ordering::Relaxed) {
        return Err(between_runs());
    }
    let case = Case::load(&run.case, &run.set)?;
    if !args.quiet {
        let cells = case.setup.mesh.cells;
        tell!("{}/{}: {} x {} x {} cells", suite.name, run.name, cells[0], cells[1], cells[2]);
    }
    let existing = if args.resume { Existing::Reuse } else { Existing::Replace };
    let command = std::env::args().collect();
    let options = Options { existing, command, threads, ..Options::default() };
    match progress::run(case.job(), folder, &options, quiet, stop.clone())? {
        Ok(Ending::Interrupted(_)) => Err(Exit::with_help(
            INTERRUPTED,
            "interrupted; a checkpoint was written",
            "continue with the same command and --resume",
        )),
        Ok(_) if stop.load(Ordering::Relaxed) => Err(between_runs()),
        Ok(_) => Ok(Ok(())),
        Err(error @ RunError::Unstable { .. }) => Ok(Err(error.to_string())),
        Err(error) => Err(error.into()),
    }
}
