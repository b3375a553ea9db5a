//! Measured values of settling grains other than a pair: a single grain, or three and more. Fixed
//! grains are left out.
//!
//! Speeds are along gravity, down positive. All values of a grain end with its landing.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use grainwake_formats::events::EventKind;
use grainwake_report::features::{RunFeatures, Scales};
use grainwake_report::figure::{GrainSurface, surfaces};
use grainwake_report::run_folder::{History, RunFolder};
use serde::{Deserialize, Serialize};

use super::mean;
use super::pair::{mean_tilt, peak_speed};

/// Measured values of settling grains. The JSON names are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SettlingMeasures {
    /// Number of grains.
    pub grains: usize,
    /// Number of grains that landed.
    pub landed: usize,
    /// Largest settling speed of any grain [sqrt(d g)]; negative for rising grains.
    pub peak_speed: Option<f64>,
    /// Final settling speed, mean over the grains [sqrt(d g)].
    pub final_speed: Option<f64>,
    /// Mean settling speed until the landing, mean over the grains [sqrt(d g)].
    pub mean_speed: Option<f64>,
    /// Relative change of the speed over the final window, mean over the grains.
    pub speed_change: Option<f64>,
    /// Largest settling speed of any grain [m/s]; negative for rising grains.
    pub peak_speed_m_per_s: Option<f64>,
    /// Final settling speed, mean over the grains [m/s].
    pub final_speed_m_per_s: Option<f64>,
    /// Largest Reynolds number of any grain, with its own diameter.
    pub peak_reynolds: Option<f64>,
    /// Reynolds number of the final speed, mean over the grains.
    pub final_reynolds: Option<f64>,
    /// First landing [sqrt(d/g)].
    pub landing_time: Option<f64>,
    /// Last landing, if all grains landed [sqrt(d/g)].
    pub last_landing: Option<f64>,
    /// First landing [s].
    pub landing_time_s: Option<f64>,
    /// Largest horizontal displacement of any grain [d].
    pub drift: Option<f64>,
    /// Angle of the long axis with the vertical in the final window; of a single grain [deg].
    pub long_axis: Option<f64>,
    /// Largest rotation from the initial orientation; of a single grain [deg].
    pub turned: Option<f64>,
    /// Measured values of each grain, in SI units.
    pub each: Vec<GrainSettling>,
}

/// Measured values of one settling grain. The JSON names are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GrainSettling {
    /// Index of the grain in the case.
    pub grain: usize,
    /// Equal-volume diameter [m].
    pub diameter_m: f64,
    /// Largest settling speed [m/s]; negative for a rising grain.
    pub peak_speed_m_per_s: f64,
    /// Reynolds number of the largest speed.
    pub peak_reynolds: Option<f64>,
    /// Mean speed over the final window [m/s]: the last diameter fallen, or the last but one of a
    /// grain that landed, because the floor slows it down.
    pub final_speed_m_per_s: Option<f64>,
    /// Reynolds number of the final speed.
    pub final_reynolds: Option<f64>,
    /// Change of the speed over the final window, relative to its mean.
    pub speed_change: Option<f64>,
    /// Mean speed until the landing or the end [m/s].
    pub mean_speed_m_per_s: Option<f64>,
    /// First contact with the floor [s].
    pub landing_time_s: Option<f64>,
    /// Largest horizontal displacement [m].
    pub drift_m: f64,
    /// Mean angle of the long axis with the vertical in the final window [deg].
    pub long_axis_deg: Option<f64>,
    /// Largest rotation from the initial orientation [deg].
    pub turned_deg: f64,
}

impl SettlingMeasures {
    /// Measures the grains of a run; none for a pair, without gravity, or if no grain moves.
    pub fn from_run(run: &RunFolder) -> Option<SettlingMeasures> {
        let features = RunFeatures::of(run);
        let scales = features.scales?;
        let moving = run.displaced();
        if features.pair.is_some() && moving.len() == 2 || !features.travels {
            return None;
        }
        let surfaces = surfaces(run, &mut Vec::new());
        let each: Vec<GrainSettling> = moving
            .into_iter()
            .map(|grain| GrainSettling::from_run(run, grain, features.up, scales, &surfaces))
            .collect();
        Some(SettlingMeasures::summarise(each, scales))
    }

