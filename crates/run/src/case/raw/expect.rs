//! `[expect]`: results that the run must give.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use crate::case::located::{Located, is_default};
use crate::case::notation::{Notation, Unsupported, notations};
use crate::case::quantity::{Kind, Number, Quantity, Rate, Time, Velocity, parse_quantity};

/// Expected results. A run that misses one ends with exit code 1.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawExpect {
    /// Largest speed along gravity of a grain [m/s].
    #[serde(skip_serializing_if = "is_default")]
    pub peak_settling_speed: OneOrMany<Velocity>,
    /// First contact of the pair [s].
    #[serde(skip_serializing_if = "is_default")]
    pub kiss_time: OneOrMany<Time>,
    /// Start of the tumbling [s].
    #[serde(skip_serializing_if = "is_default")]
    pub tumble_time: OneOrMany<Time>,
    /// Last separation of the pair [s].
    #[serde(skip_serializing_if = "is_default")]
    pub separation_time: OneOrMany<Time>,
    /// First contact of a grain with the floor [s].
    #[serde(skip_serializing_if = "is_default")]
    pub landing_time: OneOrMany<Time>,
    /// Number of role changes of the pair.
    #[serde(skip_serializing_if = "is_default")]
    pub role_changes: OneOrMany<Number>,
    /// Simulated time at the end [s].
    #[serde(skip_serializing_if = "is_default")]
    pub end_time: OneOrMany<Time>,
    /// Largest |div u| after any step [1/s].
    #[serde(skip_serializing_if = "is_default")]
    pub max_divergence: OneOrMany<Rate>,
}

/// One expected result: `value` with `tolerance`, or a bound.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "")]
#[schemars(rename = "Expected{K}")]
pub struct RawExpected<K: Kind> {
    /// Expected value [SI].
    pub value: Option<Located<Quantity<K>>>,
    /// Largest difference from `value`: in its unit, or relative as in "2 %".
    pub tolerance: Option<Located<Tolerance<K>>>,
    /// Lower bound [SI].
    pub at_least: Option<Located<Quantity<K>>>,
    /// Upper bound [SI].
    pub at_most: Option<Located<Quantity<K>>>,
    /// Index of the grain; by default the grain with the largest value, or the first to land.
    pub grain: Option<Located<usize>>,
}

/// A difference: absolute, or relative to the value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance<K> {
    /// Difference in the unit of the value.
    Absolute(Quantity<K>),
    /// Fraction of the value.
    Relative(f64),
}

impl<K: Kind> Notation for Tolerance<K> {
    const EXPECTED: &'static str =
        "a difference in the unit of the value, or a percentage such as \"2 %\"";
    type List = Unsupported;
    type Table = Unsupported;
    fn from_word(word: &str) -> Result<Self, String> {
        if word.trim_end().ends_with('%') {
            return parse_quantity::<Number>(word).map(Tolerance::Relative);
        }
        parse_quantity::<K>(word).map(|si| Tolerance::Absolute(Quantity::new(si)))
    }
    fn from_number(number: f64) -> Result<Self, String> {
        Ok(Tolerance::Absolute(Quantity::new(number)))
    }
    fn scalar_schemas(_: &mut SchemaGenerator) -> Vec<Schema> {
        let types = ["number", "string"];
        vec![json_schema!({ "type": types, "examples": ["2 %", K::EXAMPLE] })]
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

/// Expected values of one quantity: none, one or several.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OneOrMany<K: Kind>(pub Vec<Located<RawExpected<K>>>);

impl<K: Kind> Notation for OneOrMany<K> {
    const EXPECTED: &'static str =
        "a table such as { value = ..., tolerance = \"2 %\" }, or a list of them";
    type List = Vec<Located<RawExpected<K>>>;
    type Table = RawExpected<K>;
    fn from_list(list: Self::List) -> Result<Self, String> {
        Ok(OneOrMany(list))
    }
    fn from_table(table: RawExpected<K>) -> Result<Self, String> {
        Ok(OneOrMany(vec![table.into()]))
    }
}

impl<K: Kind> Serialize for OneOrMany<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

notations!(Tolerance<K: Kind>, OneOrMany<K: Kind>);
