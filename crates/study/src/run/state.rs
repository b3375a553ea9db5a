//! How far a run of a study is.

use std::path::Path;

use grainwake_solver::output::provenance::Provenance;
use grainwake_solver::output::{RESOLVED, SUMMARY};

use crate::plan::{Run, end_condition};

/// How far a run is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunState {
    /// Nothing is there.
    Missing,
    /// It was begun, and can go on.
    Unfinished,
    /// It came to its end.
    Finished,
    /// It became unstable; the same case and program would again.
    Failed(String),
    /// What is there is of another case or program, as said.
    Stale(&'static str),
}

impl RunState {
    /// One word.
    pub fn word(&self) -> &'static str {
        match self {
            RunState::Missing => "missing",
            RunState::Unfinished => "unfinished",
            RunState::Finished => "finished",
            RunState::Failed(_) => "failed",
            RunState::Stale(_) => "stale",
        }
    }
}

/// Looks into the run folder of a run, for this program.
pub fn run_state(run: &Run, study: &Path) -> RunState {
    let own = Provenance::new("");
    state_of_version(run, study, &own.version, own.commit.as_deref())
}

/// The same for a version and commit of the program.
pub(crate) fn state_of_version(
    run: &Run,
    study: &Path,
    version: &str,
    commit: Option<&str>,
) -> RunState {
    let folder = run.folder(study);
    let Some(there) = Provenance::read(&folder) else {
        return RunState::Missing;
    };
    if there.case_sha256 != run.case_sha256 {
        return RunState::Stale("its case is another one now");
    }
    if (there.version.as_str(), there.commit.as_deref()) != (version, commit) {
        return RunState::Stale("it was made by another version of the program");
    }
    if folder.join(SUMMARY).is_file() {
        let resolved = std::fs::read_to_string(folder.join(RESOLVED)).unwrap_or_default();
        return if end_condition(&resolved) == run.ending {
            RunState::Finished
        } else {
            RunState::Stale("it ends at another time now")
        };
    }
    match std::fs::read_to_string(folder.join("failure.json")) {
        Ok(text) => RunState::Failed(why(&text)),
        Err(_) => RunState::Unfinished,
    }
}

fn why(failure: &str) -> String {
    let value: serde_json::Value = serde_json::from_str(failure).unwrap_or_default();
    let what = value.get("what").and_then(serde_json::Value::as_str);
    what.unwrap_or("the numerics failed").to_owned()
}
