//! Statistical tests of claims, each with its effect and its result in words.

use std::collections::BTreeMap;

use serde::Serialize;

use super::observation::{Observation, is_time, matched, observations, ranges, with_factor};
use super::statistics::{
    Estimate, coefficient_of_variation, relative_spread_test, signed_rank, spearman,
};
use super::survival::log_rank;
use crate::format::{p_value, percent, significant, title};
use crate::measure::record::RunRecord;
use crate::plan::claims::{Claim, Sign, Test};

/// Kind of an effect. The JSON names are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Effect {
    /// Rank correlation, from -1 to 1.
    RankCorrelation,
    /// Difference, in the unit of the quantity.
    Difference,
    /// Relative difference.
    RelativeDifference,
}

/// Statement of a claim about the effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Claimed {
    /// The effect is positive.
    Positive,
    /// The effect is negative.
    Negative,
    /// There is no effect.
    Nothing,
    /// The size of the effect is at most this.
    AtMost(f64),
}

/// Result of a test before its verdict.
pub(super) struct Outcome {
    /// Number of models or pairs of models.
    pub n: usize,
    /// Number of right-censored observations.
    pub censored: usize,
    /// Number of pairs without the event on both sides, which say nothing about a difference.
    pub uninformative: usize,
    /// Kind of the effect.
    pub effect: Effect,
    /// Statement of the claim.
    pub claimed: Claimed,
    /// Estimated effect.
    pub estimate: Option<Estimate>,
    /// Result in words, with the treatment of censored observations.
    pub says: String,
}

impl Outcome {
    fn new(
        (n, censored): (usize, usize),
        effect: Effect,
        claimed: Claimed,
        estimate: Option<Estimate>,
        says: impl FnOnce(&Estimate) -> String,
    ) -> Outcome {
        let untested = || match n {
            _ if n > 0 && censored == n => {
                format!("none of the {n} models or pairs of models has the event: no test")
            }
            _ => format!("{n} models or pairs of models with a value: too few for a test"),
        };
        let says = estimate.as_ref().map_or_else(untested, says);
        Outcome { n, censored, uninformative: 0, effect, claimed, estimate, says }
    }

    /// Number of models or pairs of models that can show a difference.
    pub fn informative(&self) -> usize {
        match self.claimed {
            Claimed::AtMost(_) => self.n,
            _ => self.n - self.uninformative,
        }
    }
}

/// Tests a claim.
pub(super) fn test(claim: &Claim, records: &[RunRecord]) -> Outcome {
    let all = observations(records, &claim.quantity, &claim.when);
    let included = |all: Vec<Observation>| -> Vec<Observation> {
        let excluded = |o: &Observation| claim.observed && o.censored;
        all.into_iter().filter(|o| !excluded(o)).collect()
    };
    let name = title(&claim.quantity);
    let mut outcome = match &claim.test {
        Test::Trend { with, sign } => trend(&included(all), with, *sign, &name),
        Test::Range { over, with, sign } => {
            let all = included(ranges(&all, over));
            trend(&all, with, *sign, &format!("range of {name}"))
        }
        Test::Order { axis, more, less } => {
            let by_rates = is_time(&claim.quantity) && !claim.observed;
            order(&included(all), axis, [more, less], &name, by_rates)
        }
        Test::Equal { axis, values: [a, b], within } => {
            equal(&included(all), axis, [a, b], *within, &name)
        }
        Test::Spread { axis, more, less } => spread(&included(all), axis, [more, less], &name),
        Test::Near { model, within } => {
            let everywhere = observations(records, &claim.quantity, &BTreeMap::new());
            let pattern = glob::Pattern::new(model).ok();
            let is_reference =
                |o: &Observation| pattern.as_ref().is_some_and(|p| p.matches(&o.model));
            let reference = included(everywhere).into_iter().find(is_reference);
            near(&included(all), reference, *within, &name)
        }
    };
    if claim.observed {
        outcome.says += "; pairs that landed, or whose run ended, before the event are left out";
    }
    if outcome.uninformative > 0 && matches!(outcome.claimed, Claimed::AtMost(_)) {
        let left_out = outcome.uninformative;
        outcome.says += &format!("; {left_out} without the event on both sides are left out");
    }
    if outcome.censored > 0 {
        let censored = outcome.censored;
        outcome.says += &match claim.test {
            Test::Trend { .. } | Test::Range { .. } => {
                format!("; {censored} without the event, ranked last with equal ranks")
            }
            Test::Spread { .. } => format!("; {censored} pairs without the event are left out"),
            _ => format!(
                "; {censored} without the event before the landing or the end, which count as last"
            ),
        };
    }
    outcome
}

