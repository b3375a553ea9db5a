//! Force law selected by the parameters, and the measures of an impact under this law.

use super::hertz_mindlin::HertzMindlin;
use super::law::{
    BodyProperties, ContactCoefficients, ContactLaw, ContactMaterial, PairProperties,
};
use super::linear::Linear;
use super::params::{ContactLawKind, ContactParams};
use crate::dem::grain::Grain;

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

impl ContactParams {
    /// Duration of an undamped impact at `speed` [m/s] between two grains equal to `grain` [s].
    pub fn contact_time(&self, grain: &Grain, speed: f64) -> f64 {
        let body = body_properties(grain);
        let pair = PairProperties::of_grains(&body, &body);
        SelectedLaw::new(self).contact_time(&pair, speed, 0.0)
    }

    /// Largest overlap of an undamped impact of `grain` on a wall at `speed` [m/s], without added
    /// mass [m].
    pub fn impact_overlap(&self, grain: &Grain, speed: f64) -> f64 {
        let wall = ContactMaterial::new(&self.wall_material);
        let pair = PairProperties::with_wall(&body_properties(grain), &wall);
        SelectedLaw::new(self).impact_overlap(&pair, speed)
    }
}

/// Properties of a grain without added mass.
fn body_properties(grain: &Grain) -> BodyProperties {
    BodyProperties {
        inverse_mass: 1.0 / grain.mass(),
        radius: 0.5 * grain.shape.equivalent_diameter(),
        material: ContactMaterial::new(&grain.material),
    }
}
