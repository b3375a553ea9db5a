//! How grains create_folder that are not a pair: a single grain, or three and more.
//!
//! Speeds are along gravity, down positive; a grain that rises has negative ones. What a grain does
//! after it has landed does not count.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use grainwake_report::figure::{Body, bodies};
use grainwake_report::run_folder::{History, Kind, RunFolder};
use grainwake_report::story::{Scales, Story};
use serde::{Deserialize, Serialize};

/// What is measured on grains that create_folder. The JSON names are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SettlingMeasures {
    /// Number of grains.
    pub grains: usize,
    /// Those that landed.
    pub landed: usize,
    /// Largest settling speed of any grain [sqrt(d g)].
    pub peak_speed: Option<f64>,
    /// Final settling speed, mean over the grains [sqrt(d g)].
    pub final_speed: Option<f64>,
    /// Mean settling speed until the landing, mean over the grains [sqrt(d g)].
    pub mean_speed: Option<f64>,
    /// Change of the speed while the final speed is measured, relative to it; mean over the grains.
    pub speed_change: Option<f64>,
    /// Largest settling speed [m/s].
    pub peak_speed_m_per_s: Option<f64>,
    /// Final settling speed [m/s].
    pub final_speed_m_per_s: Option<f64>,
    /// Largest Reynolds number of any grain, with its own diameter.
    pub peak_reynolds: Option<f64>,
    /// Reynolds number of the final speed, mean over the grains.
    pub final_reynolds: Option<f64>,
    /// First landing [sqrt(d/g)].
    pub landing_time: Option<f64>,
    /// Last landing, once all have landed [sqrt(d/g)].
    pub last_landing: Option<f64>,
    /// First landing [s].
    pub landing_time_s: Option<f64>,
    /// Largest sideways drift of any grain [d].
    pub drift: Option<f64>,
    /// Of a single grain: angle of its long axis with the vertical at the final speed [deg].
    pub long_axis: Option<f64>,
    /// Of a single grain: largest angle by which it has turned from the start [deg].
    pub turned: Option<f64>,
    /// Each grain, in SI units.
    pub each: Vec<GrainSettling>,
}

/// How one grain settled. The JSON names are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GrainSettling {
    /// Number of the grain in the case.
    pub grain: usize,
    /// Equal-volume diameter [m].
    pub diameter_m: f64,
    /// Settling speed of largest size [m/s].
    pub peak_speed_m_per_s: f64,
    /// Its Reynolds number.
    pub peak_reynolds: Option<f64>,
    /// Mean speed over the last diameter fallen; of a grain that landed, over the last but one, as
    /// the floor slows the last [m/s].
    pub final_speed_m_per_s: Option<f64>,
    /// Its Reynolds number.
    pub final_reynolds: Option<f64>,
    /// Change of the speed over that diameter, relative to its mean.
    pub speed_change: Option<f64>,
    /// Distance fallen over time, until the landing or the end [m/s].
    pub mean_speed_m_per_s: Option<f64>,
    /// First contact with the floor [s].
    pub landing_time_s: Option<f64>,
    /// Largest distance sideways from the start [m].
    pub drift_m: f64,
    /// Mean angle of the long axis with the vertical where the final speed is measured [deg].
    pub long_axis_deg: Option<f64>,
    /// Largest angle by which it has turned from the start [deg].
    pub turned_deg: f64,
}

impl SettlingMeasures {
    /// Of a run folder; none of a pair, without gravity, or if nothing moves.
    pub fn of(run: &RunFolder) -> Option<SettlingMeasures> {
        let story = Story::of(run);
        let scales = story.scales?;
        if story.pair.is_some() || !story.travels {
            return None;
        }
        let bodies = bodies(run, &mut Vec::new());
        let each: Vec<GrainSettling> = (0..run.grains.len())
            .filter(|grain| !run.grains[*grain].is_empty())
            .map(|grain| GrainSettling::of(run, grain, story.up, scales, &bodies))
            .collect();
        Some(SettlingMeasures::together(each, scales))
    }

