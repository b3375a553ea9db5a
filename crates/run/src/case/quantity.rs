//! Numbers with units: a bare number is SI, a string carries its unit ("2 mm").

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, SeqAccess, Visitor};
use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::suggest::nearest;
use super::units::{Dimension, UnitError, known_symbols, parse_unit};

/// What a quantity measures. `NAME` and `EXAMPLE` go into messages and the schema.
pub trait Kind: JsonSchema + 'static {
    /// Dimension of the quantity.
    const DIMENSION: Dimension;
    /// Name with its article, "a length".
    const NAME: &'static str;
    /// SI unit, "m".
    const SI: &'static str;
    /// How to write one with a unit, "2 mm".
    const EXAMPLE: &'static str;
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident ($m:expr, $l:expr, $t:expr, $a:expr) $text:literal, $si:literal, $example:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum $name {}
        impl Kind for $name {
            const DIMENSION: Dimension = Dimension::new($m, $l, $t, $a);
            const NAME: &'static str = $text;
            const SI: &'static str = $si;
            const EXAMPLE: &'static str = $example;
        }
        // Only the name counts: it tells generic tables of different kinds apart.
        impl JsonSchema for $name {
            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }
            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                Quantity::<$name>::json_schema(generator)
            }
        }
    )*};
}

kinds! {
    /// Length [m].
    Length(0, 1, 0, 0) "a length", "m", "2 mm";
    /// Time [s].
    Time(0, 0, 1, 0) "a time", "s", "5 ms";
    /// Density [kg/m^3].
    Density(1, -3, 0, 0) "a density", "kg/m3", "1500 kg/m3";
    /// Dynamic viscosity [Pa s].
    DynamicViscosity(1, -1, -1, 0) "a dynamic viscosity", "Pa s", "1 mPa s";
    /// Kinematic viscosity [m^2/s].
    KinematicViscosity(0, 2, -1, 0) "a kinematic viscosity", "m2/s", "1 cSt";
    /// Velocity [m/s].
    Velocity(0, 1, -1, 0) "a velocity", "m/s", "10 mm/s";
    /// Acceleration [m/s^2].
    Acceleration(0, 1, -2, 0) "an acceleration", "m/s2", "9.81 m/s2";
    /// Angle [rad].
    Angle(0, 0, 0, 1) "an angle", "rad", "45 deg";
    /// Angular velocity [rad/s].
    AngularVelocity(0, 0, -1, 1) "an angular velocity", "rad/s", "90 deg/s";
    /// Stiffness [N/m].
    Stiffness(1, 0, -2, 0) "a stiffness", "N/m", "100 N/m";
    /// Elastic modulus [Pa].
    ElasticModulus(1, -1, -2, 0) "an elastic modulus", "Pa", "70 GPa";
    /// Rate [1/s].
    Rate(0, 0, -1, 0) "a rate", "1/s", "2 1/s";
    /// Plain number.
    Number(0, 0, 0, 0) "a plain number", "1", "0.5";
}

/// A value in SI units.
pub struct Quantity<K> {
    /// The value [SI].
    pub si: f64,
    kind: PhantomData<K>,
}

impl<K> Quantity<K> {
    /// A quantity from its value in SI units.
    pub const fn new(si: f64) -> Self {
        Quantity {
            si,
            kind: PhantomData,
        }
    }
}
impl<K> Clone for Quantity<K> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<K> Copy for Quantity<K> {}
impl<K> Default for Quantity<K> {
    fn default() -> Self {
        Quantity::new(0.0)
    }
}
impl<K> PartialEq for Quantity<K> {
    fn eq(&self, other: &Self) -> bool {
        self.si == other.si
    }
}
impl<K> fmt::Debug for Quantity<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.si.fmt(f)
    }
}

fn how_to_write<K: Kind>() -> String {
    if K::SI == "1" {
        format!("a plain number such as {}", K::EXAMPLE)
    } else {
        format!(
            "{} as a number in {} or a string such as \"{}\"",
            K::NAME,
            K::SI,
            K::EXAMPLE
        )
    }
}

