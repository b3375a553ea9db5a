//! `[expect]`: what a run must give, and whether it did.

use serde::Serialize;

use super::quantity::Kind;
use super::raw::{OneOrMany, RawExpect, RawExpected, Tolerance};
use grainwake_formats::summary::Summary;

/// A quantity that can be expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Measure {
    PeakSettlingSpeed,
    KissTime,
    TumbleTime,
    SeparationTime,
    LandingTime,
    RoleChanges,
    EndTime,
    MaxDivergence,
}

/// One expected result.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    quantity: &'static str,
    measure: Measure,
    grain: Option<usize>,
    reference: Option<f64>,
    low: f64,
    high: f64,
}

/// How a run compares with what was expected. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Name of the quantity, with its grain where one is named.
    pub quantity: String,
    /// What the run gave; none if it did not happen.
    pub value: Option<f64>,
    /// What was expected; none where only bounds are given.
    pub reference: Option<f64>,
    /// Difference from the reference.
    pub error: Option<f64>,
    /// Accepted range.
    pub bound: [Option<f64>; 2],
    /// Whether the value lies in it.
    pub pass: bool,
}

impl Expectation {
    /// Compares with the results of a run.
    pub fn judge(&self, summary: &Summary) -> Verdict {
        let value = self.value(summary);
        let pass = value.is_some_and(|v| (self.low..=self.high).contains(&v));
        let quantity = self.grain.map_or(self.quantity.to_string(), |g| {
            format!("{} of grain {g}", self.quantity)
        });
        let finite = |x: f64| x.is_finite().then_some(x);
        Verdict {
            quantity,
            value,
            reference: self.reference,
            error: value.zip(self.reference).map(|(v, r)| v - r),
            bound: [finite(self.low), finite(self.high)],
            pass,
        }
    }

    fn value(&self, summary: &Summary) -> Option<f64> {
        let chosen = |i: &usize| self.grain.is_none_or(|g| g == *i);
        let grains = || {
            summary
                .grains
                .iter()
                .enumerate()
                .filter(|(i, _)| chosen(i))
                .map(|(_, g)| g)
        };
        match self.measure {
            Measure::PeakSettlingSpeed => grains()
                .map(|g| g.peak_settling_speed_m_per_s)
                .reduce(f64::max),
            Measure::LandingTime => grains().filter_map(|g| g.landing_time_s).reduce(f64::min),
            Measure::KissTime => summary.pair.as_ref()?.kiss_time_s,
            Measure::TumbleTime => summary.pair.as_ref()?.tumble_time_s,
            Measure::SeparationTime => summary.pair.as_ref()?.separation_time_s,
            Measure::RoleChanges => summary.pair.as_ref().map(|p| p.role_changes as f64),
            Measure::EndTime => Some(summary.end_time_s),
            Measure::MaxDivergence => Some(summary.max_divergence),
        }
    }
}

/// Notes a problem: span, key, message, help.
pub(super) type Fail<'a> = dyn FnMut(Option<&std::ops::Range<usize>>, &str, String, &str) + 'a;

/// All expectations of a case with this number of grains.
pub(super) fn expectations(raw: &RawExpect, grains: usize, fail: &mut Fail) -> Vec<Expectation> {
    let mut all = Vec::new();
    let pair = |fail: &mut Fail, present: bool, name: &str| {
        if present && grains != 2 {
            fail(
                None,
                &format!("expect.{name}"),
                format!("this is a result of a pair, but there are {grains} grains"),
                "leave it out, or use two grains",
            );
        }
    };
    pair(fail, raw.kiss_time.is_some(), "kiss_time");
    pair(fail, raw.tumble_time.is_some(), "tumble_time");
    pair(fail, raw.separation_time.is_some(), "separation_time");
    pair(fail, raw.role_changes.is_some(), "role_changes");
    collect(
        &raw.peak_settling_speed,
        "peak_settling_speed",
        Measure::PeakSettlingSpeed,
        grains,
        &mut all,
        fail,
    );
    collect(
        &raw.kiss_time,
        "kiss_time",
        Measure::KissTime,
        grains,
        &mut all,
        fail,
    );
    collect(
        &raw.tumble_time,
        "tumble_time",
        Measure::TumbleTime,
        grains,
        &mut all,
        fail,
    );
    collect(
        &raw.separation_time,
        "separation_time",
        Measure::SeparationTime,
        grains,
        &mut all,
        fail,
    );
    collect(
        &raw.landing_time,
        "landing_time",
        Measure::LandingTime,
        grains,
        &mut all,
        fail,
    );
    collect(
        &raw.role_changes,
        "role_changes",
        Measure::RoleChanges,
        grains,
        &mut all,
        fail,
    );
    collect(
        &raw.end_time,
        "end_time",
        Measure::EndTime,
        grains,
        &mut all,
        fail,
    );
    collect(
        &raw.max_divergence,
        "max_divergence",
        Measure::MaxDivergence,
        grains,
        &mut all,
        fail,
    );
    all
}

fn collect<K: Kind>(
    raw: &Option<OneOrMany<RawExpected<K>>>,
    quantity: &'static str,
    measure: Measure,
    grains: usize,
    all: &mut Vec<Expectation>,
    fail: &mut Fail,
) {
    let key = format!("expect.{quantity}");
    for item in raw.iter().flat_map(|list| &list.0) {
        let (item, place) = (&item.value, &item.span);
        if let Some(grain) = item.grain.as_ref().filter(|g| g.value >= grains) {
            fail(
                grain.span.as_ref(),
                &key,
                format!("there is no grain {}", grain.value),
                "grains count from 0",
            );
            continue;
        }
        let span = item
            .value
            .as_ref()
            .and_then(|v| v.span.as_ref())
            .or(place.as_ref());
        if let Some((span, message, help)) = contradiction(item) {
            fail(span.or(place.as_ref()), &key, message, help);
            continue;
        }
        let bounds = match (&item.value, &item.tolerance, &item.at_least, &item.at_most) {
            (Some(value), Some(tolerance), None, None) => {
                let width = match tolerance.value {
                    Tolerance::Absolute(q) => q.si,
                    Tolerance::Relative(fraction) => fraction * value.si.abs(),
                };
                Some((value.si - width, value.si + width))
            }
            (None, None, low, high) if low.is_some() || high.is_some() => Some((
                low.as_ref().map_or(f64::NEG_INFINITY, |q| q.si),
                high.as_ref().map_or(f64::INFINITY, |q| q.si),
            )),
            _ => None,
        };
        let Some((low, high)) = bounds.filter(|(low, high)| low <= high) else {
            fail(
                span,
                &key,
                "this does not say what is expected".into(),
                "write { value = ..., tolerance = \"2 %\" }, or { at_least = ..., at_most = ... }",
            );
            continue;
        };
        let (reference, grain) = (
            item.value.as_ref().map(|v| v.si),
            item.grain.as_ref().map(|g| g.value),
        );
        all.push(Expectation {
            quantity,
            measure,
            grain,
            reference,
            low,
            high,
        });
    }
}

/// What is wrong with a bound that is complete: place, message, help.
fn contradiction<K: Kind>(
    item: &RawExpected<K>,
) -> Option<(Option<&std::ops::Range<usize>>, String, &'static str)> {
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
            return Some((tolerance.span.as_ref(), message, help));
        }
    }
    if let (Some(low), Some(high)) = (&item.at_least, &item.at_most)
        && low.si > high.si
    {
        let message = format!("at_least, {}, is above at_most, {}", low.si, high.si);
        return Some((low.span.as_ref(), message, "exchange them"));
    }
    None
}
