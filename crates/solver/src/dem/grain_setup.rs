//! Set-up of a grain and its material; energy and momentum of a grain.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use grainwake_shape::Shape;

use super::grain::{Grain, Material, MotionConstraint};
use crate::math::Pose;

impl Default for Material {
    /// Quartz without dissipation.
    fn default() -> Self {
        Material { youngs_modulus: 7e10, poisson_ratio: 0.17, restitution: 1.0 }
    }
}

impl Material {
    /// Undeformable body: the contact takes the elasticity and the restitution of its partner.
    pub const RIGID: Material =
        Material { youngs_modulus: f64::INFINITY, poisson_ratio: 0.0, restitution: 1.0 };
}

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
    /// Holds the grain still.
    pub fn held(mut self) -> Grain {
        self.hold();
        self
    }
    /// Kinetic energy of translation and rotation [J].
    pub fn kinetic_energy(&self) -> f64 {
        let omega = self.pose.orientation.conjugate() * self.angular_velocity;
        0.5 * self.mass() * self.velocity.length_squared()
            + 0.5 * omega.dot(self.principal_inertia() * omega)
    }
    /// Linear momentum [kg m/s].
    pub fn momentum(&self) -> DVec3 {
        self.mass() * self.velocity
    }
    /// Angular momentum about the point `about` [kg m^2/s, space frame].
    pub fn angular_momentum(&self, about: DVec3) -> DVec3 {
        let omega = self.pose.orientation.conjugate() * self.angular_velocity;
        (self.pose.position - about).cross(self.momentum())
            + self.pose.orientation * (self.principal_inertia() * omega)
    }
}
