//! `[[packing]]`: many grains placed by a rule.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};

use super::grain::RawShape;
use super::motion::RawMotion;
use crate::case::located::Located;
use crate::case::notation::{Notation, Unsupported, notations};
use crate::case::quantity::{Density, Length, Number, Quantity, Triple, Velocity};

/// Grains placed by a rule, reproducibly from `seed`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawPacking {
    /// Number of grains.
    pub count: Located<usize>,
    /// `.grain` files, relative to the case file, taken in turn.
    #[serde(default)]
    pub files: Vec<Located<String>>,
    /// Closed forms, taken in turn after the files.
    #[serde(default)]
    pub shapes: Vec<Located<RawShape>>,
    /// Rescales each grain to this equivalent diameter [m], or to one drawn uniformly
    /// from `{ from, to }`.
    pub equivalent_diameter: Option<Located<DiameterRange>>,
    /// Number of surface nodes of each grain.
    pub nodes: Option<Located<usize>>,
    /// Density [kg/m3].
    pub density: Located<Quantity<Density>>,
    /// Part of the box to fill; the whole box if not given.
    pub region: Option<Located<RawRegion>>,
    /// `lattice` or `random`.
    #[serde(default)]
    pub arrangement: Arrangement,
    /// Lattice only: random shift as a fraction (0 to 1) of the free space around a lattice site.
    #[serde(default = "half")]
    pub jitter: Located<Quantity<Number>>,
    /// Smallest distance between grains, and from them to the faces of the region [m].
    #[serde(default)]
    pub clearance: Located<Quantity<Length>>,
    /// `random` or `aligned` (principal axes along x, y, z).
    #[serde(default)]
    pub orientation: PackingOrientation,
    /// Velocity at the start [m/s].
    #[serde(default)]
    pub velocity: Located<Triple<Velocity>>,
    /// Motion of all grains, as for `[[grain]]`.
    #[serde(default)]
    pub motion: Located<RawMotion>,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

fn half() -> Located<Quantity<Number>> {
    Quantity::new(0.5).into()
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

/// Arrangement of packed grains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Arrangement {
    /// A cubic lattice, filled from below, each site shifted at random.
    #[default]
    Lattice,
    /// Random positions without overlap of the bounding spheres, or else of the surfaces.
    Random,
}

/// Orientations of packed grains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PackingOrientation {
    /// Uniformly distributed orientations.
    #[default]
    Random,
    /// Principal axes along x, y, z.
    Aligned,
}

/// Uniform distribution of diameters; a single one has equal bounds.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Smallest diameter [m].
    pub from: Quantity<Length>,
    /// Largest diameter [m].
    pub to: Quantity<Length>,
}

/// Diameter, or the bounds of a uniform distribution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DiameterRange(pub Bounds);

impl Notation for DiameterRange {
    const EXPECTED: &'static str =
        "a length such as \"2 mm\", or { from = \"1 mm\", to = \"2 mm\" }";
    type List = Unsupported;
    type Table = Bounds;
    fn from_word(word: &str) -> Result<Self, String> {
        Quantity::<Length>::from_word(word).and_then(|d| Self::from_number(d.si))
    }
    fn from_number(d: f64) -> Result<Self, String> {
        let (from, to) = (Quantity::new(d), Quantity::new(d));
        Ok(DiameterRange(Bounds { from, to }))
    }
    fn from_table(table: Bounds) -> Result<Self, String> {
        Ok(DiameterRange(table))
    }
    fn scalar_schemas(generator: &mut SchemaGenerator) -> Vec<Schema> {
        vec![generator.subschema_for::<Quantity<Length>>()]
    }
}

notations!(DiameterRange);
