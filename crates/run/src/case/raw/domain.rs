//! `[domain]`: the box, its cells and its faces.

use std::borrow::Cow;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use super::forms::{Forms, Never, deserialize_forms};
use crate::case::loc::Loc;
use crate::case::quantity::{Kind, Length, Quantity, Triple, Velocity, parse_quantity};
use crate::case::suggest::nearest;

/// The box. Give two of `size`, `cells` and `cell_size`.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawDomain {
    /// Edge lengths of the box along x, y, z [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<Loc<Triple<Length>>>,
    /// Number of cells along x, y, z; 1 makes a flat axis, which must be periodic or slip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<Loc<[usize; 3]>>,
    /// Cell edge [m]: one length, or one for each axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_size: Option<Loc<CellSize>>,
    /// Lower corner of the box [m].
    #[serde(default = "zero_origin")]
    pub origin: Loc<Triple<Length>>,
    /// Conditions on the six faces.
    #[serde(default)]
    pub boundaries: RawBoundaries,
}

fn zero_origin() -> Loc<Triple<Length>> {
    Loc::none(Triple::new(DVec3::ZERO))
}

/// One cell edge for all axes, or one for each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellSize(pub DVec3);

impl Forms for CellSize {
    const EXPECTED: &'static str = "a length such as \"0.25 mm\", or three of them";
    type List = [Quantity<Length>; 3];
    type Table = Never;
    fn from_word(word: &str) -> Result<Self, String> {
        parse_quantity::<Length>(word).map(|h| CellSize(DVec3::splat(h)))
    }
    fn from_number(number: f64) -> Result<Self, String> {
        Ok(CellSize(DVec3::splat(number)))
    }
    fn from_list(list: Self::List) -> Result<Self, String> {
        Ok(CellSize(DVec3::from_array(list.map(|q| q.si))))
    }
}

impl Serialize for CellSize {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.to_array().serialize(serializer)
    }
}

impl JsonSchema for CellSize {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "CellSize".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (one, three) = (
            generator.subschema_for::<Quantity<Length>>(),
            generator.subschema_for::<Triple<Length>>(),
        );
        json_schema!({ "anyOf": [one, three] })
    }
}

/// Conditions along each axis; no-slip walls at rest where nothing is said.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawBoundaries {
    /// Faces normal to x.
    pub x: Loc<AxisFaces>,
    /// Faces normal to y.
    pub y: Loc<AxisFaces>,
    /// Faces normal to z.
    pub z: Loc<AxisFaces>,
}

/// The lower and upper face of one axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisFaces {
    /// Face at the lower end.
    pub lower: Loc<Face>,
    /// Face at the upper end.
    pub upper: Loc<Face>,
}

/// Table form of `AxisFaces`: both faces, or one condition for both.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisTable {
    lower: Option<Loc<Face>>,
    upper: Option<Loc<Face>>,
    kind: Option<FaceKind>,
    velocity: Option<Triple<Velocity>>,
}

impl Forms for AxisFaces {
    const EXPECTED: &'static str = "a condition for both faces (\"periodic\", \"wall\", ...), a pair [lower, upper], or { lower = ..., upper = ... }";
    type List = [Loc<Face>; 2];
    type Table = AxisTable;
    fn from_word(word: &str) -> Result<Self, String> {
        let face = Face::from_word(word)?;
        Ok(AxisFaces {
            lower: Loc::none(face),
            upper: Loc::none(face),
        })
    }
    fn from_list([lower, upper]: Self::List) -> Result<Self, String> {
        Ok(AxisFaces { lower, upper })
    }
    fn from_table(table: AxisTable) -> Result<Self, String> {
        match table {
            AxisTable {
                lower,
                upper,
                kind: None,
                velocity: None,
            } => Ok(AxisFaces {
                lower: lower.unwrap_or_default(),
                upper: upper.unwrap_or_default(),
            }),
            AxisTable {
                lower: None,
                upper: None,
                kind: Some(kind),
                velocity,
            } => {
                let face = Loc::none(Face {
                    kind,
                    velocity: velocity.map(|v| v.si),
                });
                Ok(AxisFaces {
                    lower: face.clone(),
                    upper: face,
                })
            }
            _ => Err("give either `kind` (for both faces) or `lower` and `upper`".into()),
        }
    }
}

