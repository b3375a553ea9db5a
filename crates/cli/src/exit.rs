//! Exit codes and error messages.

use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;

use grainwake_run::case::{CaseError, Problem};
use grainwake_run::{FailureKind, RunError};
use grainwake_shape::ShapeError;
use miette::{GraphicalReportHandler, GraphicalTheme};

/// The results do not meet `[expect]`.
pub const MISSED: u8 = 1;
/// Invalid input; nothing was written.
pub const BAD_INPUT: u8 = 2;
/// The numerics became unstable, or the program has an internal error.
pub const COMPUTATION: u8 = 3;
/// Input or output failed.
pub const IO: u8 = 4;
/// Interrupted after writing a checkpoint.
pub const INTERRUPTED: u8 = 130;

/// Returns the exit code of a failed run.
pub fn exit_code(kind: FailureKind) -> u8 {
    match kind {
        FailureKind::Input => BAD_INPUT,
        FailureKind::Computation => COMPUTATION,
        FailureKind::InputOutput => IO,
    }
}

/// Runs a command; a panic becomes a failure with the exit code of an internal error. The panic has
/// printed its own message before.
pub fn without_panic(command: impl FnOnce() -> Result<(), Exit>) -> Result<(), Exit> {
    // Nothing that the command has changed is used after a panic.
    catch_unwind(AssertUnwindSafe(command)).unwrap_or_else(|_| {
        let message = "internal error: the message above names a defect of Grainwake";
        let issues = concat!(env!("CARGO_PKG_REPOSITORY"), "/issues");
        let help = format!("please report it with the command and the message: {issues}");
        Err(Exit::with_help(COMPUTATION, message, help))
    })
}

/// Failure of a command.
#[derive(Debug)]
pub struct Exit {
    code: u8,
    problems: Vec<Problem>,
}

impl Exit {
    /// Creates a failure with one message.
    pub fn new(code: u8, message: impl Into<String>) -> Exit {
        Exit { code, problems: vec![Problem::new(message)] }
    }
    /// Creates a failure because of invalid input.
    pub fn input(message: impl Into<String>) -> Exit {
        Exit::new(BAD_INPUT, message)
    }
    /// Returns the failure at a file or folder as a function of its cause.
    pub fn at<E: std::fmt::Display>(path: &Path) -> impl Fn(E) -> Exit {
        move |error| Exit::new(IO, format!("{}: {error}", path.display()))
    }
    /// Returns the failure of an action on a file or folder as a function of its cause.
    pub fn cannot<E: std::fmt::Display>(action: &str, path: &Path) -> impl Fn(E) -> Exit {
        move |error| Exit::new(IO, format!("cannot {action} {}: {error}", path.display()))
    }
    /// Creates a failure with one message and its remedy.
    pub fn with_help(code: u8, message: impl Into<String>, help: impl Into<String>) -> Exit {
        Exit { code, problems: vec![Problem::new(message).help(help)] }
    }
    /// Creates a failure because of invalid input, with its remedy.
    pub fn refused(message: impl Into<String>, help: impl Into<String>) -> Exit {
        Exit::with_help(BAD_INPUT, message, help)
    }
    /// Creates a failure with one message and its remedy if there is one.
    pub fn with_hint(code: u8, message: impl ToString, help: Option<impl Into<String>>) -> Exit {
        match help {
            Some(help) => Exit::with_help(code, message.to_string(), help),
            None => Exit::new(code, message.to_string()),
        }
    }
    /// Creates a failure with several problems.
    pub fn problems(code: u8, problems: Vec<Problem>) -> Exit {
        Exit { code, problems }
    }

    /// Returns the exit code.
    pub fn code(&self) -> ExitCode {
        ExitCode::from(self.code)
    }

    /// Returns the messages as they appear on standard error.
    pub fn messages(&self) -> String {
        let terminal = std::io::IsTerminal::is_terminal(&std::io::stderr())
            && std::env::var_os("NO_COLOR").is_none();
        let theme = if terminal { GraphicalTheme::unicode() } else { GraphicalTheme::none() };
        // A narrow report breaks paths and numbers; files and pipes have no width.
        let width = if terminal { 100 } else { 400 };
        let handler =
            GraphicalReportHandler::new_themed(theme).with_width(width).with_context_lines(1);
        let message = |problem: &Problem| {
            let mut text = String::new();
            match handler.render_report(&mut text, problem) {
                Ok(()) => text.trim_end_matches('\n').to_owned(),
                Err(_) => problem.to_string(),
            }
        };
        let messages: Vec<String> = self.problems.iter().map(message).collect();
        messages.join("\n")
    }
}

