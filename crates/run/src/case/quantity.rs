//! Numbers with units: a bare number is SI, a string carries its unit ("2 mm").

use std::borrow::Cow;
use std::f64::consts::TAU;
use std::fmt::Debug;
use std::marker::PhantomData;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::notation::{Notation, Unsupported, deserialize, refusal, schema};
use super::suggest::nearest;
use super::units::{Dimension, UnitError, known_symbols, parse_unit};
use crate::number_format::quantity;

/// Kind of physical quantity.
pub trait Kind: Copy + Debug + Default + PartialEq + JsonSchema + 'static {
    /// Dimension of the quantity.
    const DIMENSION: Dimension;
    /// SI unit, "m".
    const SI: &'static str;
    /// Largest value that is accepted [SI]: beyond it products of quantities overflow.
    const LARGEST: f64;
    /// Example with a unit, "2 mm".
    const EXAMPLE: &'static str;
    /// Accepted notations, completing "expected ...".
    const EXPECTED: &'static str;
    /// Accepted notations of a vector.
    const EXPECTED_VECTOR: &'static str;
}

/// Notations of a quantity; a plain number has no unit.
macro_rules! expected {
    ($prefix:literal, $name:literal, "1", $example:literal) => {
        concat!($prefix, "a plain number such as ", $example)
    };
    ($prefix:literal, $name:literal, $si:literal, $example:literal) => {
        concat!($prefix, $name, " as a number in ", $si, " or a string such as \"", $example, "\"")
    };
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident ($m:expr, $l:expr, $t:expr, $a:expr) $name:tt, $si:tt, $largest:tt, $example:tt;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $kind;
        impl Kind for $kind {
            const DIMENSION: Dimension = Dimension::new($m, $l, $t, $a);
            const SI: &'static str = $si;
            const LARGEST: f64 = $largest;
            const EXAMPLE: &'static str = $example;
            const EXPECTED: &'static str = expected!("", $name, $si, $example);
            const EXPECTED_VECTOR: &'static str =
                expected!("three components [x, y, z], each ", $name, $si, $example);
        }
        // Generic tables of different kinds are distinguished by the name of the kind.
        impl JsonSchema for $kind {
            fn schema_name() -> Cow<'static, str> {
                stringify!($kind).into()
            }
            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                Quantity::<$kind>::json_schema(generator)
            }
        }
    )*
        /// Dimension and name of every kind.
        const NAMES: &[(Dimension, &str)] = &[$(($kind::DIMENSION, $name)),*];
    };
}

kinds! {
    /// Length [m]; grains and boxes have bounds of their own.
    Length(0, 1, 0, 0) "a length", "m", (f64::MAX), "2 mm";
    /// Time [s].
    Time(0, 0, 1, 0) "a time", "s", 1e12, "5 ms";
    /// Density [kg/m^3].
    Density(1, -3, 0, 0) "a density", "kg/m3", 1e30, "1500 kg/m3";
    /// Dynamic viscosity [Pa s].
    DynamicViscosity(1, -1, -1, 0) "a dynamic viscosity", "Pa s", 1e15, "1 mPa s";
    /// Kinematic viscosity [m^2/s].
    KinematicViscosity(0, 2, -1, 0) "a kinematic viscosity", "m2/s", 1e15, "1 cSt";
    /// Velocity [m/s].
    Velocity(0, 1, -1, 0) "a velocity", "m/s", 1e6, "10 mm/s";
    /// Acceleration [m/s^2].
    Acceleration(0, 1, -2, 0) "an acceleration", "m/s2", 1e9, "9.81 m/s2";
    /// Angle [rad].
    Angle(0, 0, 0, 1) "an angle", "rad", 1e9, "45 deg";
    /// Angular velocity [rad/s].
    AngularVelocity(0, 0, -1, 1) "an angular velocity", "rad/s", 1e9, "90 deg/s";
    /// Stiffness [N/m].
    Stiffness(1, 0, -2, 0) "a stiffness", "N/m", 1e15, "100 N/m";
    /// Elastic modulus [Pa].
    ElasticModulus(1, -1, -2, 0) "an elastic modulus", "Pa", 1e15, "70 GPa";
    /// Force [N].
    Force(1, 1, -2, 0) "a force", "N", 1e15, "2 uN";
    /// Torque [N m].
    Torque(1, 2, -2, 0) "a torque", "N m", 1e15, "2 nN m";
    /// Rate [1/s].
    Rate(0, 0, -1, 0) "a rate", "1/s", 1e12, "2 1/s";
    /// Plain number.
    Number(0, 0, 0, 0) "a plain number", "1", 1e15, "0.5";
}

