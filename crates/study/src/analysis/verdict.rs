//! What the rows of a study say: claims tested, correlations, by ranks.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::analysis::statistics::{self, Estimate, median};
use crate::format::{p_value, percent, plain, significant};
use crate::measure::record::RunRecord;
use crate::plan::claims::{Analysis, Claim, Condition, Sign, Test};

/// What came out for a model: medians over its members.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Name of the model.
    pub model: String,
    /// Name of its value on each axis.
    pub levels: BTreeMap<String, String>,
    /// Numbers that belong to it.
    pub factors: BTreeMap<String, f64>,
    /// The value.
    pub value: f64,
    /// Smallest and largest over the members.
    pub range: (f64, f64),
    /// Whether it is only a lower bound: the pair landed before it happened.
    pub bound: bool,
}

impl Observation {
    /// The value for a test by ranks: what had not happened by the landing comes last.
    pub fn latest(&self) -> f64 {
        if self.bound {
            f64::INFINITY
        } else {
            self.value
        }
    }
}

/// A claim and what the runs say about it. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The claim in words.
    pub claim: String,
    /// Where it is made.
    pub part: String,
    /// The quantity.
    pub quantity: String,
    /// "holds", "contradicted" or "open".
    pub verdict: &'static str,
    /// The numbers in words.
    pub says: String,
    /// Models or pairs of models.
    pub n: usize,
    /// Those that are lower bounds.
    pub bounds: usize,
    /// What was estimated: a rank correlation or a difference.
    pub value: Option<f64>,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Two-sided p value.
    pub p: Option<f64>,
}

/// A quantity of a row; of a pair that landed before it happened, the landing as a lower bound.
pub fn value(row: &RunRecord, quantity: &str) -> Option<(f64, bool)> {
    if !row.finished() {
        return None;
    }
    if let Some(value) = row.get(quantity) {
        let together = row.pair.as_ref().is_some_and(|p| p.parted == Some(false));
        return Some((value, quantity == "contact_stage" && together));
    }
    let pair = row.pair.as_ref()?;
    let landing = pair.landing_time.map(|time| (time, true));
    match quantity {
        "kiss_time" => landing,
        "tumble_time" | "pass_time" | "separation_time" if pair.kiss_time.is_some() => landing,
        _ => None,
    }
}

/// A quantity of every model that has it, medians over the members.
pub fn observations(
    rows: &[RunRecord],
    quantity: &str,
    when: &BTreeMap<String, Condition>,
) -> Vec<Observation> {
    let mut members: BTreeMap<&str, Vec<(&RunRecord, f64, bool)>> = BTreeMap::new();
    let mut order: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| meets(row, when)) {
        if let Some((v, bound)) = value(row, quantity) {
            let list = members.entry(&row.model).or_default();
            if list.is_empty() {
                order.push(&row.model);
            }
            list.push((row, v, bound));
        }
    }
    let sample = |name: &str| {
        let list = &members[name];
        let values: Vec<f64> = list.iter().map(|(_, v, _)| *v).collect();
        let row = list[0].0;
        Observation {
            model: name.to_owned(),
            levels: row.levels.clone(),
            factors: row.factors.clone(),
            value: median(&values).unwrap_or(f64::NAN),
            range: values
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                    (a.min(*v), b.max(*v))
                }),
            bound: 2 * list.iter().filter(|(.., bound)| *bound).count() >= list.len(),
        }
    };
    order.into_iter().map(sample).collect()
}

fn meets(row: &RunRecord, when: &BTreeMap<String, Condition>) -> bool {
    when.iter().all(|(name, condition)| match condition {
        Condition::Is(level) => row.levels.get(name) == Some(level),
        Condition::In(levels) => row.levels.get(name).is_some_and(|l| levels.contains(l)),
        Condition::Range { at_least, at_most } => row.factors.get(name).is_some_and(|v| {
            at_least.is_none_or(|low| *v >= low) && at_most.is_none_or(|high| *v <= high)
        }),
    })
}

/// The claims of an analysis, tested.
pub fn evaluate(analysis: &Analysis, rows: &[RunRecord]) -> Vec<Finding> {
    analysis
        .claims
        .iter()
        .map(|claim| one(claim, rows))
        .collect()
}

