//! Contact force law of Hertz and Mindlin.

use std::f64::consts::PI;

use super::law::{ContactCoefficients, ContactLaw, PairProperties};

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
