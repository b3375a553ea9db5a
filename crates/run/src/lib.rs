//! Runs of Grainwake: case files, the run loop, and the run folder.
//!
//! [`case::Case`] reads and validates a case file; [`run()`] takes its [`Job`], steps the
//! simulation and fills a folder with tables, VTK files, checkpoints and a summary.
//! `docs/reference/run-folder.md` lists the files.
//!
//! Layers, downwards: `case` -> `run_loop` -> `recording` -> `recorder`, `memory` -> `run_folder`,
//! `contact_events`, `series`, `watch` -> `overlaps`, `contact_work`, `meter`, `queue`, `threads`,
//! `plan`, `error`, `grain_size` -> `number_format`.

pub mod case;
mod contact_events;
mod contact_work;
mod error;
mod grain_size;
mod job;
mod memory;
mod meter;
pub mod number_format;
mod overlaps;
mod plan;
pub mod queue;
mod recorder;
mod recording;
mod run_folder;
mod run_loop;
mod series;
pub mod threads;
mod watch;

pub use error::{FailureKind, RunError};
pub use grain_size::check_grain_size;
pub use job::{Job, Options};
pub use memory::admit_memory;
pub use plan::{Plane, PlanePosition, Probe, ProbePlace, RunPlan, Stop};
pub use recording::Recording;
pub use run_folder::{Existing, Parent, RESOLVED, checkpoint, lock, provenance};
pub use run_loop::{Ending, Observer, Progress, Silent, run};
pub use watch::Watch;
