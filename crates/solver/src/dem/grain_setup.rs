//! Set-up of a grain, and its removal.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use grainwake_shape::Shape;

use super::grain::{Grain, Material, MotionConstraint};
use crate::math::{Pose, RigidVelocity};

impl Grain {
    /// Free grain of `density` [kg/m^3] at rest at the origin.
    pub fn new(shape: impl Into<Arc<Shape>>, density: f64) -> Grain {
        Grain {
            shape: shape.into(),
            density,
            material: Material::default(),
            pose: Pose { position: DVec3::ZERO, orientation: DQuat::IDENTITY },
            velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            translation: MotionConstraint::Free,
            rotation: MotionConstraint::Free,
            plane_normal: None,
        }
    }
    /// Replaces the position of the centroid [m].
    pub fn with_position(mut self, position: DVec3) -> Grain {
        self.pose.position = position;
        self
    }
    /// Replaces the orientation (body frame to space frame).
    pub fn with_orientation(mut self, orientation: DQuat) -> Grain {
        self.pose.orientation = orientation;
        self
    }
    /// Replaces the material.
    pub fn with_material(mut self, material: Material) -> Grain {
        self.material = material;
        self
    }
    /// Replaces the initial velocity of the centroid [m/s].
    pub fn with_velocity(mut self, velocity: DVec3) -> Grain {
        self.velocity = velocity;
        self
    }
    /// Replaces the initial angular velocity, space frame [rad/s].
    pub fn with_angular_velocity(mut self, angular_velocity: DVec3) -> Grain {
        self.angular_velocity = angular_velocity;
        self
    }
    /// Sets both velocities to zero and prescribes them.
    pub(super) fn hold(&mut self) {
        (self.velocity, self.angular_velocity) = (DVec3::ZERO, DVec3::ZERO);
        let held = MotionConstraint::Prescribed(DVec3::ZERO);
        (self.translation, self.rotation) = (held, held);
    }
    /// Removes the grain from the box: it is held at rest at infinity from now on.
    pub fn leave(&mut self) {
        self.pose.position = DVec3::INFINITY;
        self.hold();
    }
    /// Holds the grain still.
    pub fn held(mut self) -> Grain {
        self.hold();
        self
    }
    /// Whether a free velocity would take the grain out of the plane with this normal axis.
    pub fn leaves_plane(&self, normal: usize) -> bool {
        let RigidVelocity { linear, mut angular } = self.rigid_velocity();
        angular[normal] = 0.0;
        self.translation == MotionConstraint::Free && linear[normal] != 0.0
            || self.rotation == MotionConstraint::Free && angular != DVec3::ZERO
    }
}
