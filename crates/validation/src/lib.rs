//! Validation: cases with reference data and bounds.
//!
//! A [`Suite`] is a folder with `validation.toml`: runs of case files, and for each run checks of
//! numbers taken from its tables ([`Take`]) against references. [`Suite::judge`] measures the run
//! folders that the ordinary runner left and gives [`Verdict`]s; each [`Figure`] draws them beside
//! the reference data. The file's keys are described in
//! `validation/README.md`.

mod figure;
mod judge;
mod measure;
mod signal;
mod suite;
mod table;

pub use figure::{Drawn, Figure};
pub use judge::Verdict;
pub use measure::{Take, Window};
pub use suite::{Check, Level, Reference, Run, Suite, SuiteError};
