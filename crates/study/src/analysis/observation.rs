//! Observations of a quantity, one per model, with right-censoring by the landing, by a grain that
//! leaves the box, or by the end of the run.

use std::collections::BTreeMap;

use grainwake_plot::axis::extent;

use super::statistics::median;
use super::survival::{Duration, median_time};
use crate::measure::mean;
use crate::measure::record::RunRecord;
use crate::plan::claims::{Condition, Range};

/// Observed value of a quantity for one model: the median of a time over the members, those without
/// the event last; the mean of another quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Name of the model.
    pub model: String,
    /// Level on each axis.
    pub levels: BTreeMap<String, String>,
    /// Numerical factors.
    pub factors: BTreeMap<String, f64>,
    /// Value; of a censored observation the median of the times of landings and events.
    pub value: f64,
    /// Times of the members; empty of a quantity that is no time.
    pub durations: Vec<Duration>,
    /// Smallest and largest value over the members with the event; over all members if none has it.
    pub range: (f64, f64),
    /// Whether the observation is right-censored: in at least half of the members the event has not
    /// occurred when the pair lands or the run ends.
    pub censored: bool,
}

impl Observation {
    /// Returns the number of members without the event.
    pub fn missed(&self) -> usize {
        self.durations.iter().filter(|duration| duration.censored).count()
    }

    /// Returns whether a member has the event, or the quantity is no time.
    pub fn occurred(&self) -> bool {
        self.durations.is_empty() || self.missed() < self.durations.len()
    }

    /// Returns the value for rank tests; censored observations rank last, all equal.
    pub fn rank_value(&self) -> f64 {
        if self.censored { f64::INFINITY } else { self.value }
    }
}

/// Returns the levels on all axes but one.
pub fn other_levels(levels: &BTreeMap<String, String>, axis: &str) -> BTreeMap<String, String> {
    let mut others = levels.clone();
    others.remove(axis);
    others
}

/// Returns a quantity of a run and whether it is right-censored.
///
/// The times of events that did not occur are censored when a grain first lands or leaves the box,
/// or at the end of the run.
pub fn observe(record: &RunRecord, quantity: &str) -> Option<(f64, bool)> {
    if !record.finished() {
        return None;
    }
    if let Some(value) = record.get(quantity) {
        return Some((value, record.is_lower_bound(quantity)));
    }
    let pair = record.pair.as_ref()?;
    let end = || Some(record.end_time_s? / record.up_and_time()?.1);
    let censored = || Some((pair.landing_time.or(pair.left_time).or_else(end)?, true));
    match quantity {
        "kiss_time" => censored(),
        "tumble_time" | "pass_time" | "separation_time" if pair.kiss_time.is_some() => censored(),
        _ => None,
    }
}

/// A run, its value of a quantity, and whether the value is right-censored.
pub type Member<'a> = (&'a RunRecord, f64, bool);

/// Returns the members that have a quantity, by model, of all models that meet the conditions.
pub fn members<'a>(
    records: &'a [RunRecord],
    quantity: &str,
    when: &BTreeMap<String, Condition>,
) -> Vec<Vec<Member<'a>>> {
    let mut models: Vec<Vec<Member>> = Vec::new();
    for record in records.iter().filter(|record| meets(record, when)) {
        if let Some((value, censored)) = observe(record, quantity) {
            let member = (record, value, censored);
            match models.iter_mut().find(|members| members[0].0.model == record.model) {
                Some(members) => members.push(member),
                None => models.push(vec![member]),
            }
        }
    }
    models
}

/// Times until an event, and stages that end with one.
const TIMES: [&str; 6] =
    ["kiss_time", "tumble_time", "pass_time", "separation_time", "kissing_stage", "contact_stage"];

/// Returns whether a quantity is the time until an event that need not occur.
pub fn is_time(quantity: &str) -> bool {
    TIMES.contains(&quantity)
}

