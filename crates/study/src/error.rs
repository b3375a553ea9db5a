//! Errors of a study, reading of tables and writing of files in one piece.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use grainwake_formats::disk::write_atomically;
use grainwake_report::ReportError;
use grainwake_run::FailureKind;
use grainwake_run::case::{CaseError, Problem};

/// Reason why a study cannot be read, planned or stored.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A file could not be read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// "read", "write", "create".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The contents of the study file are wrong.
    #[error("{}", Problem::list(.0))]
    Invalid(Vec<Problem>),
    /// A case is wrong independently of the study.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The folder holds another study or other files.
    #[error("{} {what}", folder.display())]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// Contents of the folder.
        what: String,
    },
    /// The folder holds finished runs of other cases or ends, which would be replaced.
    #[error("{}", would_replace(folder, runs))]
    WouldReplace {
        /// The folder.
        folder: PathBuf,
        /// Names of the runs, each with the reason.
        runs: Vec<(String, &'static str)>,
    },
    /// The steps of a run could not be timed.
    #[error("{run} cannot be timed: {what}")]
    NotTimed {
        /// Name of the run.
        run: String,
        /// The error.
        what: String,
        /// Kind of the error.
        kind: FailureKind,
    },
    /// A report could not be written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// A file of the study folder is damaged.
    #[error("{} is damaged: {what}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// The error in it.
        what: String,
    },
}

impl From<Problem> for StudyError {
    fn from(problem: Problem) -> Self {
        StudyError::Invalid(vec![problem])
    }
}

/// Message of [`StudyError::WouldReplace`], which names the first runs.
fn would_replace(folder: &Path, runs: &[(String, &'static str)]) -> String {
    const NAMED: usize = 10;
    let mut named: Vec<String> =
        runs.iter().take(NAMED).map(|(name, why)| format!("{name} ({why})")).collect();
    if runs.len() > NAMED {
        named.push(format!("{} more", runs.len() - NAMED));
    }
    let noun = if runs.len() == 1 { "run" } else { "runs" };
    let (folder, count) = (folder.display(), runs.len());
    format!("{folder} holds {count} finished {noun} that would be replaced: {}", named.join(", "))
}

/// Adds the action and the file to an error of the operating system.
pub(crate) trait At<T> {
    fn at(self, action: &'static str, path: &Path) -> Result<T, StudyError>;
}

impl<T> At<T> for std::io::Result<T> {
    fn at(self, action: &'static str, path: &Path) -> Result<T, StudyError> {
        self.map_err(|source| StudyError::Io { action, path: path.into(), source })
    }
}

/// Writes a file in one piece.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<(), StudyError> {
    write_atomically(path, true, |out| out.write_all(bytes)).at("write", path)
}

/// Reads the rows of a JSON table; none if the file does not exist.
///
/// # Errors
/// [`StudyError::Damaged`] with the line of the damage.
pub(crate) fn read_rows<T: serde::de::DeserializeOwned>(file: &Path) -> Result<Vec<T>, StudyError> {
    match read_json(file) {
        Err(StudyError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
            Ok(Vec::new())
        }
        rows => rows,
    }
}

/// Reads a JSON file of the study folder.
///
/// # Errors
/// [`StudyError::Damaged`] with the line of the damage.
pub(crate) fn read_json<T: serde::de::DeserializeOwned>(file: &Path) -> Result<T, StudyError> {
    let text = std::fs::read(file).at("read", file)?;
    serde_json::from_slice(&text)
        .map_err(|error| StudyError::Damaged { file: file.into(), what: error.to_string() })
}

/// Writes a value as indented JSON.
pub(crate) fn write_json(path: &Path, value: &impl serde::Serialize) -> Result<(), StudyError> {
    let text = serde_json::to_string_pretty(value).map_err(std::io::Error::from);
    write_file(path, text.at("write", path)?.as_bytes())
}

/// Refers to the page with the keys of studies; `grainwake schema` lists the keys of cases.
pub(crate) fn refer_to_study_keys(mut problem: Problem) -> Problem {
    let here = "docs/reference/study-file.md lists the keys of study and analysis files";
    problem.help =
        problem.help.map(|help| help.replace("`grainwake schema` lists every key", here));
    problem
}