/// Value that stands for the time of an event that did not occur: far beyond all others, but
/// finite, so that two of them are equal and cancel.
const LAST: f64 = 1e9;

/// Returns the value of an observation with that of a missing event beyond all others.
fn last(observation: &Observation) -> f64 {
    if observation.censored { LAST } else { observation.value }
}

/// Returns an estimate in which effects that contain a missing event are infinite.
fn unbounded(estimate: Estimate) -> Estimate {
    let end = infinite_if_missing;
    let Estimate { value, low, high, .. } = estimate;
    Estimate { value: end(value), low: end(low), high: end(high), ..estimate }
}

/// Returns an effect, infinite if it contains a missing event.
fn infinite_if_missing(value: f64) -> f64 {
    if value.abs() > 1e-3 * LAST { value.signum() * f64::INFINITY } else { value }
}

/// Tests an order by the signed ranks of the differences, or `by_rates` of the event: the log-rank
/// test.
fn order(
    all: &[Observation],
    axis: &str,
    [more, less]: [&str; 2],
    name: &str,
    by_rates: bool,
) -> Outcome {
    let pairs = matched(all, axis, more, less);
    let uninformative = pairs.iter().filter(|(a, b)| a.censored && b.censored).count();
    let differences: Vec<f64> = pairs.iter().map(|(a, b)| last(a) - last(b)).collect();
    let larger = differences.iter().filter(|d| **d > 0.0).count();
    let says = |e: &Estimate| {
        format!(
            "{name} is larger in {more} than in {less} for {larger} of {} pairs of models; \
             difference {} ({}), {}",
            e.n,
            significant(e.value),
            interval(e, significant),
            probability(e)
        )
    };
    let mut estimate = signed_rank(&differences).map(unbounded);
    if by_rates {
        let strata: Vec<_> =
            pairs.iter().map(|(a, b)| [a.durations.clone(), b.durations.clone()]).collect();
        estimate = estimate.zip(log_rank(&strata)).map(|(e, p)| Estimate { p, ..e });
    }
    let outcome =
        Outcome::new(counts(&pairs), Effect::Difference, Claimed::Positive, estimate, says);
    Outcome { uninformative, ..outcome }
}

/// Tests equality by the relative differences of the pairs. Pairs without the event at both levels
/// are left out: they would count as equal without any evidence.
fn equal(all: &[Observation], axis: &str, [a, b]: [&str; 2], within: f64, name: &str) -> Outcome {
    let mut pairs = matched(all, axis, a, b);
    let every = pairs.len();
    pairs.retain(|(a, b)| !(a.censored && b.censored));
    let uninformative = every - pairs.len();
    let relative = |(a, b): &(&Observation, &Observation)| {
        relative_difference(last(a), last(b), 0.5 * (last(a) + last(b)))
    };
    let relative: Vec<f64> = pairs.iter().map(relative).collect();
    let says = |e: &Estimate| {
        format!(
            "{name} in {a} against {b}: relative difference {} ({}, n = {})",
            percent(e.value),
            interval(e, percent),
            e.n
        )
    };
    let (effect, claimed) = (Effect::RelativeDifference, Claimed::AtMost(within));
    let outcome = Outcome::new(counts(&pairs), effect, claimed, signed_rank(&relative), says);
    Outcome { uninformative, ..outcome }
}

