//! Interface of the contact force laws, and the choice among them.

use super::hertz_mindlin::HertzMindlin;
use super::linear::Linear;
use super::params::{ContactLawKind, ContactParams};
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
    pub wall: bool,
}

impl PairProperties {
    /// Properties of two bodies with the given inverse masses [1/kg] and radii [m].
    pub fn new(
        inverse_mass: [f64; 2],
        radius: [f64; 2],
        material: [&ContactMaterial; 2],
        wall: bool,
    ) -> PairProperties {
        let [a, b] = material;
        PairProperties {
            inverse_mass: inverse_mass[0] + inverse_mass[1],
            reduced_radius: if wall {
                radius[0]
            } else {
                radius[0] * radius[1] / (radius[0] + radius[1])
            },
            effective_youngs_modulus: 1.0 / (a.normal_compliance + b.normal_compliance),
            effective_shear_modulus: 1.0 / (a.tangential_compliance + b.tangential_compliance),
            damping_ratio: a.damping_ratio.max(b.damping_ratio),
            wall,
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

/// Law selected by the parameters.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) enum SelectedLaw {
    /// Linear spring and dashpot.
    Linear(Linear),
    /// Hertz-Mindlin.
    HertzMindlin(HertzMindlin),
}

impl SelectedLaw {
    /// Law of these parameters.
    pub fn new(params: &ContactParams) -> SelectedLaw {
        match params.law {
            ContactLawKind::Linear => SelectedLaw::Linear(Linear::new(params)),
            ContactLawKind::HertzMindlin => SelectedLaw::HertzMindlin(HertzMindlin),
        }
    }
}

macro_rules! delegate {
    ($law:expr, $method:ident($($argument:expr),*)) => {
        match $law {
            SelectedLaw::Linear(law) => law.$method($($argument),*),
            SelectedLaw::HertzMindlin(law) => law.$method($($argument),*),
        }
    };
}

impl ContactLaw for SelectedLaw {
    fn coefficients(&self, pair: &PairProperties, overlap: f64) -> ContactCoefficients {
        delegate!(self, coefficients(pair, overlap))
    }
    fn normal_force(&self, at: &ContactCoefficients, damping: f64, approach: f64) -> f64 {
        delegate!(self, normal_force(at, damping, approach))
    }
    fn contact_time(&self, pair: &PairProperties, speed: f64, overlap: f64) -> f64 {
        delegate!(self, contact_time(pair, speed, overlap))
    }
    fn impact_overlap(&self, pair: &PairProperties, speed: f64) -> f64 {
        delegate!(self, impact_overlap(pair, speed))
    }
}
