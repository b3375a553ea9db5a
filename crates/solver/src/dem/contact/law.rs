//! Contact force laws: properties of a pair, the interface of the laws, the linear law of the paper
//! (Eqs 9 and 14) and Hertz-Mindlin.

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
    fn dashpot(&self, damping_ratio: f64, stiffness: f64) -> f64 {
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

/// Duration T of a Hertz impact over pi sqrt(m / S_n), with the stiffness S_n at the largest
/// overlap (Timoshenko & Goodier 1970, section 142).
///
/// ```text
/// T                = 2.9432 overlap / speed
/// pi sqrt(m / S_n) = pi sqrt(8/15) overlap / speed
/// ```
const HERTZ_DURATION: f64 = 2.943_275 / (PI * 0.730_296_743_340_221_5);

/// Hertz normal law and no-slip Mindlin tangential law. Moduli, radius and restitution come from
/// the pair.
///
/// The law applies to the equal-volume spheres of the pair: the radius of curvature is the reduced
/// radius of these spheres, not the local curvature at the contact, which a sampled distance field
/// does not resolve. It is exact for spheres.
#[derive(Clone, Copy, Debug)]
pub(super) struct HertzMindlin;

impl ContactLaw for HertzMindlin {
    /// Coefficients at the overlap delta, with the tangential stiffness of Mindlin (1949).
    ///
    /// ```text
    /// a   = sqrt(R* delta)                contact radius
    /// F_n = 4/3 E* a delta                normal force
    /// S_n = 2 E* a                        normal stiffness dF_n / d delta
    /// S_t = 8 G* a                        tangential stiffness
    /// c   = 2 zeta sqrt(5/6) sqrt(S m*)   dashpot, S = S_n or S_t
    /// ```
    ///
    /// The dashpot is Tsuji's (1992). In the variable delta^(5/4) the damped Hertz impact is a
    /// damped linear oscillator (Antypov & Elliott 2011), with the same end of contact at zero
    /// force, so the damping ratio of the linear law gives the restitution here as well.
    fn coefficients(&self, pair: &PairProperties, overlap: f64) -> ContactCoefficients {
        let contact_radius = (pair.reduced_radius * overlap).sqrt();
        let normal_force = 4.0 / 3.0 * pair.effective_youngs_modulus * contact_radius * overlap;
        let normal_stiffness = 2.0 * pair.effective_youngs_modulus * contact_radius;
        let tangential_stiffness = 8.0 * pair.effective_shear_modulus * contact_radius;
        ContactCoefficients {
            normal_force,
            normal_energy: 0.4 * normal_force * overlap,
            normal_damping: pair.dashpot(pair.damping_ratio, 5.0 / 6.0 * normal_stiffness),
            tangential_stiffness,
            tangential_damping_ratio: (tangential_stiffness / normal_stiffness).sqrt(),
        }
    }

    /// Hertz duration of the impact whose largest overlap stores the kinetic energy and the energy
    /// of the present overlap. An impact that begins at zero overlap takes
    ///
    /// ```text
    /// 2.87 (m^2 / (R* E*^2 speed))^(1/5)
    /// ```
    fn contact_time(&self, pair: &PairProperties, speed: f64, overlap: f64) -> f64 {
        let largest = (self.impact_overlap(pair, speed).powf(2.5) + overlap.powf(2.5)).powf(0.4);
        let contact_radius = (pair.reduced_radius * largest).sqrt();
        let normal_stiffness = 2.0 * pair.effective_youngs_modulus * contact_radius;
        let half_period = PI * (1.0 / (pair.inverse_mass * normal_stiffness)).sqrt();
        HERTZ_DURATION * half_period
    }

    fn impact_overlap(&self, pair: &PairProperties, speed: f64) -> f64 {
        let stiffness = 16.0 / 15.0 * pair.effective_youngs_modulus * pair.reduced_radius.sqrt();
        (speed * speed / (pair.inverse_mass * stiffness)).powf(0.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_time_is_the_duration_of_a_hertz_impact() {
        let pair = PairProperties {
            inverse_mass: 40.0,
            reduced_radius: 0.005,
            effective_youngs_modulus: 2.5e10,
            effective_shear_modulus: 8e9,
            damping_ratio: 0.0,
        };
        let (mut overlap, mut speed, mut time, dt) = (0.0, 3.0, 0.0, 1e-9);
        let expected = HertzMindlin.contact_time(&pair, speed, 0.0);
        let largest = HertzMindlin.impact_overlap(&pair, speed);
        let mut deepest = 0.0f64;
        while overlap >= 0.0 {
            let force = HertzMindlin.coefficients(&pair, overlap).normal_force;
            speed -= dt * force * pair.inverse_mass;
            overlap += dt * speed;
            time += dt;
            deepest = deepest.max(overlap);
        }
        assert!((time / expected - 1.0).abs() < 1e-4, "{time} {expected}");
        assert!((deepest / largest - 1.0).abs() < 1e-4, "{deepest} {largest}");
        // Half way into the contact the speed is lower, but the expected duration is unchanged.
        let half: f64 = 0.5 * largest;
        let energy: f64 = 0.5 * 9.0 / pair.inverse_mass;
        let stored = HertzMindlin.coefficients(&pair, half).normal_energy;
        let speed = (2.0 * (energy - stored) * pair.inverse_mass).sqrt();
        let later = HertzMindlin.contact_time(&pair, speed, half);
        assert!((later / expected - 1.0).abs() < 1e-9, "{later} {expected}");
    }
}
