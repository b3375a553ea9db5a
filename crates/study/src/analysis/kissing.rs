//! Who kisses: share of runs in which a pair comes into contact before it lands, the time of the
//! first contact, and how both depend on the level of an axis and on the grid.
//!
//! The share of a set of models is the mean over the models of the share of their members.
//! Two sets are compared over the models that are equal on all other axes. A model kisses if more
//! than half of its members do.

use std::collections::BTreeMap;

use serde::Serialize;

use super::observation::{Member, members, other_levels};
use super::statistics::{difference_interval, median, share_interval, sign_flip_p, signed_rank};
use super::survival::{Duration, cumulative_incidence, log_rank, median_time};
use crate::measure::record::RunRecord;
use crate::measure::{mean, unique};
use crate::plan::claims::{Analysis, Kissing};

/// Results on the first contact.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KissingResults {
    /// Every level on every grid.
    pub levels: Vec<Level>,
    /// Pairs of levels, on every grid.
    pub differences: Vec<LevelDifference>,
    /// Pairs of successive grids, at every level and over all levels.
    pub grids: Vec<GridDifference>,
}

/// Models at a level of the axis, on one grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Level.
    pub level: String,
    /// Level of the axis of grids.
    pub grid: Option<String>,
    /// Number of models.
    pub models: usize,
    /// Number of runs.
    pub runs: usize,
    /// Number of models of which all, some, or no members kiss.
    pub all_some_none: [usize; 3],
    /// Share of runs that kiss.
    pub share: f64,
    /// Interval of the share.
    pub interval: [f64; 2],
    /// Time by which half of the runs have kissed, if they have.
    pub median_time: Option<f64>,
    /// Times of contacts, each with the share of runs that have kissed by then, for the figure.
    #[serde(skip)]
    pub incidence: Vec<(f64, f64)>,
    /// Time of the last contact or landing.
    #[serde(skip)]
    pub last: f64,
}

/// Difference between two levels, over the models that are equal on all other axes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelDifference {
    /// First level.
    pub first: String,
    /// Second level.
    pub second: String,
    /// Level of the axis of grids.
    pub grid: Option<String>,
    /// Number of pairs of models.
    pub pairs: usize,
    /// Share at the first level less that at the second.
    pub share: f64,
    /// Interval of the difference of the shares.
    pub interval: [f64; 2],
    /// Two-sided p value of this difference, by exchanging the levels within the pairs; none below
    /// six pairs.
    pub share_p: Option<f64>,
    /// Two-sided p value of the log-rank test of the times, stratified by the other axes, the
    /// members of a model counting as one; none below six pairs.
    pub log_rank_p: Option<f64>,
    /// Hodges-Lehmann shift of the median times of models that kiss at both levels.
    pub time_shift: Option<f64>,
    /// Interval of the shift.
    pub time_shift_interval: Option<[f64; 2]>,
}

/// Difference between a grid and the next finer one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GridDifference {
    /// Level of the axis; none for all levels together.
    pub level: Option<String>,
    /// Coarse grid.
    pub coarse: String,
    /// Fine grid.
    pub fine: String,
    /// Number of models on both grids.
    pub models: usize,
    /// Share on the coarse grid less that on the fine grid.
    pub share: f64,
    /// Interval of the difference of the shares.
    pub interval: [f64; 2],
    /// Share of models for which most members have the same outcome on both grids.
    pub agreement: f64,
    /// Median of the relative differences of the median times of models that kiss on both.
    pub time: Option<f64>,
}

/// Outcomes of the members of one model.
struct Outcomes {
    levels: BTreeMap<String, String>,
    members: BTreeMap<usize, Duration>,
}

impl Outcomes {
    fn durations(&self) -> Vec<Duration> {
        self.members.values().copied().collect()
    }
    fn share(&self) -> f64 {
        let kissed = self.members.values().filter(|d| !d.censored).count();
        kissed as f64 / self.members.len() as f64
    }
    /// Median time; none unless more than half of the members kiss.
    fn median_time(&self) -> Option<f64> {
        median_time(&self.durations())
    }
    fn level(&self, axis: &str) -> Option<&str> {
        self.levels.get(axis).map(String::as_str)
    }
}

