//! Directions, turns and orientations in a case file.

use glam::{DQuat, DVec3};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use crate::case::notation::{Notation, Unsupported, notations, refusal};
use crate::case::quantity::{Angle, Quantity};

/// A direction of space: "x", "-z", or a vector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Direction(pub DVec3);

impl Notation for Direction {
    const EXPECTED: &'static str = "x, y, z, -x, -y, -z or a vector such as [1, 0, 1]";
    type List = [f64; 3];
    type Table = Unsupported;
    fn from_word(word: &str) -> Result<Self, String> {
        let (sign, letter) = match word.strip_prefix('-') {
            Some(rest) => (-1.0, rest),
            None => (1.0, word.strip_prefix('+').unwrap_or(word)),
        };
        let axis = ["x", "y", "z"].iter().position(|name| *name == letter);
        let refused = || format!("unknown direction \"{word}\"; expected {}", Self::EXPECTED);
        axis.map(|axis| Direction(DVec3::AXES[axis] * sign)).ok_or_else(refused)
    }
    fn from_list(list: [f64; 3]) -> Result<Self, String> {
        DVec3::from_array(list)
            .try_normalize()
            .map(Direction)
            .ok_or_else(|| "a direction cannot be zero".into())
    }
    fn scalar_schemas(_: &mut SchemaGenerator) -> Vec<Schema> {
        vec![json_schema!({ "enum": ["x", "y", "z", "-x", "-y", "-z"] })]
    }
}

/// A turn about an axis of space.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// Axis.
    pub axis: Direction,
    /// Angle, right-handed [rad].
    pub angle: Quantity<Angle>,
}

impl Turn {
    /// Returns the quaternion of the turn.
    pub fn quaternion(&self) -> DQuat {
        DQuat::from_axis_angle(self.axis.0, self.angle.si)
    }
}

/// Turns in the order in which they are applied.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Turns(pub Vec<Turn>);

impl Notation for Turns {
    const EXPECTED: &'static str = "{ axis = \"y\", angle = \"45 deg\" } or a list of such turns";
    type List = Vec<Turn>;
    type Table = Turn;
    fn from_list(list: Vec<Turn>) -> Result<Self, String> {
        Ok(Turns(list))
    }
    fn from_table(turn: Turn) -> Result<Self, String> {
        Ok(Turns(vec![turn]))
    }
}

/// Orientation of a grain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Orientation {
    /// Unit quaternion, body to space.
    Quaternion(DQuat),
    /// Directions of the principal axes with the smallest, the middle and the largest moment of
    /// inertia, one or two of them given.
    Axes([Option<DVec3>; 3]),
}

impl Default for Orientation {
    fn default() -> Self {
        Orientation::Quaternion(DQuat::IDENTITY)
    }
}

/// Table of [`Orientation`].
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OrientationTable {
    /// Axis of a turn.
    axis: Option<Direction>,
    /// Angle of the turn, right-handed [rad].
    angle: Option<Quantity<Angle>>,
    /// Direction of the principal axis with the smallest moment of inertia, mostly the longest.
    long_axis: Option<Direction>,
    /// Direction of the principal axis with the middle moment of inertia.
    middle_axis: Option<Direction>,
    /// Direction of the principal axis with the largest moment of inertia, mostly the shortest.
    short_axis: Option<Direction>,
}

impl Notation for Orientation {
    const EXPECTED: &'static str = "a quaternion [w, x, y, z], \
        { axis = \"y\", angle = \"45 deg\" }, \
        or one or two of { long_axis, middle_axis, short_axis }";
    type List = Vec<f64>;
    type Table = OrientationTable;
    fn from_list(list: Vec<f64>) -> Result<Self, String> {
        let [w, x, y, z] = list[..] else {
            return Err(refusal::<Self>(&format!("{} numbers", list.len())));
        };
        let q = DQuat::from_xyzw(x, y, z, w);
        let norm = q.length_squared();
        if !(norm.is_finite() && norm > 1e-12) {
            return Err("a quaternion cannot be zero".into());
        }
        // A quaternion that is already of unit length is kept exactly.
        Ok(Orientation::Quaternion(if (norm - 1.0).abs() < 1e-14 { q } else { q.normalize() }))
    }
    fn from_table(table: OrientationTable) -> Result<Self, String> {
        let axes = [table.long_axis, table.middle_axis, table.short_axis].map(|d| d.map(|d| d.0));
        match (table.axis, table.angle, axes.iter().flatten().count()) {
            (Some(axis), Some(angle), 0) => {
                Ok(Orientation::Quaternion(Turn { axis, angle }.quaternion()))
            }
            (None, None, 1 | 2) => Ok(Orientation::Axes(axes)),
            (None, None, 3) => {
                Err("give at most two of long_axis, middle_axis and short_axis: they fix the third"
                    .into())
            }
            _ => Err(format!("expected {}", Self::EXPECTED)),
        }
    }
}

impl Serialize for Orientation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Orientation::Quaternion(q) => [q.w, q.x, q.y, q.z].serialize(serializer),
            Orientation::Axes(axes) => {
                let names = ["long_axis", "middle_axis", "short_axis"].iter();
                serializer
                    .collect_map(names.zip(axes).filter_map(|(name, axis)| Some((name, (*axis)?))))
            }
        }
    }
}

notations!(Direction, Turns, Orientation);
