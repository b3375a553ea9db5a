//! Number formatting of messages.

use glam::DVec3;

/// Names of the axes.
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];
/// Names of the two sides of the box along an axis.
pub(crate) const SIDES: [&str; 2] = ["lower", "upper"];

/// Units that take a prefix: those whose first part is not a power.
const PREFIXED: [&str; 7] = ["m", "s", "m/s", "m/s2", "Pa s", "N/m", "L/s"];
/// Prefixes with their powers of ten and the smallest number that takes them: "0.25 mm", but not
/// "0.3 m". Numbers above one thousand take no prefix.
const PREFIXES: [(&str, i32, f64); 4] = [("", 0, 1.0), ("m", 3, 0.1), ("u", 6, 0.1), ("n", 9, 0.1)];

/// Formats a number with at most six digits; a power of ten replaces many zeros.
pub fn number(value: f64) -> String {
    let rounded = six_digits(value);
    if rounded == 0.0 || (1e-4..1e9).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// Formats a value [SI] with its unit ("1" for none): "2.5 mm".
pub fn quantity(value: f64, unit: &str) -> String {
    if unit == "1" {
        return number(value);
    }
    let rounded = six_digits(value);
    let scaled = |power: i32| six_digits(rounded * 10f64.powi(power));
    let (prefix, power, _) = PREFIXES
        .into_iter()
        .filter(|_| PREFIXED.contains(&unit))
        .find(|(_, power, least)| scaled(*power).abs() >= *least)
        .unwrap_or(PREFIXES[0]);
    format!("{} {prefix}{unit}", number(scaled(power)))
}

/// Formats a length [m].
pub fn length(value: f64) -> String {
    quantity(value, "m")
}

/// Formats a vector [SI] with its unit: "[25 mm, 25 mm, 0 m]".
pub fn vector(value: DVec3, unit: &str) -> String {
    let parts = value.to_array().map(|x| quantity(x, unit));
    format!("[{}]", parts.join(", "))
}

/// Formats a size [bytes] with three digits, in gigabytes from 1 GB on and in megabytes below.
pub fn size(bytes: u64) -> String {
    let bytes = bytes as f64;
    let (value, unit) = if bytes < 1e9 { (1e-6 * bytes, "MB") } else { (1e-9 * bytes, "GB") };
    let digits = (2.0 - value.max(0.1).log10().floor()).clamp(0.0, 2.0) as usize;
    format!("{value:.digits$} {unit}")
}

/// Formats a count with its noun: "1 grain", "2 grains".
pub fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// Formats a number of grains: "1 grain", "3 grains".
pub fn number_of_grains(number: usize) -> String {
    count(number, "grain")
}

fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_have_prefixes() {
        let texts = [14.25, 2e-3, 0.25e-3, 0.1 + 0.2, 12e-6, -0.05, 0.0, 8e3].map(length);
        let wanted = ["14.25 m", "2 mm", "0.25 mm", "300 mm", "12 um", "-50 mm", "0 m", "8000 m"];
        assert_eq!(texts, wanted);
        assert_eq!(quantity(1e-3, "Pa s"), "1 mPa s");
        assert_eq!(quantity(1500.0, "kg/m3"), "1500 kg/m3");
        assert_eq!(quantity(1e-6, "m2/s"), "1e-6 m2/s");
        assert_eq!(quantity(0.5, "1"), "0.5");
        assert_eq!(number(3.1e-12), "3.1e-12");
        assert_eq!(number(1.0 / 3.0), "0.333333");
    }

    #[test]
    fn sizes_have_three_digits() {
        let sizes =
            [0, 20_000, 1_234_567, 45_678_900, 999_000_000, 1_279_999_999, 7_040_400_000_000];
        let wanted = ["0.00 MB", "0.02 MB", "1.23 MB", "45.7 MB", "999 MB", "1.28 GB", "7040 GB"];
        assert_eq!(sizes.map(size), wanted);
    }
}
