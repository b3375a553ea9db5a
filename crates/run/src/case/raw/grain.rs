//! `[[grain]]`: shape, density, placement and motion of one grain.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::motion::RawMotion;
use super::orientation::{Orientation, Turns};
use crate::case::exactly::Exactly;
use crate::case::located::{Located, is_default};
use crate::case::notation::{Notation, Unsupported, notations, refusal};
use crate::case::quantity::{
    AngularVelocity, Density, ElasticModulus, Length, Number, Quantity, Triple, Velocity,
};

/// One grain.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawGrain {
    /// A `.grain` file, relative to the case file. Give either `file` or `shape`.
    pub file: Option<Located<String>>,
    /// A closed form. Give either `file` or `shape`.
    pub shape: Option<Located<RawShape>>,
    /// Rescales the shape to this equivalent diameter [m]; without it the shape keeps its size.
    pub equivalent_diameter: Option<Located<Quantity<Length>>>,
    /// Surface nodes of a closed form; 2000 if not given. A file brings its own.
    pub nodes: Option<Located<usize>>,
    /// Density [kg/m3].
    pub density: Located<Quantity<Density>>,
    /// Young's modulus [Pa], for the contact law "hertz-mindlin"; the one of `[contact]` if not
    /// given.
    pub youngs_modulus: Option<Located<Quantity<ElasticModulus>>>,
    /// Poisson ratio, for the contact law "hertz-mindlin"; the one of `[contact]` if not given.
    pub poisson_ratio: Option<Located<Quantity<Number>>>,
    /// Coefficient of restitution, for the contact law "hertz-mindlin"; the one of `[contact]` if
    /// not given. A pair takes the smaller value.
    pub restitution: Option<Located<Quantity<Number>>>,
    /// Centroid [m]: `[x, y, z]`; with `gap_above` only the two horizontal components.
    pub position: Option<Located<Position>>,
    /// Places the grain above another: the vertical distance from the top of that grain's
    /// surface to the bottom of this one's.
    pub gap_above: Option<Located<RawGapAbove>>,
    /// Orientation: a quaternion `[w, x, y, z]`, `{ axis, angle }`, or directions of the
    /// principal axes such as `{ long_axis = "z" }`.
    #[serde(default)]
    pub orientation: Located<Orientation>,
    /// Turns applied after `orientation`, about axes of space: one `{ axis, angle }` or a list.
    #[serde(default, skip_serializing_if = "is_default")]
    pub rotate: Turns,
    /// Velocity at the start [m/s].
    pub velocity: Option<Located<Triple<Velocity>>>,
    /// Angular velocity at the start, axes of space [rad/s].
    pub angular_velocity: Option<Located<Triple<AngularVelocity>>>,
    /// "free", "fixed", or `{ velocity = ..., angular_velocity = ... }`, each "free", "fixed" or a
    /// prescribed vector.
    #[serde(default)]
    pub motion: Located<RawMotion>,
}

/// A closed form. Which sizes belong to it depends on `kind`. In the frame of the body the moment
/// of inertia about x is the smallest and the one about z the largest, whatever the order of
/// `size`; `orientation` turns it from there.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawShape {
    /// Kind of body.
    pub kind: Located<ShapeKind>,
    /// Diameter of a sphere, cylinder or capsule [m].
    pub diameter: Option<Located<Quantity<Length>>>,
    /// Height of a cylinder; length between the cap centres of a capsule [m].
    pub height: Option<Located<Quantity<Length>>>,
    /// Full edge lengths of an ellipsoid, rounded box or superquadric [m].
    pub size: Option<Located<Triple<Length>>>,
    /// Edge radius of a rounded box [m].
    pub radius: Option<Located<Quantity<Length>>>,
    /// Exponents e1, e2 of a superquadric (Barr 1981), 0.1 to 2; 1, 1 is an ellipsoid.
    pub exponents: Option<Located<Exactly<f64, 2>>>,
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
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Position(pub Vec<f64>);

impl Notation for Position {
    const EXPECTED: &'static str = "[x, y, z], each a length in m or a string such as \"2 mm\"";
    type List = Vec<Quantity<Length>>;
    type Table = Unsupported;
    fn from_list(list: Self::List) -> Result<Self, String> {
        match list.len() {
            2 | 3 => Ok(Position(list.iter().map(|q| q.si).collect())),
            n => Err(refusal::<Self>(&format!("{n} components"))),
        }
    }
}

/// Placement above another grain.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawGapAbove {
    /// Index of the grain below, which must stand earlier in the file.
    pub grain: Located<usize>,
    /// Vertical distance between the two surfaces [m].
    pub gap: Located<Quantity<Length>>,
}

notations!(Position);
