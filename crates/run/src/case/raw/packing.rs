//! `[[packing]]`: many grains placed by a rule.

use std::borrow::Cow;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use super::forms::{Forms, Never, deserialize_forms};
use super::grain::RawShape;
use crate::case::loc::Loc;
use crate::case::quantity::{Density, Length, Number, Quantity, Triple, Velocity, parse_quantity};

/// Grains placed by a rule, reproducibly from `seed`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawPacking {
    /// Number of grains.
    pub count: Loc<usize>,
    /// `.grain` files, relative to the case file, taken in turn.
    #[serde(default)]
    pub files: Vec<Loc<String>>,
    /// Closed forms, taken in turn after the files.
    #[serde(default)]
    pub shapes: Vec<Loc<RawShape>>,
    /// Rescales each grain to this equal-volume diameter [m], or to one drawn evenly from
    /// `{ from, to }`.
    pub equivalent_diameter: Option<Loc<DiameterRange>>,
    /// Number of surface nodes of each grain.
    pub nodes: Option<Loc<usize>>,
    /// Density [kg/m3].
    pub density: Loc<Quantity<Density>>,
    /// Part of the box to fill; the whole box if not given.
    pub region: Option<Loc<RawRegion>>,
    /// `lattice` or `random`.
    #[serde(default)]
    pub arrangement: Arrangement,
    /// Lattice only: random shift as a fraction (0 to 1) of the free space around a site.
    #[serde(default = "half")]
    pub jitter: Loc<Quantity<Number>>,
    /// Smallest distance between bounding spheres, and from them to the walls [m].
    #[serde(default = "touching")]
    pub clearance: Loc<Quantity<Length>>,
    /// `random` or `aligned` (principal axes along x, y, z).
    #[serde(default)]
    pub orientation: PackingOrientation,
    /// Velocity at the start [m/s].
    #[serde(default = "at_rest")]
    pub velocity: Loc<Triple<Velocity>>,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

fn half() -> Loc<Quantity<Number>> {
    Quantity::new(0.5).into()
}
fn touching() -> Loc<Quantity<Length>> {
    Quantity::new(0.0).into()
}
fn at_rest() -> Loc<Triple<Velocity>> {
    Triple::new(DVec3::ZERO).into()
}

/// A part of the box.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawRegion {
    /// Lower corner [m].
    pub lower: Triple<Length>,
    /// Upper corner [m].
    pub upper: Triple<Length>,
}

/// How grains are arranged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Arrangement {
    /// A cubic lattice, filled from below, each site shifted at random.
    #[default]
    Lattice,
    /// Random positions without overlap.
    Random,
}

/// How packed grains are turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PackingOrientation {
    /// Evenly over all orientations.
    #[default]
    Random,
    /// Principal axes along x, y, z.
    Aligned,
}

/// One diameter, or an even distribution of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiameterRange {
    /// Smallest [m].
    pub from: f64,
    /// Largest [m].
    pub to: f64,
}

/// Table form of `DiameterRange`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeTable {
    from: Quantity<Length>,
    to: Quantity<Length>,
}

impl Forms for DiameterRange {
    const EXPECTED: &'static str =
        "a length such as \"2 mm\", or { from = \"1 mm\", to = \"2 mm\" }";
    type List = Never;
    type Table = RangeTable;
    fn from_word(word: &str) -> Result<Self, String> {
        parse_quantity::<Length>(word).map(|d| DiameterRange { from: d, to: d })
    }
    fn from_number(d: f64) -> Result<Self, String> {
        Ok(DiameterRange { from: d, to: d })
    }
    fn from_table(table: RangeTable) -> Result<Self, String> {
        Ok(DiameterRange {
            from: table.from.si,
            to: table.to.si,
        })
    }
}

deserialize_forms!(DiameterRange);

impl Serialize for DiameterRange {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map([("from", self.from), ("to", self.to)])
    }
}

impl JsonSchema for DiameterRange {
    fn schema_name() -> Cow<'static, str> {
        "DiameterRange".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let length = generator.subschema_for::<Quantity<Length>>();
        json_schema!({
            "anyOf": [
                length,
                {
                    "type": "object",
                    "properties": { "from": length, "to": length },
                    "required": ["from", "to"],
                    "additionalProperties": false,
                },
            ],
        })
    }
}
