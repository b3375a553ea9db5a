//! Verdicts on claims, from rank tests on the observations.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::observation::{Observation, matched, observations, ranges, with_factor};
use super::statistics::{
    Estimate, coefficient_of_variation, relative_spread_test, signed_rank, spearman,
};
use crate::format::{p_value, percent, significant, title};
use crate::measure::record::RunRecord;
use crate::plan::claims::{Analysis, Claim, Sign, Test};

/// Verdict on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The confidence interval shows the claim.
    Holds,
    /// The confidence interval shows the opposite.
    Contradicted,
    /// The confidence interval shows neither.
    Open,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(match self {
            Verdict::Holds => "holds",
            Verdict::Contradicted => "contradicted",
            Verdict::Open => "open",
        })
    }
}

/// Claim and the result of its test. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Statement of the claim.
    pub claim: String,
    /// Section of the publication that makes the claim.
    pub part: String,
    /// Quantity.
    pub quantity: String,
    /// Verdict.
    pub verdict: Verdict,
    /// Result of the test in words.
    pub says: String,
    /// Number of models or pairs of models.
    pub n: usize,
    /// Number of right-censored observations.
    #[serde(rename = "bounds")]
    pub censored: usize,
    /// Estimated rank correlation or difference.
    pub value: Option<f64>,
    /// 95 % confidence interval.
    pub interval: Option<[f64; 2]>,
    /// Two-sided p value.
    pub p: Option<f64>,
}

/// Tests the claims of an analysis. A claim about a quantity that is not converged with the grid is
/// never called contradicted.
pub fn evaluate(analysis: &Analysis, records: &[RunRecord]) -> Vec<Finding> {
    let unconverged = |claim: &Claim| {
        let resolution = analysis.resolution.as_ref();
        resolution.is_some_and(|r| r.unconverged.contains(&claim.quantity))
    };
    let test = |claim: &Claim| {
        let mut finding = test(claim, records);
        if unconverged(claim) {
            finding.says += "; not converged with the grid";
            if finding.verdict == Verdict::Contradicted {
                finding.verdict = Verdict::Open;
            }
        }
        finding
    };
    analysis.claims.iter().map(test).collect()
}

/// Result of a test before it is worded.
struct Outcome {
    n: usize,
    censored: usize,
    estimate: Option<Estimate>,
    /// Result in words; without meaning if there is no estimate.
    says: String,
    verdict: Verdict,
}

impl Outcome {
    fn new(
        n: usize,
        censored: usize,
        estimate: Option<Estimate>,
        says: impl FnOnce(&Estimate) -> String,
        verdict: impl FnOnce(&Estimate) -> Verdict,
    ) -> Outcome {
        Outcome {
            n,
            censored,
            says: estimate.as_ref().map_or(String::new(), says),
            verdict: estimate.as_ref().map_or(Verdict::Open, verdict),
            estimate,
        }
    }
}

fn test(claim: &Claim, records: &[RunRecord]) -> Finding {
    let all = observations(records, &claim.quantity, &claim.when);
    let included = |all: Vec<Observation>| -> Vec<Observation> {
        let excluded = |o: &Observation| claim.observed && o.censored;
        all.into_iter().filter(|o| !excluded(o)).collect()
    };
    let name = title(&claim.quantity);
    let outcome = match &claim.test {
        Test::Trend { with, sign } => trend(&included(all), with, *sign, &name),
        Test::Range { over, with, sign } => {
            let all = included(ranges(&all, over));
            trend(&all, with, *sign, &format!("range of {name}"))
        }
        Test::Order { axis, more, less } => order(&included(all), axis, [more, less], &name),
        Test::Equal { axis, values: [a, b], within } => {
            equal(&included(all), axis, [a, b], *within, &name)
        }
        Test::Spread { axis, more, less } => spread(&included(all), axis, [more, less], &name),
        Test::Near { model, within } => {
            let everywhere = observations(records, &claim.quantity, &BTreeMap::new());
            let reference = included(everywhere).into_iter().find(|o| o.model == *model);
            near(&included(all), model, reference, *within, &name)
        }
    };
    word(claim, outcome)
}

