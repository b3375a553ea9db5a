//! Material of a grain or wall, and the damping ratio that gives a restitution. This file runs at
//! set-up only.

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
