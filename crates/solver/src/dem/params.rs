//! Parameters of contact.

/// Contact law (Eqs 9-18) and its options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactParams {
    /// Normal stiffness k_n [N/m] (Eq. 9).
    pub normal_stiffness: f64,
    /// Tangential stiffness over normal stiffness, k_zeta / k_n (Eq. 14).
    pub tangential_ratio: f64,
    /// Coulomb friction coefficient between grains (Eq. 15).
    pub friction: f64,
    /// Coulomb friction coefficient at walls.
    pub wall_friction: f64,
    /// Coefficient of restitution; 1 has no dashpot (the paper's setting). Values under
    /// `SMALLEST_RESTITUTION` act as that value, where a spring-dashpot hardly rebounds.
    pub restitution: f64,
    /// Tangential dashpot over normal dashpot (only present where `restitution` < 1).
    pub tangential_damping: f64,
    /// Global damping constant xi [1/s] (Eqs 6, 22, 24).
    pub global_damping: f64,
    /// Lubrication correction below this gap [m]; zero turns it off (the paper's setting).
    pub lubrication_gap: f64,
    /// Dynamic viscosity of the fluid in the lubrication correction [Pa s].
    pub lubrication_viscosity: f64,
    /// Height of the asperities [m]: the lubrication film is never thinner.
    pub roughness: f64,
    /// Added mass of a touching grain over its volume [kg/m^3]. A contact that is over within a step
    /// has to turn this fluid as well; without it the grain loses what the fluid takes afterwards
    /// (decision 0009).
    pub added_density: f64,
    /// Sub-steps per contact time (half period of the stiffest pair).
    pub substeps_per_contact: f64,
}

impl Default for ContactParams {
    fn default() -> Self {
        ContactParams {
            normal_stiffness: 100.0,
            tangential_ratio: 2.0 / 7.0,
            friction: 0.5,
            wall_friction: 0.5,
            restitution: 1.0,
            tangential_damping: 0.5,
            global_damping: 0.0,
            lubrication_gap: 0.0,
            lubrication_viscosity: 0.0,
            roughness: 0.0,
            added_density: 0.0,
            substeps_per_contact: 25.0,
        }
    }
}

impl ContactParams {
    /// Restitution under which the dashpot grows no further.
    pub const SMALLEST_RESTITUTION: f64 = 0.05;

    /// Damping ratio zeta = c / (2 sqrt(k m)) that gives the coefficient of restitution when the
    /// contact ends where its force vanishes, since a dry contact cannot pull (Schwager & Poeschel
    /// 2007). With zeta = sin(theta), e = exp(-tan(theta) (pi - 2 theta)); with zeta = cosh(u),
    /// e = exp(-2 u / tanh(u)).
    pub fn damping_ratio(&self) -> f64 {
        let wanted = -self.restitution.clamp(Self::SMALLEST_RESTITUTION, 1.0).ln();
        if wanted == 0.0 {
            return 0.0;
        }
        let bisect = |mut low: f64, mut high: f64, exponent: &dyn Fn(f64) -> f64| {
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if exponent(middle) < wanted {
                    low = middle
                } else {
                    high = middle
                }
            }
            0.5 * (low + high)
        };
        let pi = std::f64::consts::PI;
        if wanted < 2.0 {
            bisect(0.0, 0.5 * pi - 1e-9, &|theta| {
                theta.tan() * (pi - 2.0 * theta)
            })
            .sin()
        } else {
            bisect(1e-9, 20.0, &|u| 2.0 * u / u.tanh()).cosh()
        }
    }

    /// Duration of a contact of two bodies of reduced mass `mass` [kg] without dashpot,
    /// pi sqrt(m / k_n) [s].
    pub fn contact_time(&self, mass: f64) -> f64 {
        std::f64::consts::PI * (mass / self.normal_stiffness).sqrt()
    }

    /// Stiffness [N/m] for which two bodies of reduced mass `mass` [kg] that meet at `speed` [m/s]
    /// overlap by at most `overlap` [m].
    pub fn stiffness_for_overlap(mass: f64, speed: f64, overlap: f64) -> f64 {
        mass * (speed / overlap).powi(2)
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
            let params = ContactParams {
                restitution,
                ..Default::default()
            };
            let measured = rebound(params.damping_ratio());
            assert!(
                (measured - restitution).abs() < 1e-4,
                "{restitution}: {measured}"
            );
        }
        assert_eq!(ContactParams::default().damping_ratio(), 0.0);
    }

    #[test]
    fn stiffness_for_overlap_inverts_the_energy_balance() {
        let k = ContactParams::stiffness_for_overlap(2.0, 3.0, 1e-3);
        assert!((0.5 * k * 1e-6 - 0.5 * 2.0 * 9.0).abs() < 1e-9);
    }
}
