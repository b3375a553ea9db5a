//! What can go wrong with a study.

use std::path::{Path, PathBuf};

use grainwake_solver::case::{CaseError, Problem};

/// Why a study could not be read, planned or kept.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A file could not be read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// "read", "write", "create".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The contents of the study file are wrong.
    #[error("{}", list(.0))]
    Invalid(Vec<Problem>),
    /// A case is wrong without regard to the study.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The folder belongs to something else.
    #[error("{} {what}", folder.display())]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// What is there.
        what: String,
    },
    /// A file of the study folder is damaged.
    #[error("{} is damaged: {what}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

fn list(problems: &[Problem]) -> String {
    let lines: Vec<String> = problems.iter().map(Problem::to_string).collect();
    lines.join("\n")
}

impl From<Problem> for StudyError {
    fn from(problem: Problem) -> Self {
        StudyError::Invalid(vec![problem])
    }
}

/// Names the file and the action of a system error.
pub(crate) trait At<T> {
    fn at(self, action: &'static str, path: &Path) -> Result<T, StudyError>;
}

impl<T> At<T> for std::io::Result<T> {
    fn at(self, action: &'static str, path: &Path) -> Result<T, StudyError> {
        self.map_err(|source| StudyError::Io {
            action,
            path: path.into(),
            source,
        })
    }
}

/// Writes a file whole or not at all; programs that share the folder do not meet in it.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), StudyError> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(name);
    std::fs::write(&temporary, bytes)
        .and_then(|()| std::fs::rename(&temporary, path))
        .at("write", path)
}

/// Points to the page that has the keys of studies: `grainwake schema` has those of cases.
pub(crate) fn of_a_study(mut problem: Problem) -> Problem {
    let here = "docs/study.md lists the keys of study and analysis files";
    problem.help = problem
        .help
        .map(|help| help.replace("`grainwake schema` lists every key", here));
    problem
}
