//! Figures and pages from run folders.
mod error;
mod figure;
mod run_folder;
#[cfg(test)]
mod testing;
pub use error::ReportError;
