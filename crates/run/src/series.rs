//! Series of outputs. Output times are multiples of their intervals, so that they do not depend on
//! where a run was interrupted.

use grainwake_solver::sim::SAME_TIME;

use crate::plan::RunPlan;

/// Outputs closer than this fraction of a time step are written together.
const SHORTEST_STEP: f64 = 0.1;

/// Content of a series of outputs.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Content {
    Tables,
    Slices,
    Fields,
    Surfaces,
    /// VTK files of the contacts.
    Contacts,
    /// Rows of the extra table with this index.
    Extra(usize),
}

/// Outputs at the multiples of an interval.
pub(crate) struct Series {
    /// Content of each output.
    pub content: Content,
    /// Interval [s]; zero turns the series off.
    pub interval: f64,
    /// Index of the next output.
    pub next: u64,
}

impl Series {
    /// Returns all series of a plan, in the order of the checkpoint; `extra` are the intervals of
    /// the extra tables [s].
    pub fn of(plan: &RunPlan, extra: &[f64]) -> Vec<Series> {
        let fixed = [
            (Content::Tables, plan.tables),
            (Content::Slices, plan.slices),
            (Content::Fields, plan.fields),
            (Content::Surfaces, plan.surfaces),
            (Content::Contacts, plan.contact_network),
        ];
        let extra = extra.iter().enumerate();
        let extra = extra.map(|(index, interval)| (Content::Extra(index), *interval));
        let all = fixed.into_iter().chain(extra);
        all.map(|(content, interval)| Series { content, interval, next: 0 }).collect()
    }

    /// Returns whether the series is turned on.
    pub fn is_on(&self) -> bool {
        self.interval > 0.0
    }

    /// Returns the time of the next output [s].
    fn next_time(&self) -> Option<f64> {
        self.is_on().then_some(self.next as f64 * self.interval)
    }

    /// Returns whether the next output is due at `time` [s].
    pub fn is_due(&self, time: f64) -> bool {
        self.next_time().is_some_and(|next| time >= next - SAME_TIME * self.interval)
    }

    /// Moves on to the first output after `time` [s].
    pub fn start_after(&mut self, time: f64) {
        if self.is_on() {
            self.next = (time / self.interval + SAME_TIME).floor() as u64 + 1;
        }
    }
}

/// Returns the time from `now` to the next output of any series, to `end` or to the time `wanted`
/// by the caller [s].
///
/// Times that are nearly the same are one time, the last of them: a time step much shorter than the
/// usual `step` [s] disturbs the pressure. A continued run may ask for intervals shorter than the
/// last step; two outputs of one series are never written together.
pub(crate) fn until_next(series: &[Series], [end, wanted]: [f64; 2], now: f64, step: f64) -> f64 {
    let times = || {
        let next = series.iter().filter_map(Series::next_time).chain([wanted]);
        next.filter(|time| *time < end).chain([end])
    };
    let first = times().fold(f64::INFINITY, f64::min);
    let intervals = series.iter().filter(|series| series.is_on()).map(|series| series.interval);
    let together = first + SHORTEST_STEP * intervals.fold(step, f64::min);
    times().filter(|time| *time <= together).fold(first, f64::max) - now
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_closer_than_the_last_step_are_written_one_by_one() {
        let of = |content, interval| Series { content, interval, next: 1 };
        let series = [of(Content::Tables, 1e-3), of(Content::Slices, 0.5e-3)];
        let until = |series: &[Series], wanted, step| until_next(series, [1.0, wanted], 0.0, step);
        assert_eq!(until(&series, f64::INFINITY, 0.1), 0.5e-3);
        // Nearly equal times are written together.
        let series = [of(Content::Tables, 1e-3), of(Content::Slices, 1.01e-3)];
        assert_eq!(until(&series, f64::INFINITY, 1e-3), 1.01e-3);
        // A time that the caller wants is one of them, before or after an output.
        assert_eq!(until(&series[..1], 0.9999e-3, 1e-3), 1e-3);
        assert_eq!(until(&series[..1], 1.0001e-3, 1e-3), 1.0001e-3);
        assert_eq!(until(&series[..1], 0.7e-3, 1e-3), 0.7e-3);
    }
}
