//! `validate`: suites of cases with references and bounds.

use std::collections::BTreeMap;
use std::path::PathBuf;

use grainwake_run::Existing;
use grainwake_run::case::Case;
use grainwake_validation::{Level, Library};
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
    #[pyo3(from_py_with = crate::arguments::threads)] threads: usize,
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
    let suites = library.chosen(&names, Some(level)).raise()?;
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
