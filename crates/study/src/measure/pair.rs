//! The quantities of a settling pair, taken from a run folder.
//!
//! Lengths are in equal-volume diameters d, times in sqrt(d/g), speeds in sqrt(d g), down
//! positive. *Leading* and *trailing* are the grains as they lie at the start. What happens after
//! the first grain has landed does not count.

use glam::DVec3;
use grainwake_report::run_folder::{Event, History, Kind, RunFolder};
use grainwake_report::story::{Scales, Story};
use serde::{Deserialize, Serialize};

/// What is measured on a pair. The JSON names are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairMeasures {
    /// First contact.
    pub kiss_time: Option<f64>,
    /// From the first contact until the line of centres stands at 45 degrees (or the pair parts, or lands).
    pub kissing_stage: Option<f64>,
    /// From the first contact until the pair parts (or lands): the flat part of the gap.
    pub contact_stage: Option<f64>,
    /// Whether it parted before it landed; if not, `contact_stage` is a lower bound.
    pub parted: Option<bool>,
    /// The line of centres stands at 45 degrees, after the first contact.
    pub tumble_time: Option<f64>,
    /// The trailing grain passes the leading one, after the first contact.
    pub pass_time: Option<f64>,
    /// End of the first contact.
    pub separation_time: Option<f64>,
    /// First landing.
    pub landing_time: Option<f64>,
    /// How often the pair came into contact, having been apart.
    pub kisses: Option<f64>,
    /// Whether it kissed again after it had parted.
    pub repeated: Option<bool>,
    /// How often the upper grain passed the lower one.
    pub role_changes: Option<f64>,
    /// Smallest distance of the centres.
    pub closest: Option<f64>,
    /// Smallest distance of the surfaces; negative where they overlap.
    pub closest_gap: Option<f64>,
    /// Distance of the centres at the first landing, or the end.
    pub final_distance: Option<f64>,
    /// Mean speed until the first landing.
    pub mean_speed_leading: Option<f64>,
    /// Mean speed until the first landing.
    pub mean_speed_trailing: Option<f64>,
    /// Largest speed.
    pub peak_speed_leading: Option<f64>,
    /// Largest speed.
    pub peak_speed_trailing: Option<f64>,
    /// Mean speed over the second half of the drafting.
    pub draft_speed_leading: Option<f64>,
    /// Mean speed over the second half of the drafting.
    pub draft_speed_trailing: Option<f64>,
    /// Angle of the long axis with the vertical [deg], mean over the second half of the drafting;
    /// 90 is broad side across the stream.
    pub long_axis_leading: Option<f64>,
    /// The same of the trailing grain.
    pub long_axis_trailing: Option<f64>,
}

/// A pair and its scales, as the measures need them.
pub struct PairHistory<'a> {
    /// The grain that trails at the start, and the one that leads.
    pub grains: [&'a History; 2],
    /// Against gravity.
    pub up: DVec3,
    /// d and g.
    pub scales: Scales,
    /// Log.
    pub events: &'a [Event],
    /// Whether its grains have a long axis.
    pub oblong: bool,
}

impl PairMeasures {
    /// Of a run folder; none if it holds no pair.
    pub fn of(run: &RunFolder) -> Option<PairMeasures> {
        let story = Story::of(run);
        let [behind, ahead] = story.pair?;
        let oblong = [behind, ahead].iter().all(|g| {
            let facts = run.facts.grains.get(*g);
            facts.is_none_or(|f| f.shape.as_deref() != Some("sphere"))
        });
        let scales = story.scales?;
        let mut found = PairMeasures::of_pair(&PairHistory {
            grains: [&run.grains[behind], &run.grains[ahead]],
            up: story.up,
            scales,
            events: &run.events,
            oblong,
        });
        let until = found.landing_time.map(|t| t * scales.time());
        found.closest_gap = closest_gap(run, until.unwrap_or(f64::INFINITY));
        found.closest_gap = found.closest_gap.map(|gap| gap / scales.diameter);
        Some(found)
    }

