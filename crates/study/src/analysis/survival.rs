//! Right-censored times: Kaplan and Meier's estimate of the distribution, and the log-rank test.

use super::statistics::sign_flip_p;

/// A time until an event, or until the observation ended without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Duration {
    /// Time.
    pub time: f64,
    /// Whether the event did not occur until `time`.
    pub censored: bool,
}

/// Returns Kaplan and Meier's estimate: the times of events, ascending, each with the probability
/// that the event has occurred by then.
pub fn kaplan_meier(durations: &[Duration]) -> Vec<(f64, f64)> {
    let mut survival = 1.0;
    let step = |(time, [events, at_risk]): (f64, [f64; 2])| {
        survival *= 1.0 - events / at_risk;
        (time, 1.0 - survival)
    };
    events(durations).into_iter().map(step).collect()
}

/// Returns the time by which the event has occurred with a probability of one half, if it has.
pub fn median_time(durations: &[Duration]) -> Option<f64> {
    // The last digits of the product must not decide.
    let half = 0.5 - 1e-12;
    kaplan_meier(durations).into_iter().find(|(_, share)| *share >= half).map(|(time, _)| time)
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
