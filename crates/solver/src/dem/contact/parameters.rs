//! Parameters of the contact, the law that they select, and estimates for choosing them. This file
//! runs at set-up only.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::hertz_mindlin::HertzMindlin;
use super::law::{BodyProperties, ContactLaw, Linear, PairProperties};
use crate::dem::grain::{Grain, Material};
use crate::dem::ranges::{FRACTION, NOT_NEGATIVE, POSITIVE, check};

/// Force laws of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactLawKind {
    /// Linear spring and dashpot (Eqs 9 and 14), the paper's law.
    #[default]
    Linear,
    /// Hertz normal force and no-slip Mindlin tangential force.
    HertzMindlin,
}

/// Contact law (Eqs 9-18) and its options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactParams {
    /// Force law. The linear law uses `normal_stiffness`, `tangential_ratio`, `restitution` and
    /// `tangential_damping`; Hertz-Mindlin uses the materials of grains and walls.
    pub law: ContactLawKind,
    /// Normal stiffness k_n [N/m] (Eq. 9).
    pub normal_stiffness: f64,
    /// Tangential stiffness over normal stiffness, k_zeta / k_n (Eq. 14).
    pub tangential_ratio: f64,
    /// Coulomb friction coefficient between grains (Eq. 15).
    pub friction: f64,
    /// Coulomb friction coefficient at walls.
    pub wall_friction: f64,
    /// Coefficient of restitution; 1 has no dashpot (the paper's setting). Values below
    /// `MIN_RESTITUTION` act as that value, at which a contact hardly rebounds.
    pub restitution: f64,
    /// Tangential over normal dashpot, for `restitution` < 1.
    pub tangential_damping: f64,
    /// Material of the walls.
    pub wall_material: Material,
    /// Global damping constant xi [1/s] (Eqs 6, 22, 24).
    pub global_damping: f64,
    /// Gap below which the lubrication force acts [m]; zero switches it off (the paper's setting).
    pub lubrication_gap: f64,
    /// Dynamic viscosity of the fluid in the lubrication force [Pa s].
    pub lubrication_viscosity: f64,
    /// Height of the asperities [m], the smallest thickness of the lubrication film.
    pub roughness: f64,
    /// Added mass of a touching grain over its volume [kg/m^3]. A contact shorter than a step also
    /// accelerates this fluid; without it the fluid takes the momentum afterwards (decision 0009).
    pub added_density: f64,
    /// Sub-steps per contact time of the fastest pair.
    pub substeps_per_contact: f64,
    /// Overlap over the smaller equivalent diameter above which a step of
    /// [`Simulation`](crate::sim::Simulation) fails; by default infinite, which is no limit.
    pub overlap_limit: f64,
}

impl Default for ContactParams {
    fn default() -> Self {
        ContactParams {
            law: ContactLawKind::Linear,
            normal_stiffness: 100.0,
            tangential_ratio: 2.0 / 7.0,
            friction: 0.5,
            wall_friction: 0.5,
            restitution: 1.0,
            tangential_damping: 0.5,
            wall_material: Material::RIGID,
            global_damping: 0.0,
            lubrication_gap: 0.0,
            lubrication_viscosity: 0.0,
            roughness: 0.0,
            added_density: 0.0,
            substeps_per_contact: 25.0,
            overlap_limit: f64::INFINITY,
        }
    }
}

impl ContactParams {
    /// Restitution below which the dashpot grows no further.
    pub const MIN_RESTITUTION: f64 = 0.05;