/// Reads "2 mm" as a quantity of kind `K` in SI units; the error says what is accepted.
pub fn parse_quantity<K: Kind>(text: &str) -> Result<f64, String> {
    let trimmed = text.trim();
    let end = number_end(trimmed);
    let value: f64 = trimmed[..end].parse().map_err(|_| {
        format!(
            "\"{text}\" does not start with a number; write {}",
            how_to_write::<K>()
        )
    })?;
    let unit = trimmed[end..].trim();
    if unit.is_empty() {
        return Ok(value);
    }
    let scale = parse_unit(unit).map_err(|error| match error {
        UnitError::Unknown(symbol) => {
            let symbols = known_symbols();
            let near = || nearest(&symbol, symbols.iter().map(String::as_str)).map(str::to_string);
            let hint = parted(unit, &symbol, K::DIMENSION)
                .or_else(near)
                .map_or(String::new(), |s| format!(" (did you mean `{s}`?)"));
            format!(
                "unknown unit `{symbol}` in \"{text}\"{hint}; write {}",
                how_to_write::<K>()
            )
        }
        UnitError::Malformed(unit) => format!(
            "the unit `{unit}` in \"{text}\" cannot be read; write {}",
            how_to_write::<K>()
        ),
    })?;
    let bare_angle = Dimension {
        angle: 0,
        ..K::DIMENSION
    };
    if scale.dimension != K::DIMENSION
        && !(K::DIMENSION.angle != 0 && scale.dimension == bare_angle)
    {
        return Err(format!(
            "\"{text}\" is {}; expected {}",
            scale.dimension.describe(),
            how_to_write::<K>()
        ));
    }
    Ok(scale.to_si(value))
}

/// The unit with a space or slash in `symbol` that gives it the right dimension: "mPas" is "mPa s".
fn parted(unit: &str, symbol: &str, dimension: Dimension) -> Option<String> {
    let cuts = symbol.char_indices().skip(1);
    cuts.flat_map(|(cut, _)| [" ", "/"].map(|between| (cut, between)))
        .map(|(cut, between)| {
            let (first, second) = symbol.split_at(cut);
            unit.replacen(symbol, &format!("{first}{between}{second}"), 1)
        })
        .find(|parted| parse_unit(parted).is_ok_and(|scale| scale.dimension == dimension))
}

/// Length of the leading number of `text`, in bytes.
fn number_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |mut i: usize| {
        while i < bytes.len() && (bytes[i].is_ascii_digit() || bytes[i] == b'.') {
            i += 1;
        }
        i
    };
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let mantissa = digits(sign);
    if mantissa < bytes.len() && matches!(bytes[mantissa], b'e' | b'E') {
        let after = mantissa + 1;
        let start = after + usize::from(matches!(bytes.get(after), Some(b'+' | b'-')));
        let end = digits(start);
        if end > start {
            return end;
        }
    }
    mantissa
}

impl<'de, K: Kind> Deserialize<'de> for Quantity<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct QuantityVisitor<K>(PhantomData<K>);
        impl<K: Kind> QuantityVisitor<K> {
            fn finite<E: de::Error>(value: f64) -> Result<Quantity<K>, E> {
                if value.is_finite() {
                    Ok(Quantity::new(value))
                } else {
                    Err(E::custom(format!(
                        "found {value}; expected {}",
                        how_to_write::<K>()
                    )))
                }
            }
        }
        impl<K: Kind> Visitor<'_> for QuantityVisitor<K> {
            type Value = Quantity<K>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&how_to_write::<K>())
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Self::Value, E> {
                Self::finite(value)
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Self::Value, E> {
                Self::finite(value as f64)
            }
            fn visit_u64<E: de::Error>(self, value: u64) -> Result<Self::Value, E> {
                Self::finite(value as f64)
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Self::Value, E> {
                Self::finite(parse_quantity::<K>(text).map_err(E::custom)?)
            }
        }
        deserializer.deserialize_any(QuantityVisitor(PhantomData))
    }
}

impl<K> Serialize for Quantity<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.si)
    }
}

