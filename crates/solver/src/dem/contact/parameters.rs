//! Parameters of the contact, the law that they select, and estimates for choosing them. This file
//! runs at set-up only.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::law::{
    BodyProperties, ContactLaw, ContactMaterial, HertzMindlin, Linear, PairProperties,
};
use crate::dem::grain::Grain;
use crate::dem::material::{MIN_RESTITUTION, Material, damping_ratio};

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
    pub const MIN_RESTITUTION: f64 = MIN_RESTITUTION;

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

    /// Duration of an undamped impact at `speed` [m/s] between two grains equal to `grain` [s].
    pub fn contact_time(&self, grain: &Grain, speed: f64) -> f64 {
        let body = BodyProperties::of(grain);
        let pair = PairProperties::new(&body, Some(&body), &ContactMaterial::default());
        self.force_law().contact_time(&pair, speed, 0.0)
    }

    /// Largest overlap of an undamped impact of `grain` on a wall at `speed` [m/s], without added
    /// mass [m].
    pub fn impact_overlap(&self, grain: &Grain, speed: f64) -> f64 {
        let wall = ContactMaterial::new(&self.wall_material);
        let pair = PairProperties::new(&BodyProperties::of(grain), None, &wall);
        self.force_law().impact_overlap(&pair, speed)
    }
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

impl BodyProperties {
    /// Properties of a grain without added mass, as if it moved freely.
    pub fn of(grain: &Grain) -> BodyProperties {
        BodyProperties {
            inverse_mass: 1.0 / grain.mass(),
            radius: 0.5 * grain.shape.equivalent_diameter(),
            material: ContactMaterial::new(&grain.material),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffness_for_overlap_inverts_the_energy_balance() {
        let k = ContactParams::stiffness_for_overlap(2.0, 3.0, 1e-3);
        assert!((0.5 * k * 1e-6 - 0.5 * 2.0 * 9.0).abs() < 1e-9);
    }
}