    /// Checks the range of each parameter, and of the wall material if the law uses it.
    ///
    /// # Errors
    /// A message with the parameter, its value and its range.
    pub fn validate(&self) -> Result<(), String> {
        let is_linear = self.law == ContactLawKind::Linear;
        if is_linear {
            check("normal stiffness", self.normal_stiffness, POSITIVE)?;
        } else {
            self.wall_material.validate().map_err(|message| format!("walls: {message}"))?;
        }
        check("substeps per contact", self.substeps_per_contact, POSITIVE)?;
        check("restitution", self.restitution, FRACTION)?;
        for (name, value) in [
            ("tangential ratio", self.tangential_ratio),
            ("friction", self.friction),
            ("wall friction", self.wall_friction),
            ("tangential damping", self.tangential_damping),
            ("global damping", self.global_damping),
            ("lubrication gap", self.lubrication_gap),
            ("lubrication viscosity", self.lubrication_viscosity),
            ("added density", self.added_density),
        ] {
            check(name, value, NOT_NEGATIVE)?;
        }
        check("roughness", self.roughness, ("at least 0", |x| x >= 0.0))?;
        check("overlap limit", self.overlap_limit, ("positive", |x| x > 0.0))
    }

    /// Damping ratio of the linear law, c / (2 sqrt(k m)), that gives `restitution`.
    pub fn damping_ratio(&self) -> f64 {
        damping_ratio(self.restitution)
    }

    /// Stiffness [N/m] at which two bodies of reduced mass `mass` [kg] that meet at `speed` [m/s]
    /// overlap by at most `overlap` [m].
    pub fn stiffness_for_overlap(mass: f64, speed: f64, overlap: f64) -> f64 {
        mass * (speed / overlap).powi(2)
    }

    /// Force law with these parameters. A law that is added needs one arm here.
    pub(super) fn force_law(&self) -> Arc<dyn ContactLaw> {
        match self.law {
            ContactLawKind::Linear => Arc::new(Linear {
                normal_stiffness: self.normal_stiffness,
                tangential_stiffness: self.normal_stiffness * self.tangential_ratio,
                damping_ratio: self.damping_ratio(),
                tangential_damping_ratio: self.tangential_damping,
            }),
            ContactLawKind::HertzMindlin => Arc::new(HertzMindlin),
        }
    }

    /// Properties of the walls.
    pub(super) fn wall(&self) -> BodyProperties {
        BodyProperties::new(&self.wall_material, 0.0, f64::INFINITY)
    }

    /// Duration of an undamped impact at `speed` [m/s] between two grains equal to `grain` [s].
    pub fn contact_time(&self, grain: &Grain, speed: f64) -> f64 {
        let body = BodyProperties::of(grain);
        self.force_law().contact_time(&PairProperties::new(&body, &body), speed, 0.0)
    }

    /// Largest overlap of an undamped impact of `grain` on a wall at `speed` [m/s], without added
    /// mass [m].
    pub fn impact_overlap(&self, grain: &Grain, speed: f64) -> f64 {
        let pair = PairProperties::new(&BodyProperties::of(grain), &self.wall());
        self.force_law().impact_overlap(&pair, speed)
    }

    /// Returns the factor on the stiffness (linear law) or on Young's modulus (Hertz-Mindlin) at
    /// which a pair that is closing at `speed` [m/s] with the overlap `now` [m] would overlap by at
    /// most `wanted` [m].
    ///
    /// The energy of the spring and of the approach is that of an impact at a higher speed. A
    /// partner of `None` is a wall.
    pub fn stiffening(
        &self,
        grain: &Grain,
        partner: Option<&Grain>,
        speed: f64,
        now: f64,
        wanted: f64,
    ) -> f64 {
        let body = |grain: &Grain| BodyProperties {
            inverse_mass: grain.inverse_mass(self.added_density),
            ..BodyProperties::of(grain)
        };
        let pair = PairProperties::new(&body(grain), &partner.map_or(self.wall(), body));
        // Overlap ~ speed^n and stiffness^(-n / 2).
        let n = match self.law {
            ContactLawKind::Linear => 1.0,
            ContactLawKind::HertzMindlin => 0.8,
        };
        let law = self.force_law();
        let of_speed = |speed: f64| law.impact_overlap(&pair, speed);
        let stored = (now / of_speed(1.0)).powf(1.0 / n);
        let overlap = of_speed(stored.hypot(speed));
        (overlap / wanted).powf(2.0 / n)
    }
}