/// Returns the observations of a quantity for all models that meet the conditions and of which more
/// than half of the finished members have the quantity.
pub fn observations(
    records: &[RunRecord],
    quantity: &str,
    when: &BTreeMap<String, Condition>,
) -> Vec<Observation> {
    let finished = |model: &str| {
        let of_model = records.iter().filter(|r| r.model == model && r.finished());
        of_model.filter(|record| meets(record, when)).count()
    };
    let observation = |members: Vec<Member>| {
        let first = members[0].0;
        if 2 * members.len() <= finished(&first.model) {
            return None;
        }
        let values: Vec<f64> = members.iter().map(|(_, v, _)| *v).collect();
        let duration = |&(_, time, censored): &Member| Duration { time, censored };
        let durations: Vec<Duration> = match is_time(quantity) {
            true => members.iter().map(duration).collect(),
            false => Vec::new(),
        };
        let (value, censored) = match (is_time(quantity), median_time(&durations)) {
            (false, _) => (mean(values.iter().copied())?, false),
            (true, Some(time)) => (time, false),
            (true, None) => (median(&values)?, true),
        };
        let events = || members.iter().filter(|(_, _, censored)| !censored).map(|(_, v, _)| *v);
        let range = extent(events()).or_else(|| extent(values.iter().copied()))?;
        Some(Observation {
            model: first.model.clone(),
            levels: first.levels.clone().into_iter().collect(),
            factors: first.factors.clone().into_iter().collect(),
            value,
            durations,
            range,
            censored,
        })
    };
    members(records, quantity, when).into_iter().filter_map(observation).collect()
}

/// Returns whether a run meets all conditions.
pub(crate) fn meets(record: &RunRecord, when: &BTreeMap<String, Condition>) -> bool {
    when.iter().all(|(name, condition)| match condition {
        Condition::Is(level) => record.levels.get(name) == Some(level),
        Condition::In(levels) => record.levels.get(name).is_some_and(|l| levels.contains(l)),
        Condition::Range(Range { at_least, at_most }) => {
            record.factors.get(name).is_some_and(|v| {
                at_least.is_none_or(|low| *v >= low) && at_most.is_none_or(|high| *v <= high)
            })
        }
    })
}

/// Pairs the observations at two levels of an axis that are equal on all other axes.
pub fn matched<'a>(
    all: &'a [Observation],
    axis: &str,
    first: &str,
    second: &str,
) -> Vec<(&'a Observation, &'a Observation)> {
    let on = |o: &&Observation, level: &str| o.levels.get(axis).is_some_and(|l| l == level);
    let partner = |a: &'a Observation| {
        let others = other_levels(&a.levels, axis);
        let same = |b: &&Observation| on(b, second) && other_levels(&b.levels, axis) == others;
        Some((a, all.iter().find(same)?))
    };
    all.iter().filter(|a| on(a, first)).filter_map(partner).collect()
}

/// Returns the range of the values over an axis, for every combination of the other axes.
///
/// Combinations with missing levels are left out. A range is censored if one of its values is.
pub fn ranges(all: &[Observation], axis: &str) -> Vec<Observation> {
    let mut groups: BTreeMap<BTreeMap<String, String>, Vec<&Observation>> = BTreeMap::new();
    for observation in all.iter().filter(|o| o.levels.contains_key(axis)) {
        groups.entry(other_levels(&observation.levels, axis)).or_default().push(observation);
    }
    let complete = groups.values().map(Vec::len).max().unwrap_or(0);
    let range = |group: &Vec<&Observation>| {
        let values = || group.iter().map(|o| o.value);
        let high = values().fold(f64::NEG_INFINITY, f64::max);
        let low = values().fold(f64::INFINITY, f64::min);
        Observation {
            value: high - low,
            censored: group.iter().any(|o| o.censored),
            ..group[0].clone()
        }
    };
    let whole = groups.values().filter(|g| g.len() == complete && complete > 1);
    whole.map(range).collect()
}

/// Returns the factor and the rank value of all observations that have the factor, and the number
/// of censored ones among them.
pub(super) fn with_factor(all: &[Observation], factor: &str) -> (Vec<f64>, Vec<f64>, usize) {
    let known = all.iter().filter_map(|o| Some((o, *o.factors.get(factor)?)));
    let known: Vec<(&Observation, f64)> = known.collect();
    let (x, y) = known.iter().map(|(o, f)| (*f, o.rank_value())).unzip();
    (x, y, known.iter().filter(|(o, _)| o.censored).count())
}
