//! `[domain]`: the box, its cells and its faces.

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize, Serializer};

use crate::case::exactly::Exactly;
use crate::case::located::Located;
use crate::case::notation::{Notation, Unsupported, notations, variant};
use crate::case::quantity::{Length, Quantity, Triple, Velocity};

/// The box. Give two of `size`, `cells` and `cell_size`.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawDomain {
    /// Edge lengths of the box along x, y, z [m].
    pub size: Option<Located<Triple<Length>>>,
    /// Number of cells along x, y, z; 1 makes a flat axis, which must be periodic.
    pub cells: Option<Located<Exactly<usize, 3>>>,
    /// Cell edge [m]: one length, or one for each axis.
    pub cell_size: Option<Located<CellSize>>,
    /// Cells along the edge of a cell in a box around the grains, which moves with them: 1 or 2.
    pub refinement: Option<Located<usize>>,
    /// Least distance from the grains to the sides of that box [m]: one length, or one for each
    /// axis.
    pub refinement_margin: Option<Located<CellSize>>,
    /// Lower corner of the box [m].
    #[serde(default)]
    pub origin: Located<Triple<Length>>,
    /// Conditions on the six faces.
    #[serde(default)]
    pub boundaries: Located<RawBoundaries>,
}

/// Edges of a cell [m]: one for all axes, or one for each axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CellSize(pub DVec3);

impl Notation for CellSize {
    const EXPECTED: &'static str = "a length such as \"0.25 mm\", or three of them";
    type List = Exactly<Quantity<Length>, 3>;
    type Table = Unsupported;
    fn from_word(word: &str) -> Result<Self, String> {
        Quantity::<Length>::from_word(word).and_then(|h| Self::from_number(h.si))
    }
    fn from_number(number: f64) -> Result<Self, String> {
        Ok(CellSize(DVec3::splat(number)))
    }
    fn from_list(Exactly(list): Self::List) -> Result<Self, String> {
        Ok(CellSize(DVec3::from_array(list.map(|q| q.si))))
    }
    fn scalar_schemas(generator: &mut SchemaGenerator) -> Vec<Schema> {
        vec![generator.subschema_for::<Quantity<Length>>()]
    }
}

/// Conditions along each axis; no-slip walls at rest by default.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RawBoundaries {
    /// Faces normal to x.
    pub x: Located<AxisFaces>,
    /// Faces normal to y.
    pub y: Located<AxisFaces>,
    /// Faces normal to z.
    pub z: Located<AxisFaces>,
}

/// Table of [`RawBoundaries`].
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BoundariesTable {
    /// Faces normal to x.
    x: Located<AxisFaces>,
    /// Faces normal to y.
    y: Located<AxisFaces>,
    /// Faces normal to z.
    z: Located<AxisFaces>,
}

impl Notation for RawBoundaries {
    const EXPECTED: &'static str = "a condition for all sides (\"wall\", \"slip\" or \
        \"periodic\"), or { x = ..., y = ..., z = ... }";
    type List = Unsupported;
    type Table = BoundariesTable;
    fn from_word(word: &str) -> Result<Self, String> {
        let faces = || Face::from_word(word).map(|face| AxisFaces::both(face).into());
        Ok(RawBoundaries { x: faces()?, y: faces()?, z: faces()? })
    }
    fn from_table(BoundariesTable { x, y, z }: BoundariesTable) -> Result<Self, String> {
        Ok(RawBoundaries { x, y, z })
    }
    fn scalar_schemas(generator: &mut SchemaGenerator) -> Vec<Schema> {
        vec![generator.subschema_for::<FaceKind>()]
    }
}

/// Faces normal to one axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisFaces {
    /// Face at the lower end.
    pub lower: Located<Face>,
    /// Face at the upper end.
    pub upper: Located<Face>,
}

impl AxisFaces {
    fn both(face: Face) -> AxisFaces {
        AxisFaces { lower: face.into(), upper: face.into() }
    }
}

/// Table of [`AxisFaces`]: both faces, or one condition for both.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisTable {
    /// Condition on the lower face.
    lower: Option<Located<Face>>,
    /// Condition on the upper face.
    upper: Option<Located<Face>>,
    /// Kind of condition on both faces.
    kind: Option<FaceKind>,
    /// Velocity of both walls or of the entering fluid [m/s].
    velocity: Option<Triple<Velocity>>,
}

impl Notation for AxisFaces {
    const EXPECTED: &'static str = "a condition for both sides (\"periodic\", \"wall\", ...), \
        a pair [lower, upper], or { lower = ..., upper = ... }";
    type List = Exactly<Located<Face>, 2>;
    type Table = AxisTable;
    fn from_word(word: &str) -> Result<Self, String> {
        Face::from_word(word).map(AxisFaces::both)
    }
    fn from_list(Exactly([lower, upper]): Self::List) -> Result<Self, String> {
        Ok(AxisFaces { lower, upper })
    }
    fn from_table(table: AxisTable) -> Result<Self, String> {
        let given = (&table.lower, &table.upper, table.kind, table.velocity);
        match given {
            (_, _, None, None) => Ok(AxisFaces {
                lower: table.lower.unwrap_or_default(),
                upper: table.upper.unwrap_or_default(),
            }),
            (None, None, Some(kind), velocity) => Ok(AxisFaces::both(Face { kind, velocity })),
            _ => Err("give either `kind` (for both sides) or `lower` and `upper`".into()),
        }
    }
    fn scalar_schemas(generator: &mut SchemaGenerator) -> Vec<Schema> {
        vec![generator.subschema_for::<FaceKind>()]
    }
}

impl Serialize for AxisFaces {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        [&self.lower, &self.upper].serialize(serializer)
    }
}

/// Kind of boundary condition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FaceKind {
    /// No-slip wall, at rest or moving in its own plane.
    #[default]
    Wall,
    /// Frictionless wall.
    Slip,
    /// Joined to the opposite face.
    Periodic,
    /// Fluid enters at a given velocity.
    Inflow,
    /// Fluid leaves.
    Outflow,
    /// Flat stress-free lid.
    FreeSurface,
}

grainwake_formats::display_as_serialized!(FaceKind);

/// Condition on one face: a word, or a table with the velocity of the wall or inflow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Face {
    /// Kind of condition.
    pub kind: FaceKind,
    /// Velocity of a moving wall or of the entering fluid [m/s].
    pub velocity: Option<Triple<Velocity>>,
}

/// Table of [`Face`].
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceTable {
    /// Kind of condition.
    kind: FaceKind,
    /// Velocity of a moving wall or of the entering fluid [m/s].
    velocity: Option<Triple<Velocity>>,
}

impl Notation for Face {
    const EXPECTED: &'static str = "wall, slip, periodic, inflow, outflow or free-surface, \
        or { kind = \"wall\", velocity = [...] }";
    type List = Unsupported;
    type Table = FaceTable;
    fn from_word(word: &str) -> Result<Self, String> {
        let (kind, velocity) = (variant(word)?, None);
        Ok(Face { kind, velocity })
    }
    fn from_table(FaceTable { kind, velocity }: FaceTable) -> Result<Self, String> {
        Ok(Face { kind, velocity })
    }
    fn scalar_schemas(generator: &mut SchemaGenerator) -> Vec<Schema> {
        vec![generator.subschema_for::<FaceKind>()]
    }
}

impl Serialize for Face {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Face { kind, velocity } = *self;
        match velocity {
            None => kind.serialize(serializer),
            Some(_) => FaceTable { kind, velocity }.serialize(serializer),
        }
    }
}

notations!(CellSize, RawBoundaries, AxisFaces, Face);
