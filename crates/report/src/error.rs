//! Why a report could not be made.

use std::path::PathBuf;

/// Why a report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A folder without any file of a run.
    #[error("{} holds no run: none of case.resolved.toml, grains.csv, diagnostics.csv and summary.json is there", .0.display())]
    NotARun(PathBuf),
    /// A file could not be read.
    #[error("cannot read {}: {source}", .file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error("cannot write {}: {source}", .file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A line of a table or log is damaged.
    #[error("{}, line {line}: {what}", .file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        what: String,
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
        matches!(self, ReportError::Read { .. } | ReportError::Write { .. })
    }
}
