//! Small mathematics shared by every layer: poses, dense 6 x 6 systems, vector registers, formulas.

mod aligned;
mod cache;
mod formula;
pub(crate) mod lanes;
mod linear;
mod pose;
mod real;

pub(crate) use aligned::Aligned;
pub(crate) use cache::last_cache;
pub use formula::Formula;
pub use linear::{Matrix6, Vector6, solve6};
pub use pose::{Load, Pose};
pub use real::Precision;
pub(crate) use real::Real;
