//! Whether a grain moves freely or as prescribed.

use std::borrow::Cow;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use super::forms::{Forms, Never, deserialize_forms};
use super::given::{FormulaTable, OfTime, formula_schema, write_formula};
use crate::case::quantity::{AngularVelocity, Quantity, Triple, Velocity};
use grainwake_solver::math::Formula;

/// Law of a velocity: free, or prescribed.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Law {
    /// Follows the dynamics.
    #[default]
    Free,
    /// Held at this value [SI].
    Prescribed(DVec3),
    /// A formula in t.
    Formula(Formula),
}

impl Law {
    fn word(word: &str) -> Result<Law, String> {
        match word {
            "free" => Ok(Law::Free),
            "fixed" => Ok(Law::Prescribed(DVec3::ZERO)),
            _ => Err(format!(
                "found \"{word}\"; expected \"free\", \"fixed\", a vector or a formula"
            )),
        }
    }
    fn is_fixed(&self) -> bool {
        *self == Law::Prescribed(DVec3::ZERO)
    }
}

impl Serialize for Law {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Law::Free => serializer.serialize_str("free"),
            Law::Prescribed(v) => v.to_array().serialize(serializer),
            Law::Formula(formula) => write_formula(formula, serializer),
        }
    }
}

macro_rules! law {
    ($(#[$doc:meta])* $name:ident, $kind:ty) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct $name(pub Law);
        impl Forms for $name {
            const EXPECTED: &'static str = "\"free\", \"fixed\", a vector [x, y, z] or { formula = [x, y, z] }";
            type List = Vec<Quantity<$kind>>;
            type Table = FormulaTable;
            fn from_table(table: FormulaTable) -> Result<Self, String> {
                Ok($name(Law::Formula(table.read::<OfTime>()?)))
            }
            fn from_word(word: &str) -> Result<Self, String> {
                Law::word(word).map($name)
            }
            fn from_list(list: Self::List) -> Result<Self, String> {
                match list[..] {
                    [x, y, z] => Ok($name(Law::Prescribed(DVec3::new(x.si, y.si, z.si)))),
                    _ => Err(format!("found {} components; expected {}", list.len(), Self::EXPECTED)),
                }
            }
        }
        deserialize_forms!($name);
    };
}
law!(
    /// Law of the translation [m/s].
    TranslationLaw, Velocity
);
law!(
    /// Law of the rotation [rad/s].
    RotationLaw, AngularVelocity
);

/// Laws of translation and rotation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Law of the translation [m/s].
    pub velocity: Law,
    /// Law of the rotation [rad/s, axes of space].
    pub angular_velocity: Law,
}

/// Table form of `Motion`; what is not named is free.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionTable {
    #[serde(default)]
    velocity: TranslationLaw,
    #[serde(default)]
    angular_velocity: RotationLaw,
}

impl Forms for Motion {
    const EXPECTED: &'static str =
        "\"free\", \"fixed\", or { velocity = ..., angular_velocity = ... }";
    type List = Never;
    type Table = MotionTable;
    fn from_word(word: &str) -> Result<Self, String> {
        let law = Law::word(word)
            .map_err(|_| format!("found \"{word}\"; expected {}", Self::EXPECTED))?;
        Ok(Motion {
            velocity: law.clone(),
            angular_velocity: law,
        })
    }
    fn from_table(table: MotionTable) -> Result<Self, String> {
        Ok(Motion {
            velocity: table.velocity.0,
            angular_velocity: table.angular_velocity.0,
        })
    }
}

impl Serialize for Motion {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Table<'a> {
            velocity: &'a Law,
            angular_velocity: &'a Law,
        }
        match (&self.velocity, &self.angular_velocity) {
            (Law::Free, Law::Free) => serializer.serialize_str("free"),
            (v, w) if v.is_fixed() && w.is_fixed() => serializer.serialize_str("fixed"),
            (velocity, angular_velocity) => Table {
                velocity,
                angular_velocity,
            }
            .serialize(serializer),
        }
    }
}

impl JsonSchema for Motion {
    fn schema_name() -> Cow<'static, str> {
        "Motion".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (v, w) = (
            generator.subschema_for::<Triple<Velocity>>(),
            generator.subschema_for::<Triple<AngularVelocity>>(),
        );
        let words = json_schema!({ "enum": ["free", "fixed"] });
        json_schema!({
            "description": Motion::EXPECTED,
            "anyOf": [
                words,
                {
                    "type": "object",
                    "properties": {
                        "velocity": { "anyOf": [words, v, formula_schema()] },
                        "angular_velocity": { "anyOf": [words, w, formula_schema()] },
                    },
                    "additionalProperties": false,
                },
            ],
        })
    }
}

deserialize_forms!(Motion);
