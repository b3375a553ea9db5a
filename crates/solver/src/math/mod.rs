//! Small mathematics shared by every layer: poses and dense 6 x 6 systems.

mod linear;
mod pose;

pub use linear::{Matrix6, Vector6, solve6};
pub use pose::{Load, Pose};
