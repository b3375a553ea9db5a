//! Units: dimensions, the table of known units, and the parser of unit expressions.

use std::fmt;

/// Exponents of kilogram, metre, second and radian.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimension {
    /// Exponent of kg.
    pub mass: i8,
    /// Exponent of m.
    pub length: i8,
    /// Exponent of s.
    pub time: i8,
    /// Exponent of rad, which distinguishes an angle from a plain number.
    pub angle: i8,
}

impl Dimension {
    /// A dimension from its exponents of kg, m, s and rad.
    pub const fn new(mass: i8, length: i8, time: i8, angle: i8) -> Dimension {
        Dimension { mass, length, time, angle }
    }
    fn plus(self, other: Dimension, times: i8) -> Option<Dimension> {
        let add = |a: i8, b: i8| b.checked_mul(times).and_then(|b| a.checked_add(b));
        Some(Dimension {
            mass: add(self.mass, other.mass)?,
            length: add(self.length, other.length)?,
            time: add(self.time, other.time)?,
            angle: add(self.angle, other.angle)?,
        })
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bases = [("kg", self.mass), ("m", self.length), ("s", self.time), ("rad", self.angle)];
        let mut separator = "";
        for (unit, power) in bases.into_iter().filter(|(_, power)| *power != 0) {
            write!(f, "{separator}{unit}")?;
            if power != 1 {
                write!(f, "^{power}")?;
            }
            separator = " ";
        }
        Ok(())
    }
}

struct Unit {
    symbol: &'static str,
    factor: f64,
    dimension: Dimension,
    prefixes: bool,
}

const fn unit(symbol: &'static str, factor: f64, d: (i8, i8, i8, i8), prefixes: bool) -> Unit {
    Unit { symbol, factor, dimension: Dimension::new(d.0, d.1, d.2, d.3), prefixes }
}

const UNITS: &[Unit] = &[
    unit("m", 1.0, (0, 1, 0, 0), true),
    unit("g", 1e-3, (1, 0, 0, 0), true),
    unit("s", 1.0, (0, 0, 1, 0), true),
    unit("min", 60.0, (0, 0, 1, 0), false),
    unit("h", 3600.0, (0, 0, 1, 0), false),
    unit("rad", 1.0, (0, 0, 0, 1), false),
    unit("deg", std::f64::consts::PI / 180.0, (0, 0, 0, 1), false),
    unit("°", std::f64::consts::PI / 180.0, (0, 0, 0, 1), false),
    unit("rpm", std::f64::consts::PI / 30.0, (0, 0, -1, 1), false),
    unit("Hz", 1.0, (0, 0, -1, 0), true),
    unit("N", 1.0, (1, 1, -2, 0), true),
    unit("Pa", 1.0, (1, -1, -2, 0), true),
    unit("bar", 1e5, (1, -1, -2, 0), true),
    unit("P", 0.1, (1, -1, -1, 0), true),
    unit("St", 1e-4, (0, 2, -1, 0), true),
    unit("L", 1e-3, (0, 3, 0, 0), true),
    unit("%", 0.01, (0, 0, 0, 0), false),
    unit("t", 1e3, (1, 0, 0, 0), false),
];

/// Decimal exponents, so that `prefixed` can divide by an exact power of ten.
const PREFIXES: &[(&str, i32)] = &[
    ("n", -9),
    ("u", -6),
    ("µ", -6),
    ("μ", -6),
    ("m", -3),
    ("c", -2),
    ("d", -1),
    ("k", 3),
    ("M", 6),
    ("G", 9),
];

/// A parsed unit: multiply by `numerator`, divide by `denominator`. Both are kept so that
/// "2 mm" is 2 / 1000, the double nearest to 0.002, and not 2 * 0.001 rounded twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Factor that multiplies.
    pub numerator: f64,
    /// Factor that divides.
    pub denominator: f64,
    /// Dimension of the unit.
    pub dimension: Dimension,
}

impl Scale {
    const ONE: Scale =
        Scale { numerator: 1.0, denominator: 1.0, dimension: Dimension::new(0, 0, 0, 0) };

    /// `value` of this unit in SI.
    pub fn to_si(self, value: f64) -> f64 {
        value * self.numerator / self.denominator
    }
}

/// Symbols of units and of usual prefixed units, for suggestions.
pub fn known_symbols() -> Vec<String> {
    let common = [
        "mm", "um", "cm", "km", "nm", "mg", "kg", "ms", "us", "mPa", "kPa", "MPa", "GPa", "kN",
        "mN", "cP", "cSt", "mL",
    ];
    UNITS
        .iter()
        .map(|u| u.symbol.to_string())
        .chain(common.iter().map(|s| (*s).to_string()))
        .collect()
}

fn split(factor: f64) -> (f64, f64) {
    if factor < 1.0 && (1.0 / factor).fract() == 0.0 { (1.0, 1.0 / factor) } else { (factor, 1.0) }
}

