//! Python exceptions for the errors of the libraries: refused input, failed numerics, failed input
//! or output, in the words of the command line.

use std::io;

use grainwake_report::ReportError;
use grainwake_run::case::{CaseError as WrongCase, Problem};
use grainwake_run::{FailureKind, RunError};
use grainwake_shape::ShapeError;
use grainwake_solver::sim::{ControlError, SetupError, StepError};
use grainwake_study::StudyError;
use grainwake_validation::SuiteError;
use miette::{GraphicalReportHandler, GraphicalTheme};
use pyo3::exceptions::{
    PyFileExistsError, PyFileNotFoundError, PyIsADirectoryError, PyKeyboardInterrupt,
    PyNotADirectoryError, PyOSError, PyPermissionError,
};
use pyo3::prelude::*;

use crate::words::{python_words, words_of_dict};

pyo3::import_exception!(grainwake._errors, CaseError);
pyo3::import_exception!(grainwake._errors, SolverError);

/// Width of a message [columns], as in a file or pipe of the command line.
const WIDTH: usize = 400;

/// Returns a problem as the command line writes it to a file.
fn rendered(problem: &Problem) -> String {
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::none())
        .with_width(WIDTH)
        .with_context_lines(1);
    let mut text = String::new();
    match handler.render_report(&mut text, problem) {
        Ok(()) => text.trim_end_matches('\n').to_owned(),
        Err(_) => problem.to_string(),
    }
}

/// Parts of a problem for Python: key, message, help, file, line, column.
type Parts = (Option<String>, String, Option<String>, Option<String>, Option<usize>, Option<usize>);

fn parts(problem: &Problem) -> Parts {
    let place = problem.place();
    (
        problem.key.clone(),
        problem.message.clone(),
        problem.help.clone(),
        place.map(|(file, ..)| file.to_owned()),
        place.map(|(_, line, _)| line),
        place.map(|(.., column)| column),
    )
}

/// Returns the exception of refused input, in the names of Python.
pub fn refused(problems: &[Problem]) -> PyErr {
    refused_in(problems, python_words)
}

/// Returns the exception of a refused case that was given as a dict.
pub fn refused_dict(error: &WrongCase) -> PyErr {
    refused_in(error.problems(), words_of_dict)
}

fn refused_in(problems: &[Problem], words: fn(&str) -> String) -> PyErr {
    let problems: Vec<Problem> = problems.iter().map(|p| p.clone().reworded(words)).collect();
    let texts: Vec<String> = problems.iter().map(rendered).collect();
    let all: Vec<Parts> = problems.iter().map(parts).collect();
    CaseError::new_err((texts.join("\n"), all))
}

/// Returns the exception of refused input with one message.
pub fn input(message: impl Into<String>) -> PyErr {
    let message = python_words(&message.into());
    let only: Parts = (None, message.clone(), None, None, None, None);
    CaseError::new_err((message, vec![only]))
}

/// Returns the exception of failed numerics.
pub fn numerics(message: impl Into<String>) -> PyErr {
    SolverError::new_err(python_words(&message.into()))
}

/// Returns the exception of the operating system for this kind of error.
pub fn system(kind: io::ErrorKind, message: impl Into<String>) -> PyErr {
    let message = python_words(&message.into());
    match kind {
        io::ErrorKind::NotFound => PyFileNotFoundError::new_err(message),
        io::ErrorKind::AlreadyExists => PyFileExistsError::new_err(message),
        io::ErrorKind::PermissionDenied => PyPermissionError::new_err(message),
        io::ErrorKind::IsADirectory => PyIsADirectoryError::new_err(message),
        io::ErrorKind::NotADirectory => PyNotADirectoryError::new_err(message),
        // The contents of a file were refused, not the access.
        io::ErrorKind::InvalidData => input(message),
        _ => PyOSError::new_err(message),
    }
}

/// Gives notes as `CaseWarning`s.
pub fn warn(py: Python<'_>, notes: impl IntoIterator<Item = String>) -> PyResult<()> {
    let warnings = py.import("warnings")?;
    let kind = py.import("grainwake")?.getattr("CaseWarning")?;
    notes
        .into_iter()
        .try_for_each(|note| warnings.call_method1("warn", (python_words(&note), &kind)).map(drop))
}

/// Conversion of an error of a library to a Python exception.
pub trait Raise<T> {
    /// Replaces the error by its exception.
    fn raise(self) -> Result<T, PyErr>;
}

