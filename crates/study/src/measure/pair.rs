//! Measured values of a settling pair.
//!
//! Lengths are in equivalent diameters d, times in sqrt(d/g), speeds in sqrt(d g), down positive.
//! *Leading* is the lower grain at the start, *trailing* the upper one; of grains that rise the
//! upper one leads. The observation ends when a grain first lands or leaves the
//! box, or with the run.

use glam::{DQuat, DVec3};
use grainwake_formats::events::{Event, EventKind};
use grainwake_report::features::{RunFeatures, Scales};
use grainwake_report::run_folder::{History, RunFolder, nearest_image};
use serde::{Deserialize, Serialize};

use super::mean;

/// Measured values of a pair. The JSON names are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairMeasures {
    /// First contact.
    pub kiss_time: Option<f64>,
    /// From the first contact until the line of centres is at 45 degrees or the contact ends.
    pub kissing_stage: Option<f64>,
    /// From the first contact until the pair separates, or the observation ends.
    pub contact_stage: Option<f64>,
    /// Whether the pair separated before the end of the observation; if not, `contact_stage` is a
    /// lower bound.
    pub parted: Option<bool>,
    /// Line of centres at 45 degrees, after the first contact.
    pub tumble_time: Option<f64>,
    /// Trailing grain passes the leading one, after the first contact.
    pub pass_time: Option<f64>,
    /// End of the first contact.
    pub separation_time: Option<f64>,
    /// First landing.
    pub landing_time: Option<f64>,
    /// End of the observation, if a grain leaves the box before any lands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_time: Option<f64>,
    /// Number of contacts after a separation, and the first one.
    pub kisses: Option<f64>,
    /// Whether the pair came into contact more than once.
    pub repeated: Option<bool>,
    /// Number of times the upper grain passed the lower one.
    pub role_changes: Option<f64>,
    /// Smallest distance of the centres.
    pub closest: Option<f64>,
    /// Smallest distance of the surfaces; negative for an overlap.
    pub closest_gap: Option<f64>,
    /// Distance of the centres at the first landing or the end.
    pub final_distance: Option<f64>,
    /// Mean speed of the leading grain until the first landing.
    pub mean_speed_leading: Option<f64>,
    /// Mean speed of the trailing grain until the first landing.
    pub mean_speed_trailing: Option<f64>,
    /// Largest speed of the leading grain.
    pub peak_speed_leading: Option<f64>,
    /// Largest speed of the trailing grain.
    pub peak_speed_trailing: Option<f64>,
    /// Mean speed of the leading grain over the second half of the drafting.
    pub draft_speed_leading: Option<f64>,
    /// Mean speed of the trailing grain over the second half of the drafting.
    pub draft_speed_trailing: Option<f64>,
    /// Mean angle of the leading grain's long axis with the vertical over the second half of the
    /// drafting [deg]; 90 is broad side on.
    pub long_axis_leading: Option<f64>,
    /// Mean angle of the trailing grain's long axis with the vertical over the second half of the
    /// drafting [deg]; 90 is broad side on.
    pub long_axis_trailing: Option<f64>,
}

/// Histories and events of a pair, with its scales.
pub struct PairHistory<'a> {
    /// Trailing and leading grain.
    pub grains: [&'a History; 2],
    /// Unit vector against gravity.
    pub up: DVec3,
    /// Scales d and g.
    pub scales: Scales,
    /// Events of the run.
    pub events: &'a [Event],
    /// Whether the grains have a long axis.
    pub oblong: bool,
    /// Lengths of the box along its periodic axes [m].
    pub periods: [Option<f64>; 3],
}

impl PairMeasures {
    /// Measures the pair of a run folder; none if the run is not a pair of moving grains.
    pub fn from_run(run: &RunFolder) -> Option<PairMeasures> {
        let features = RunFeatures::of(run);
        let [trailing, leading] = features.pair.filter(|_| run.displaced().len() == 2)?;
        let oblong = [trailing, leading].iter().all(|g| !run.facts.is_sphere(*g));
        let scales = features.scales?;
        let mut measures = PairMeasures::from_history(&PairHistory {
            grains: [&run.grains[trailing], &run.grains[leading]],
            up: features.up,
            scales,
            events: &run.events,
            oblong,
            periods: run.periods(),
        });
        let end = measures.landing_time.or(measures.left_time).map(|t| t * scales.time());
        let gap = closest_gap(run, end.unwrap_or(f64::INFINITY));
        measures.closest_gap = gap.map(|gap| gap / scales.diameter);
        Some(measures)
    }

