//! Interface of the contact force laws: properties of a pair, and coefficients at an overlap.

use crate::dem::material::{Material, damping_ratio};

/// Elastic constants of one body as contact laws use them.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::dem) struct ContactMaterial {
    /// (1 - nu^2) / E [1/Pa].
    normal_compliance: f64,
    /// (2 - nu) / G [1/Pa].
    tangential_compliance: f64,
    /// Damping ratio of the restitution.
    damping_ratio: f64,
}

impl ContactMaterial {
    /// Constants of a material.
    pub fn new(material: &Material) -> ContactMaterial {
        ContactMaterial {
            normal_compliance: material.normal_compliance(),
            tangential_compliance: material.tangential_compliance(),
            damping_ratio: damping_ratio(material.restitution),
        }
    }
}

/// Properties of a pair that do not change during a contact.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct PairProperties {
    /// 1/m_a + 1/m_b [1/kg], with added mass.
    pub inverse_mass: f64,
    /// Reduced radius of the equal-volume spheres, R_a R_b / (R_a + R_b); R_a at a wall [m].
    pub reduced_radius: f64,
    /// Effective Young's modulus E*, 1/E* = (1 - nu_a^2)/E_a + (1 - nu_b^2)/E_b [Pa].
    pub effective_youngs_modulus: f64,
    /// Effective shear modulus G*, 1/G* = (2 - nu_a)/G_a + (2 - nu_b)/G_b [Pa].
    pub effective_shear_modulus: f64,
    /// Damping ratio: the larger one of the two bodies.
    pub damping_ratio: f64,
    /// Whether the partner is a wall.
    pub partner_is_wall: bool,
}

/// Properties of one body of a pair.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct BodyProperties {
    /// Inverse of the mass, with added mass [1/kg].
    pub inverse_mass: f64,
    /// Radius of the equal-volume sphere [m].
    pub radius: f64,
    /// Elastic constants.
    pub material: ContactMaterial,
}

impl PairProperties {
    /// Properties of two grains.
    pub fn of_grains(a: &BodyProperties, b: &BodyProperties) -> PairProperties {
        PairProperties {
            inverse_mass: a.inverse_mass + b.inverse_mass,
            reduced_radius: a.radius * b.radius / (a.radius + b.radius),
            partner_is_wall: false,
            ..PairProperties::of_materials(&a.material, &b.material)
        }
    }

    /// Properties of a grain and a plane wall, whose mass and radius are infinite.
    pub fn with_wall(grain: &BodyProperties, wall: &ContactMaterial) -> PairProperties {
        PairProperties {
            inverse_mass: grain.inverse_mass,
            reduced_radius: grain.radius,
            partner_is_wall: true,
            ..PairProperties::of_materials(&grain.material, wall)
        }
    }

    /// Elastic constants of a pair; mass and radius are zero.
    fn of_materials(a: &ContactMaterial, b: &ContactMaterial) -> PairProperties {
        PairProperties {
            inverse_mass: 0.0,
            reduced_radius: 0.0,
            effective_youngs_modulus: 1.0 / (a.normal_compliance + b.normal_compliance),
            effective_shear_modulus: 1.0 / (a.tangential_compliance + b.tangential_compliance),
            damping_ratio: a.damping_ratio.max(b.damping_ratio),
            partner_is_wall: false,
        }
    }
}

/// Forces and coefficients of a pair at one overlap.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::dem) struct ContactCoefficients {
    /// Normal force without dashpot [N].
    pub normal_force: f64,
    /// Energy of the normal spring [J].
    pub normal_energy: f64,
    /// Coefficient of the normal dashpot [N s/m].
    pub normal_damping: f64,
    /// Tangential stiffness k_zeta [N/m]; zero: no friction.
    pub tangential_stiffness: f64,
    /// Tangential over normal dashpot.
    pub tangential_damping_ratio: f64,
}

/// Force law of a pair.
///
/// A law sees the deepest overlap of the pair. The pair's force is distributed over the penetrating
/// points by `ContactModel`, which also applies Coulomb's bound.
pub(in crate::dem) trait ContactLaw {
    /// Forces and coefficients at `overlap` [m], positive.
    fn coefficients(&self, pair: &PairProperties, overlap: f64) -> ContactCoefficients;

    /// Normal force [N], positive in compression, for the closing speed `approach` [m/s]; a law
    /// without cohesion does not pull.
    fn normal_force(&self, at: &ContactCoefficients, damping: f64, approach: f64) -> f64 {
        (at.normal_force + damping * approach).max(0.0)
    }

    /// Duration of an undamped contact [s] that is closing at `speed` [m/s] at `overlap` [m].
    fn contact_time(&self, pair: &PairProperties, speed: f64, overlap: f64) -> f64;

    /// Largest overlap [m] of an undamped impact at `speed` [m/s].
    fn impact_overlap(&self, pair: &PairProperties, speed: f64) -> f64;
}
