//! Errors of reading a file of text.

use std::path::{Path, PathBuf};

use crate::bounded_file;

/// Reason why a file of text cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", .file.display())]
    Read {
        /// Path of the file.
        file: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A line is damaged.
    #[error("{}, line {line}: {what}", .file.display())]
    Line {
        /// Path of the file.
        file: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// Description of the damage.
        what: String,
    },
}

impl FormatError {
    /// Returns the error of a damaged line.
    pub fn line(file: &Path, line: usize, what: impl Into<String>) -> FormatError {
        FormatError::Line { file: file.to_owned(), line, what: what.into() }
    }
}

/// Reads a file of UTF-8 text.
///
/// # Errors
/// [`FormatError::Line`] with the first line that is not UTF-8, or [`FormatError::Read`].
pub fn read_text(file: &Path) -> Result<String, FormatError> {
    let bytes = bounded_file::read_bytes(file, bounded_file::DATA)
        .map_err(|source| FormatError::Read { file: file.to_owned(), source })?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|byte| **byte == b'\n').count();
        FormatError::line(file, line, "not text (UTF-8)")
    })
}

/// Returns the note on an unfinished last line of a file.
pub(crate) fn unfinished_line(file: &Path, line: usize) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    format!("{name}: the last line (line {line}) is unfinished and was left out")
}
