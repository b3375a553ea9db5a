//! Material of a grain or wall.

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
