//! Linear spring-dashpot law of the paper (Eqs 9 and 14).

use super::law::{ContactCoefficients, ContactLaw, PairProperties};
use super::params::ContactParams;
use crate::dem::material::damping_ratio;

/// Linear normal and tangential springs, and dashpots that give a constant restitution.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct Linear {
    /// k_n [N/m].
    normal_stiffness: f64,
    /// k_zeta [N/m].
    tangential_stiffness: f64,
    /// Damping ratio of the restitution.
    damping_ratio: f64,
    /// Tangential over normal dashpot.
    tangential_damping_ratio: f64,
}

impl Linear {
    /// Law of these parameters.
    pub fn new(params: &ContactParams) -> Linear {
        Linear {
            normal_stiffness: params.normal_stiffness,
            tangential_stiffness: params.normal_stiffness * params.tangential_ratio,
            damping_ratio: damping_ratio(params.restitution),
            tangential_damping_ratio: params.tangential_damping,
        }
    }
}

impl ContactLaw for Linear {
    fn coefficients(&self, pair: &PairProperties, overlap: f64) -> ContactCoefficients {
        let k = self.normal_stiffness;
        let normal_damping = if pair.inverse_mass > 0.0 {
            2.0 * self.damping_ratio * (k / pair.inverse_mass).sqrt()
        } else {
            0.0
        };
        ContactCoefficients {
            normal_force: k * overlap,
            normal_energy: 0.5 * k * overlap * overlap,
            normal_damping,
            tangential_stiffness: self.tangential_stiffness,
            tangential_damping_ratio: self.tangential_damping_ratio,
        }
    }

    /// Half period of the spring, pi sqrt(m / k_n).
    fn contact_time(&self, pair: &PairProperties, _speed: f64, _overlap: f64) -> f64 {
        std::f64::consts::PI * (1.0 / pair.inverse_mass / self.normal_stiffness).sqrt()
    }

    fn impact_overlap(&self, pair: &PairProperties, speed: f64) -> f64 {
        speed * (1.0 / pair.inverse_mass / self.normal_stiffness).sqrt()
    }
}
