//! `validate`: suites of cases with references and bounds.

use std::collections::BTreeMap;
use std::path::PathBuf;

use grainwake_run::Existing;
use grainwake_run::case::Case;
use grainwake_validation::{Level, Library, Suite};
use pyo3::prelude::*;

use crate::arrays::json;
use crate::error::{Raise, SolverError, input};
use crate::{running, threads};

/// Results of validations as dicts; called by ``grainwake.validate``.
#[pyfunction]
pub fn _validate<'py>(
    py: Python<'py>,
    names: Vec<String>,
    suites: Option<PathBuf>,
    output: PathBuf,
    level: &str,
    threads: usize,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let level = match level {
        "ci" => Level::Ci,
        "full" => Level::Full,
        other => {
            let message = format!("level: found \"{other}\"; expected \"ci\" or \"full\"");
            return Err(input(message));
        }
    };
    let library = Library::open(suites.as_deref()).raise()?;
    let suites = chosen(library.suites.clone(), &names)?;
    let threads = threads::resolve(py, threads)?;
    let mut results = Vec::new();
    for suite in &suites {
        let mut values = BTreeMap::new();
        for run in suite.runs.iter().filter(|run| run.level <= level) {
            let folder = output.join(&suite.name).join(&run.name);
            let case = py.detach(|| Case::load(&run.case, &run.set)).raise()?;
            let existing = Existing::Replace;
            let found = match running::run(py, &case, &folder, existing, None, threads, progress) {
                Ok(_) => py.detach(|| suite.evaluate(run, &folder, &mut values)),
                Err(error) if error.is_instance_of::<SolverError>(py) => {
                    suite.results_of_failed_run(run, &error.value(py).to_string())
                }
                Err(error) => return Err(error),
            };
            results.extend(found);
        }
    }
    json(py, &results)
}

/// Returns the suites and runs with the given names, NAME or NAME/RUN; all without names.
fn chosen(all: Vec<Suite>, names: &[String]) -> PyResult<Vec<Suite>> {
    let absent = |what: String, known: Vec<&str>| {
        Err(input(format!("{what}; there are: {}", known.join(", "))))
    };
    for name in names {
        let (suite_name, run) = name.split_once('/').unwrap_or((name, ""));
        let Some(suite) = all.iter().find(|suite| suite.name == suite_name) else {
            let known = all.iter().map(|suite| suite.name.as_str()).collect();
            return absent(format!("there is no validation \"{suite_name}\""), known);
        };
        if !run.is_empty() && suite.runs.iter().all(|known| known.name != run) {
            let known = suite.runs.iter().map(|run| run.name.as_str()).collect();
            return absent(format!("the validation \"{suite_name}\" has no run \"{run}\""), known);
        }
    }
    let wanted = |suite: Suite| {
        if names.is_empty() || names.contains(&suite.name) {
            return suite;
        }
        let name = suite.name.clone();
        suite.restricted_to(|run| names.contains(&format!("{name}/{run}")))
    };
    Ok(all.into_iter().map(wanted).collect())
}
