//! `grainwake validate`.

mod pictures;
mod saved;
mod table;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use grainwake_formats::summary::Summary;
use grainwake_run::case::Case;
use grainwake_run::provenance::Provenance;
use grainwake_run::{Ending, Existing, Options, RunError};
use grainwake_validation::{Level, Library, Suite, SuiteError, SuiteRun};
use table::{line, table};

use crate::args::ValidateArgs;
use crate::exit::{BAD_INPUT, Exit, INTERRUPTED, IO, MISSED};
use crate::progress::{self, clock};
use crate::{print, signals, tell, threads};

impl From<SuiteError> for Exit {
    fn from(error: SuiteError) -> Exit {
        match error {
            SuiteError::Invalid(problem) => (*problem).into(),
            SuiteError::Unreadable { ref source, .. } => {
                let missing = source.kind() == std::io::ErrorKind::NotFound;
                Exit::with_help(
                    if missing { BAD_INPUT } else { IO },
                    error.to_string(),
                    "give the folder of the validations with --suites, or omit --suites for those \
                     in the program",
                )
            }
        }
    }
}

/// Runs validations and prints the deviation of each value from its reference.
pub fn validate(args: &ValidateArgs) -> Result<(), Exit> {
    let library = Library::open(args.suites.as_deref())?;
    let level = match args.level.as_str() {
        "full" => Level::Full,
        _ => Level::Ci,
    };
    let mut suites = library.chosen(&args.names, (!args.list).then_some(level))?;
    for run in suites.iter_mut().flat_map(|suite| &mut suite.runs) {
        run.set.extend(args.overrides.list());
    }
    if args.list {
        return print(&if args.json {
            serde_json::to_string_pretty(&listed(&suites))?
        } else {
            listing(&suites)
        });
    }
    let stop = Arc::new(AtomicBool::new(false));
    signals::watch_for_interrupt(stop.clone());
    let started = std::time::Instant::now();
    let mut results = Vec::new();
    for suite in &suites {
        let mut known = BTreeMap::new();
        for run in suite.runs.iter().filter(|run| run.level <= level) {
            let folder = args.output.join(&suite.name).join(&run.name);
            if args.judge && !is_finished(run, &folder)? {
                continue;
            }
            let ending =
                if args.judge { Ok(()) } else { execute(args, suite, run, &folder, stop.clone())? };
            let found = match ending {
                Ok(()) => suite.evaluate(run, &folder, &mut known),
                Err(why) => suite.results_of_failed_run(run, &why),
            };
            if !args.quiet {
                found.iter().for_each(|v| tell!("  {}", line(v)));
            }
            results.extend(found);
        }
    }
    if args.judge && results.is_empty() {
        return Err(Exit::refused(
            format!("{}: no finished run of these validations", args.output.display()),
            "omit --judge to execute them, or give their folder with -o",
        ));
    }
    if args.json {
        print(&serde_json::to_string_pretty(&results)?)?;
    } else {
        print(&table(&results).to_string())?;
    }
    if let Some(folder) = &args.save {
        let all = &library.suites;
        let saved = saved::add(folder, &args.level, &results, &args.output, all)?;
        let drawn = pictures::add(folder, &suites, &args.output, &saved)?;
        pictures::list(folder, all)?;
        if !args.quiet {
            tell!("{drawn} figures in {}", folder.join("figures").display());
        }
    }
    let short = results.iter().filter(|v| !v.pass).count();
    if !args.quiet {
        tell!(
            "{} of {} hold, in {}",
            results.len() - short,
            results.len(),
            clock(started.elapsed().as_secs_f64())
        );
    }
    if short == 0 {
        return Ok(());
    }
    let missed: Vec<String> = results.iter().filter(|v| !v.pass).map(line).collect();
    Err(Exit::new(
        MISSED,
        format!("{short} of {} fall short:\n{}", results.len(), missed.join("\n")),
    ))
}

/// Returns whether `folder` holds a finished run of the same case.
fn is_finished(run: &SuiteRun, folder: &Path) -> Result<bool, Exit> {
    let Some(provenance) = Provenance::read(folder).filter(|_| Summary::read(folder).is_ok())
    else {
        return Ok(false);
    };
    if provenance.case_sha256 != Case::load(&run.case, &run.set)?.digest {
        tell!("{}: left out: its case has changed", folder.display());
        return Ok(false);
    }
    Ok(true)
}

/// Executes one run. The outer error ends the command, the inner one only this run.
fn execute(
    args: &ValidateArgs,
    suite: &Suite,
    run: &SuiteRun,
    folder: &Path,
    stop: Arc<AtomicBool>,
) -> Result<Result<(), String>, Exit> {
    let case = Case::load(&run.case, &run.set)?;
    let threads = threads::resolve(args.threads);
    if !args.quiet {
        let cells = case.setup.mesh.cells;
        tell!("{}/{}: {} x {} x {} cells", suite.name, run.name, cells[0], cells[1], cells[2]);
    }
    let existing = if args.resume { Existing::Reuse } else { Existing::Replace };
    let command = std::env::args().collect();
    let options = Options { existing, command, threads, ..Options::default() };
    match progress::run(case.job(), folder, &options, args.quiet, stop.clone())? {
        Ok(Ending::Interrupted(_)) => Err(Exit::with_help(
            INTERRUPTED,
            "interrupted; a checkpoint was written",
            "continue with the same command and --resume",
        )),
        Ok(_) if stop.load(Ordering::Relaxed) => {
            Err(Exit::new(INTERRUPTED, "interrupted between two runs"))
        }
        Ok(_) => Ok(Ok(())),
        Err(error @ RunError::Unstable { .. }) => Ok(Err(error.to_string())),
        Err(error) => Err(error.into()),
    }
}

/// Returns the suites with their runs and quantities as JSON. The names are stable.
fn listed(suites: &[Suite]) -> serde_json::Value {
    let run = |run: &SuiteRun| {
        let level = if run.level == Level::Full { "full" } else { "ci" };
        let quantities: Vec<&str> = run.checks.iter().map(|c| c.quantity.as_str()).collect();
        serde_json::json!({ "name": run.name, "level": level, "quantities": quantities })
    };
    let suite = |suite: &Suite| {
        let runs: Vec<_> = suite.runs.iter().map(run).collect();
        serde_json::json!({ "name": suite.name, "title": suite.title, "runs": runs })
    };
    suites.iter().map(suite).collect()
}

/// Lists the suites with their runs and quantities.
fn listing(suites: &[Suite]) -> String {
    let mut lines = Vec::new();
    for suite in suites {
        lines.push(format!("{}: {}", suite.name, suite.title));
        for run in &suite.runs {
            let level = if run.level == Level::Full { " (full)" } else { "" };
            let checks: Vec<&str> = run.checks.iter().map(|c| c.quantity.as_str()).collect();
            lines.push(format!("  {}{level}: {}", run.name, checks.join(", ")));
        }
    }
    lines.join("\n")
}