    /// Summarises the measured values of all grains.
    fn summarise(each: Vec<GrainSettling>, scales: Scales) -> SettlingMeasures {
        let mean = |pick: fn(&GrainSettling) -> Option<f64>| mean(each.iter().filter_map(pick));
        let largest = |pick: fn(&GrainSettling) -> Option<f64>| {
            let values = each.iter().filter_map(pick);
            values.max_by(|a, b| a.abs().total_cmp(&b.abs()))
        };
        let landings: Vec<f64> = each.iter().filter_map(|g| g.landing_time_s).collect();
        let first = landings.iter().copied().reduce(f64::min);
        let last = landings.iter().copied().reduce(f64::max);
        let all_landed = landings.len() == each.len();
        let single = each.len() == 1;
        let peak = largest(|g| Some(g.peak_speed_m_per_s));
        let terminal = mean(|g| g.final_speed_m_per_s);
        let speed = |v: f64| v / scales.velocity();
        let time = |t: f64| t / scales.time();
        SettlingMeasures {
            grains: each.len(),
            landed: landings.len(),
            peak_speed: peak.map(speed),
            final_speed: terminal.map(speed),
            mean_speed: mean(|g| g.mean_speed_m_per_s).map(speed),
            speed_change: mean(|g| g.speed_change),
            peak_speed_m_per_s: peak,
            final_speed_m_per_s: terminal,
            peak_reynolds: largest(|g| g.peak_reynolds),
            final_reynolds: mean(|g| g.final_reynolds),
            landing_time: first.map(time),
            last_landing: last.filter(|_| all_landed).map(time),
            landing_time_s: first,
            drift: largest(|g| Some(g.drift_m)).map(|x| x / scales.diameter),
            long_axis: mean(|g| g.long_axis_deg).filter(|_| single),
            turned: mean(|g| Some(g.turned_deg)).filter(|_| single),
            each,
        }
    }

    /// Returns a quantity by name.
    pub fn get(&self, name: &str) -> Option<f64> {
        let value = serde_json::to_value(self).ok()?;
        value.get(name)?.as_f64()
    }
}

