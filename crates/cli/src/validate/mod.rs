//! `grainwake validate`.

mod pictures;
mod runs;
mod saved;
mod table;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use grainwake_formats::summary::Summary;
use grainwake_run::case::Case;
use grainwake_run::provenance::Provenance;
use grainwake_validation::{Level, Library, Suite, SuiteError, SuiteRun};
use runs::ChosenRun;
use table::{line, table};

use crate::args::ValidateArgs;
use crate::exit::{BAD_INPUT, Exit, IO, MISSED};
use crate::progress::clock;
use crate::{print, signals, tell};

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
    let mut chosen = Vec::new();
    for suite in &suites {
        for run in suite.runs.iter().filter(|run| run.level <= level) {
            let folder = args.output.join(&suite.name).join(&run.name);
            if !args.judge || is_finished(run, &folder)? {
                chosen.push(ChosenRun { suite, run, folder });
            }
        }
    }
    let (mut results, mut known) = (Vec::new(), BTreeMap::new());
    let mut evaluate = |ChosenRun { suite, run, folder }: &ChosenRun,
                        ending: Result<(), String>| {
        let found = match ending {
            Ok(()) => suite.evaluate(run, folder, known.entry(suite.name.clone()).or_default()),
            Err(why) => suite.results_of_failed_run(run, &why),
        };
        if !args.quiet {
            found.iter().for_each(|v| tell!("  {}", line(v)));
        }
        results.extend(found);
    };
    if args.judge {
        chosen.iter().for_each(|run| evaluate(run, Ok(())));
    } else {
        runs::execute(args, &chosen, &stop, evaluate)?;
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
