//! `[expect]` -> expected results.

use super::check::Checker;
use crate::case::expect::{Expectation, Measure};
use crate::case::located::{Located, Span};
use crate::case::quantity::Kind;
use crate::case::raw::{OneOrMany, RawExpect, RawExpected, Tolerance};
use crate::number_format::number_of_grains;

/// Returns all expectations of a case with this number of grains.
pub(super) fn expectations(
    check: &mut Checker,
    raw: &RawExpect,
    grains: usize,
) -> Vec<Expectation> {
    [
        expected(check, &raw.peak_settling_speed, Measure::PeakSettlingSpeed, grains),
        expected(check, &raw.kiss_time, Measure::KissTime, grains),
        expected(check, &raw.tumble_time, Measure::TumbleTime, grains),
        expected(check, &raw.separation_time, Measure::SeparationTime, grains),
        expected(check, &raw.landing_time, Measure::LandingTime, grains),
        expected(check, &raw.role_changes, Measure::RoleChanges, grains),
        expected(check, &raw.end_time, Measure::EndTime, grains),
        expected(check, &raw.max_divergence, Measure::MaxDivergence, grains),
    ]
    .concat()
}

fn expected<K: Kind>(
    check: &mut Checker,
    raw: &OneOrMany<K>,
    measure: Measure,
    grains: usize,
) -> Vec<Expectation> {
    // A single table has no position of its own.
    let whole = check.span_of(&format!("expect.{measure}"));
    if let [first, ..] = &raw.0[..]
        && measure.of_pair()
        && grains != 2
    {
        let count = number_of_grains(grains);
        let message = format!("this is a result of a pair, but the case has {count}");
        let span = first.span.as_ref().or(whole.as_ref()).cloned();
        check.fail(&span, message, "leave it out, or use two grains");
    }
    let mut all = Vec::new();
    for item in &raw.0 {
        match bounds(item, grains) {
            Ok((low, high)) => all.push(Expectation {
                measure,
                grain: item.grain.as_ref().map(|grain| grain.value),
                reference: item.value.value.as_ref().map(|value| value.si),
                low,
                high,
            }),
            Err((span, message, help)) => {
                check.fail(if span.is_some() { span } else { &whole }, message, help);
            }
        }
    }
    all
}

/// Position, message and help of a problem.
type Refusal<'a> = (&'a Span, String, &'static str);

/// Returns the bounds of an expected result [SI].
fn bounds<K: Kind>(
    item: &Located<RawExpected<K>>,
    grains: usize,
) -> Result<(f64, f64), Refusal<'_>> {
    if let Some(grain) = item.grain.as_ref().filter(|grain| grain.value >= grains) {
        let message = format!("there is no grain {}", grain.value);
        return Err((&grain.span, message, "grains count from 0"));
    }
    if let Some(tolerance) = &item.tolerance {
        let (size, text) = match tolerance.value {
            Tolerance::Absolute(q) => (q.si, format!("{}", q.si)),
            Tolerance::Relative(fraction) => (fraction, format!("{} %", 100.0 * fraction)),
        };
        if size.is_nan() || size < 0.0 {
            let message = format!(
                "a tolerance of {text}: it is the largest difference either way, zero or more"
            );
            let help = "write it without its sign, tolerance = \"2 %\"";
            return Err((&tolerance.span, message, help));
        }
    }
    let RawExpected { value, tolerance, at_least, at_most, .. } = &item.value;
    if let (Some(low), Some(high)) = (at_least, at_most)
        && low.si > high.si
    {
        let message = format!("at_least, {}, is above at_most, {}", low.si, high.si);
        return Err((&low.span, message, "exchange them"));
    }
    match (value, tolerance, at_least, at_most) {
        (Some(value), Some(tolerance), None, None) => {
            let width = match tolerance.value {
                Tolerance::Absolute(q) => q.si,
                Tolerance::Relative(fraction) => fraction * value.si.abs(),
            };
            Ok((value.si - width, value.si + width))
        }
        (None, None, low, high) if low.is_some() || high.is_some() => Ok((
            low.as_ref().map_or(f64::NEG_INFINITY, |q| q.si),
            high.as_ref().map_or(f64::INFINITY, |q| q.si),
        )),
        _ => {
            let span = value.as_ref().map_or(&item.span, |value| &value.span);
            let message = "this does not say what is expected".to_owned();
            let help =
                "write { value = ..., tolerance = \"2 %\" }, or { at_least = ..., at_most = ... }";
            Err((span, message, help))
        }
    }
}
