//! Values that may be written in more than one notation: a word, a number, a list or a table.

use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{Error as WordError, MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, DeserializeOwned, IgnoredAny, IntoDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// Contents of a notation that a value does not have; its conversion refuses them.
#[derive(Debug)]
pub struct Unsupported;

impl<'de> Deserialize<'de> for Unsupported {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        IgnoredAny::deserialize(deserializer).map(|_| Unsupported)
    }
}

impl JsonSchema for Unsupported {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Unsupported".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        false.into()
    }
}

/// A value with one or more notations. A notation that is not implemented is refused.
///
/// `notations!` derives `Deserialize` and `JsonSchema` from it.
pub trait Notation: Sized {
    /// Accepted notations, completing "expected ...".
    const EXPECTED: &'static str;
    /// Contents of the list.
    type List: for<'de> Deserialize<'de> + JsonSchema;
    /// Contents of the table.
    type Table: for<'de> Deserialize<'de> + JsonSchema;

    /// Converts a word.
    fn from_word(word: &str) -> Result<Self, String> {
        Err(refusal::<Self>(&format!("\"{word}\"")))
    }
    /// Converts a number without unit.
    fn from_number(number: f64) -> Result<Self, String> {
        Err(refusal::<Self>(&number.to_string()))
    }
    /// Converts a list.
    fn from_list(_: Self::List) -> Result<Self, String> {
        Err(refusal::<Self>("a list"))
    }
    /// Converts a table.
    fn from_table(_: Self::Table) -> Result<Self, String> {
        Err(refusal::<Self>("a table"))
    }
    /// Schemas of the word and of the number.
    fn scalar_schemas(_: &mut SchemaGenerator) -> Vec<Schema> {
        Vec::new()
    }
}

/// Message about a value that has no accepted notation.
pub fn refusal<T: Notation>(found: &str) -> String {
    format!("found {found}; expected {}", T::EXPECTED)
}

/// Value of an enumeration from its word; the error lists the accepted words.
pub fn variant<T: DeserializeOwned>(word: &str) -> Result<T, String> {
    T::deserialize(word.into_deserializer()).map_err(|error: WordError| error.to_string())
}

struct NotationVisitor<T>(PhantomData<T>);

impl<'de, T: Notation> Visitor<'de> for NotationVisitor<T> {
    type Value = T;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::EXPECTED)
    }
    fn visit_str<E: de::Error>(self, word: &str) -> Result<T, E> {
        T::from_word(word).map_err(E::custom)
    }
    fn visit_f64<E: de::Error>(self, number: f64) -> Result<T, E> {
        T::from_number(number).map_err(E::custom)
    }
    fn visit_i64<E: de::Error>(self, number: i64) -> Result<T, E> {
        self.visit_f64(number as f64)
    }
    fn visit_u64<E: de::Error>(self, number: u64) -> Result<T, E> {
        self.visit_f64(number as f64)
    }
    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<T, A::Error> {
        T::from_list(T::List::deserialize(SeqAccessDeserializer::new(seq))?)
            .map_err(de::Error::custom)
    }
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        T::from_table(T::Table::deserialize(MapAccessDeserializer::new(map))?)
            .map_err(de::Error::custom)
    }
}

/// Deserialises any of the notations of `T`.
pub fn deserialize<'de, T: Notation, D: Deserializer<'de>>(d: D) -> Result<T, D::Error> {
    d.deserialize_any(NotationVisitor(PhantomData))
}

/// JSON schema of all notations of `T`.
pub fn schema<T: Notation>(generator: &mut SchemaGenerator) -> Schema {
    let mut notations = T::scalar_schemas(generator);
    notations.push(generator.subschema_for::<T::List>());
    notations.push(generator.subschema_for::<T::Table>());
    notations.retain(|schema| schema.as_bool() != Some(false));
    json_schema!({ "description": T::EXPECTED, "anyOf": notations })
}

/// Implements `Deserialize` and `JsonSchema` for types with [`Notation`].
macro_rules! notations {
    ($($name:ident $(<$($kind:ident: $bound:path),*>)?),* $(,)?) => {$(
        impl<'de $($(, $kind: $bound)*)?> serde::Deserialize<'de> for $name $(<$($kind),*>)? {
            fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                $crate::case::notation::deserialize(d)
            }
        }
        impl$(<$($kind: $bound),*>)? schemars::JsonSchema for $name $(<$($kind),*>)? {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                [stringify!($name), $($(&$kind::schema_name()),*)?].concat().into()
            }
            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                $crate::case::notation::schema::<Self>(generator)
            }
        }
    )*};
}
pub(crate) use notations;
