//! Numbers and names in words.

/// The name of a quantity for readers.
pub fn plain(quantity: &str) -> String {
    quantity.replace('_', " ")
}

/// Three significant digits.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "?".into() };
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}").replace('-', "−")
}

/// In hundredths.
pub fn percent(value: f64) -> String {
    format!("{:.1} %", 100.0 * value).replace('-', "−")
}

/// A p value in words.
pub fn p_text(p: f64) -> String {
    if p < 1e-4 {
        "below 0.0001".into()
    } else {
        format!("{p:.4}")
    }
}