fn one(claim: &Claim, rows: &[RunRecord]) -> Finding {
    let every = observations(rows, &claim.quantity, &claim.when);
    let seen = |all: Vec<Observation>| -> Vec<Observation> {
        let counts = |s: &Observation| !(claim.observed && s.bound);
        all.into_iter().filter(counts).collect()
    };
    let ranges = |over: &str| seen(ranges(&every, over));
    let all = seen(every.clone());
    match &claim.test {
        Test::Trend { with, sign } => trend(claim, &all, with, *sign, ""),
        Test::Range { over, with, sign } => trend(claim, &ranges(over), with, *sign, "range of "),
        Test::Order { axis, more, less } => {
            let pairs = pairs(&all, axis, more, less);
            let differences: Vec<f64> = pairs.iter().map(|(a, b)| a.value - b.value).collect();
            let found = statistics::signed_rank(&differences);
            let larger = differences.iter().filter(|d| **d > 0.0).count();
            let says = |e: Estimate| {
                format!(
                    "{} is larger in {more} than in {less} for {larger} of {} grains; difference {} (95 % interval {} to {}), p = {}",
                    plain(&claim.quantity),
                    e.n,
                    significant(e.value),
                    significant(e.low),
                    significant(e.high),
                    p_value(e.p)
                )
            };
            finding(claim, pairs.len(), bounds(&pairs), found, says, |e| {
                verdict(e.low > 0.0, e.high < 0.0)
            })
        }
        Test::Equal {
            axis,
            values: [a, b],
            within,
        } => {
            let pairs = pairs(&all, axis, a, b);
            let relative: Vec<f64> = pairs
                .iter()
                .map(|(a, b)| 2.0 * (a.value - b.value) / (a.value + b.value))
                .collect();
            let says = |e: Estimate| {
                format!(
                    "{} in {a} against {b}: relative difference {} (95 % interval {} to {}, n = {})",
                    plain(&claim.quantity),
                    percent(e.value),
                    percent(e.low),
                    percent(e.high),
                    e.n
                )
            };
            let found = statistics::signed_rank(&relative);
            finding(claim, pairs.len(), bounds(&pairs), found, says, |e| {
                inside(e, *within)
            })
        }
        Test::Spread { axis, more, less } => {
            let pairs = pairs(&all, axis, more, less);
            let side = |pick: fn(&(&Observation, &Observation)) -> f64| {
                pairs.iter().map(pick).collect::<Vec<f64>>()
            };
            let (first, second) = (side(|p| p.0.value), side(|p| p.1.value));
            let spread =
                |v: &[f64]| statistics::coefficient_of_variation(v).map_or("?".into(), percent);
            let says = |e: Estimate| {
                format!(
                    "{} varies over the grains by {} in {more} and by {} in {less} (standard deviation over mean, n = {}; p of equal spreads = {})",
                    plain(&claim.quantity),
                    spread(&first),
                    spread(&second),
                    e.n,
                    p_value(e.p)
                )
            };
            let found = statistics::relative_spread_test(&first, &second);
            finding(claim, pairs.len(), bounds(&pairs), found, says, |e| {
                verdict(e.low > 0.0, e.high < 0.0)
            })
        }
        Test::Near { model, within } => near(claim, rows, &all, model, *within),
    }
}

/// The range over an axis, of models that differ on it alone.
fn ranges(all: &[Observation], axis: &str) -> Vec<Observation> {
    let mut groups: BTreeMap<BTreeMap<String, String>, Vec<&Observation>> = BTreeMap::new();
    for sample in all.iter().filter(|s| s.levels.contains_key(axis)) {
        let mut rest = sample.levels.clone();
        rest.remove(axis);
        groups.entry(rest).or_default().push(sample);
    }
    let whole = groups.values().map(Vec::len).max().unwrap_or(0);
    let range = |group: &Vec<&Observation>| {
        let of =
            |start: f64, pick: fn(f64, f64) -> f64| group.iter().map(|s| s.value).fold(start, pick);
        let mut sample = group[0].clone();
        sample.value = of(f64::NEG_INFINITY, f64::max) - of(f64::INFINITY, f64::min);
        sample.bound = group.iter().any(|s| s.bound);
        sample
    };
    groups
        .values()
        .filter(|g| g.len() == whole && whole > 1)
        .map(range)
        .collect()
}

