//! Grain: a shared shape, density, material, pose, velocities, and the constraints of its motion.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use grainwake_shape::Shape;
use serde::{Deserialize, Serialize};

use crate::math::{Pose, RigidVelocity};

/// Whether the three components of a velocity follow the equations of motion or are prescribed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum MotionConstraint {
    /// Newton's or Euler's equation determines the velocity.
    Free,
    /// Velocity [m/s] or angular velocity [rad/s, space frame] over the next step; zero holds the
    /// grain still.
    Prescribed(DVec3),
}

impl MotionConstraint {
    /// Prescribed velocity, or `free` if the velocity is free.
    pub(super) fn velocity(self, free: DVec3) -> DVec3 {
        match self {
            MotionConstraint::Free => free,
            MotionConstraint::Prescribed(velocity) => velocity,
        }
    }
}

/// Elastic constants and restitution of one body; the linear contact law does not use them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus E [Pa]; infinite for a rigid body.
    pub youngs_modulus: f64,
    /// Poisson ratio nu.
    pub poisson_ratio: f64,
    /// Coefficient of restitution; a pair takes the smaller of its two values.
    pub restitution: f64,
}

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

/// One grain. Velocities are at integer time levels, in the space frame.
#[derive(Clone, Debug)]
pub struct Grain {
    /// Shape, shared between grains of equal shape.
    pub shape: Arc<Shape>,
    /// Density [kg/m^3].
    pub density: f64,
    /// Material, for contact laws with elastic constants.
    pub material: Material,
    /// Position and orientation.
    pub pose: Pose,
    /// Velocity of the centroid [m/s].
    pub velocity: DVec3,
    /// Angular velocity, space frame [rad/s].
    pub angular_velocity: DVec3,
    /// Translational degrees of freedom.
    pub translation: MotionConstraint,
    /// Rotational degrees of freedom.
    pub rotation: MotionConstraint,
    /// Normal axis of the plane in which the grain moves, in a flow with one cell along this axis:
    /// where its motion is free, it does not move along the axis, and turns about it only.
    pub plane_normal: Option<usize>,
}

impl Grain {
    /// Returns whether the grain has left the box.
    pub fn has_left(&self) -> bool {
        self.pose.position == DVec3::INFINITY
    }
    /// Velocity and angular velocity, space frame.
    pub fn rigid_velocity(&self) -> RigidVelocity {
        RigidVelocity { linear: self.velocity, angular: self.angular_velocity }
    }
    /// The degrees of freedom that follow the equations of motion: translation along x, y and z,
    /// then rotation about x, y and z.
    pub fn free_axes(&self) -> [bool; 6] {
        let free = [self.translation, self.rotation].map(|c| c == MotionConstraint::Free);
        // In a plane, the grain moves along two axes and turns about the third.
        let fits = |n: usize| self.plane_normal.is_none_or(|axis| (n < 3) != (n % 3 == axis));
        std::array::from_fn(|n| free[n / 3] && fits(n))
    }
    /// A vector less its component out of the plane of motion.
    pub fn in_plane(&self, mut vector: DVec3) -> DVec3 {
        if let Some(normal) = self.plane_normal {
            vector[normal] = 0.0;
        }
        vector
    }
    /// An angular velocity less the components about axes in the plane of motion.
    pub(super) fn spin_in_plane(&self, omega: DVec3) -> DVec3 {
        self.plane_normal.map_or(omega, |normal| omega[normal] * DVec3::AXES[normal])
    }
    /// Mass [kg].
    pub fn mass(&self) -> f64 {
        self.density * self.shape.volume()
    }
    /// Inertia tensor in the space frame [kg m^2].
    pub fn inertia(&self) -> DMat3 {
        let rotation = DMat3::from_quat(self.pose.orientation);
        rotation * DMat3::from_diagonal(self.principal_inertia()) * rotation.transpose()
    }
    /// Angular acceleration [rad/s^2] of a grain at rest under a torque [N m] about its centroid,
    /// or change of its angular velocity by an angular impulse; space frame.
    pub fn angular_response(&self, torque: DVec3) -> DVec3 {
        match self.plane_normal {
            Some(n) => torque[n] / self.inertia().col(n)[n] * DVec3::AXES[n],
            None => self.inertia().inverse() * torque,
        }
    }
    /// Principal moments of inertia [kg m^2].
    pub fn principal_inertia(&self) -> DVec3 {
        self.shape.inertia() * self.density
    }
    /// Inverse of the mass and the added mass of fluid, `added_density` [kg/m^3] times the volume;
    /// zero if the translation is prescribed [1/kg].
    pub(super) fn inverse_mass(&self, added_density: f64) -> f64 {
        match self.translation {
            MotionConstraint::Free => 1.0 / (self.mass() + added_density * self.shape.volume()),
            MotionConstraint::Prescribed(_) => 0.0,
        }
    }
    /// Rigid velocity V + Omega x (x - X) at a point of the space frame [m/s].
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        self.rigid_velocity().at(x - self.pose.position)
    }
}