fn lookup(symbol: &str) -> Option<Scale> {
    let named = |name: &str| UNITS.iter().find(|u| u.symbol == name);
    let prefixed = |(prefix, power): &(&str, i32)| {
        let unit = named(symbol.strip_prefix(prefix)?)?;
        unit.prefixes.then_some((unit, *power))
    };
    let (unit, power) =
        (named(symbol).map(|unit| (unit, 0))).or_else(|| PREFIXES.iter().find_map(prefixed))?;
    let (mut numerator, mut denominator) = split(unit.factor);
    if power < 0 {
        denominator *= 10f64.powi(-power);
    } else {
        numerator *= 10f64.powi(power);
    }
    let common = numerator.min(denominator);
    if (numerator / common).fract() == 0.0 && (denominator / common).fract() == 0.0 {
        numerator /= common;
        denominator /= common;
    }
    Some(Scale { numerator, denominator, dimension: unit.dimension })
}

/// Error of a unit expression.
#[derive(Clone, Debug, PartialEq)]
pub enum UnitError {
    /// This symbol is not a unit.
    Unknown(String),
    /// The expression cannot be read.
    Malformed(String),
}

/// Parses expressions such as "mm", "kg/m3", "mPa s", "m s^-2", "N/m", "1/s".
pub fn parse_unit(text: &str) -> Result<Scale, UnitError> {
    let mut result = Scale::ONE;
    let mut divide = false;
    let spaced = text.replace(['*', '·', '.'], " ").replace('/', " / ");
    for token in spaced.split_whitespace() {
        if token == "/" {
            divide = true;
            continue;
        }
        // "1/s" has a one before the slash.
        if token == "1" && spaced.trim_start().starts_with("1 /") && !divide {
            continue;
        }
        let (symbol, power) =
            split_power(token).ok_or_else(|| UnitError::Malformed(text.to_string()))?;
        let scale = lookup(symbol).ok_or_else(|| UnitError::Unknown(symbol.to_string()))?;
        // As in "kg/m s": everything after a slash divides.
        let power = if divide { -power } else { power };
        let (up, down) = if power >= 0 {
            (scale.numerator, scale.denominator)
        } else {
            (scale.denominator, scale.numerator)
        };
        result.numerator *= up.powi(i32::from(power).abs());
        result.denominator *= down.powi(i32::from(power).abs());
        result.dimension = result
            .dimension
            .plus(scale.dimension, power)
            .ok_or_else(|| UnitError::Malformed(text.to_string()))?;
    }
    if divide && text.trim_end().ends_with('/') {
        return Err(UnitError::Malformed(text.to_string()));
    }
    Ok(result)
}

/// "m3", "m^3", "m³", "s-1", "s^-1" -> symbol and power.
fn split_power(token: &str) -> Option<(&str, i8)> {
    let superscripts = [("⁻¹", -1), ("⁻²", -2), ("⁻³", -3), ("²", 2), ("³", 3)];
    for (mark, power) in superscripts {
        if let Some(symbol) = token.strip_suffix(mark) {
            return (!symbol.is_empty()).then_some((symbol, power));
        }
    }
    let end =
        token.find(|c: char| c.is_ascii_digit() || c == '^' || c == '-').unwrap_or(token.len());
    let (symbol, tail) = token.split_at(end);
    let digits = tail.strip_prefix('^').unwrap_or(tail);
    let power = if tail.is_empty() {
        1
    } else {
        digits.parse::<i8>().ok().filter(|p| (1..=9).contains(&p.abs()))?
    };
    (!symbol.is_empty()).then_some((symbol, power))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn si(value: f64, text: &str) -> f64 {
        parse_unit(text).unwrap().to_si(value)
    }

    #[test]
    fn values_are_the_nearest_doubles() {
        assert_eq!(si(2.0, "mm"), 0.002);
        assert_eq!(si(0.25, "mm"), 0.00025);
        assert_eq!(si(12.0, "um"), 12e-6);
        assert_eq!(si(1.0, "mPa s"), 0.001);
        assert_eq!(si(1.0, "cSt"), 1e-6);
        assert_eq!(si(1.0, "cP"), 1e-3);
        assert_eq!(si(1500.0, "kg/m3"), 1500.0);
        assert_eq!(si(1.5, "g/cm3"), 1500.0);
        assert_eq!(si(9.81, "m/s^2"), 9.81);
        assert_eq!(si(9.81, "m s⁻²"), 9.81);
        assert_eq!(si(3.0, "1/s"), 3.0);
        assert_eq!(si(60.0, "rpm"), 2.0 * std::f64::consts::PI);
        assert_eq!(si(97.5, "mm"), 0.0975);
    }

    #[test]
    fn dimensions_add_up() {
        assert_eq!(parse_unit("mPa s").unwrap().dimension, Dimension::new(1, -1, -1, 0));
        assert_eq!(parse_unit("kg/m/s").unwrap().dimension, Dimension::new(1, -1, -1, 0));
        assert_eq!(parse_unit("kg/m s").unwrap().dimension, Dimension::new(1, -1, -1, 0));
        assert_eq!(parse_unit("deg/s").unwrap().dimension, Dimension::new(0, 0, -1, 1));
        assert_eq!(parse_unit("N/m").unwrap().dimension, Dimension::new(1, 0, -2, 0));
    }

    #[test]
    fn nonsense_is_named() {
        assert_eq!(parse_unit("mmm").unwrap_err(), UnitError::Unknown("mmm".into()));
        assert!(parse_unit("m99").is_err());
        assert!(parse_unit("m^").is_err());
        assert!(parse_unit("1 mm").is_err(), "a second number");
        assert!(parse_unit("m/").is_err());
    }
}
