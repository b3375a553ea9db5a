//! `[expect]`: results that the run must give.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use super::forms::{Forms, Never};
use crate::case::loc::Loc;
use crate::case::quantity::{Kind, Number, Quantity, Rate, Time, Velocity, parse_quantity};

/// Expected results. A run that misses one ends with exit code 1.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawExpect {
    /// Largest speed along gravity of a grain [m/s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_settling_speed: Option<OneOrMany<RawExpected<Velocity>>>,
    /// First contact of the pair [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kiss_time: Option<OneOrMany<RawExpected<Time>>>,
    /// Start of the tumbling [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tumble_time: Option<OneOrMany<RawExpected<Time>>>,
    /// Last parting of the pair [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separation_time: Option<OneOrMany<RawExpected<Time>>>,
    /// First contact of a grain with the floor [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub landing_time: Option<OneOrMany<RawExpected<Time>>>,
    /// Number of role changes of the pair.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub role_changes: Option<OneOrMany<RawExpected<Number>>>,
    /// Simulated time at the end [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_time: Option<OneOrMany<RawExpected<Time>>>,
    /// Largest |div u| after any step [1/s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_divergence: Option<OneOrMany<RawExpected<Rate>>>,
}

impl RawExpect {
    /// Whether nothing is expected.
    pub fn is_empty(&self) -> bool {
        self.peak_settling_speed.is_none()
            && self.kiss_time.is_none()
            && self.tumble_time.is_none()
            && self.separation_time.is_none()
            && self.landing_time.is_none()
            && self.role_changes.is_none()
            && self.end_time.is_none()
            && self.max_divergence.is_none()
    }
}

/// One expected result: `value` with `tolerance`, or a bound.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "")]
#[schemars(rename = "Expected{K}")]
pub struct RawExpected<K: Kind> {
    /// Expected value [SI].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<Loc<Quantity<K>>>,
    /// Largest difference from `value`: in its unit, or relative as in "2 %".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Loc<Tolerance<K>>>,
    /// Lower bound [SI].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_least: Option<Loc<Quantity<K>>>,
    /// Upper bound [SI].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_most: Option<Loc<Quantity<K>>>,
    /// Which grain; any grain (the largest value, or the first to land) if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grain: Option<Loc<usize>>,
}

/// A difference: absolute, or relative to the value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance<K> {
    /// In the unit of the value.
    Absolute(Quantity<K>),
    /// As a fraction of the value.
    Relative(f64),
}

impl<K: Kind> Forms for Tolerance<K> {
    const EXPECTED: &'static str =
        "a difference in the unit of the value, or a percentage such as \"2 %\"";
    type List = Never;
    type Table = Never;
    fn from_word(word: &str) -> Result<Self, String> {
        if word.trim_end().ends_with('%') {
            return parse_quantity::<Number>(word).map(Tolerance::Relative);
        }
        parse_quantity::<K>(word).map(|si| Tolerance::Absolute(Quantity::new(si)))
    }
    fn from_number(number: f64) -> Result<Self, String> {
        Ok(Tolerance::Absolute(Quantity::new(number)))
    }
}

impl<'de, K: Kind> Deserialize<'de> for Tolerance<K> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        super::forms::deserialize(deserializer)
    }
}

impl<K> Serialize for Tolerance<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Tolerance::Absolute(q) => q.serialize(serializer),
            Tolerance::Relative(fraction) => {
                serializer.serialize_str(&format!("{} %", fraction * 100.0))
            }
        }
    }
}

impl<K: Kind> JsonSchema for Tolerance<K> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Tolerance".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"], "description": Tolerance::<K>::EXPECTED, "examples": ["2 %", K::EXAMPLE] })
    }
}

/// One value or a list of them.
#[derive(Clone, Debug)]
pub struct OneOrMany<T>(pub Vec<Loc<T>>);

impl<T: for<'de> Deserialize<'de>> Forms for OneOrMany<T> {
    const EXPECTED: &'static str =
        "a table such as { value = ..., tolerance = \"2 %\" }, or a list of them";
    type List = Vec<Loc<T>>;
    type Table = T;
    fn from_list(list: Vec<Loc<T>>) -> Result<Self, String> {
        Ok(OneOrMany(list))
    }
    fn from_table(table: T) -> Result<Self, String> {
        Ok(OneOrMany(vec![Loc::none(table)]))
    }
}

impl<'de, T: for<'a> Deserialize<'a>> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        super::forms::deserialize(deserializer)
    }
}

impl<T: Serialize> Serialize for OneOrMany<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<T: JsonSchema> JsonSchema for OneOrMany<T> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("OneOrMany{}", T::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<T>();
        json_schema!({ "anyOf": [one, { "type": "array", "items": one }] })
    }
}