/// Returns the settling speed at a time, linearly interpolated between rows [m/s].
fn speed_at(history: &History, up: DVec3, time: f64) -> Option<f64> {
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

impl GrainSettling {
    fn from_run(
        run: &RunFolder,
        grain: usize,
        up: DVec3,
        scales: Scales,
        surfaces: &BTreeMap<usize, GrainSurface>,
    ) -> GrainSettling {
        let history = &run.grains[grain];
        let facts = run.facts.grains.get(grain);
        let diameter = facts.and_then(|f| f.diameter).unwrap_or(scales.diameter);
        let mut landings = run.events.iter().filter(|e| e.kind == EventKind::Landing);
        let landing = landings.find(|e| e.grains.contains(&grain)).map(|e| e.time);
        let last = *history.time.last().unwrap_or(&0.0);
        let until = landing.unwrap_or(last).min(last);
        let rows = history.time.partition_point(|t| *t <= until).max(1);
        let peak = peak_speed(history, rows, up).unwrap_or(0.0);
        let reynolds = |v: f64| Some(v.abs() * diameter / run.facts.viscosity?);
        let window = FinalWindow::find(history, up, rows, diameter, landing.is_some());
        let terminal = window.as_ref().map(|w| w.fallen / (w.to - w.from));
        let change = window.as_ref().and_then(|w| {
            Some((speed_at(history, up, w.to)? - speed_at(history, up, w.from)?) / terminal?)
        });
        let start = history.position[0];
        let fallen = (start - history.position[rows - 1]).dot(up);
        let elapsed = history.time[rows - 1] - history.time[0];
        let drift = |p: &DVec3| (*p - start).reject_from_normalized(up).length();
        let rotation = |q: &DQuat| history.orientation[0].angle_between(*q).to_degrees();
        let long_axis = surfaces.get(&grain).and_then(|surface| surface.axes().long);
        let tilt = |axis: DVec3| {
            let w = window.as_ref()?;
            let inside = (0..rows).filter(|i| (w.from..=w.to).contains(&history.time[*i]));
            mean_tilt(history, inside, axis, up)
        };
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        GrainSettling {
            grain,
            diameter_m: diameter,
            peak_speed_m_per_s: peak,
            peak_reynolds: reynolds(peak),
            final_speed_m_per_s: terminal,
            final_reynolds: terminal.and_then(reynolds),
            speed_change: change,
            mean_speed_m_per_s: (elapsed > 0.0).then(|| fallen / elapsed),
            landing_time_s: landing,
            drift_m: largest(&mut history.position[..rows].iter().map(drift)),
            long_axis_deg: long_axis.and_then(tilt),
            turned_deg: largest(&mut history.orientation[..rows].iter().map(rotation)),
        }
    }
}

/// Time window in which the final speed of a grain is measured.
struct FinalWindow {
    /// Begin [s].
    from: f64,
    /// End [s].
    to: f64,
    /// Distance fallen in the window [m]; negative for a rising grain.
    fallen: f64,
}

impl FinalWindow {
    /// Finds the last diameter fallen, or the last but one of a grain that landed.
    ///
    /// None if the grain has fallen less than half a diameter before the window.
    fn find(
        history: &History,
        up: DVec3,
        rows: usize,
        diameter: f64,
        landed: bool,
    ) -> Option<FinalWindow> {
        let total = (history.position[0] - history.position[rows - 1]).dot(up);
        let sign = total.signum();
        let fallen = |row: usize| sign * (history.position[0] - history.position[row]).dot(up);
        let end = total.abs() - if landed { diameter } else { 0.0 };
        let begin = end - diameter;
        if begin < 0.5 * diameter {
            return None;
        }
        // Time at which a distance has been fallen, linearly interpolated between rows.
        let time_of = |distance: f64| {
            let after = (1..rows).find(|row| fallen(*row) >= distance * (1.0 - 1e-12))?;
            let (a, b) = (fallen(after - 1), fallen(after));
            let part = ((distance - a) / (b - a)).clamp(0.0, 1.0);
            let (from, to) = (history.time[after - 1], history.time[after]);
            Some(from + part * (to - from))
        };
        let (from, to) = (time_of(begin)?, time_of(end)?);
        (to > from).then_some(FinalWindow { from, to, fallen: sign * diameter })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// History of a grain that falls along z with speed v(t), one row per millisecond.
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
        run.facts.add_diameters((0..histories.len()).map(|i| (i, 1e-2)));
        run.grains = histories;
        run
    }

    fn land(run: &mut RunFolder, grain: usize, time: f64) {
        let landing = grainwake_formats::events::Event::new(EventKind::Landing, time, &[grain]);
        run.events.push(landing);
    }

    #[test]
    fn a_grain_that_settles_has_its_terminal_speed() {
        // v = 0.1 (1 - exp(-t/0.05)) is terminal long before the end.
        let run = run_of(vec![falling(|t| 0.1 * (1.0 - (-t / 0.05).exp()), 1.0)]);
        let found = SettlingMeasures::from_run(&run).unwrap();
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
    fn values_end_with_the_landing() {
        // The grain slows down over its last diameter, lands at 1 s and comes to rest.
        let v = |t: f64| match t {
            t if t < 0.9 => 0.1,
            t if t < 1.0 => 0.05,
            _ => 0.0,
        };
        let mut run = run_of(vec![falling(v, 2.0)]);
        land(&mut run, 0, 1.0);
        // The row of the landing has the velocity of the rebound.
        let landing = run.grains[0].time.partition_point(|t| *t <= 1.0) - 1;
        run.grains[0].velocity[landing].z = 0.3;
        let found = SettlingMeasures::from_run(&run).unwrap();
        assert!((found.final_speed_m_per_s.unwrap() - 0.1).abs() < 1e-6);
        assert!((found.peak_speed_m_per_s.unwrap() - 0.1).abs() < 1e-9);
        assert_eq!((found.landed, found.landing_time_s), (1, Some(1.0)));
        assert!((found.landing_time.unwrap() - 1.0 / 1e-3_f64.sqrt()).abs() < 1e-9);
        assert!((found.mean_speed.unwrap() * 0.1_f64.sqrt() - 0.095).abs() < 1e-4);
    }

    #[test]
    fn a_grain_that_rises_has_a_negative_speed() {
        let found = SettlingMeasures::from_run(&run_of(vec![falling(|_| -0.04, 1.0)])).unwrap();
        assert!((found.final_speed_m_per_s.unwrap() + 0.04).abs() < 1e-6);
        assert!((found.peak_speed_m_per_s.unwrap() + 0.04).abs() < 1e-9);
        assert!((found.final_reynolds.unwrap() - 400.0).abs() < 1e-2);
    }

    #[test]
    fn a_short_fall_has_no_final_speed() {
        let found = SettlingMeasures::from_run(&run_of(vec![falling(|_| 0.1, 0.1)])).unwrap();
        assert_eq!(found.final_speed_m_per_s, None);
        assert!(found.peak_speed_m_per_s.is_some());
    }

    #[test]
    fn several_grains_have_means_and_individual_landings() {
        let fall = |v: f64| falling(move |_| v, 1.0);
        let mut run = run_of(vec![fall(0.1), fall(0.2), fall(0.3)]);
        let found = SettlingMeasures::from_run(&run).unwrap();
        assert!((found.final_speed_m_per_s.unwrap() - 0.2).abs() < 1e-6);
        assert!((found.peak_speed_m_per_s.unwrap() - 0.3).abs() < 1e-9);
        assert_eq!((found.turned, found.last_landing), (None, None));
        for (grain, time) in [(2, 0.5), (1, 0.7), (0, 0.9)] {
            land(&mut run, grain, time);
        }
        let found = SettlingMeasures::from_run(&run).unwrap();
        assert_eq!((found.grains, found.landed), (3, 3));
        assert_eq!(found.landing_time_s, Some(0.5));
        assert!((found.last_landing.unwrap() - 0.9 / 1e-3_f64.sqrt()).abs() < 1e-9);
        let landings: Vec<_> = found.each.iter().map(|g| g.landing_time_s).collect();
        assert_eq!(landings, [Some(0.9), Some(0.7), Some(0.5)]);
        run.grains.pop();
        assert_eq!(SettlingMeasures::from_run(&run), None, "a pair has measures of its own");
    }
}
