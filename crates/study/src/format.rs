//! Numbers and names in words.

/// The name of a quantity for readers.
pub fn plain(quantity: &str) -> String {
    quantity.replace('_', " ")
}

/// Three significant digits.
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "?".into() };
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}").replace('-', "−")
}

/// Quantities that are counted.
const COUNTS: [&str; 4] = ["kisses", "role_changes", "grains", "landed"];

/// The value of a quantity: a count as a whole number where it is one, else three significant digits.
pub fn number(quantity: &str, value: f64) -> String {
    if COUNTS.contains(&quantity) && value.fract() == 0.0 {
        return format!("{value:.0}");
    }
    significant(value)
}

/// In hundredths.
pub fn percent(value: f64) -> String {
    format!("{:.1} %", 100.0 * value).replace('-', "−")
}

/// A p value in words.
pub fn p_value(p: f64) -> String {
    if p < 1e-4 {
        "below 0.0001".into()
    } else {
        format!("{p:.4}")
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn counts_are_whole_numbers() {
        assert_eq!(number("kisses", 1.0), "1");
        assert_eq!(number("kiss_time", 1.0), "1.00");
        assert_eq!(number("kisses", 1.5), "1.50");
    }
}