impl BodyProperties {
    /// Properties of a body of `material`.
    fn new(material: &Material, inverse_mass: f64, radius: f64) -> BodyProperties {
        let Material { youngs_modulus, poisson_ratio: nu, restitution } = *material;
        BodyProperties {
            inverse_mass,
            radius,
            normal_compliance: (1.0 - nu * nu) / youngs_modulus,
            tangential_compliance: 2.0 * (2.0 - nu) * (1.0 + nu) / youngs_modulus,
            damping_ratio: damping_ratio(restitution),
        }
    }

    /// Properties of a grain without added mass, as if it moved freely.
    pub fn of(grain: &Grain) -> BodyProperties {
        let radius = 0.5 * grain.shape.equivalent_diameter();
        BodyProperties::new(&grain.material, 1.0 / grain.mass(), radius)
    }
}

/// Damping ratio zeta = c / (2 sqrt(k m)) of a spring and dashpot that give the coefficient of
/// restitution e if the contact ends where its force vanishes (Schwager & Poeschel 2007).
///
/// A dry contact cannot pull. With zeta = sin(theta), e = exp(-tan(theta) (pi - 2 theta)); with
/// zeta = cosh(u), e = exp(-2 u / tanh(u)).
fn damping_ratio(restitution: f64) -> f64 {
    let log_loss = -restitution.clamp(ContactParams::MIN_RESTITUTION, 1.0).ln();
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
    use grainwake_shape::ShapeOptions;
    use grainwake_shape::analytic::sphere;

    use super::*;

    #[test]
    fn stiffness_for_overlap_inverts_the_energy_balance() {
        let k = ContactParams::stiffness_for_overlap(2.0, 3.0, 1e-3);
        assert!((0.5 * k * 1e-6 - 0.5 * 2.0 * 9.0).abs() < 1e-9);
    }

    #[test]
    fn the_stiffened_contact_has_the_wanted_overlap() {
        let material = Material { youngs_modulus: 1e6, poisson_ratio: 0.3, restitution: 1.0 };
        let shape = sphere(1e-3, &ShapeOptions::default()).unwrap();
        let grain = Grain::new(shape, 2500.0).with_material(material);
        for law in [ContactLawKind::Linear, ContactLawKind::HertzMindlin] {
            let soft = ContactParams { law, normal_stiffness: 10.0, ..Default::default() };
            let full = soft.impact_overlap(&grain, 0.1);
            // All energy is that of the approach, then all is that of the spring.
            for (speed, now) in [(0.1, 0.0), (0.0, full)] {
                let factor = soft.stiffening(&grain, None, speed, now, 0.1 * full);
                let mut stiff = (soft, grain.clone());
                stiff.0.normal_stiffness *= factor;
                stiff.1.material.youngs_modulus *= factor;
                let reached = stiff.0.impact_overlap(&stiff.1, 0.1) / full;
                assert!((reached - 0.1).abs() < 1e-9, "{law:?}, {speed} m/s: {reached}");
            }
        }
    }

    #[test]
    fn parameters_without_a_meaning_are_refused() {
        let refused = |change: &dyn Fn(&mut ContactParams)| {
            let mut params = ContactParams::default();
            change(&mut params);
            params.validate().unwrap_err()
        };
        let message = refused(&|params| params.normal_stiffness = -50.0);
        assert_eq!(message, "the normal stiffness must be positive and finite, not -50");
        let hertz = ContactLawKind::HertzMindlin;
        let changes: [&dyn Fn(&mut ContactParams); 8] = [
            &|params| params.normal_stiffness = f64::NAN,
            &|params| params.substeps_per_contact = 0.0,
            &|params| params.friction = f64::NAN,
            &|params| params.wall_friction = -0.1,
            &|params| params.restitution = 1.1,
            &|params| params.roughness = f64::NAN,
            &|params| params.overlap_limit = 0.0,
            &|params| (params.law, params.wall_material.poisson_ratio) = (hertz, 0.6),
        ];
        for change in changes {
            refused(change);
        }
        for law in [ContactLawKind::Linear, hertz] {
            assert_eq!(ContactParams { law, ..Default::default() }.validate(), Ok(()));
        }
    }

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
