//! `output.scales`.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use crate::case::located::Located;
use crate::case::notation::{Notation, Unsupported, notations, variant};
use crate::case::quantity::{Density, Length, Quantity, Time, Velocity};

/// Scales of the dimensionless columns: a preset, or lengths and times of the user.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum RawScales {
    /// Scales that follow from the case.
    Preset(ScalePreset),
    /// Given scales.
    Given(ScaleTable),
}

/// Scales that follow from the case; d is the mean equivalent diameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ScalePreset {
    /// Length d, velocity sqrt(g d).
    Gravity,
    /// Length d, velocity sqrt(|density ratio - 1| g d).
    Buoyancy,
    /// Length d, velocity nu / d.
    Viscous,
}

/// Scales given by the user.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScaleTable {
    /// Length [m].
    pub length: Located<Quantity<Length>>,
    /// Time [s]; length / velocity if not given.
    pub time: Option<Located<Quantity<Time>>>,
    /// Velocity [m/s]; length / time if not given.
    pub velocity: Option<Located<Quantity<Velocity>>>,
    /// Density [kg/m3]; that of the fluid if not given, dry the mean density of the grains.
    pub density: Option<Located<Quantity<Density>>>,
}

impl Notation for RawScales {
    const EXPECTED: &'static str = "\"gravity\", \"buoyancy\", \"viscous\", or \
                                    { length = \"2 mm\", velocity = \"0.1 m/s\" }";
    type List = Unsupported;
    type Table = ScaleTable;
    fn from_word(word: &str) -> Result<Self, String> {
        variant(word).map(RawScales::Preset)
    }
    fn from_table(table: ScaleTable) -> Result<Self, String> {
        Ok(RawScales::Given(table))
    }
    fn scalar_schemas(_: &mut SchemaGenerator) -> Vec<Schema> {
        let presets = [ScalePreset::Gravity, ScalePreset::Buoyancy, ScalePreset::Viscous];
        vec![json_schema!({ "enum": presets })]
    }
}

notations!(RawScales);
