//! Errors of a run.

use std::io;
use std::path::{Path, PathBuf};

use crate::number_format::{quantity, size};
use grainwake_solver::sim::{RemedyTerms, SetupError, StepError};

/// Kind of a failure, from the mildest to the worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FailureKind {
    /// The case or the command is invalid.
    Input,
    /// The numerics became unstable, or the program has an internal error.
    Computation,
    /// Reading or writing failed.
    InputOutput,
}

/// Error of a run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The set-up is inconsistent.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The folder holds data that must not be overwritten.
    #[error("{what}; {remedy}")]
    Occupied {
        /// Description of the folder.
        what: String,
        /// Advice.
        remedy: String,
    },
    /// Another program is writing into the folder.
    #[error("another run{} is writing into {}; wait for it or stop it, or give another folder with -o", process.map_or(String::new(), |p| format!(" (process {p})")), folder.display())]
    InUse {
        /// The run folder.
        folder: PathBuf,
        /// Process number, if known.
        process: Option<u32>,
    },
    /// The numerics failed, or grains overlap too far.
    #[error("{}\nThe last good checkpoint, at t = {}, is kept in {}", source.message(terms), quantity(*time, "s"), folder.display())]
    Unstable {
        /// Symptom.
        source: StepError,
        /// Keys of the case in the advice.
        terms: Box<RemedyTerms>,
        /// Time of the last good checkpoint [s].
        time: f64,
        /// Folder of the checkpoints.
        folder: PathBuf,
    },
    /// The run needs more memory than is free.
    #[error("the run needs {} of memory and {} are free; take larger cells, a smaller box, fewer surface nodes, no surfaces in VTK files (output.surfaces = 0) or [run] precision = \"f32\"", size(*needed), size(*free))]
    Memory {
        /// Memory of the run [bytes].
        needed: u64,
        /// Free memory [bytes].
        free: u64,
    },
    /// Reading or writing failed.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// "write", "read", "create".
        action: &'static str,
        /// File.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// No checkpoint is valid.
    #[error("no checkpoint in {} can be used:\n{}\n{remedy}", folder.display(), reasons.join("\n"))]
    NoCheckpoint {
        /// Folder of the checkpoints.
        folder: PathBuf,
        /// Fault of each checkpoint.
        reasons: Vec<String>,
        /// Advice.
        remedy: &'static str,
    },
    /// There is no checkpoint to start a new run from.
    #[error("{what}; {remedy}")]
    NoParent {
        /// Description of the run.
        what: String,
        /// Advice.
        remedy: String,
    },
    /// The run was controlled by another program, which alone can go on with it.
    #[error("the run in {} was controlled from {program}: continue it there, with output and resume=True, or give another folder with -o", folder.display())]
    Controlled {
        /// The run folder.
        folder: PathBuf,
        /// Program.
        program: String,
    },
    /// The folder belongs to another case.
    #[error("the run folder {} was made from another case ({what}); give another folder with -o, or start over with --force", folder.display())]
    OtherCase {
        /// The run folder.
        folder: PathBuf,
        /// Differences.
        what: String,
    },
}

impl RunError {
    /// Returns the refusal of a folder that holds other data.
    pub(crate) fn occupied(
        folder: &Path,
        what: impl std::fmt::Display,
        remedy: impl Into<String>,
    ) -> RunError {
        RunError::Occupied { what: format!("{} {what}", folder.display()), remedy: remedy.into() }
    }

    /// Returns the kind of the failure.
    pub fn kind(&self) -> FailureKind {
        match self {
            RunError::Setup(_)
            | RunError::Occupied { .. }
            | RunError::InUse { .. }
            | RunError::Memory { .. }
            | RunError::NoParent { .. }
            | RunError::Controlled { .. }
            | RunError::OtherCase { .. } => FailureKind::Input,
            RunError::Unstable { .. } => FailureKind::Computation,
            RunError::Io { .. } | RunError::NoCheckpoint { .. } => FailureKind::InputOutput,
        }
    }
}

/// Conversion of input/output errors, with the file and the action.
pub(crate) trait Context<T> {
    fn context(self, action: &'static str, path: &Path) -> Result<T, RunError>;
}

impl<T> Context<T> for io::Result<T> {
    fn context(self, action: &'static str, path: &Path) -> Result<T, RunError> {
        self.map_err(|source| RunError::Io { action, path: path.into(), source })
    }
}