/// Adds the claim and the treatment of censored observations to the outcome of a test.
fn word(claim: &Claim, outcome: Outcome) -> Finding {
    let Outcome { n, censored, .. } = outcome;
    let mut says = outcome.says;
    if outcome.estimate.is_none() {
        says = format!("{n} models or pairs of models have finished: too few for a test");
    }
    if claim.observed {
        says += "; pairs that landed before the event are left out";
    }
    if censored > 0 {
        says += &match claim.test {
            Test::Trend { .. } | Test::Range { .. } => {
                format!("; {censored} right-censored at the landing, ranked last with equal ranks")
            }
            _ => format!("; {censored} right-censored: lower bounds, as the pair landed before"),
        };
    }
    Finding {
        claim: claim.says.clone(),
        part: claim.part.clone(),
        quantity: claim.quantity.clone(),
        verdict: outcome.verdict,
        says,
        n,
        censored,
        value: outcome.estimate.map(|e| e.value),
        interval: outcome.estimate.map(|e| [e.low, e.high]),
        p: outcome.estimate.map(|e| e.p),
    }
}

fn order(all: &[Observation], axis: &str, [more, less]: [&str; 2], name: &str) -> Outcome {
    let pairs = matched(all, axis, more, less);
    let differences: Vec<f64> = pairs.iter().map(|(a, b)| a.value - b.value).collect();
    let larger = differences.iter().filter(|d| **d > 0.0).count();
    let says = |e: &Estimate| {
        format!(
            "{name} is larger in {more} than in {less} for {larger} of {} grains; difference {} \
             ({}), {}",
            e.n,
            significant(e.value),
            interval(e, significant),
            probability(e)
        )
    };
    let estimate = signed_rank(&differences);
    Outcome::new(pairs.len(), censored(&pairs), estimate, says, |e| {
        verdict(e.low > 0.0, e.high < 0.0)
    })
}

fn equal(all: &[Observation], axis: &str, [a, b]: [&str; 2], within: f64, name: &str) -> Outcome {
    let pairs = matched(all, axis, a, b);
    let relative =
        |(a, b): &(&Observation, &Observation)| 2.0 * (a.value - b.value) / (a.value + b.value);
    let relative: Vec<f64> = pairs.iter().map(relative).collect();
    let says = |e: &Estimate| {
        format!(
            "{name} in {a} against {b}: relative difference {} ({}, n = {})",
            percent(e.value),
            interval(e, percent),
            e.n
        )
    };
    let estimate = signed_rank(&relative);
    Outcome::new(pairs.len(), censored(&pairs), estimate, says, |e| inside(e, within))
}

fn spread(all: &[Observation], axis: &str, [more, less]: [&str; 2], name: &str) -> Outcome {
    let pairs = matched(all, axis, more, less);
    let (first, second): (Vec<f64>, Vec<f64>) =
        pairs.iter().map(|(a, b)| (a.value, b.value)).unzip();
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
    Outcome::new(pairs.len(), censored(&pairs), estimate, says, |e| {
        verdict(e.low > 0.0, e.high < 0.0)
    })
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
    Outcome::new(x.len(), censored, spearman(&x, &y), says, |e| {
        let (rises, falls) = (e.low > 0.0, e.high < 0.0);
        match sign {
            Sign::Rises => verdict(rises, falls),
            Sign::Falls => verdict(falls, rises),
            Sign::None => verdict(false, rises || falls),
        }
    })
}

fn near(
    all: &[Observation],
    model: &str,
    reference: Option<Observation>,
    within: f64,
    name: &str,
) -> Outcome {
    let Some(reference) = reference else {
        return Outcome::new(0, 0, None, |_| String::new(), |_| Verdict::Open);
    };
    let others: Vec<&Observation> = all.iter().filter(|o| o.model != model).collect();
    let relative = |o: &&Observation| o.value / reference.value - 1.0;
    let relative: Vec<f64> = others.iter().map(relative).collect();
    let larger = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
    let largest = relative.iter().fold(0.0, larger);
    let says = |e: &Estimate| {
        format!(
            "{name} against {model} ({}): {} ({}, n = {}); largest difference {}",
            significant(reference.value),
            percent(e.value),
            interval(e, percent),
            e.n,
            percent(largest)
        )
    };
    let censored = others.iter().filter(|o| o.censored).count();
    let estimate = signed_rank(&relative);
    Outcome::new(others.len(), censored, estimate, says, |e| inside(e, within))
}

fn censored(pairs: &[(&Observation, &Observation)]) -> usize {
    pairs.iter().filter(|(a, b)| a.censored || b.censored).count()
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

fn verdict(holds: bool, contradicted: bool) -> Verdict {
    match (holds, contradicted) {
        (true, _) => Verdict::Holds,
        (_, true) => Verdict::Contradicted,
        _ => Verdict::Open,
    }
}

/// Verdict on equality: whether the interval lies inside or outside of ± `within`.
fn inside(e: &Estimate, within: f64) -> Verdict {
    let equal = e.low >= -within && e.high <= within;
    verdict(equal, e.low > within || e.high < -within)
}
