//! Keys that may be written in more than one form: a word, a number, a list or a table.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A form that this key does not have.
#[derive(Debug)]
pub enum Never {}

impl<'de> Deserialize<'de> for Never {
    fn deserialize<D: Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
        Err(de::Error::custom("this form is not accepted here"))
    }
}

/// A value with several written forms. Unsupported forms keep the default, which refuses.
pub trait Forms: Sized {
    /// What is accepted, completing "expected ...".
    const EXPECTED: &'static str;
    /// Contents of the list form.
    type List: for<'de> Deserialize<'de>;
    /// Contents of the table form.
    type Table: for<'de> Deserialize<'de>;

    /// From a word.
    fn from_word(word: &str) -> Result<Self, String> {
        Err(format!("found \"{word}\"; expected {}", Self::EXPECTED))
    }
    /// From a bare number.
    fn from_number(number: f64) -> Result<Self, String> {
        Err(format!("found {number}; expected {}", Self::EXPECTED))
    }
    /// From a list.
    fn from_list(_: Self::List) -> Result<Self, String> {
        Err(format!("found a list; expected {}", Self::EXPECTED))
    }
    /// From a table.
    fn from_table(_: Self::Table) -> Result<Self, String> {
        Err(format!("found a table; expected {}", Self::EXPECTED))
    }
}

struct FormsVisitor<T>(PhantomData<T>);

impl<'de, T: Forms> Visitor<'de> for FormsVisitor<T> {
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
        T::from_number(number as f64).map_err(E::custom)
    }
    fn visit_u64<E: de::Error>(self, number: u64) -> Result<T, E> {
        T::from_number(number as f64).map_err(E::custom)
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

/// Deserialises any of the forms of `T`.
pub fn deserialize<'de, T: Forms, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    deserializer.deserialize_any(FormsVisitor(PhantomData))
}

/// Implements `Deserialize` for a type with `Forms`.
macro_rules! deserialize_forms {
    ($($type:ty),* $(,)?) => {$(
        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $crate::case::raw::forms::deserialize(deserializer)
            }
        }
    )*};
}
pub(crate) use deserialize_forms;
