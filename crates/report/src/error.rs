//! Errors of a report.

use std::io;
use std::path::{Path, PathBuf};

use grainwake_formats::FormatError;

/// Reason why a report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The folder does not exist, or holds no file of a run.
    #[error("{}", no_run(.0))]
    NotARun(PathBuf),
    /// A file of the run is unreadable or damaged.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A film would have too few pictures.
    #[error("no film of {}: it would have {found} pictures, and at least {least} are needed; run the \
             case with a shorter interval, for example --set output.{output}=END/100 with the end \
             of the run in place of END", .folder.display())]
    TooFewFrames {
        /// Run folder.
        folder: PathBuf,
        /// Number of moments that can be shown.
        found: usize,
        /// Least number of moments.
        least: usize,
        /// Key of `[output]` that gives more.
        output: &'static str,
    },
    /// A file could not be written, or a figure could not be drawn.
    #[error("cannot write {}: {source}", .file.display())]
    Write {
        /// File.
        file: PathBuf,
        /// Error of the operating system, or reason why the figure could not be drawn.
        source: io::Error,
    },
}

/// Adds the file to the error of a write, or of a drawing for it.
pub(crate) trait Written<T> {
    fn written(self, file: &Path) -> Result<T, ReportError>;
}

impl<T> Written<T> for io::Result<T> {
    fn written(self, file: &Path) -> Result<T, ReportError> {
        self.map_err(|source| ReportError::Write { file: file.into(), source })
    }
}

impl<T> Written<T> for Result<T, String> {
    fn written(self, file: &Path) -> Result<T, ReportError> {
        self.map_err(io::Error::other).written(file)
    }
}

/// Describes why a path is no run folder.
fn no_run(path: &Path) -> String {
    let shown = path.display();
    if !path.exists() {
        return format!("there is no folder {shown}");
    }
    if !path.is_dir() {
        return format!("{shown} is a file, not a run folder");
    }
    format!(
        "{shown} holds no run: none of case.resolved.toml, grains.csv, diagnostics.csv and \
         summary.json is there"
    )
}

impl ReportError {
    /// Returns whether reading or writing failed (exit code 4) rather than the contents being wrong
    /// (exit code 2).
    pub fn is_input_output(&self) -> bool {
        matches!(self, ReportError::Format(FormatError::Read { .. }) | ReportError::Write { .. })
    }
}
