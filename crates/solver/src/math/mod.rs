//! Small mathematics shared by every layer: poses and dense 6 x 6 systems.

mod pose;

pub use pose::{Load, Pose};
