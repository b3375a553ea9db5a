//! Validation: cases with references and bounds.
//!
//! A [`Suite`] is a folder with `validation.toml`: runs of case files, and for each run checks of
//! values measured in its tables ([`Measure`]) against references and bounds. [`Suite::evaluate`]
//! measures a run folder and returns [`CheckResult`]s; each [`FigureSpec`] shows results beside the
//! reference data. [`Library`] opens all suites: those of a folder, or those in the program.
//! `docs/reference/validation-file.md` describes the keys of the file.

mod check;
mod check_result;
mod columns;
mod expression;
mod figure;
mod library;
mod measurement;
mod problem;
mod signal;
mod suite;

pub use check::{Bounds, Check, Level, Reference, SuiteRun};
pub use check_result::CheckResult;
pub use columns::TableSource;
pub use figure::{DrawnFigure, FigureSpec};
pub use library::Library;
pub use measurement::{Measure, Sampling};
pub use suite::{Suite, SuiteError};