fn spread(all: &[Observation], axis: &str, [more, less]: [&str; 2], name: &str) -> Outcome {
    let pairs = matched(all, axis, more, less);
    let counted = counts(&pairs);
    let kept = pairs.iter().filter(|(a, b)| !a.censored && !b.censored);
    let (first, second): (Vec<f64>, Vec<f64>) = kept.map(|(a, b)| (a.value, b.value)).unzip();
    let variation = |v: &[f64]| coefficient_of_variation(v).map_or("?".into(), percent);
    let says = |e: &Estimate| {
        format!(
            "coefficient of variation of {name} over the grains: {} in {more}, {} in {less} \
             (n = {}; equal variation: {})",
            variation(&first),
            variation(&second),
            e.n,
            probability(e)
        )
    };
    let estimate = relative_spread_test(&first, &second);
    Outcome::new(counted, Effect::RankCorrelation, Claimed::Positive, estimate, says)
}

fn trend(all: &[Observation], with: &str, sign: Sign, name: &str) -> Outcome {
    let (x, y, censored) = with_factor(all, with);
    let says = |e: &Estimate| {
        format!(
            "rank correlation of {name} with {with}: {} ({}, n = {}, {})",
            significant(e.value),
            interval(e, significant),
            e.n,
            probability(e)
        )
    };
    let claimed = match sign {
        Sign::Rises => Claimed::Positive,
        Sign::Falls => Claimed::Negative,
        Sign::None => Claimed::Nothing,
    };
    let counts = (x.len(), censored);
    Outcome::new(counts, Effect::RankCorrelation, claimed, spearman(&x, &y), says)
}

fn near(all: &[Observation], reference: Option<Observation>, within: f64, name: &str) -> Outcome {
    let (effect, claimed) = (Effect::RelativeDifference, Claimed::AtMost(within));
    let Some(reference) = reference else {
        return Outcome::new((0, 0), effect, claimed, None, |_| String::new());
    };
    let model = &reference.model;
    let mut others: Vec<&Observation> = all.iter().filter(|o| o.model != *model).collect();
    let every = others.len();
    others.retain(|o| !(o.censored && reference.censored));
    let uninformative = every - others.len();
    let relative = |o: &&Observation| match (o.censored, reference.censored) {
        (true, _) => LAST,
        (false, true) => -LAST,
        (false, false) => relative_difference(o.value, reference.value, reference.value),
    };
    let relative: Vec<f64> = others.iter().map(relative).collect();
    let larger = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
    let largest = relative.iter().fold(0.0, larger);
    let says = |e: &Estimate| {
        format!(
            "{name} against {model} ({}{}): {} ({}, n = {}); largest difference {}",
            if reference.censored { "none before " } else { "" },
            significant(reference.value),
            percent(e.value),
            interval(e, percent),
            e.n,
            percent(infinite_if_missing(largest))
        )
    };
    let censored = others.iter().filter(|o| o.censored || reference.censored).count();
    let estimate = signed_rank(&relative).map(unbounded);
    let outcome = Outcome::new((others.len(), censored), effect, claimed, estimate, says);
    Outcome { uninformative, ..outcome }
}

/// Difference of two values over `scale`; zero for equal values, also if both are zero.
fn relative_difference(value: f64, other: f64, scale: f64) -> f64 {
    if value == other { 0.0 } else { (value - other) / scale }
}

/// Number of pairs, and of pairs with a right-censored observation.
fn counts(pairs: &[(&Observation, &Observation)]) -> (usize, usize) {
    (pairs.len(), pairs.iter().filter(|(a, b)| a.censored || b.censored).count())
}

fn probability(e: &Estimate) -> String {
    match p_value(e.p) {
        bound if bound.starts_with('<') => format!("p {bound}"),
        value => format!("p = {value}"),
    }
}

fn interval(e: &Estimate, form: fn(f64) -> String) -> String {
    format!("95 % interval {} to {}", form(e.low), form(e.high))
}
