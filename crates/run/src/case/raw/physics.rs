//! `[fluid]`, `[coupling]` and `[contact]`. Defaults come from the modules that own the parameters.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::formula::{OfPosition, OfTime, VectorOrFormula};
use crate::case::located::{Located, is_default};
use crate::case::quantity::{
    Acceleration, Density, DynamicViscosity, ElasticModulus, KinematicViscosity, Length, Number,
    Quantity, Rate, Stiffness, Velocity,
};
use grainwake_solver::dem::{ContactLawKind, ContactParams};
use grainwake_solver::immersed::{Scheme, Start};

/// The fluid.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawFluid {
    /// Density [kg/m3].
    pub density: Located<Quantity<Density>>,
    /// Dynamic viscosity [Pa s]. Give either this or `kinematic_viscosity`.
    pub viscosity: Option<Located<Quantity<DynamicViscosity>>>,
    /// Kinematic viscosity [m2/s].
    pub kinematic_viscosity: Option<Located<Quantity<KinematicViscosity>>>,
    /// Uniform acceleration that drives the flow, a mean pressure gradient over density [m/s2].
    #[serde(default)]
    pub body_acceleration: Located<VectorOrFormula<Acceleration, OfTime>>,
    /// Velocity at the start [m/s]; it is made free of divergence.
    #[serde(default)]
    pub initial_velocity: Located<VectorOrFormula<Velocity, OfPosition>>,
    /// Advection scheme.
    #[serde(default)]
    #[schemars(schema_with = "advection_schema")]
    pub advection: Located<Advection>,
}

fn advection_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "enum": [Advection::Central] })
}

/// Advection scheme. The solver has one; the key states it in the case file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Advection {
    /// Conservative second-order central differences: no numerical dissipation.
    #[default]
    Central,
}

/// Coupling of grains and fluid.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawCoupling {
    /// `aperture` (smoothed ghost-Dirichlet drag) or `paper` (Patankar 2000, as the paper does).
    #[schemars(schema_with = "scheme_schema")]
    pub scheme: Located<Scheme>,
    /// `impulsive` (a grain starts with its velocity, and the fluid around it is set in motion) or
    /// `released` (the grain loses the momentum that the fluid gains).
    // The default is not written, so that checkpoints of earlier versions still match their case.
    #[serde(skip_serializing_if = "is_default")]
    #[schemars(schema_with = "start_schema")]
    pub start: Located<Start>,
}

fn scheme_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "enum": [Scheme::Aperture, Scheme::Paper] })
}

fn start_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "enum": [Start::Impulsive, Start::Released] })
}

/// Contact law (Eqs 9-18).
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawContact {
    /// `linear` (Eqs 9 and 14) or `hertz-mindlin` (Hertz normal force, no-slip Mindlin tangential
    /// force, material by grain).
    // The default is not written, so that checkpoints of earlier versions still match their case.
    #[serde(skip_serializing_if = "is_default")]
    #[schemars(schema_with = "law_schema")]
    pub law: Located<ContactLawKind>,
    /// Normal stiffness k_n [N/m] (Eq. 9). Give either this or `maximum_overlap`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Located<Quantity<Stiffness>>>,
    /// Derives the stiffness: largest overlap at impact, as a fraction of the smallest equal-volume
    /// diameter. 0.01 where neither is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum_overlap: Option<Located<Quantity<Number>>>,
    /// Tangential over normal stiffness (Eq. 14); 2/7 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tangential_ratio: Option<Located<Quantity<Number>>>,
    /// Coulomb friction coefficient between grains (Eq. 15).
    pub friction: Located<Quantity<Number>>,
    /// Coulomb friction coefficient at walls; that of the grains where it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_friction: Option<Located<Quantity<Number>>>,
    /// Coefficient of restitution; 1 has no dashpot.
    pub restitution: Located<Quantity<Number>>,
    /// Tangential over normal dashpot, where `restitution` is below 1; 0.5 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tangential_damping: Option<Located<Quantity<Number>>>,
    /// Young's modulus of the grains [Pa], for the law "hertz-mindlin".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub youngs_modulus: Option<Located<Quantity<ElasticModulus>>>,
    /// Poisson ratio of the grains, 0 to 0.5, for the law "hertz-mindlin".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<Located<Quantity<Number>>>,
    /// Young's modulus of the walls [Pa], for the law "hertz-mindlin"; rigid walls if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_youngs_modulus: Option<Located<Quantity<ElasticModulus>>>,
    /// Poisson ratio of the walls, for the law "hertz-mindlin"; `poisson_ratio` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_poisson_ratio: Option<Located<Quantity<Number>>>,
    /// Global damping xi [1/s] (Eqs 6, 22, 24).
    pub global_damping: Located<Quantity<Rate>>,
    /// Lubrication correction below this gap [m]; 0 turns it off.
    pub lubrication_gap: Located<Quantity<Length>>,
    /// Height of the asperities: the lubrication film is never thinner [m]; a thousandth of the
    /// smallest equal-volume diameter where it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roughness: Option<Located<Quantity<Length>>>,
    /// Sub-steps per contact time.
    pub substeps_per_contact: Located<Quantity<Number>>,
    /// Overlap over the smaller equivalent diameter at which the run stops; 0.1, or twice
    /// `maximum_overlap` if that is larger.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overlap_limit: Option<Located<Quantity<Number>>>,
    /// Overlap over the smaller equivalent diameter up to which grains may overlap at the start:
    /// they begin in contact, with compressed springs. Without it they may not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accept_overlap: Option<Located<Quantity<Number>>>,
}

fn law_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "enum": [ContactLawKind::Linear, ContactLawKind::HertzMindlin] })
}

impl Default for RawContact {
    fn default() -> Self {
        let params = ContactParams::default();
        RawContact {
            law: Located::default(),
            stiffness: None,
            maximum_overlap: None,
            tangential_ratio: None,
            friction: Quantity::new(params.friction).into(),
            wall_friction: None,
            restitution: Quantity::new(params.restitution).into(),
            tangential_damping: None,
            youngs_modulus: None,
            poisson_ratio: None,
            wall_youngs_modulus: None,
            wall_poisson_ratio: None,
            global_damping: Quantity::new(params.global_damping).into(),
            lubrication_gap: Quantity::new(params.lubrication_gap).into(),
            roughness: None,
            substeps_per_contact: Quantity::new(params.substeps_per_contact).into(),
            overlap_limit: None,
            accept_overlap: None,
        }
    }
}
