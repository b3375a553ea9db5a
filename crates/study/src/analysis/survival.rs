//! Times until an event that need not occur: their median, the share of runs with the event by a
//! time, and the log-rank test.

use super::statistics::{median, sign_flip_p};

/// A time until an event, or until the observation ended without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Duration {
    /// Time.
    pub time: f64,
    /// Whether the event did not occur until `time`.
    pub censored: bool,
}

impl Duration {
    /// Returns the time of the event; infinity if it did not occur.
    pub fn event(&self) -> f64 {
        if self.censored { f64::INFINITY } else { self.time }
    }
}

/// Returns the median time of the event, runs without it last; none if half of them are without.
pub fn median_time(durations: &[Duration]) -> Option<f64> {
    let events: Vec<f64> = durations.iter().map(Duration::event).collect();
    median(&events).filter(|time| time.is_finite())
}

/// Returns the times of events, ascending, each with the mean over the models of the share of their
/// members in which the event has occurred by then (cumulative incidence).
pub fn cumulative_incidence(models: &[Vec<Duration>]) -> Vec<(f64, f64)> {
    let weighted = |model: &Vec<Duration>| {
        let weight = 1.0 / (models.len() * model.len()) as f64;
        let events = model.iter().filter(|d| !d.censored).map(move |d| (d.time, weight));
        events.collect::<Vec<_>>()
    };
    let mut steps: Vec<(f64, f64)> = models.iter().flat_map(weighted).collect();
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut share = 0.0;
    for step in &mut steps {
        share += step.1;
        step.1 = share;
    }
    steps
}

/// Performs the log-rank test of two samples, stratified: each stratum is a pair of samples.
///
/// The durations of a stratum may depend on each other. The two-sided p value is that of the sum of
/// [`log_rank_excess`] if exchanging the samples of a stratum is as likely as not
/// ([`sign_flip_p`]); none below six strata.
pub fn log_rank(strata: &[[Vec<Duration>; 2]]) -> Option<f64> {
    let excesses: Vec<f64> = strata.iter().map(log_rank_excess).collect();
    sign_flip_p(&excesses)
}

/// Returns the number of events in the first sample less the number that the log-rank test expects
/// there if both samples have the same distribution.
pub fn log_rank_excess([first, second]: &[Vec<Duration>; 2]) -> f64 {
    let all: Vec<Duration> = first.iter().chain(second).copied().collect();
    let excess_at = |(time, [events, at_risk]): (f64, [f64; 2])| {
        let own = first.iter().filter(|d| d.time >= time).count() as f64;
        let observed = first.iter().filter(|d| d.time == time && !d.censored).count() as f64;
        observed - events * own / at_risk
    };
    events(&all).into_iter().map(excess_at).sum()
}

/// Returns the distinct times of events, ascending, each with the numbers of events and of those
/// at risk.
fn events(durations: &[Duration]) -> Vec<(f64, [f64; 2])> {
    let mut times: Vec<f64> = durations.iter().filter(|d| !d.censored).map(|d| d.time).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let count = |time: f64| {
        let events = durations.iter().filter(|d| d.time == time && !d.censored).count();
        let at_risk = durations.iter().filter(|d| d.time >= time).count();
        (time, [events as f64, at_risk as f64])
    };
    times.into_iter().map(count).collect()
}