/// A value of kind `K`: a number, or a vector ([`Triple`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantity<K, T = f64> {
    /// Value [SI].
    pub si: T,
    kind: PhantomData<K>,
}

/// Three quantities of one kind.
pub type Triple<K> = Quantity<K, DVec3>;

impl<K, T> Quantity<K, T> {
    /// Returns the quantity with this value [SI].
    pub const fn new(si: T) -> Self {
        let kind = PhantomData;
        Quantity { si, kind }
    }
}

impl<K: Kind> Notation for Quantity<K> {
    const EXPECTED: &'static str = K::EXPECTED;
    type List = Unsupported;
    type Table = Unsupported;
    fn from_word(word: &str) -> Result<Self, String> {
        parse_quantity::<K>(word).map(Quantity::new)
    }
    fn from_number(number: f64) -> Result<Self, String> {
        without_unit::<K>(number).map(Quantity::new)
    }
    fn scalar_schemas(_: &mut SchemaGenerator) -> Vec<Schema> {
        let word = json_schema!({ "type": "string", "examples": [K::EXAMPLE] });
        vec![json_schema!({ "type": "number" }), word]
    }
}

impl<K: Kind> Notation for Triple<K> {
    const EXPECTED: &'static str = K::EXPECTED_VECTOR;
    type List = Vec<Quantity<K>>;
    type Table = Unsupported;
    fn from_list(list: Self::List) -> Result<Self, String> {
        match list[..] {
            [x, y, z] => Ok(Triple::new(DVec3::new(x.si, y.si, z.si))),
            _ => Err(refusal::<Self>(&format!("{} components", list.len()))),
        }
    }
}

impl<K, T: Serialize> Serialize for Quantity<K, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.si.serialize(serializer)
    }
}

impl<'de, K, T> Deserialize<'de> for Quantity<K, T>
where
    Quantity<K, T>: Notation,
{
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize(deserializer)
    }
}

impl<K: Kind> JsonSchema for Quantity<K> {
    fn schema_name() -> Cow<'static, str> {
        K::schema_name()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        schema::<Self>(generator)
    }
}

impl<K: Kind> JsonSchema for Triple<K> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        format!("{}Triple", K::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let item = generator.subschema_for::<Quantity<K>>();
        json_schema!({ "type": "array", "items": item, "minItems": 3, "maxItems": 3 })
    }
}

/// Accepts a number without a unit as a quantity of kind `K`.
///
/// # Errors
/// The number is beyond the largest of its kind, not finite, or an angle of more than a turn; the
/// message says what is accepted.
pub fn without_unit<K: Kind>(number: f64) -> Result<f64, String> {
    within_range::<K>(number)?;
    // Degrees without a unit are the commonest mistake.
    if K::SI == Angle::SI && number.abs() > TAU {
        return Err(format!(
            "found {number}, which is more than a turn in radians; write \"{number} deg\" for \
             degrees, or \"{number} rad\""
        ));
    }
    Ok(number)
}

/// Reads "2 mm" as a quantity of kind `K` in SI units.
///
/// # Errors
/// The text is no number with a unit of the kind, or beyond the largest of its kind; the message
/// says what is accepted.
pub fn parse_quantity<K: Kind>(text: &str) -> Result<f64, String> {
    let trimmed = text.trim();
    let end = number_end(trimmed);
    let value: f64 = trimmed[..end]
        .parse()
        .map_err(|_| format!("\"{text}\" does not start with a number; write {}", K::EXPECTED))?;
    let unit = trimmed[end..].trim();
    if unit.strip_prefix(',').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit())) {
        return Err(format!(
            "\"{text}\" has a comma in its number, and the decimal separator is a point; write {}",
            K::EXPECTED
        ));
    }
    if unit.is_empty() {
        return without_unit::<K>(value);
    }
    let scale = parse_unit(unit).map_err(|error| match error {
        UnitError::Unknown(symbol) => {
            let symbols = known_symbols();
            let fits = |candidate: &&str| {
                has_dimension(&unit.replacen(&symbol, candidate, 1), K::DIMENSION)
            };
            let symbols = symbols.iter().map(String::as_str).filter(fits);
            let near = || nearest(&symbol, symbols).map(str::to_string);
            let hint = parted(unit, &symbol, K::DIMENSION)
                .or_else(near)
                .map_or(String::new(), |s| format!(" (did you mean `{s}`?)"));
            format!("unknown unit `{symbol}` in \"{text}\"{hint}; write {}", K::EXPECTED)
        }
        UnitError::Malformed(unit) => {
            format!("the unit `{unit}` in \"{text}\" cannot be read; write {}", K::EXPECTED)
        }
    })?;
    // "1/s" is understood as rad/s; a frequency counts turns, and a share of 1 is no angle.
    let bare_angle = K::DIMENSION.angle != 0
        && scale.dimension == Dimension { angle: 0, ..K::DIMENSION }
        && !unit.contains(['%', 'H']);
    if scale.dimension != K::DIMENSION && !bare_angle {
        return Err(format!(
            "\"{text}\" is {}; expected {}",
            describe(scale.dimension),
            K::EXPECTED
        ));
    }
    within_range::<K>(scale.to_si(value))
}

