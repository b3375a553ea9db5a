//! State of a run in a study folder.

use std::collections::BTreeSet;
use std::path::Path;

use grainwake_formats::bounded_file::{SETTINGS, read_text};
use grainwake_formats::summary;
use grainwake_run::RESOLVED;
use grainwake_run::provenance::Provenance;
use serde::{Deserialize, Serialize};

use crate::error::{StudyError, read_rows};
use crate::plan::{Run, TABLE, end_condition};

/// Reasons why a run folder belongs to another run.
const OTHER_CASE: &str = "its case has changed";
const OTHER_END: &str = "its end time has changed";

/// State of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunState {
    /// The run folder does not exist.
    Missing,
    /// The run was started and can be resumed.
    Unfinished,
    /// The run reached its end.
    Finished,
    /// The numerics failed, with the reason; the same case and program would fail again.
    Failed(String),
    /// The run folder belongs to another case or program, with the reason.
    Stale(&'static str),
    /// The run reached its end, but the file that tells which end cannot be read; with the file
    /// and the reason.
    Damaged(String),
}

impl RunState {
    /// Returns the kind of the state, without the reason.
    pub fn kind(&self) -> StateKind {
        match self {
            RunState::Missing => StateKind::Missing,
            RunState::Unfinished => StateKind::Unfinished,
            RunState::Finished => StateKind::Finished,
            RunState::Failed(_) => StateKind::Failed,
            RunState::Stale(_) => StateKind::Stale,
            RunState::Damaged(_) => StateKind::Damaged,
        }
    }
}

/// Kind of a [`RunState`], as in the tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StateKind {
    /// [`RunState::Missing`].
    #[default]
    Missing,
    /// [`RunState::Unfinished`].
    Unfinished,
    /// [`RunState::Finished`].
    Finished,
    /// [`RunState::Failed`].
    Failed,
    /// [`RunState::Stale`].
    Stale,
    /// [`RunState::Damaged`].
    Damaged,
}

grainwake_formats::display_as_serialized!(StateKind);

/// Finished runs in `table.json` of a study folder. Their run folders may have been removed.
#[derive(Clone, Debug, Default)]
pub struct Archive(BTreeSet<(String, String)>);

impl Archive {
    /// Reads the names and hashes of the finished runs; none without a table.
    ///
    /// # Errors
    /// [`StudyError::Damaged`] for a damaged table.
    pub fn read(study: &Path) -> Result<Archive, StudyError> {
        #[derive(Deserialize)]
        struct Row {
            name: String,
            id: String,
            state: StateKind,
        }
        let rows: Vec<Row> = read_rows(&study.join(TABLE))?;
        let finished = rows.into_iter().filter(|row| row.state == StateKind::Finished);
        Ok(Archive(finished.map(|row| (row.name, row.id)).collect()))
    }

    /// Returns whether the run finished with the same case and end condition, by the program of the
    /// plan or an accepted one.
    pub fn contains(&self, run: &Run) -> bool {
        run.ids().any(|id| self.0.contains(&(run.name.clone(), id.clone())))
    }

    /// Returns how many of the `runs` had finished with another case, end or program only.
    pub fn outdated(&self, runs: &[Run]) -> usize {
        let names: BTreeSet<&str> = self.0.iter().map(|(name, _)| name.as_str()).collect();
        let outdated = |run: &&Run| names.contains(run.name.as_str()) && !self.contains(run);
        runs.iter().filter(outdated).count()
    }
}

/// Determines the state of a run. A run without a folder is finished if the archive contains it.
pub fn run_state(run: &Run, study: &Path, archive: &Archive) -> RunState {
    match folder_state(run, study) {
        RunState::Missing if archive.contains(run) => RunState::Finished,
        state => state,
    }
}

/// Refuses a study folder in which [`execute`](crate::execute) would replace finished runs of other
/// cases or ends. Runs that differ by the program alone may be replaced: their repetition gives the
/// results of the present program.
///
/// # Errors
/// [`StudyError::WouldReplace`] with the runs.
pub fn refuse_to_replace(runs: &[Run], chosen: &[usize], study: &Path) -> Result<(), StudyError> {
    let differs = |run: &Run| {
        let folder = run.folder(study);
        let found = Provenance::read(&folder).filter(|_| folder.join(summary::FILE).is_file())?;
        if found.case_sha256 != run.case_sha256 {
            return Some(OTHER_CASE);
        }
        // A damaged file is a failure of the run, which replaces nothing.
        ending_in(&folder).ok().filter(|ending| *ending != run.ending).map(|_| OTHER_END)
    };
    let named = |n: &usize| differs(&runs[*n]).map(|why| (runs[*n].name.clone(), why));
    match chosen.iter().filter_map(named).collect::<Vec<_>>() {
        found if found.is_empty() => Ok(()),
        found => Err(StudyError::WouldReplace { folder: study.into(), runs: found }),
    }
}

/// Determines the state of a run by its run folder. The finished run of an accepted program counts.
pub(crate) fn folder_state(run: &Run, study: &Path) -> RunState {
    let folder = run.folder(study);
    let Some(found) = Provenance::read(&folder) else {
        return RunState::Missing;
    };
    if found.case_sha256 != run.case_sha256 {
        return RunState::Stale(OTHER_CASE);
    }
    let (finished, id) = (folder.join(summary::FILE).is_file(), run.id_by(&found));
    if id != run.id && !(finished && run.accepted_ids.contains(&id)) {
        return RunState::Stale("another version of the program produced it");
    }
    if finished {
        return match ending_in(&folder) {
            Ok(ending) if ending == run.ending => RunState::Finished,
            Ok(_) => RunState::Stale(OTHER_END),
            Err(why) => RunState::Damaged(why),
        };
    }
    match std::fs::read_to_string(folder.join("failure.json")) {
        Ok(text) => RunState::Failed(failure_reason(&text)),
        Err(_) => RunState::Unfinished,
    }
}

/// Returns the end condition of the run in a folder.
///
/// # Errors
/// The file and the reason why it is not known.
fn ending_in(folder: &Path) -> Result<String, String> {
    let file = folder.join(RESOLVED);
    let text = read_text(&file, SETTINGS)
        .map_err(|error| format!("{} cannot be read: {error}", file.display()))?;
    end_condition(&text).map_err(|error| format!("{} is damaged: {error}", file.display()))
}

fn failure_reason(failure: &str) -> String {
    let value: serde_json::Value = serde_json::from_str(failure).unwrap_or_default();
    let what = value.get("what").and_then(serde_json::Value::as_str);
    what.unwrap_or("the numerics failed").to_owned()
}
