//! `[[grain]]`: shape, density, placement and motion of one grain.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use super::forms::{Forms, Never, deserialize_forms};
use super::motion::Motion;
use super::orientation::{Orientation, Turns};
use crate::case::loc::Loc;
use crate::case::quantity::{
    AngularVelocity, Density, ElasticModulus, Length, Number, Quantity, Triple, Velocity,
};

/// One grain.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawGrain {
    /// A `.grain` file, relative to the case file. Give either `file` or `shape`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<Loc<String>>,
    /// A closed form. Give either `file` or `shape`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Loc<RawShape>>,
    /// Rescales the shape to this equal-volume diameter [m]; without it the shape keeps its size.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equivalent_diameter: Option<Loc<Quantity<Length>>>,
    /// Surface nodes of a closed form; 2000 if not given. A file brings its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<Loc<usize>>,
    /// Density [kg/m3].
    pub density: Loc<Quantity<Density>>,
    /// Young's modulus [Pa], for the contact law "hertz-mindlin"; the one of `[contact]` if not
    /// given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub youngs_modulus: Option<Loc<Quantity<ElasticModulus>>>,
    /// Poisson ratio, for the contact law "hertz-mindlin"; the one of `[contact]` if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<Loc<Quantity<Number>>>,
    /// Coefficient of restitution, for the contact law "hertz-mindlin"; the one of `[contact]` if
    /// not given. A pair takes the smaller value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restitution: Option<Loc<Quantity<Number>>>,
    /// Centroid [m]: `[x, y, z]`; with `gap_above` only the two horizontal components.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<Loc<Position>>,
    /// Places the grain above another: the vertical distance from the top of that grain's
    /// surface to the bottom of this one's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_above: Option<Loc<RawGapAbove>>,
    /// Orientation: a quaternion `[w, x, y, z]`, `{ axis, angle }`, or directions of the
    /// principal axes such as `{ long_axis = "z" }`.
    #[serde(default)]
    pub orientation: Loc<Orientation>,
    /// Turns applied after `orientation`, about axes of space: one `{ axis, angle }` or a list.
    #[serde(default, skip_serializing_if = "Turns::is_empty")]
    pub rotate: Turns,
    /// Velocity at the start [m/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Loc<Triple<Velocity>>>,
    /// Angular velocity at the start, axes of space [rad/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angular_velocity: Option<Loc<Triple<AngularVelocity>>>,
    /// "free", "fixed", or `{ velocity = ..., angular_velocity = ... }`, each "free", "fixed" or a
    /// prescribed vector.
    #[serde(default)]
    pub motion: Loc<Motion>,
}

/// A closed form. Which sizes belong to it depends on `kind`. In the frame of the body the longest
/// axis is x and the shortest z, whatever the order of `size`; `orientation` turns it from there.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawShape {
    /// Which body.
    pub kind: Loc<ShapeKind>,
    /// Diameter of a sphere, cylinder or capsule [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diameter: Option<Loc<Quantity<Length>>>,
    /// Height of a cylinder; length between the cap centres of a capsule [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<Loc<Quantity<Length>>>,
    /// Full edge lengths of an ellipsoid, rounded box or superquadric [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<Loc<Triple<Length>>>,
    /// Edge radius of a rounded box [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<Loc<Quantity<Length>>>,
    /// Exponents e1, e2 of a superquadric (Barr 1981), 0.1 to 2; 1, 1 is an ellipsoid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exponents: Option<Loc<[f64; 2]>>,
}

/// Closed forms that can be written in a case file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeKind {
    /// `diameter`.
    Sphere,
    /// `size`.
    Ellipsoid,
    /// `size`, `radius`.
    RoundedBox,
    /// `diameter`, `height`.
    Cylinder,
    /// `diameter`, `height` between the centres of the caps.
    Capsule,
    /// `size`, `exponents`.
    Superquadric,
}

/// Centroid: three components, or the two horizontal ones next to `gap_above`.
#[derive(Clone, Debug, PartialEq)]
pub struct Position(pub Vec<f64>);

impl Forms for Position {
    const EXPECTED: &'static str = "[x, y, z], each a length in m or a string such as \"2 mm\"";
    type List = Vec<Quantity<Length>>;
    type Table = Never;
    fn from_list(list: Self::List) -> Result<Self, String> {
        match list.len() {
            2 | 3 => Ok(Position(list.iter().map(|q| q.si).collect())),
            n => Err(format!("found {n} components; expected {}", Self::EXPECTED)),
        }
    }
}

impl Serialize for Position {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl JsonSchema for Position {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Position".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let item = generator.subschema_for::<Quantity<Length>>();
        json_schema!({ "type": "array", "items": item, "minItems": 2, "maxItems": 3 })
    }
}

/// Placement above another grain.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawGapAbove {
    /// Index of the grain below, which must stand earlier in the file.
    pub grain: Loc<usize>,
    /// Vertical distance between the two surfaces [m].
    pub gap: Loc<Quantity<Length>>,
}

deserialize_forms!(Position);
