//! Comparison of the results of a run with `[expect]`.

use serde::Serialize;

use grainwake_formats::summary::Summary;

/// A quantity that can be expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Measure {
    PeakSettlingSpeed,
    KissTime,
    TumbleTime,
    SeparationTime,
    LandingTime,
    RoleChanges,
    EndTime,
    MaxDivergence,
}

impl Measure {
    /// Returns whether the quantity is a result of a pair.
    pub fn of_pair(self) -> bool {
        use Measure::{KissTime, RoleChanges, SeparationTime, TumbleTime};
        matches!(self, KissTime | TumbleTime | SeparationTime | RoleChanges)
    }
}

grainwake_formats::display_as_serialized!(Measure);

/// One expected result.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    pub(super) measure: Measure,
    pub(super) grain: Option<usize>,
    pub(super) reference: Option<f64>,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Comparison of a result with its expectation. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Name of the quantity, with its grain if one is named.
    pub quantity: String,
    /// Result of the run; none if the event did not happen.
    pub value: Option<f64>,
    /// Expected value; none if only bounds are given.
    pub reference: Option<f64>,
    /// Difference from the reference.
    pub error: Option<f64>,
    /// Accepted range.
    pub bound: [Option<f64>; 2],
    /// Whether the value lies in the accepted range.
    pub pass: bool,
}

impl Expectation {
    /// Compares the expectation with the results of a run.
    pub fn judge(&self, summary: &Summary) -> Verdict {
        let value = self.value(summary);
        let pass = value.is_some_and(|v| (self.low..=self.high).contains(&v));
        let quantity = match self.grain {
            Some(grain) => format!("{} of grain {grain}", self.measure),
            None => self.measure.to_string(),
        };
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
        let grains = || {
            let all = summary.grains.iter().enumerate();
            let chosen = all.filter(|(i, _)| self.grain.is_none_or(|grain| grain == *i));
            chosen.map(|(_, grain)| grain)
        };
        match self.measure {
            Measure::PeakSettlingSpeed => {
                grains().map(|g| g.peak_settling_speed_m_per_s).reduce(f64::max)
            }
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
