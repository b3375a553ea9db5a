//! Text form of values and names, for the report page and the tables.

/// Name of a quantity with blanks.
pub fn title(quantity: &str) -> String {
    quantity.replace('_', " ")
}

/// Value with three significant digits; "?" if it is not a number.
pub fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if let Some(text) = infinite(value) {
        return text;
    }
    if value.is_nan() {
        return "?".into();
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}").replace('-', "−")
}

/// Quantities that are counts.
const COUNTS: [&str; 4] = ["kisses", "role_changes", "grains", "landed"];

/// Value of a quantity: whole counts without decimals, else three significant digits.
pub fn quantity_value(quantity: &str, value: f64) -> String {
    if COUNTS.contains(&quantity) && value.fract() == 0.0 {
        return format!("{value:.0}");
    }
    significant(value)
}

/// Text of an infinite value.
fn infinite(value: f64) -> Option<String> {
    value.is_infinite().then(|| if value > 0.0 { "∞".into() } else { "−∞".into() })
}

/// Percentage with one decimal.
pub fn percent(value: f64) -> String {
    if let Some(text) = infinite(value) {
        return text;
    }
    format!("{:.1} %", 100.0 * value).replace('-', "−")
}

/// Returns the start of a sentence about models without an event: "1 model, whose pair landed or
/// whose run ended before, has". `several` if models have several runs, of which half or more have
/// no event then.
pub fn missed(models: usize, several: bool) -> String {
    match (models, several) {
        (1, false) => "1 model, whose pair landed or whose run ended before, has".to_owned(),
        (n, false) => format!("{n} models, whose pairs landed or whose runs ended before, have"),
        (1, true) => {
            "1 model, in half or more of whose runs the pair landed or the run ended before, has"
                .to_owned()
        }
        (n, true) => format!(
            "{n} models, in half or more of whose runs the pair landed or the run ended before, \
             have"
        ),
    }
}

/// Probability with four decimals, as in "0.0152" and "< 0.0001".
pub fn p_value(p: f64) -> String {
    if p < 1e-4 { "< 0.0001".into() } else { format!("{p:.4}") }
}

/// Value rounded to six significant digits, for tables.
pub fn rounded(value: f64) -> f64 {
    // The sum turns -0 into 0.
    format!("{value:.5e}").parse().unwrap_or(value) + 0.0
}

#[cfg(test)]
mod tests {
    use super::quantity_value;

    #[test]
    fn counts_are_whole_numbers() {
        assert_eq!(quantity_value("kisses", 1.0), "1");
        assert_eq!(quantity_value("kiss_time", 1.0), "1.00");
        assert_eq!(quantity_value("kisses", 1.5), "1.50");
    }
}
