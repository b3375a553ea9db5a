//! Right-censored times: Kaplan and Meier's estimate of the distribution, and the log-rank test.

use statrs::distribution::{ChiSquared, ContinuousCDF};

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
/// Returns the two-sided p value; none if no stratum has an event while both samples are at risk.
pub fn log_rank(strata: &[[Vec<Duration>; 2]]) -> Option<f64> {
    let (mut excess, mut variance) = (0.0, 0.0);
    for [first, second] in strata {
        let all: Vec<Duration> = first.iter().chain(second).copied().collect();
        for (time, [events, at_risk]) in events(&all) {
            let own = first.iter().filter(|d| d.time >= time).count() as f64;
            let observed = first.iter().filter(|d| d.time == time && !d.censored).count() as f64;
            let part = own / at_risk;
            excess += observed - events * part;
            if at_risk > 1.0 {
                variance += events * part * (1.0 - part) * (at_risk - events) / (at_risk - 1.0);
            }
        }
    }
    let distribution = ChiSquared::new(1.0).ok()?;
    (variance > 0.0).then(|| distribution.sf(excess * excess / variance))
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
