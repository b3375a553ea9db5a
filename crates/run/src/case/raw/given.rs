//! Vectors that may be constants or formulas: `[0, 0, 1]` or `{ formula = ["0", "0", "sin(t)"] }`.

use std::borrow::Cow;
use std::marker::PhantomData;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use super::forms::{Forms, Never, deserialize, deserialize_forms};
use crate::case::quantity::{Kind, Quantity, Triple};
use grainwake_solver::math::Formula;

/// Names that a formula may use.
pub trait Variables: 'static {
    /// The names.
    const NAMES: &'static [&'static str];
}

/// Formulas of the position: x, y, z [m].
#[derive(Clone, Copy, Debug)]
pub enum OfPlace {}
impl Variables for OfPlace {
    const NAMES: &'static [&'static str] = &["x", "y", "z"];
}

/// Formulas of the time: t [s].
#[derive(Clone, Copy, Debug)]
pub enum OfTime {}
impl Variables for OfTime {
    const NAMES: &'static [&'static str] = &["t"];
}

/// One component of a formula; a plain number is one too.
#[derive(Debug)]
struct Component(String);

impl Forms for Component {
    const EXPECTED: &'static str = "a formula such as \"sin(t)\", or a number";
    type List = Never;
    type Table = Never;
    fn from_word(word: &str) -> Result<Self, String> {
        Ok(Component(word.to_owned()))
    }
    fn from_number(number: f64) -> Result<Self, String> {
        Ok(Component(number.to_string()))
    }
}
deserialize_forms!(Component);

/// Table form: `{ formula = [x, y, z] }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FormulaTable {
    formula: Vec<Component>,
}

impl FormulaTable {
    /// The formula, which may use the names of `V`.
    pub fn read<V: Variables>(self) -> Result<Formula, String> {
        let found = self.formula.len();
        let text: [String; 3] = self
            .formula
            .into_iter()
            .map(|component| component.0)
            .collect::<Vec<_>>()
            .try_into()
            .map_err(|_| format!("found {found} formulas; expected three, for x, y and z"))?;
        Formula::parse(text.clone(), V::NAMES).map_err(|message| reworded(&text, message))
    }
}

/// The message of a formula that cannot be read, without the parser's own words for it.
fn reworded(text: &[String; 3], message: String) -> String {
    for (name, component) in ["x", "y", "z"].iter().zip(text) {
        let start = format!("the {name} component \"{component}\": ");
        let Some((said, accepted)) = message
            .strip_prefix(&start)
            .and_then(|rest| rest.split_once("; a formula may use "))
        else {
            continue;
        };
        if !said.starts_with("unknown name") {
            return format!("{start}{}; a formula may use {accepted}", fault(component));
        }
    }
    message
}

/// What may be wrong with a formula that cannot be read.
fn fault(formula: &str) -> &'static str {
    let count = |mark| formula.matches(mark).count();
    if formula.trim().is_empty() {
        "it is empty (write 0 for nothing)"
    } else if count('(') != count(')') {
        "its brackets do not match"
    } else {
        "it cannot be read (every product needs its *, and functions take brackets)"
    }
}

/// Writes a formula in its table form.
pub fn write_formula<S: Serializer>(formula: &Formula, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Table<'a> {
        formula: &'a [String; 3],
    }
    Table {
        formula: formula.text(),
    }
    .serialize(serializer)
}

/// Schema of the table form.
pub fn formula_schema() -> Schema {
    json_schema!({
        "type": "object",
        "description": "formulas in SI units",
        "properties": { "formula": {
            "type": "array",
            "items": { "anyOf": [{ "type": "string" }, { "type": "number" }] },
            "minItems": 3,
            "maxItems": 3,
        } },
        "required": ["formula"],
        "additionalProperties": false,
    })
}

/// A vector of kind `K`, constant or a formula in the names of `V`.
#[derive(Clone, Debug)]
pub enum Given<K, V> {
    /// The same always and everywhere [SI].
    Constant(DVec3),
    /// A formula.
    Formula(Formula, PhantomData<(K, V)>),
}

impl<K, V> Given<K, V> {
    /// The constant, zero where a formula is given, and the formula.
    pub fn parts(&self) -> (DVec3, Option<Formula>) {
        match self {
            Given::Constant(value) => (*value, None),
            Given::Formula(formula, _) => (DVec3::ZERO, Some(formula.clone())),
        }
    }
}

impl<K, V> Default for Given<K, V> {
    fn default() -> Self {
        Given::Constant(DVec3::ZERO)
    }
}

impl<K: Kind, V: Variables> Forms for Given<K, V> {
    const EXPECTED: &'static str = "three components [x, y, z], or { formula = [x, y, z] }";
    type List = Vec<Quantity<K>>;
    type Table = FormulaTable;
    fn from_list(list: Self::List) -> Result<Self, String> {
        match list[..] {
            [x, y, z] => Ok(Given::Constant(DVec3::new(x.si, y.si, z.si))),
            _ => Err(format!(
                "found {} components; expected {}",
                list.len(),
                Self::EXPECTED
            )),
        }
    }
    fn from_table(table: FormulaTable) -> Result<Self, String> {
        Ok(Given::Formula(table.read::<V>()?, PhantomData))
    }
}

impl<'de, K: Kind, V: Variables> Deserialize<'de> for Given<K, V> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize(deserializer)
    }
}

impl<K, V> Serialize for Given<K, V> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Given::Constant(value) => value.to_array().serialize(serializer),
            Given::Formula(formula, _) => write_formula(formula, serializer),
        }
    }
}

impl<K: Kind, V: Variables> JsonSchema for Given<K, V> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("{}OrFormula", Quantity::<K>::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let constant = generator.subschema_for::<Triple<K>>();
        let mut formula = formula_schema();
        formula.insert(
            "description".into(),
            format!("formulas in {}, SI units", V::NAMES.join(", ")).into(),
        );
        json_schema!({ "anyOf": [constant, formula] })
    }
}