impl<T, E: IntoException> Raise<T> for Result<T, E> {
    fn raise(self) -> Result<T, PyErr> {
        self.map_err(E::into_exception)
    }
}

/// Error of a library that has an exception.
pub trait IntoException {
    /// Returns the exception.
    fn into_exception(self) -> PyErr;
}

impl IntoException for WrongCase {
    fn into_exception(self) -> PyErr {
        match &self {
            WrongCase::Unreadable { source, .. } => system(source.kind(), self.to_string()),
            WrongCase::Invalid(problems) => refused(problems),
            WrongCase::Interrupted => PyKeyboardInterrupt::new_err(self.to_string()),
        }
    }
}

impl IntoException for RunError {
    fn into_exception(self) -> PyErr {
        let message = self.to_string();
        match (&self, self.kind()) {
            (RunError::Io { source, .. }, _) => system(source.kind(), message),
            (_, FailureKind::Input) => input(message),
            (_, FailureKind::Computation) => numerics(message),
            (_, FailureKind::InputOutput) => system(io::ErrorKind::Other, message),
        }
    }
}

impl IntoException for ShapeError {
    fn into_exception(self) -> PyErr {
        match &self {
            ShapeError::Io { source, .. } => system(source.kind(), self.to_string()),
            ShapeError::Interrupted => PyKeyboardInterrupt::new_err(self.to_string()),
            _ => match advice(&self) {
                Some(advice) => refused(&[Problem::new(self.to_string()).help(advice)]),
                None => input(self.to_string()),
            },
        }
    }
}

/// Returns the arguments that may remedy a refused shape, in the words of the command line.
fn advice(error: &ShapeError) -> Option<String> {
    let advice = match error {
        ShapeError::EmptyVolume | ShapeError::SolidVolume => {
            "check the grey values of the image; a grey image needs threshold=VALUE, \"otsu\" or \
             \"otsu3\""
        }
        ShapeError::MedianWithoutThreshold => {
            "add threshold=\"otsu\" or a grey value, or omit median=True for an image of labels"
        }
        ShapeError::CutByBorder { .. } | ShapeError::CutByView { .. } => {
            "scan a larger region; if the crop is merely tight, pad=True includes the grain, \
             truncated there; if the label is a whole phase: split=True treats each piece as a grain"
        }
        ShapeError::SeveralPieces { .. } => {
            "if the label is a whole phase: split=True treats each piece as a grain, separate=0.87 \
             also separates touching grains; if it is one grain: largest_piece=True keeps the \
             largest"
        }
        ShapeError::Quality { cells: Some(cells), .. } => {
            return Some(format!("cells={cells} resolves it"));
        }
        ShapeError::InsideOut { .. } => "flip=True inverts its normals",
        ShapeError::TooFewVoxels { .. } => "scan at a higher resolution, or omit the grain",
        ShapeError::Malformed { .. } => {
            "copy or export the file again; if another program opens it, save it uncompressed"
        }
        _ => return None,
    };
    Some(advice.into())
}

impl IntoException for SetupError {
    fn into_exception(self) -> PyErr {
        input(self.to_string())
    }
}

impl IntoException for StepError {
    fn into_exception(self) -> PyErr {
        numerics(self.to_string())
    }
}

impl IntoException for ControlError {
    fn into_exception(self) -> PyErr {
        input(self.to_string())
    }
}

impl IntoException for ReportError {
    fn into_exception(self) -> PyErr {
        match &self {
            ReportError::Write { source, .. }
            | ReportError::Format(grainwake_formats::FormatError::Read { source, .. }) => {
                system(source.kind(), self.to_string())
            }
            _ => input(self.to_string()),
        }
    }
}

impl IntoException for grainwake_formats::FormatError {
    fn into_exception(self) -> PyErr {
        ReportError::from(self).into_exception()
    }
}

impl IntoException for StudyError {
    fn into_exception(self) -> PyErr {
        match self {
            StudyError::Invalid(problems) => refused(&problems),
            StudyError::Case(error) => error.into_exception(),
            StudyError::Report(error) => error.into_exception(),
            StudyError::Io { ref source, .. } => system(source.kind(), self.to_string()),
            StudyError::WouldReplace { .. } => {
                input(format!("{self}; give another folder, or use force=True"))
            }
            other => input(other.to_string()),
        }
    }
}

impl IntoException for SuiteError {
    fn into_exception(self) -> PyErr {
        match self {
            SuiteError::Invalid(problem) => refused(&[*problem]),
            SuiteError::Unreadable { ref source, .. } => system(source.kind(), self.to_string()),
        }
    }
}