    /// What grains have in common.
    fn together(each: Vec<GrainSettling>, scales: Scales) -> SettlingMeasures {
        let mean = |pick: fn(&GrainSettling) -> Option<f64>| {
            let values: Vec<f64> = each.iter().filter_map(pick).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        let largest = |pick: fn(&GrainSettling) -> Option<f64>| {
            let values = each.iter().filter_map(pick);
            values.max_by(|a, b| a.abs().total_cmp(&b.abs()))
        };
        let landings: Vec<f64> = each.iter().filter_map(|g| g.landing_time_s).collect();
        let first = landings.iter().copied().reduce(f64::min);
        let last = landings.iter().copied().reduce(f64::max);
        let all = landings.len() == each.len();
        let alone = each.len() == 1;
        let (peak, settled) = (
            largest(|g| Some(g.peak_speed_m_per_s)),
            mean(|g| g.final_speed_m_per_s),
        );
        let of_v = |v: f64| v / scales.velocity();
        let of_t = |t: f64| t / scales.time();
        SettlingMeasures {
            grains: each.len(),
            landed: landings.len(),
            peak_speed: peak.map(of_v),
            final_speed: settled.map(of_v),
            mean_speed: mean(|g| g.mean_speed_m_per_s).map(of_v),
            speed_change: mean(|g| g.speed_change),
            peak_speed_m_per_s: peak,
            final_speed_m_per_s: settled,
            peak_reynolds: largest(|g| g.peak_reynolds),
            final_reynolds: mean(|g| g.final_reynolds),
            landing_time: first.map(of_t),
            last_landing: last.filter(|_| all).map(of_t),
            landing_time_s: first,
            drift: largest(|g| Some(g.drift_m)).map(|x| x / scales.diameter),
            long_axis: mean(|g| g.long_axis_deg).filter(|_| alone),
            turned: mean(|g| Some(g.turned_deg)).filter(|_| alone),
            each,
        }
    }

    /// A quantity by name.
    pub fn get(&self, name: &str) -> Option<f64> {
        let value = serde_json::to_value(self).ok()?;
        value.get(name)?.as_f64()
    }
}

/// Settling speed at a time [m/s], between rows in proportion.
fn speed(history: &History, up: DVec3, time: f64) -> Option<f64> {
    let after = history.time.partition_point(|t| *t < time);
    let row = |row: usize| Some((*history.time.get(row)?, -history.velocity.get(row)?.dot(up)));
    let Some((end, v)) = row(after) else {
        return row(history.len().checked_sub(1)?).map(|(_, v)| v);
    };
    let Some((start, before)) = after.checked_sub(1).and_then(row) else {
        return Some(v);
    };
    Some(before + (time - start) / (end - start) * (v - before))
}

/// Where the final speed of a grain is measured.
struct Stretch {
    /// Begin and end [s].
    time: (f64, f64),
    /// Distance fallen between them [m].
    fallen: f64,
}

impl GrainSettling {
    fn of(
        run: &RunFolder,
        grain: usize,
        up: DVec3,
        scales: Scales,
        bodies: &BTreeMap<usize, Body>,
    ) -> GrainSettling {
        let history = &run.grains[grain];
        let facts = run.facts.grains.get(grain);
        let diameter = facts.and_then(|f| f.diameter).unwrap_or(scales.diameter);
        let landing = run
            .events
            .iter()
            .find(|e| e.kind == Kind::Landing && e.grains.contains(&grain))
            .map(|e| e.time);
        let last = *history.time.last().unwrap_or(&0.0);
        let until = landing.unwrap_or(last).min(last);
        let rows = history.time.partition_point(|t| *t <= until).max(1);
        let speeds = || history.velocity[..rows].iter().map(|v| -v.dot(up));
        let peak = speeds().max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let peak = peak.unwrap_or(0.0);
        let reynolds = |v: f64| Some(v.abs() * diameter / run.facts.viscosity?);
        let stretch = Stretch::of(history, up, rows, diameter, landing.is_some());
        let settled = stretch.as_ref().map(|s| s.fallen / (s.time.1 - s.time.0));
        let change = stretch.as_ref().and_then(|s| {
            Some((speed(history, up, s.time.1)? - speed(history, up, s.time.0)?) / settled?)
        });
        let start = history.position[0];
        let fallen = (start - history.position[rows - 1]).dot(up);
        let elapsed = history.time[rows - 1] - history.time[0];
        let sideways = |p: &DVec3| (*p - start).reject_from_normalized(up).length();
        let turn = |q: &DQuat| history.orientation[0].angle_between(*q).to_degrees();
        let long = bodies
            .get(&grain)
            .and_then(Body::axes)
            .map(|axes| axes.long);
        let tilt = |axis: DVec3| {
            let within = stretch.as_ref()?;
            let rows =
                (0..rows).filter(|i| (within.time.0..=within.time.1).contains(&history.time[*i]));
            let angles: Vec<f64> = rows
                .map(|i| (history.orientation[i] * axis).dot(up).abs().min(1.0))
                .map(|cosine| cosine.acos().to_degrees())
                .collect();
            (!angles.is_empty()).then(|| angles.iter().sum::<f64>() / angles.len() as f64)
        };
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        GrainSettling {
            grain,
            diameter_m: diameter,
            peak_speed_m_per_s: peak,
            peak_reynolds: reynolds(peak),
            final_speed_m_per_s: settled,
            final_reynolds: settled.and_then(reynolds),
            speed_change: change,
            mean_speed_m_per_s: (elapsed > 0.0).then(|| fallen / elapsed),
            landing_time_s: landing,
            drift_m: largest(&mut history.position[..rows].iter().map(sideways)),
            long_axis_deg: long.and_then(tilt),
            turned_deg: largest(&mut history.orientation[..rows].iter().map(turn)),
        }
    }
}

impl Stretch {
    /// The last diameter fallen, or the last but one of a grain that landed; none of a grain that has
    /// not fallen that far and half a diameter before.
    fn of(
        history: &History,
        up: DVec3,
        rows: usize,
        diameter: f64,
        landed: bool,
    ) -> Option<Stretch> {
        let whole = (history.position[0] - history.position[rows - 1]).dot(up);
        let sign = whole.signum();
        let fallen = |row: usize| sign * (history.position[0] - history.position[row]).dot(up);
        let end = whole.abs() - if landed { diameter } else { 0.0 };
        let begin = end - diameter;
        if begin < 0.5 * diameter {
            return None;
        }
        // When a distance has been fallen, between rows in proportion.
        let when = |distance: f64| {
            let after = (1..rows).find(|row| fallen(*row) >= distance * (1.0 - 1e-12))?;
            let (a, b) = (fallen(after - 1), fallen(after));
            let part = ((distance - a) / (b - a)).clamp(0.0, 1.0);
            let (from, to) = (history.time[after - 1], history.time[after]);
            Some(from + part * (to - from))
        };
        let time = (when(begin)?, when(end)?);
        (time.1 > time.0).then_some(Stretch {
            time,
            fallen: sign * diameter,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grain that falls along z with v(t), a row every millisecond, down positive.
    fn falling(v: impl Fn(f64) -> f64, end: f64) -> History {
        let mut h = History::default();
        let (dt, mut z, mut t) = (1e-3, 0.5, 0.0);
        while t <= end {
            h.time.push(t);
            h.position.push(DVec3::new(0.2 * t, 0.0, z));
            h.velocity.push(DVec3::new(0.2, 0.0, -v(t)));
            h.orientation.push(DQuat::from_rotation_x(t));
            z -= dt * v(t + 0.5 * dt);
            t += dt;
        }
        h
    }

    fn run_of(histories: Vec<History>) -> RunFolder {
        let mut run = RunFolder::default();
        run.facts.gravity = Some(DVec3::new(0.0, 0.0, -10.0));
        run.facts.viscosity = Some(1e-6);
        run.facts
            .add_diameters((0..histories.len()).map(|i| (i, 1e-2)));
        run.grains = histories;
        run
    }

    fn land(run: &mut RunFolder, grain: usize, time: f64) {
        run.events.push(grainwake_report::run_folder::Event {
            time,
            kind: Kind::Landing,
            grains: vec![grain],
            details: Vec::new(),
        });
    }

    #[test]
    fn a_grain_that_settles_has_its_terminal_speed() {
        // v = 0.1 (1 - exp(-t/0.05)): terminal long before the end.
        let run = run_of(vec![falling(|t| 0.1 * (1.0 - (-t / 0.05).exp()), 1.0)]);
        let found = SettlingMeasures::of(&run).unwrap();
        let close = |a: Option<f64>, b: f64| (a.unwrap() / b - 1.0).abs() < 1e-3;
        assert!(close(found.final_speed_m_per_s, 0.1), "{found:?}");
        assert!(close(found.peak_speed_m_per_s, 0.1));
        assert!(close(found.final_reynolds, 1000.0));
        assert!(close(found.final_speed, 0.1 / 0.1_f64.sqrt()));
        assert!(found.speed_change.unwrap().abs() < 1e-3);
        assert!(close(found.drift, 20.0) && close(found.turned, 1_f64.to_degrees()));
        assert_eq!((found.landed, found.landing_time), (0, None));
        assert_eq!(found.get("grains"), Some(1.0));
    }

    #[test]
    fn the_floor_does_not_count() {
        // It slows down over its last diameter, lands at 1 s, and lies still.
        let v = |t: f64| match t {
            t if t < 0.9 => 0.1,
            t if t < 1.0 => 0.05,
            _ => 0.0,
        };
        let mut run = run_of(vec![falling(v, 2.0)]);
        land(&mut run, 0, 1.0);
        let found = SettlingMeasures::of(&run).unwrap();
        assert!((found.final_speed_m_per_s.unwrap() - 0.1).abs() < 1e-6);
        assert_eq!((found.landed, found.landing_time_s), (1, Some(1.0)));
        assert!((found.landing_time.unwrap() - 1.0 / 1e-3_f64.sqrt()).abs() < 1e-9);
        assert!((found.mean_speed.unwrap() * 0.1_f64.sqrt() - 0.095).abs() < 1e-4);
    }

    #[test]
    fn a_grain_that_rises_has_a_negative_speed() {
        let found = SettlingMeasures::of(&run_of(vec![falling(|_| -0.04, 1.0)])).unwrap();
        assert!((found.final_speed_m_per_s.unwrap() + 0.04).abs() < 1e-6);
        assert!((found.peak_speed_m_per_s.unwrap() + 0.04).abs() < 1e-9);
        assert!((found.final_reynolds.unwrap() - 400.0).abs() < 1e-2);
    }

    #[test]
    fn what_has_hardly_fallen_has_no_final_speed() {
        let found = SettlingMeasures::of(&run_of(vec![falling(|_| 0.1, 0.1)])).unwrap();
        assert_eq!(found.final_speed_m_per_s, None);
        assert!(found.peak_speed_m_per_s.is_some());
    }

    #[test]
    fn many_grains_have_means_and_each_its_landing() {
        let fall = |v: f64| falling(move |_| v, 1.0);
        let mut run = run_of(vec![fall(0.1), fall(0.2), fall(0.3)]);
        let found = SettlingMeasures::of(&run).unwrap();
        assert!((found.final_speed_m_per_s.unwrap() - 0.2).abs() < 1e-6);
        assert!((found.peak_speed_m_per_s.unwrap() - 0.3).abs() < 1e-9);
        assert_eq!((found.turned, found.last_landing), (None, None));
        for (grain, time) in [(2, 0.5), (1, 0.7), (0, 0.9)] {
            land(&mut run, grain, time);
        }
        let found = SettlingMeasures::of(&run).unwrap();
        assert_eq!((found.grains, found.landed), (3, 3));
        assert_eq!(found.landing_time_s, Some(0.5));
        assert!((found.last_landing.unwrap() - 0.9 / 1e-3_f64.sqrt()).abs() < 1e-9);
        let landings: Vec<_> = found.each.iter().map(|g| g.landing_time_s).collect();
        assert_eq!(landings, [Some(0.9), Some(0.7), Some(0.5)]);
        run.grains.pop();
        assert_eq!(
            SettlingMeasures::of(&run),
            None,
            "a pair has measures of its own"
        );
    }
}
