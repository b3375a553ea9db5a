//! Text form of the results of `[expect]`.

use grainwake_run::case::{Problem, Verdict};
use grainwake_run::number_format::quantity;

/// Returns the value, the expected range and the verdict on one line.
pub fn line(v: &Verdict) -> String {
    let verdict = if v.pass { "met" } else { "missed" };
    let (value, error) = (value(v), error(v));
    format!("{}: {value}{error}, expected {}: {verdict}", v.quantity, range(v))
}

/// Returns the message of a missed expectation.
pub fn missed(v: &Verdict) -> Problem {
    let is = if v.value.is_some() { "is " } else { "" };
    Problem::new(format!(
        "expected {}: {}, but it {is}{}{}",
        v.quantity,
        range(v),
        value(v),
        error(v)
    ))
}

fn value(v: &Verdict) -> String {
    v.value.map_or("did not happen".into(), |x| with_unit(x, &v.quantity))
}

/// Returns the accepted range in words.
fn range(v: &Verdict) -> String {
    let unit = |x| with_unit(x, &v.quantity);
    match v.bound {
        [Some(low), Some(high)] => format!("{} to {}", unit(low), unit(high)),
        [Some(low), None] => format!("at least {}", unit(low)),
        [None, Some(high)] => format!("at most {}", unit(high)),
        [None, None] => "anything".into(),
    }
}

/// Returns the deviation from the reference; empty without a reference.
fn error(v: &Verdict) -> String {
    match v.error.zip(v.reference) {
        Some((error, reference)) if reference != 0.0 => {
            format!(" (error {:+.2} %)", 100.0 * error / reference.abs())
        }
        _ => String::new(),
    }
}

fn with_unit(x: f64, name: &str) -> String {
    quantity(x, unit(name))
}

/// Returns the unit of a quantity of `[expect]`; its name may be followed by that of a grain.
fn unit(quantity: &str) -> &'static str {
    match quantity.split(' ').next() {
        Some("peak_settling_speed") => "m/s",
        Some("max_divergence") => "1/s",
        Some("role_changes") => "1",
        _ => "s",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(quantity: &str, value: Option<f64>, bound: [Option<f64>; 2]) -> Verdict {
        Verdict {
            quantity: quantity.into(),
            value,
            reference: None,
            error: None,
            bound,
            pass: false,
        }
    }

    #[test]
    fn verdicts_read_like_a_sentence() {
        let speed = Verdict {
            reference: Some(0.2),
            error: Some(-0.004),
            ..verdict("peak_settling_speed of grain 0", Some(0.196), [Some(0.198), Some(0.202)])
        };
        assert_eq!(
            line(&speed),
            "peak_settling_speed of grain 0: 196 mm/s (error -2.00 %), expected 198 mm/s to 202 mm/s: missed"
        );
        assert_eq!(
            missed(&speed).to_string(),
            "expected peak_settling_speed of grain 0: 198 mm/s to 202 mm/s, but it is 196 mm/s (error -2.00 %)"
        );
        let kiss = verdict("kiss_time", None, [Some(0.17), None]);
        assert_eq!(
            missed(&kiss).to_string(),
            "expected kiss_time: at least 170 ms, but it did not happen"
        );
        let roles =
            Verdict { pass: true, ..verdict("role_changes", Some(3.0), [None, Some(10.0)]) };
        assert_eq!(line(&roles), "role_changes: 3, expected at most 10: met");
        let still = verdict("max_divergence", Some(2.5e-14), [None, Some(0.0)]);
        assert_eq!(line(&still), "max_divergence: 2.5e-14 1/s, expected at most 0 1/s: missed");
    }
}
