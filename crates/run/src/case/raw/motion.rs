//! Free and prescribed motion of a grain.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use super::formula::{FormulaTable, OfTime, VectorOrFormula};
use crate::case::notation::{Notation, Unsupported, notations, refusal};
use crate::case::quantity::{AngularVelocity, Kind, Quantity, Velocity};
use grainwake_solver::dem::MotionConstraint;
use grainwake_solver::math::Formula;

/// Law of a velocity of kind `K`.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum MotionLaw<K> {
    /// The velocity follows from the loads.
    #[default]
    Free,
    /// The velocity is given.
    Prescribed(VectorOrFormula<K, OfTime>),
}

impl<K: Kind> MotionLaw<K> {
    /// Returns the degree of freedom at t = 0.
    pub fn at_start(&self) -> MotionConstraint {
        match self {
            MotionLaw::Free => MotionConstraint::Free,
            MotionLaw::Prescribed(velocity) => {
                let (constant, formula) = velocity.parts();
                MotionConstraint::Prescribed(formula.map_or(constant, |formula| formula.at(&[0.0])))
            }
        }
    }
    /// Returns the formula, if the velocity is given by one.
    pub fn formula(&self) -> Option<Formula> {
        match self {
            MotionLaw::Free => None,
            MotionLaw::Prescribed(velocity) => velocity.parts().1,
        }
    }
    fn is_fixed(&self) -> bool {
        *self == MotionLaw::Prescribed(VectorOrFormula::default())
    }
}

impl<K: Kind> Notation for MotionLaw<K> {
    const EXPECTED: &'static str =
        "\"free\", \"fixed\", a vector [x, y, z] or { formula = [x, y, z] }";
    type List = Vec<Quantity<K>>;
    type Table = FormulaTable<OfTime>;
    fn from_word(word: &str) -> Result<Self, String> {
        match word {
            "free" => Ok(MotionLaw::Free),
            "fixed" => Ok(MotionLaw::Prescribed(VectorOrFormula::default())),
            _ => Err(refusal::<Self>(&format!("\"{word}\""))),
        }
    }
    fn from_list(list: Self::List) -> Result<Self, String> {
        VectorOrFormula::from_list(list).map(MotionLaw::Prescribed)
    }
    fn from_table(table: FormulaTable<OfTime>) -> Result<Self, String> {
        VectorOrFormula::from_table(table).map(MotionLaw::Prescribed)
    }
    fn scalar_schemas(_: &mut SchemaGenerator) -> Vec<Schema> {
        vec![json_schema!({ "enum": ["free", "fixed"] })]
    }
}

impl<K: Kind> Serialize for MotionLaw<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            MotionLaw::Free => serializer.serialize_str("free"),
            MotionLaw::Prescribed(velocity) => velocity.serialize(serializer),
        }
    }
}

/// Laws of translation and rotation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawMotion {
    /// Law of the translation [m/s].
    pub velocity: MotionLaw<Velocity>,
    /// Law of the rotation [rad/s, axes of space].
    pub angular_velocity: MotionLaw<AngularVelocity>,
}

/// Table of [`RawMotion`]; a law that is not given is free.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionTable {
    /// Law of the translation [m/s].
    #[serde(default)]
    velocity: MotionLaw<Velocity>,
    /// Law of the rotation [rad/s, axes of space].
    #[serde(default)]
    angular_velocity: MotionLaw<AngularVelocity>,
}

impl Notation for RawMotion {
    const EXPECTED: &'static str =
        "\"free\", \"fixed\", or { velocity = ..., angular_velocity = ... }";
    type List = Unsupported;
    type Table = MotionTable;
    fn from_word(word: &str) -> Result<Self, String> {
        let refused = |_| refusal::<Self>(&format!("\"{word}\""));
        Ok(RawMotion {
            velocity: MotionLaw::from_word(word).map_err(refused)?,
            angular_velocity: MotionLaw::from_word(word).map_err(refused)?,
        })
    }
    fn from_table(table: MotionTable) -> Result<Self, String> {
        let MotionTable { velocity, angular_velocity } = table;
        Ok(RawMotion { velocity, angular_velocity })
    }
    fn scalar_schemas(generator: &mut SchemaGenerator) -> Vec<Schema> {
        MotionLaw::<Velocity>::scalar_schemas(generator)
    }
}

impl Serialize for RawMotion {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match (&self.velocity, &self.angular_velocity) {
            (MotionLaw::Free, MotionLaw::Free) => serializer.serialize_str("free"),
            (v, w) if v.is_fixed() && w.is_fixed() => serializer.serialize_str("fixed"),
            (velocity, angular_velocity) => MotionTable {
                velocity: velocity.clone(),
                angular_velocity: angular_velocity.clone(),
            }
            .serialize(serializer),
        }
    }
}

notations!(MotionLaw<K: Kind>, RawMotion);
