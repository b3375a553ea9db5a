//! Contact force laws: properties of a pair, the interface of the laws, and the linear law of the
//! paper (Eqs 9 and 14).

use std::f64::consts::PI;
use std::fmt::Debug;

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
}

/// Properties of one body of a pair, a grain or a wall.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct BodyProperties {
    /// Inverse of the mass, with added mass [1/kg]; zero for a wall.
    pub inverse_mass: f64,
    /// Radius of the equal-volume sphere [m]; infinite for a wall.
    pub radius: f64,
    /// Share of the body in the normal compliance, (1 - nu^2) / E [1/Pa].
    pub normal_compliance: f64,
    /// Share in the tangential compliance, (2 - nu) / G with G = E / (2 (1 + nu)) [1/Pa].
    pub tangential_compliance: f64,
    /// Damping ratio of the restitution.
    pub damping_ratio: f64,
}

impl PairProperties {
    /// Properties of a grain `a` and its partner `b`.
    pub fn new(a: &BodyProperties, b: &BodyProperties) -> PairProperties {
        let reduced_radius = if b.radius.is_finite() {
            a.radius * b.radius / (a.radius + b.radius)
        } else {
            a.radius
        };
        PairProperties {
            inverse_mass: a.inverse_mass + b.inverse_mass,
            reduced_radius,
            effective_youngs_modulus: 1.0 / (a.normal_compliance + b.normal_compliance),
            effective_shear_modulus: 1.0 / (a.tangential_compliance + b.tangential_compliance),
            damping_ratio: a.damping_ratio.max(b.damping_ratio),
        }
    }

    /// Coefficient [N s/m] of a dashpot beside a spring of `stiffness` [N/m]; zero if neither body
    /// can move.
    pub(super) fn dashpot(&self, damping_ratio: f64, stiffness: f64) -> f64 {
        let is_movable = self.inverse_mass > 0.0;
        if is_movable { 2.0 * damping_ratio * (stiffness / self.inverse_mass).sqrt() } else { 0.0 }
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
/// A law sees the effective overlap of the pair. `ContactModel` distributes the pair's force over
/// the penetrating points and applies Coulomb's bound.
pub(in crate::dem) trait ContactLaw: Debug + Send + Sync {
    /// Forces and coefficients at `overlap` [m], positive.
    fn coefficients(&self, pair: &PairProperties, overlap: f64) -> ContactCoefficients;

    /// Normal force [N], positive in compression, of the elastic force and of a dashpot with the
    /// coefficient `damping` [N s/m] at the closing speed `approach` [m/s]; a law without cohesion
    /// does not pull.
    fn normal_force(&self, elastic_force: f64, damping: f64, approach: f64) -> f64 {
        (elastic_force + damping * approach).max(0.0)
    }

    /// Duration of an undamped contact [s] that is closing at `speed` [m/s] at `overlap` [m].
    fn contact_time(&self, pair: &PairProperties, speed: f64, overlap: f64) -> f64;

    /// Largest overlap [m] of an undamped impact at `speed` [m/s].
    fn impact_overlap(&self, pair: &PairProperties, speed: f64) -> f64;
}

/// Linear normal and tangential springs, and dashpots that give a constant restitution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear {
    /// k_n [N/m].
    pub normal_stiffness: f64,
    /// k_zeta [N/m].
    pub tangential_stiffness: f64,
    /// Damping ratio of the restitution.
    pub damping_ratio: f64,
    /// Tangential over normal dashpot.
    pub tangential_damping_ratio: f64,
}

impl ContactLaw for Linear {
    fn coefficients(&self, pair: &PairProperties, overlap: f64) -> ContactCoefficients {
        let k = self.normal_stiffness;
        ContactCoefficients {
            normal_force: k * overlap,
            normal_energy: 0.5 * k * overlap * overlap,
            normal_damping: pair.dashpot(self.damping_ratio, k),
            tangential_stiffness: self.tangential_stiffness,
            tangential_damping_ratio: self.tangential_damping_ratio,
        }
    }

    /// Half period of the spring, pi sqrt(m / k_n).
    fn contact_time(&self, pair: &PairProperties, _speed: f64, _overlap: f64) -> f64 {
        PI * (1.0 / pair.inverse_mass / self.normal_stiffness).sqrt()
    }

    fn impact_overlap(&self, pair: &PairProperties, speed: f64) -> f64 {
        speed * (1.0 / pair.inverse_mass / self.normal_stiffness).sqrt()
    }
}