fn trend(claim: &Claim, all: &[Observation], with: &str, sign: Sign, of: &str) -> Finding {
    let known: Vec<(&Observation, f64)> = all
        .iter()
        .filter_map(|s| Some((s, *s.factors.get(with)?)))
        .collect();
    let (x, y): (Vec<f64>, Vec<f64>) = known.iter().map(|(s, f)| (*f, s.latest())).unzip();
    let found = statistics::spearman(&x, &y);
    let says = |e: Estimate| {
        format!(
            "rank correlation of {of}{} with {with}: {} (95 % interval {} to {}, n = {}, p = {})",
            plain(&claim.quantity),
            significant(e.value),
            significant(e.low),
            significant(e.high),
            e.n,
            p_value(e.p)
        )
    };
    let bounds = known.iter().filter(|(s, _)| s.bound).count();
    finding(claim, known.len(), bounds, found, says, |e| {
        let (up, down) = (e.low > 0.0, e.high < 0.0);
        match sign {
            Sign::Rises => verdict(up, down),
            Sign::Falls => verdict(down, up),
            Sign::None => verdict(false, up || down),
        }
    })
}

fn near(
    claim: &Claim,
    rows: &[RunRecord],
    all: &[Observation],
    model: &str,
    within: f64,
) -> Finding {
    let own = observations(rows, &claim.quantity, &BTreeMap::new());
    let usable = |s: &&Observation| s.model == model && !(claim.observed && s.bound);
    let Some(reference) = own.iter().find(usable) else {
        return finding(claim, 0, 0, None, |_| String::new(), |_| "open");
    };
    let others: Vec<&Observation> = all.iter().filter(|s| s.model != model).collect();
    let relative: Vec<f64> = others
        .iter()
        .map(|s| s.value / reference.value - 1.0)
        .collect();
    let furthest = relative
        .iter()
        .fold(0.0, |a: f64, b| if b.abs() > a.abs() { *b } else { a });
    let says = |e: Estimate| {
        format!(
            "{} against that of {model}, {}: {} (95 % interval {} to {}, n = {}); the furthest differs by {}",
            plain(&claim.quantity),
            significant(reference.value),
            percent(e.value),
            percent(e.low),
            percent(e.high),
            e.n,
            percent(furthest)
        )
    };
    let bounds = others.iter().filter(|s| s.bound).count();
    finding(
        claim,
        others.len(),
        bounds,
        statistics::signed_rank(&relative),
        says,
        |e| inside(e, within),
    )
}

/// Models that differ on one axis alone: at `more`, at `less`.
fn pairs<'a>(
    all: &'a [Observation],
    axis: &str,
    more: &str,
    less: &str,
) -> Vec<(&'a Observation, &'a Observation)> {
    let rest = |s: &Observation| {
        let mut levels = s.levels.clone();
        levels.remove(axis);
        levels
    };
    let at = |level: &str| -> Vec<&'a Observation> {
        let here = |s: &&Observation| s.levels.get(axis).is_some_and(|l| l == level);
        all.iter().filter(here).collect()
    };
    let others = at(less);
    let pair = |a: &'a Observation| Some((a, *others.iter().find(|b| rest(a) == rest(b))?));
    at(more).into_iter().filter_map(pair).collect()
}

fn bounds(pairs: &[(&Observation, &Observation)]) -> usize {
    pairs.iter().filter(|(a, b)| a.bound || b.bound).count()
}

fn verdict(holds: bool, contradicted: bool) -> &'static str {
    match (holds, contradicted) {
        (true, _) => "holds",
        (_, true) => "contradicted",
        _ => "open",
    }
}

/// Whether an interval lies within a bound of zero, or beyond it.
fn inside(e: &Estimate, within: f64) -> &'static str {
    verdict(
        e.low >= -within && e.high <= within,
        e.low > within || e.high < -within,
    )
}

fn finding(
    claim: &Claim,
    n: usize,
    bounds: usize,
    found: Option<Estimate>,
    says: impl Fn(Estimate) -> String,
    verdict: impl Fn(&Estimate) -> &'static str,
) -> Finding {
    let mut text = match found {
        Some(e) => says(e),
        None => format!("{n} models or pairs of models are finished: too few to say anything"),
    };
    if claim.observed {
        text += "; what landed before is left out";
    }
    if bounds > 0 {
        text += &match claim.test {
            Test::Trend { .. } | Test::Range { .. } => {
                format!("; {bounds} of them landed before and count as latest, alike")
            }
            _ => format!("; {bounds} of them are lower bounds, as the pair landed before"),
        };
    }
    Finding {
        claim: claim.says.clone(),
        part: claim.part.clone(),
        quantity: claim.quantity.clone(),
        verdict: found.as_ref().map_or("open", verdict),
        says: text,
        n,
        bounds,
        value: found.map(|e| e.value),
        interval: found.map(|e| [e.low, e.high]),
        p: found.map(|e| e.p),
    }
}