/// Accepts a number [SI] up to the largest of its kind.
fn within_range<K: Kind>(si: f64) -> Result<f64, String> {
    if si.abs() <= K::LARGEST {
        return Ok(si);
    }
    if !si.is_finite() {
        return Err(format!("found {si}; expected {}", K::EXPECTED));
    }
    let [found, largest] = [si, K::LARGEST].map(|value| quantity(value, K::SI));
    Err(format!("found {found}; accepted: up to {largest}"))
}

/// The unit with a space or slash in `symbol` that gives it the right dimension: "mPas" is "mPa s".
fn parted(unit: &str, symbol: &str, dimension: Dimension) -> Option<String> {
    let cuts = symbol.char_indices().skip(1);
    cuts.flat_map(|(cut, _)| [" ", "/"].map(|between| (cut, between)))
        .map(|(cut, between)| {
            let (first, second) = symbol.split_at(cut);
            unit.replacen(symbol, &format!("{first}{between}{second}"), 1)
        })
        .find(|parted| has_dimension(parted, dimension))
}

/// Returns whether `unit` can be read and has the given dimension.
fn has_dimension(unit: &str, dimension: Dimension) -> bool {
    parse_unit(unit).is_ok_and(|scale| scale.dimension == dimension)
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

/// Name of a dimension with its article, for messages.
fn describe(dimension: Dimension) -> String {
    let others = [
        (Dimension::new(1, 0, 0, 0), "a mass"),
        (Dimension::new(0, 2, 0, 0), "an area"),
        (Dimension::new(0, 3, 0, 0), "a volume"),
        (Dimension::new(1, 2, -2, 0), "an energy or a torque"),
        (Dimension::new(1, -1, -2, 0), "a pressure"),
    ];
    let mut known = others.iter().chain(NAMES);
    known
        .find(|(candidate, _)| *candidate == dimension)
        .map_or_else(|| format!("in {dimension}"), |(_, name)| (*name).into())
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
        // Turns per second and shares are no angles.
        assert!(parse_quantity::<AngularVelocity>("2 Hz").is_err());
        assert!(parse_quantity::<Angle>("50 %").is_err());
    }

    #[test]
    fn numbers_that_no_case_has_are_refused() {
        let refused = without_unit::<Velocity>(-1e150).unwrap_err();
        assert_eq!(refused, "found -1e150 m/s; accepted: up to 1000000 m/s");
        assert!(parse_quantity::<Velocity>("1e150 mm/s").is_err());
        assert!(without_unit::<Length>(f64::NAN).unwrap_err().starts_with("found NaN; expected"));
        assert!(parse_quantity::<Time>("1e400 s").unwrap_err().starts_with("found inf; expected"));
        assert_eq!(parse_quantity::<Stiffness>("1e15 N/m"), Ok(1e15));
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
        assert!(message.contains("dynamic viscosity") && message.contains("1 cSt"), "{message}");
        let message = parse_quantity::<DynamicViscosity>("1 mPas").unwrap_err();
        assert!(message.contains("did you mean `mPa s`?"), "{message}");
        for (text, wanted) in [("2 kgm3", "`kg/m3`"), ("2 kgg/m3", "`kg`")] {
            let message = parse_quantity::<Density>(text).unwrap_err();
            assert!(message.contains(&format!("did you mean {wanted}?")), "{message}");
        }
        // Only units of the expected dimension are suggested.
        for refused in [
            parse_quantity::<Length>("0.02 in"),
            parse_quantity::<Density>("1.5 g/cc"),
            parse_quantity::<DynamicViscosity>("1 mPaS"),
        ] {
            let message = refused.unwrap_err();
            assert!(message.contains("unknown unit") && !message.contains("did you"), "{message}");
        }
        for text in ["0,5 mm", "-1,5e-3", "1,000.5 m"] {
            let message = parse_quantity::<Length>(text).unwrap_err();
            assert!(message.contains("the decimal separator is a point"), "{message}");
        }
        assert!(parse_quantity::<Number>("45 deg").is_err());
        assert!(parse_quantity::<Length>("mm").is_err());
    }
}