impl From<Problem> for Exit {
    fn from(problem: Problem) -> Exit {
        Exit::problems(BAD_INPUT, vec![problem])
    }
}

impl From<CaseError> for Exit {
    fn from(error: CaseError) -> Exit {
        match error {
            CaseError::Unreadable { ref source, .. } => {
                let (code, help) = match source.kind() {
                    ErrorKind::NotFound | ErrorKind::IsADirectory => (
                        BAD_INPUT,
                        "give the path of a case file, for example cases/dkt-pair/quick.toml",
                    ),
                    ErrorKind::InvalidData | ErrorKind::InvalidInput | ErrorKind::FileTooLarge => {
                        (BAD_INPUT, "a case file is a TOML text in UTF-8")
                    }
                    _ => (IO, "check the file and its permissions"),
                };
                Exit::with_help(code, error.to_string(), help)
            }
            CaseError::Invalid(problems) => Exit::problems(BAD_INPUT, problems),
            CaseError::Interrupted => Exit::new(INTERRUPTED, error.to_string()),
        }
    }
}

impl From<RunError> for Exit {
    fn from(error: RunError) -> Exit {
        let help = match &error {
            RunError::Io { source, .. } => Some(match source.kind() {
                ErrorKind::StorageFull => {
                    "the disk is full: free some space, then continue with --resume"
                }
                ErrorKind::FileTooLarge => {
                    "the file exceeds the limit of this shell (ulimit -f) or of the file system: raise it, then continue with --resume"
                }
                ErrorKind::QuotaExceeded => {
                    "your disk quota is used up: free some space, then continue with --resume"
                }
                _ => "check the folder and its permissions; continue a started run with --resume",
            }),
            _ => None,
        };
        Exit::with_hint(exit_code(error.kind()), error, help)
    }
}

impl From<ShapeError> for Exit {
    fn from(error: ShapeError) -> Exit {
        let code = match &error {
            ShapeError::Io { source, .. } => match source.kind() {
                ErrorKind::NotFound | ErrorKind::InvalidInput => BAD_INPUT,
                _ => IO,
            },
            _ => BAD_INPUT,
        };
        Exit::with_hint(code, &error, shape_help(&error))
    }
}

/// Returns the options that may remedy a refused shape.
pub fn shape_help(error: &ShapeError) -> Option<String> {
    let help = match error {
        ShapeError::EmptyVolume | ShapeError::SolidVolume => {
            "check the grey values of the image; a grey image needs --threshold VALUE, otsu or otsu3"
        }
        ShapeError::MedianWithoutThreshold => {
            "add --threshold otsu or a grey value, or omit --median for an image of labels"
        }
        ShapeError::CutByBorder { label, faces } if faces.split(", ").count() == 6 => {
            return Some(format!(
                "if label {label} is a whole phase: --split treats each piece as a grain, --separate also separates touching grains; if it is one grain: --pad includes it, truncated at the border; if the grains are darker than the void, invert the grey values first (ImageJ: Edit > Invert; NumPy: image.max() - image)"
            ));
        }
        ShapeError::CutByBorder { .. } | ShapeError::CutByView { .. } => {
            "scan a larger region; if the crop is merely tight, --pad includes the grain, truncated there"
        }
        ShapeError::SeveralPieces { label, .. } => {
            return Some(format!(
                "if label {label} is a whole phase: --split treats each piece as a grain, --separate also separates touching grains; if it is one grain: --largest-piece keeps the largest"
            ));
        }
        ShapeError::Quality { cells: Some(cells), .. } => {
            return Some(format!("--cells {cells} resolves it"));
        }
        ShapeError::InsideOut { .. } => "--flip inverts its normals",
        ShapeError::TooFewVoxels { .. } => "scan at a higher resolution, or omit the grain",
        ShapeError::Malformed { .. } => {
            "copy or export the file again; if another program opens it, save it uncompressed"
        }
        _ => return None,
    };
    Some(help.into())
}

impl From<std::io::Error> for Exit {
    fn from(error: std::io::Error) -> Exit {
        Exit::new(IO, error.to_string())
    }
}

impl From<serde_json::Error> for Exit {
    fn from(error: serde_json::Error) -> Exit {
        Exit::new(IO, error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_internal_error() {
        let exit = without_panic(|| panic!("planned by a test")).unwrap_err();
        assert_eq!(exit.code, 3);
        let message = exit.messages();
        assert!(message.contains("internal error") && message.contains("/issues"), "{message}");
        assert!(without_panic(|| Ok(())).is_ok());
        assert_eq!(without_panic(|| Err(Exit::input("bad"))).unwrap_err().code, BAD_INPUT);
    }
}
