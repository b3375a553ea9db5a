//! Grain: a shared shape, density, material, pose and velocities.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
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
        (self.velocity, self.angular_velocity) = (DVec3::ZERO, DVec3::ZERO);
        (self.translation, self.rotation) =
            (MotionConstraint::Prescribed(DVec3::ZERO), MotionConstraint::Prescribed(DVec3::ZERO));
        self
    }
    /// Removes the grain from the box: it is at rest at infinity from now on.
    pub fn leave(&mut self) {
        self.pose.position = DVec3::INFINITY;
        (self.velocity, self.angular_velocity) = (DVec3::ZERO, DVec3::ZERO);
    }
    /// Returns whether the grain has left the box.
    pub fn has_left(&self) -> bool {
        self.pose.position == DVec3::INFINITY
    }
    /// Velocity and angular velocity, space frame.
    pub fn rigid_velocity(&self) -> RigidVelocity {
        RigidVelocity { linear: self.velocity, angular: self.angular_velocity }
    }
    /// Mass [kg].
    pub fn mass(&self) -> f64 {
        self.density * self.shape.volume()
    }
    /// Inertia tensor in the space frame [kg m^2].
    pub fn inertia(&self) -> DMat3 {
        let rotation = DMat3::from_quat(self.pose.orientation);
        rotation * DMat3::from_diagonal(self.shape.inertia() * self.density) * rotation.transpose()
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
    /// Rigid velocity V + Omega x (x - X) at a point of the space frame [m/s].
    pub fn velocity_at(&self, x: DVec3) -> DVec3 {
        self.velocity + self.angular_velocity.cross(x - self.pose.position)
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

    /// Share of this body in the normal compliance of a contact, (1 - nu^2) / E [1/Pa].
    pub(super) fn normal_compliance(&self) -> f64 {
        (1.0 - self.poisson_ratio * self.poisson_ratio) / self.youngs_modulus
    }

    /// Share of this body in the tangential compliance of a contact, (2 - nu) / G [1/Pa] with the
    /// shear modulus G = E / (2 (1 + nu)).
    pub(super) fn tangential_compliance(&self) -> f64 {
        2.0 * (2.0 - self.poisson_ratio) * (1.0 + self.poisson_ratio) / self.youngs_modulus
    }
}

/// Restitution below which the dashpot grows no further.
pub(super) const MIN_RESTITUTION: f64 = 0.05;

/// Damping ratio zeta = c / (2 sqrt(k m)) of a spring and dashpot that give the coefficient of
/// restitution e if the contact ends where its force vanishes (Schwager & Poeschel 2007).
///
/// A dry contact cannot pull. With zeta = sin(theta), e = exp(-tan(theta) (pi - 2 theta)); with
/// zeta = cosh(u), e = exp(-2 u / tanh(u)).
pub(super) fn damping_ratio(restitution: f64) -> f64 {
    let log_loss = -restitution.clamp(MIN_RESTITUTION, 1.0).ln();
    if log_loss == 0.0 {
        return 0.0;
    }
    let bisect = |mut low: f64, mut high: f64, exponent: &dyn Fn(f64) -> f64| {
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if exponent(middle) < log_loss { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let pi = std::f64::consts::PI;
    if log_loss < 2.0 {
        bisect(0.0, 0.5 * pi - 1e-9, &|theta| theta.tan() * (pi - 2.0 * theta)).sin()
    } else {
        bisect(1e-9, 20.0, &|u| 2.0 * u / u.tanh()).cosh()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rebound speed of a unit oscillator with dashpot, released where the force vanishes.
    fn rebound(zeta: f64) -> f64 {
        let (mut x, mut v, dt) = (0.0f64, 1.0f64, 1e-5);
        loop {
            let a = -x - 2.0 * zeta * v;
            let (xm, vm) = (x + 0.5 * dt * v, v + 0.5 * dt * a);
            let am = -xm - 2.0 * zeta * vm;
            x += dt * vm;
            v += dt * am;
            if x + 2.0 * zeta * v <= 0.0 {
                return -v;
            }
        }
    }

    #[test]
    fn damping_ratio_gives_the_restitution_of_a_contact_that_cannot_pull() {
        for restitution in [0.97, 0.9, 0.5, 0.2, 0.08] {
            let measured = rebound(damping_ratio(restitution));
            assert!((measured - restitution).abs() < 1e-4, "{restitution}: {measured}");
        }
        assert_eq!(damping_ratio(1.0), 0.0);
    }
}