impl Serialize for AxisFaces {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        [&self.lower, &self.upper].serialize(serializer)
    }
}

impl JsonSchema for AxisFaces {
    fn schema_name() -> Cow<'static, str> {
        "AxisFaces".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let face = generator.subschema_for::<Face>();
        json_schema!({
            "description": AxisFaces::EXPECTED,
            "anyOf": [
                face,
                { "type": "array", "items": face, "minItems": 2, "maxItems": 2 },
                { "type": "object", "properties": { "lower": face, "upper": face }, "additionalProperties": false },
            ],
        })
    }
}

/// What happens at a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
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

impl FaceKind {
    const NAMES: [(&'static str, FaceKind); 6] = [
        ("wall", FaceKind::Wall),
        ("slip", FaceKind::Slip),
        ("periodic", FaceKind::Periodic),
        ("inflow", FaceKind::Inflow),
        ("outflow", FaceKind::Outflow),
        ("free-surface", FaceKind::FreeSurface),
    ];
    /// The word for this condition in a case file.
    pub fn name(self) -> &'static str {
        FaceKind::NAMES
            .iter()
            .find(|(_, kind)| *kind == self)
            .map_or("wall", |(name, _)| name)
    }
}

impl Forms for FaceKind {
    const EXPECTED: &'static str = "wall, slip, periodic, inflow, outflow or free-surface";
    type List = Never;
    type Table = Never;
    fn from_word(word: &str) -> Result<Self, String> {
        FaceKind::NAMES
            .iter()
            .find(|(name, _)| *name == word)
            .map(|(_, kind)| *kind)
            .ok_or_else(|| {
                let hint = nearest(word, FaceKind::NAMES.iter().map(|(name, _)| *name))
                    .map_or(String::new(), |name| format!(" (did you mean \"{name}\"?)"));
                format!(
                    "unknown boundary \"{word}\"{hint}; accepted: {}",
                    FaceKind::EXPECTED
                )
            })
    }
}

/// Condition on one face: a word, or a table with the velocity of the wall or inflow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Face {
    /// What happens there.
    pub kind: FaceKind,
    /// Velocity of a moving wall or of the entering fluid [m/s].
    pub velocity: Option<DVec3>,
}

/// Table form of `Face`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaceTable {
    kind: FaceKind,
    velocity: Option<Triple<Velocity>>,
}

impl Forms for Face {
    const EXPECTED: &'static str = "wall, slip, periodic, inflow, outflow or free-surface, or { kind = \"wall\", velocity = [...] }";
    type List = Never;
    type Table = FaceTable;
    fn from_word(word: &str) -> Result<Self, String> {
        Ok(Face {
            kind: FaceKind::from_word(word)?,
            velocity: None,
        })
    }
    fn from_table(table: FaceTable) -> Result<Self, String> {
        Ok(Face {
            kind: table.kind,
            velocity: table.velocity.map(|v| v.si),
        })
    }
}

deserialize_forms!(CellSize, AxisFaces, FaceKind, Face);

impl Serialize for Face {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Table {
            kind: FaceKind,
            velocity: [f64; 3],
        }
        match self.velocity {
            None => self.kind.serialize(serializer),
            Some(velocity) => Table {
                kind: self.kind,
                velocity: velocity.to_array(),
            }
            .serialize(serializer),
        }
    }
}

impl JsonSchema for Face {
    fn schema_name() -> Cow<'static, str> {
        "Face".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let kind = generator.subschema_for::<FaceKind>();
        let velocity = generator.subschema_for::<Triple<Velocity>>();
        json_schema!({
            "anyOf": [
                kind,
                {
                    "type": "object",
                    "properties": { "kind": kind, "velocity": velocity },
                    "required": ["kind"],
                    "additionalProperties": false,
                },
            ],
            "examples": ["wall", { "kind": "wall", "velocity": [format!("1 {}", Velocity::SI), 0, 0] }],
        })
    }
}
