//! The run folder: tables, pictures, checkpoints, and the loop that fills it.
//!
//! [`run()`] takes a [`Job`] and a folder. What it writes is listed in `docs/reference/run-folder.md`.

pub mod checkpoint;
mod compare;
mod error;
mod file;
mod folder;
pub mod lock;
mod meetings;
mod pictures;
mod plan;
pub mod provenance;
mod pvd;
mod recorder;
mod run;
mod summary;
mod tables;
pub mod vti;
mod vtp;

pub use error::RunError;
pub use folder::{Existing, RESOLVED, SUMMARY, read_summary};
pub use plan::{Place, Plane, RunPlan, Stop};
pub use pvd::Picture;
pub use run::{Ending, Job, Observer, Options, Progress, Silent, run};
pub use summary::{GrainSummary, PairSummary, Summary};
pub use tables::{DIAGNOSTICS_HEADER, GRAINS_HEADER, Lengths};
