//! Why a report could not be made.

use std::path::PathBuf;

use grainwake_formats::FormatError;

/// Why a report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A folder without any file of a run.
    #[error("{} holds no run: none of case.resolved.toml, grains.csv, diagnostics.csv and summary.json is there", .0.display())]
    NotARun(PathBuf),
    /// A file of the run is unreadable or damaged.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A file could not be written.
    #[error("cannot write {}: {source}", .file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A figure could not be turned into pixels.
    #[error("figure {figure} cannot be drawn: {what}")]
    Draw {
        /// Name of the figure.
        figure: String,
        /// What is wrong.
        what: String,
    },
}

impl ReportError {
    /// Whether the system failed to read or write (exit code 4), not the content (exit code 2).
    pub fn is_input_output(&self) -> bool {
        matches!(
            self,
            ReportError::Format(FormatError::Read { .. }) | ReportError::Write { .. }
        )
    }
}
