//! Why a run ended before its end.

use std::io;
use std::path::{Path, PathBuf};

use crate::sim::{SetupError, StepError};

/// Why a run could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The set-up contradicts itself.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The folder holds something that must not be overwritten.
    #[error("{what}; {remedy}")]
    Occupied {
        /// What is there.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// Another program writes into the folder.
    #[error("another run{} is writing into {}; wait for it or stop it, or give another folder with -o", process.map_or(String::new(), |p| format!(" (process {p})")), folder.display())]
    InUse {
        /// The run folder.
        folder: PathBuf,
        /// Its process number, where known.
        process: Option<u32>,
    },
    /// The numerics failed.
    #[error("{source}\nThe last good checkpoint, at t = {time:.6e} s, is kept in {}", folder.display())]
    Unstable {
        /// What was seen.
        source: StepError,
        /// Time of the last good checkpoint [s].
        time: f64,
        /// Where it is.
        folder: PathBuf,
    },
    /// Reading or writing failed.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// "write", "read", "create".
        action: &'static str,
        /// Which file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// No checkpoint can be used.
    #[error("no checkpoint in {} can be used:\n{}\nRun again without --resume (and with --force) to start over", folder.display(), reasons.join("\n"))]
    NoCheckpoint {
        /// Where they are.
        folder: PathBuf,
        /// What is wrong with each.
        reasons: Vec<String>,
    },
    /// The folder was made from another case.
    #[error("the run folder {} was made from another case ({what}); give another folder with -o, or start over with --force", folder.display())]
    OtherCase {
        /// The run folder.
        folder: PathBuf,
        /// How it differs.
        what: String,
    },
}

impl RunError {
    /// Exit code of the command line: 2 bad input, 3 numerics, 4 input/output.
    pub fn exit_code(&self) -> u8 {
        match self {
            RunError::Setup(_)
            | RunError::Occupied { .. }
            | RunError::InUse { .. }
            | RunError::OtherCase { .. } => 2,
            RunError::Unstable { .. } => 3,
            RunError::Io { .. } | RunError::NoCheckpoint { .. } => 4,
        }
    }
}

/// Puts the file and what was tried into an input/output error.
pub(super) trait Context<T> {
    fn context(self, action: &'static str, path: &Path) -> Result<T, RunError>;
}

impl<T> Context<T> for io::Result<T> {
    fn context(self, action: &'static str, path: &Path) -> Result<T, RunError> {
        self.map_err(|source| RunError::Io {
            action,
            path: path.into(),
            source,
        })
    }
}
