//! Mathematics shared by all layers: poses, dense 6 x 6 systems, formulas.

mod cache;
mod formula;
mod linear;
mod pose;

pub(crate) use cache::last_cache;
pub use formula::Formula;
pub(crate) use grainwake_simd::{Aligned, Real};
pub use grainwake_simd::{InstructionSet, Precision, instructions, limit_instructions};
pub(crate) use linear::{Matrix6, Vector6, solve6};
pub use pose::{Load, Pose};