    /// Of a pair.
    pub fn of_pair(pair: &PairHistory) -> PairMeasures {
        let end = pair
            .grains
            .iter()
            .filter_map(|h| h.time.last())
            .fold(f64::INFINITY, |a, b| a.min(*b));
        let landing = pair.first(&Kind::Landing, 0.0);
        let until = landing.unwrap_or(end);
        let before = |time: &f64| *time <= until;
        let count = |kind: &Kind| {
            let of = pair
                .events
                .iter()
                .filter(|e| e.kind == *kind && e.time <= until);
            Some(of.count() as f64)
        };
        let kiss = pair.first(&Kind::Kiss, 0.0).filter(before);
        let after = |kind: &Kind| pair.first(kind, kiss?).filter(before);
        let (tumble, pass) = (after(&Kind::Tumble), after(&Kind::RoleChange));
        let parting = after(&Kind::Separation);
        let contact_end = parting.unwrap_or(until);
        let t = 1.0 / pair.scales.time();
        let scaled = |time: Option<f64>| time.map(|s| s * t);
        let kisses = count(&Kind::Kiss);
        let half = kiss.map(|k| (0.5 * k, k));
        let draft = |g: usize| half.and_then(|(from, to)| pair.mean_speed(g, from, to));
        let angle = |g: usize| {
            half.filter(|_| pair.oblong)
                .and_then(|(from, to)| pair.long_axis(g, from, to))
        };
        let (closest, last) = pair.distances(until);
        PairMeasures {
            kiss_time: scaled(kiss),
            kissing_stage: scaled(kiss.map(|k| tumble.unwrap_or(contact_end).min(contact_end) - k)),
            contact_stage: scaled(kiss.map(|k| contact_end - k)),
            parted: kiss.map(|_| parting.is_some()),
            tumble_time: scaled(tumble),
            pass_time: scaled(pass),
            separation_time: scaled(parting),
            landing_time: scaled(landing),
            repeated: kisses.map(|n| n > 1.0),
            kisses,
            role_changes: count(&Kind::RoleChange),
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

    /// A quantity by name; true and false are 1 and 0.
    pub fn get(&self, name: &str) -> Option<f64> {
        let value = serde_json::to_value(self).ok()?;
        match value.get(name)? {
            serde_json::Value::Bool(yes) => Some(f64::from(u8::from(*yes))),
            number => number.as_f64(),
        }
    }
}

/// Smallest gap of the diagnostics before a time [m].
fn closest_gap(run: &RunFolder, until: f64) -> Option<f64> {
    let table = run.diagnostics.as_ref()?;
    let rows = table.column("time")?.iter().zip(table.column("gap")?);
    rows.filter(|(time, gap)| **time < until && gap.is_finite())
        .map(|(_, gap)| *gap)
        .reduce(f64::min)
}

impl PairHistory<'_> {
    fn first(&self, kind: &Kind, from: f64) -> Option<f64> {
        let found = self
            .events
            .iter()
            .find(|e| e.kind == *kind && e.time >= from);
        found.map(|e| e.time)
    }

    /// Smallest distance of the centres, and the last one, up to a time [d].
    fn distances(&self, until: f64) -> (Option<f64>, Option<f64>) {
        let [a, b] = self.grains;
        let rows = a.time.partition_point(|t| *t <= until).min(b.len());
        let distance =
            |row: usize| (a.position[row] - b.position[row]).length() / self.scales.diameter;
        let closest = (0..rows).map(distance).reduce(f64::min);
        (closest, rows.checked_sub(1).map(distance))
    }

    /// Distance fallen over time between two moments.
    fn mean_speed(&self, grain: usize, from: f64, to: f64) -> Option<f64> {
        let h = self.grains[grain];
        let (a, b) = (
            h.pose(from)?.0,
            h.pose(to)
                .or_else(|| Some((*h.position.last()?, glam::DQuat::IDENTITY)))?
                .0,
        );
        (to > from).then(|| (a - b).dot(self.up) / (to - from) / self.scales.velocity())
    }

    fn peak_speed(&self, grain: usize, until: f64) -> Option<f64> {
        let h = self.grains[grain];
        let rows = h.time.partition_point(|t| *t <= until);
        let speeds = h.velocity[..rows]
            .iter()
            .map(|v| -v.dot(self.up) / self.scales.velocity());
        speeds.reduce(f64::max)
    }

    /// Mean angle of the long axis (x of the body) with the vertical [deg].
    fn long_axis(&self, grain: usize, from: f64, to: f64) -> Option<f64> {
        let h = self.grains[grain];
        let rows = (0..h.len()).filter(|i| (from..=to).contains(&h.time[*i]));
        let angle = |i: usize| {
            (h.orientation[i] * DVec3::X)
                .dot(self.up)
                .abs()
                .min(1.0)
                .acos()
                .to_degrees()
        };
        let (sum, n) = rows.fold((0.0, 0usize), |(sum, n), i| (sum + angle(i), n + 1));
        (n > 0).then(|| sum / n as f64)
    }
}