/// Two models that differ on one axis only.
type Pair<'a> = [&'a Outcomes; 2];

/// Evaluates the first contacts, if the analysis requests it.
pub fn kissing(analysis: &Analysis, records: &[RunRecord]) -> Option<KissingResults> {
    let Kissing { by, grid } = analysis.kissing.as_ref()?;
    let models = outcomes(records);
    let levels = names(records, by);
    let grids = grid.as_ref().map(|axis| names(records, axis)).unwrap_or_default();
    let on = |wanted: Option<&str>| -> Vec<&Outcomes> {
        let on_grid = |m: &&Outcomes| match (grid, wanted) {
            (Some(axis), Some(wanted)) => m.level(axis) == Some(wanted),
            _ => true,
        };
        models.iter().filter(on_grid).collect()
    };
    let every_grid: Vec<Option<&str>> = match grids.is_empty() {
        true => vec![None],
        false => grids.iter().map(|g| Some(g.as_str())).collect(),
    };
    let mut results =
        KissingResults { levels: Vec::new(), differences: Vec::new(), grids: Vec::new() };
    for grid in &every_grid {
        let models = on(*grid);
        for (i, level) in levels.iter().enumerate() {
            let at = |m: &&&Outcomes| m.level(by) == Some(level);
            let here: Vec<&Outcomes> = models.iter().filter(at).copied().collect();
            results.levels.extend(summary(level, *grid, &here));
            for second in &levels[i + 1..] {
                let pairs = matched(&models, by, level, second);
                results.differences.extend(difference([level, second], *grid, &pairs));
            }
        }
    }
    if let Some(axis) = grid {
        let all: Vec<&Outcomes> = models.iter().collect();
        for two in grids.windows(2) {
            let pairs = matched(&all, axis, &two[0], &two[1]);
            results.grids.extend(refinement(None, two, &pairs));
            for level in &levels {
                let at = |pair: &&Pair| pair[0].level(by) == Some(level);
                let pairs: Vec<Pair> = pairs.iter().filter(at).copied().collect();
                results.grids.extend(refinement(Some(level), two, &pairs));
            }
        }
    }
    Some(results)
}

/// Returns the outcomes of all models on the axes.
fn outcomes(records: &[RunRecord]) -> Vec<Outcomes> {
    let duration = |(run, time, censored): Member| (run.member, Duration { time, censored });
    let outcomes = |members: Vec<Member>| Outcomes {
        levels: members[0].0.levels.clone().into_iter().collect(),
        members: members.into_iter().map(duration).collect(),
    };
    let models = members(records, "kiss_time", &BTreeMap::new()).into_iter().map(outcomes);
    models.filter(|model| !model.levels.is_empty()).collect()
}

/// Returns the levels of an axis in the order of the study file, whether their runs have finished
/// or not.
fn names(records: &[RunRecord], axis: &str) -> Vec<String> {
    unique(records.iter().filter_map(|record| record.levels.get(axis)))
}

/// Pairs the models at two levels of an axis that are equal on all other axes.
fn matched<'a>(models: &[&'a Outcomes], axis: &str, first: &str, second: &str) -> Vec<Pair<'a>> {
    let at = |level: &str| {
        let here = models.iter().filter(move |m| m.level(axis) == Some(level));
        here.map(|m| (other_levels(&m.levels, axis), *m)).collect::<BTreeMap<_, _>>()
    };
    let second = at(second);
    let pair = |(key, model): (_, &'a Outcomes)| Some([model, *second.get(&key)?]);
    at(first).into_iter().filter_map(pair).collect()
}