impl<K: Kind> JsonSchema for Quantity<K> {
    fn schema_name() -> Cow<'static, str> {
        K::schema_name()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": how_to_write::<K>(),
            "anyOf": [{ "type": "number" }, { "type": "string", "examples": [K::EXAMPLE] }],
        })
    }
}

/// Three quantities of one kind.
pub struct Triple<K> {
    /// The values [SI].
    pub si: DVec3,
    kind: PhantomData<K>,
}

impl<K> Triple<K> {
    /// A vector from its values in SI units.
    pub const fn new(si: DVec3) -> Self {
        Triple {
            si,
            kind: PhantomData,
        }
    }
}
impl<K> Clone for Triple<K> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<K> Copy for Triple<K> {}
impl<K> Default for Triple<K> {
    fn default() -> Self {
        Triple::new(DVec3::ZERO)
    }
}
impl<K> PartialEq for Triple<K> {
    fn eq(&self, other: &Self) -> bool {
        self.si == other.si
    }
}
impl<K> fmt::Debug for Triple<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.si.fmt(f)
    }
}

struct TripleVisitor<K>(PhantomData<K>);

impl<'de, K: Kind> Visitor<'de> for TripleVisitor<K> {
    type Value = Triple<K>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "three components [x, y, z], each {}",
            how_to_write::<K>()
        )
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = seq.next_element::<Quantity<K>>()? {
            values.push(value.si);
        }
        match values[..] {
            [x, y, z] => Ok(Triple::new(DVec3::new(x, y, z))),
            _ => Err(de::Error::invalid_length(values.len(), &self)),
        }
    }
}

impl<'de, K: Kind> Deserialize<'de> for Triple<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TripleVisitor(PhantomData))
    }
}

impl<K> Serialize for Triple<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut seq = serializer.serialize_seq(Some(3))?;
        for value in self.si.to_array() {
            seq.serialize_element(&value)?;
        }
        seq.end()
    }
}

impl<K: Kind> JsonSchema for Triple<K> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("{}Triple", Quantity::<K>::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let item = generator.subschema_for::<Quantity<K>>();
        json_schema!({ "type": "array", "items": item, "minItems": 3, "maxItems": 3 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_numbers_and_units() {
        assert_eq!(parse_quantity::<Length>("2 mm"), Ok(0.002));
        assert_eq!(parse_quantity::<Length>("2e-3"), Ok(0.002));
        assert_eq!(parse_quantity::<Length>("-2.5e1mm"), Ok(-0.025));
        assert_eq!(parse_quantity::<DynamicViscosity>("1 mPa s"), Ok(1e-3));
        assert_eq!(parse_quantity::<Angle>("180 deg"), Ok(std::f64::consts::PI));
        assert_eq!(parse_quantity::<AngularVelocity>("2 1/s"), Ok(2.0));
    }

    #[test]
    fn wrong_dimension_names_the_expected_unit() {
        let message = parse_quantity::<Length>("2 kg").unwrap_err();
        assert!(
            message.contains("is a mass")
                && message.contains("a length")
                && message.contains("2 mm"),
            "{message}"
        );
        let message = parse_quantity::<Length>("2 mmm").unwrap_err();
        assert!(message.contains("did you mean `mm`"), "{message}");
        let message = parse_quantity::<KinematicViscosity>("1 mPa s").unwrap_err();
        assert!(
            message.contains("dynamic viscosity") && message.contains("1 cSt"),
            "{message}"
        );
        for (text, wanted) in [("1 mPas", "`mPa s`"), ("1 mPaS", "`mPa`")] {
            let message = parse_quantity::<DynamicViscosity>(text).unwrap_err();
            assert!(
                message.contains(&format!("did you mean {wanted}?")),
                "{message}"
            );
        }
        let message = parse_quantity::<Density>("2 kgm3").unwrap_err();
        assert!(message.contains("did you mean `kg/m3`?"), "{message}");
        assert!(parse_quantity::<Number>("45 deg").is_err());
        assert!(parse_quantity::<Length>("mm").is_err());
    }
}
