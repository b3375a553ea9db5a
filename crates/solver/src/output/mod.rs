//! The run folder: tables, pictures, checkpoints, and the loop that fills it.

mod plan;
mod summary;

pub use plan::{Place, Plane, RunPlan, Stop};
pub use summary::{GrainSummary, PairSummary, Summary};