    /// Measures a pair.
    pub fn from_history(pair: &PairHistory) -> PairMeasures {
        let ends = pair.grains.iter().filter_map(|h| h.time.last());
        let end = ends.fold(f64::INFINITY, |a, b| a.min(*b));
        let landing = pair.first(EventKind::Landing, 0.0);
        let left = pair.first(EventKind::Left, 0.0);
        let until = [landing, left].into_iter().flatten().reduce(f64::min).unwrap_or(end);
        let before = |time: &f64| *time <= until;
        let landing = landing.filter(before);
        let count = |kind: EventKind| {
            let counted = pair.events.iter().filter(|e| e.kind == kind && e.time <= until);
            Some(counted.count() as f64)
        };
        let kiss = pair.first(EventKind::Kiss, 0.0).filter(before);
        let after_kiss = |kind: EventKind| pair.first(kind, kiss?).filter(before);
        let (tumble, pass) = (after_kiss(EventKind::Tumble), after_kiss(EventKind::RoleChange));
        let separation = after_kiss(EventKind::Separation);
        let contact_end = separation.unwrap_or(until);
        let per_second = 1.0 / pair.scales.time();
        let scaled = |time: Option<f64>| time.map(|s| s * per_second);
        let kisses = count(EventKind::Kiss);
        let late_drafting = kiss.map(|k| (0.5 * k, k));
        let draft = |g: usize| late_drafting.and_then(|(from, to)| pair.mean_speed(g, from, to));
        let angle = |g: usize| {
            let window = late_drafting.filter(|_| pair.oblong);
            window.and_then(|(from, to)| pair.long_axis(g, from, to))
        };
        let (closest, last) = pair.distances(until);
        PairMeasures {
            kiss_time: scaled(kiss),
            kissing_stage: scaled(kiss.map(|k| tumble.unwrap_or(contact_end).min(contact_end) - k)),
            contact_stage: scaled(kiss.map(|k| contact_end - k)),
            parted: kiss.map(|_| separation.is_some()),
            tumble_time: scaled(tumble),
            pass_time: scaled(pass),
            separation_time: scaled(separation),
            landing_time: scaled(landing),
            left_time: scaled(left.filter(|_| landing.is_none())),
            repeated: kisses.map(|n| n > 1.0),
            kisses,
            role_changes: count(EventKind::RoleChange),
            closest,
            closest_gap: None,
            final_distance: last,
            mean_speed_trailing: pair.mean_speed(0, 0.0, until),
            mean_speed_leading: pair.mean_speed(1, 0.0, until),
            peak_speed_trailing: pair.peak_speed(0, until),
            peak_speed_leading: pair.peak_speed(1, until),
            draft_speed_trailing: draft(0),
            draft_speed_leading: draft(1),
            long_axis_trailing: angle(0),
            long_axis_leading: angle(1),
        }
    }

    /// Returns a quantity by name; true and false are 1 and 0.
    pub fn get(&self, name: &str) -> Option<f64> {
        let value = serde_json::to_value(self).ok()?;
        match value.get(name)? {
            serde_json::Value::Bool(yes) => Some(f64::from(u8::from(*yes))),
            number => number.as_f64(),
        }
    }
}

/// Smallest gap in the diagnostics before a time [m].
fn closest_gap(run: &RunFolder, until: f64) -> Option<f64> {
    let table = run.diagnostics.as_ref()?;
    let rows = table.column("time")?.iter().zip(table.column("gap")?);
    let before = rows.filter(|(time, gap)| **time < until && gap.is_finite());
    before.map(|(_, gap)| *gap).reduce(f64::min)
}

impl PairHistory<'_> {
    /// Time of the first event of a kind from a time on [s].
    fn first(&self, kind: EventKind, from: f64) -> Option<f64> {
        let mut events = self.events.iter();
        Some(events.find(|e| e.kind == kind && e.time >= from)?.time)
    }

    /// Smallest and last distance of the centres up to a time [d].
    fn distances(&self, until: f64) -> (Option<f64>, Option<f64>) {
        let [a, b] = self.grains;
        let rows = a.time.partition_point(|t| *t <= until).min(b.len());
        let distance = |row: usize| {
            let line = nearest_image(a.position[row] - b.position[row], self.periods);
            line.length() / self.scales.diameter
        };
        let closest = (0..rows).map(distance).reduce(f64::min);
        (closest, rows.checked_sub(1).map(distance))
    }

    /// Mean settling speed between two times [sqrt(d g)].
    fn mean_speed(&self, grain: usize, from: f64, to: f64) -> Option<f64> {
        let h = self.grains[grain];
        let last = || Some((*h.position.last()?, DQuat::IDENTITY));
        let (start, end) = (h.pose(from)?.0, h.pose(to).or_else(last)?.0);
        let fallen = (start - end).dot(self.up);
        (to > from).then(|| fallen / (to - from) / self.scales.velocity())
    }

    /// Largest settling speed up to a time [sqrt(d g)].
    fn peak_speed(&self, grain: usize, until: f64) -> Option<f64> {
        let h = self.grains[grain];
        let rows = h.time.partition_point(|t| *t <= until);
        Some(peak_speed(h, rows, self.up)? / self.scales.velocity())
    }

    /// Mean angle of the long axis (x of the body) with the vertical between two times [deg].
    fn long_axis(&self, grain: usize, from: f64, to: f64) -> Option<f64> {
        let h = self.grains[grain];
        let rows = (0..h.len()).filter(|i| (from..=to).contains(&h.time[*i]));
        mean_tilt(h, rows, DVec3::X, self.up)
    }
}

/// Largest settling speed in the first `rows`, in the direction in which the grain has moved since
/// its start [m/s]: the rebound from an impact does not count.
pub(super) fn peak_speed(history: &History, rows: usize, up: DVec3) -> Option<f64> {
    let fallen = history.position[0] - *history.position[..rows].last()?;
    let sign = fallen.dot(up).signum();
    let speeds = history.velocity[..rows].iter().map(|v| -sign * v.dot(up));
    Some(sign * speeds.reduce(f64::max)?)
}

/// Mean angle of a body axis with the vertical over the given rows [deg]; none without rows.
pub(super) fn mean_tilt(
    history: &History,
    rows: impl Iterator<Item = usize>,
    axis: DVec3,
    up: DVec3,
) -> Option<f64> {
    let angle = |i: usize| {
        let cosine = (history.orientation[i] * axis).dot(up).abs().min(1.0);
        cosine.acos().to_degrees()
    };
    mean(rows.map(angle))
}
