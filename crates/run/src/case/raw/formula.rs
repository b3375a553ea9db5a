//! Vectors that may be constants or formulas: `[0, 0, 1]` or `{ formula = ["0", "0", "sin(t)"] }`.

use std::borrow::Cow;
use std::marker::PhantomData;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

use crate::case::notation::{Notation, Unsupported, notations, refusal};
use crate::case::quantity::{Kind, Quantity, Triple};
use grainwake_solver::math::Formula;

/// Variables of a formula.
pub trait Variables: JsonSchema + 'static {
    /// Names of the variables.
    const NAMES: &'static [&'static str];
}

macro_rules! variables {
    ($($(#[$doc:meta])* $set:ident = $names:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum $set {}
        impl Variables for $set {
            const NAMES: &'static [&'static str] = &$names;
        }
        // The schema of a formula takes its name and description from the variables.
        impl JsonSchema for $set {
            fn schema_name() -> Cow<'static, str> {
                stringify!($set).into()
            }
            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!({ "enum": $names })
            }
        }
    )*};
}
variables! {
    /// Position: x, y, z [m].
    OfPosition = ["x", "y", "z"];
    /// Time: t [s].
    OfTime = ["t"];
}

/// One component of a formula, or a number.
#[derive(Debug)]
struct Component(String);

impl Notation for Component {
    const EXPECTED: &'static str = "a formula such as \"sin(t)\", or a number";
    type List = Unsupported;
    type Table = Unsupported;
    fn from_word(word: &str) -> Result<Self, String> {
        Ok(Component(word.to_owned()))
    }
    fn from_number(number: f64) -> Result<Self, String> {
        Ok(Component(number.to_string()))
    }
    fn scalar_schemas(_: &mut SchemaGenerator) -> Vec<Schema> {
        vec![json_schema!({ "type": "string" }), json_schema!({ "type": "number" })]
    }
}
notations!(Component);

/// Table `{ formula = [x, y, z] }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, bound = "")]
pub struct FormulaTable<V> {
    formula: Vec<Component>,
    #[serde(skip)]
    variables: PhantomData<V>,
}

impl<V: Variables> FormulaTable<V> {
    /// Parses the three components.
    fn parse(self) -> Result<Formula, String> {
        let found = self.formula.len();
        let text: Vec<String> = self.formula.into_iter().map(|component| component.0).collect();
        let text: [String; 3] = (text.try_into())
            .map_err(|_| format!("found {found} formulas; expected three, for x, y and z"))?;
        Formula::parse(text.clone(), V::NAMES).map_err(|message| reworded(&text, message))
    }
}

impl<V: Variables> JsonSchema for FormulaTable<V> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("Formula{}", V::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let item = generator.subschema_for::<Component>();
        json_schema!({
            "type": "object",
            "description": format!("formulas in {}, SI units", V::NAMES.join(", ")),
            "properties": {
                "formula": { "type": "array", "items": item, "minItems": 3, "maxItems": 3 },
            },
            "required": ["formula"],
            "additionalProperties": false,
        })
    }
}

/// Message of a malformed formula, with the wording of the parser replaced.
fn reworded(text: &[String; 3], message: String) -> String {
    for (name, component) in ["x", "y", "z"].iter().zip(text) {
        let start = format!("the {name} component \"{component}\": ");
        let Some((said, accepted)) =
            message.strip_prefix(&start).and_then(|rest| rest.split_once("; a formula may use "))
        else {
            continue;
        };
        if !said.starts_with("unknown name") {
            return format!("{start}{}; a formula may use {accepted}", fault(component));
        }
    }
    message
}

/// Probable fault of a malformed formula.
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

/// Vector of kind `K`: constant, or a formula in the variables `V`.
#[derive(Clone, Debug, PartialEq)]
pub enum VectorOrFormula<K, V> {
    /// Constant and uniform vector [SI].
    Constant(DVec3),
    /// Formula.
    Formula(Formula, PhantomData<(K, V)>),
}

impl<K, V> VectorOrFormula<K, V> {
    /// Returns the constant, zero for a formula, and the formula.
    pub fn parts(&self) -> (DVec3, Option<Formula>) {
        match self {
            VectorOrFormula::Constant(value) => (*value, None),
            VectorOrFormula::Formula(formula, _) => (DVec3::ZERO, Some(formula.clone())),
        }
    }
}

impl<K, V> Default for VectorOrFormula<K, V> {
    fn default() -> Self {
        VectorOrFormula::Constant(DVec3::ZERO)
    }
}

impl<K: Kind, V: Variables> Notation for VectorOrFormula<K, V> {
    const EXPECTED: &'static str = "three components [x, y, z], or { formula = [x, y, z] }";
    type List = Vec<Quantity<K>>;
    type Table = FormulaTable<V>;
    fn from_list(list: Self::List) -> Result<Self, String> {
        let found = format!("{} components", list.len());
        let vector = Triple::from_list(list).map_err(|_| refusal::<Self>(&found))?;
        Ok(VectorOrFormula::Constant(vector.si))
    }
    fn from_table(table: FormulaTable<V>) -> Result<Self, String> {
        Ok(VectorOrFormula::Formula(table.parse()?, PhantomData))
    }
}
notations!(VectorOrFormula<K: Kind, V: Variables>);

impl<K, V> Serialize for VectorOrFormula<K, V> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Table<'a> {
            formula: &'a [String; 3],
        }
        match self {
            VectorOrFormula::Constant(value) => value.serialize(serializer),
            VectorOrFormula::Formula(formula, _) => {
                let formula = formula.text();
                Table { formula }.serialize(serializer)
            }
        }
    }
}
