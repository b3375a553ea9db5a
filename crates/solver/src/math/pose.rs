//! Position and orientation of a body, force and torque on it.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Position of the centroid and orientation (rotates body vectors into the space frame).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Centroid in the space frame [m].
    pub position: DVec3,
    /// Unit quaternion, body -> space.
    pub orientation: DQuat,
}

impl Pose {
    /// Transforms a point from the space frame to the body frame [m].
    pub fn to_body(&self, x: DVec3) -> DVec3 {
        self.orientation.conjugate() * (x - self.position)
    }
    /// Transforms a point from the body frame to the space frame [m].
    pub fn to_space(&self, x: DVec3) -> DVec3 {
        self.position + self.orientation * x
    }
}

/// A force [N] and a torque about the centroid [N m], both in the space frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Force [N].
    pub force: DVec3,
    /// Torque about the centroid [N m].
    pub torque: DVec3,
}

impl Load {
    /// Whether force and torque are both zero.
    pub fn is_zero(&self) -> bool {
        *self == Load::default()
    }
}

impl std::ops::Add for Load {
    type Output = Load;
    fn add(self, other: Load) -> Load {
        Load { force: self.force + other.force, torque: self.torque + other.torque }
    }
}
impl std::ops::AddAssign for Load {
    fn add_assign(&mut self, other: Load) {
        *self = *self + other;
    }
}
impl std::ops::Mul<f64> for Load {
    type Output = Load;
    fn mul(self, factor: f64) -> Load {
        Load { force: self.force * factor, torque: self.torque * factor }
    }
}
