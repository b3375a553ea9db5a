//! Errors of the view.

use std::path::PathBuf;

use grainwake_report::ReportError;

/// Reason why a view cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// A folder holds no run, or cannot be read.
    #[error(transparent)]
    Run(#[from] ReportError),
    /// The page could not be written.
    #[error("cannot write {}: {source}", .file.display())]
    Write {
        /// File.
        file: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The port cannot be used.
    #[error("cannot listen on 127.0.0.1:{port}: {source}")]
    Listen {
        /// Port.
        port: u16,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

impl ViewError {
    /// Returns whether reading, writing or listening failed (exit code 4) rather than the input
    /// being wrong (exit code 2).
    pub fn is_input_output(&self) -> bool {
        match self {
            ViewError::Run(error) => error.is_input_output(),
            ViewError::Write { .. } | ViewError::Listen { .. } => true,
        }
    }
}