fn summary(level: &str, grid: Option<&str>, models: &[&Outcomes]) -> Option<Level> {
    let shares: Vec<f64> = models.iter().map(|m| m.share()).collect();
    let count = |test: fn(f64) -> bool| shares.iter().filter(|s| test(**s)).count();
    let members: Vec<Vec<f64>> = models.iter().map(|m| kissed(&m.members)).collect();
    let durations: Vec<Vec<Duration>> = models.iter().map(|m| m.durations()).collect();
    let incidence = cumulative_incidence(&durations);
    // The last digits of the sum must not decide.
    let half = incidence.iter().find(|(_, share)| *share >= 0.5 - 1e-12);
    Some(Level {
        level: level.to_owned(),
        grid: grid.map(str::to_owned),
        models: models.len(),
        runs: members.iter().map(Vec::len).sum(),
        all_some_none: [count(|s| s == 1.0), count(|s| s > 0.0 && s < 1.0), count(|s| s == 0.0)],
        share: mean(shares.iter().copied())?,
        interval: share_interval(&members)?,
        median_time: half.map(|(time, _)| *time),
        last: durations.iter().flatten().map(|d| d.time).fold(0.0, f64::max),
        incidence,
    })
}

fn difference(
    [first, second]: [&str; 2],
    grid: Option<&str>,
    pairs: &[Pair],
) -> Option<LevelDifference> {
    let (share, interval, differences) = share_difference(pairs)?;
    let strata: Vec<[Vec<Duration>; 2]> =
        pairs.iter().map(|pair| pair.map(Outcomes::durations)).collect();
    let shifts: Vec<f64> =
        pairs.iter().filter_map(|[a, b]| Some(a.median_time()? - b.median_time()?)).collect();
    let shift = signed_rank(&shifts);
    Some(LevelDifference {
        first: first.to_owned(),
        second: second.to_owned(),
        grid: grid.map(str::to_owned),
        pairs: pairs.len(),
        share,
        interval,
        share_p: sign_flip_p(&differences),
        log_rank_p: log_rank(&strata),
        time_shift: shift.map(|s| s.value),
        time_shift_interval: shift.map(|s| [s.low, s.high]),
    })
}

fn refinement(level: Option<&str>, grids: &[String], pairs: &[Pair]) -> Option<GridDifference> {
    let (share, interval, _) = share_difference(pairs)?;
    let same = pairs.iter().filter(|[a, b]| (a.share() > 0.5) == (b.share() > 0.5)).count();
    let times = pairs.iter().filter_map(|[a, b]| Some([a.median_time()?, b.median_time()?]));
    let relative: Vec<f64> = times.map(|[a, b]| (a - b).abs() / b).collect();
    Some(GridDifference {
        level: level.map(str::to_owned),
        coarse: grids[0].clone(),
        fine: grids[1].clone(),
        models: pairs.len(),
        share,
        interval,
        agreement: same as f64 / pairs.len() as f64,
        time: median(&relative),
    })
}

/// Mean difference of the shares of two sets, over the members that both have, its interval, and
/// the differences of the pairs.
fn share_difference(pairs: &[Pair]) -> Option<(f64, [f64; 2], Vec<f64>)> {
    let common = |[a, b]: &Pair| -> Vec<f64> {
        let both = a.members.iter().filter_map(|(n, first)| Some((first, b.members.get(n)?)));
        both.map(|(a, b)| one_if_kissed(a) - one_if_kissed(b)).collect()
    };
    let members: Vec<Vec<f64>> = pairs.iter().map(common).filter(|m| !m.is_empty()).collect();
    let means: Vec<f64> = members.iter().filter_map(|m| mean(m.iter().copied())).collect();
    Some((mean(means.iter().copied())?, difference_interval(&members)?, means))
}

fn kissed(members: &BTreeMap<usize, Duration>) -> Vec<f64> {
    members.values().map(one_if_kissed).collect()
}

fn one_if_kissed(duration: &Duration) -> f64 {
    if duration.censored { 0.0 } else { 1.0 }
}
