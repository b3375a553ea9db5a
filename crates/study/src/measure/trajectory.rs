//! Trajectories of the grains of a run for the figures, and their thinned copies in `histories/`.

use std::path::Path;

use glam::DVec3;
use grainwake_formats::disk;
use grainwake_report::run_folder::{History, histories, nearest_image};

use super::mean;
use super::record::RunRecord;
use super::table::write_csv;
use crate::error::{At, StudyError};
use crate::format::rounded;
use crate::plan::Run;

/// Subfolder of a study folder that holds the thinned histories.
pub const HISTORIES: &str = "histories";
/// Time between rows of a thinned history [sqrt(d/g)].
const INTERVAL: f64 = 0.25;
const HEADER: [&str; 16] = [
    "time", "grain", "x", "y", "z", "vx", "vy", "vz", "qw", "qx", "qy", "qz", "wx", "wy", "wz",
    "contacts",
];

/// Reads the histories of the grains from the run folder, or else, and for a run with damaged
/// files, from the thinned copy.
fn read_histories(run: &Run, record: &RunRecord, study: &Path) -> Option<Vec<History>> {
    let full = (!record.unmeasured()).then(|| run.folder(study).join("grains.csv"));
    let thinned = study.join(HISTORIES).join(format!("{}.csv", run.name));
    full.iter().chain([&thinned]).find_map(|file| histories(file, &mut Vec::new()).ok())
}

/// Relative motion of a pair until the first landing, dimensionless.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Times [sqrt(d/g)].
    pub time: Vec<f64>,
    /// Distance of the centres [d].
    pub distance: Vec<f64>,
    /// Vertical velocity of the trailing and of the leading grain, up positive [sqrt(d g)].
    pub velocity: [Vec<f64>; 2],
}

impl Trajectory {
    /// Reads the trajectory of a finished run; none if the run is not a pair.
    pub fn read(run: &Run, record: &RunRecord, study: &Path) -> Option<Trajectory> {
        let grains = read_histories(run, record, study)?;
        let [a, b] = grains.as_slice() else {
            return None;
        };
        let (up, unit) = record.up_and_time()?;
        let diameter = record.diameter_m?;
        let landing = record.pair.as_ref()?.landing_time;
        let until = landing.map_or(f64::INFINITY, |t| t * unit);
        let height = |h: &History| Some(h.position.first()?.dot(up));
        let (trailing, leading) = if height(a)? >= height(b)? { (a, b) } else { (b, a) };
        let rows = trailing.time.partition_point(|t| *t < until).min(leading.len());
        let velocity = |h: &History| {
            let vertical = |v: &DVec3| v.dot(up) * unit / diameter;
            h.velocity[..rows].iter().map(vertical).collect()
        };
        let distance = |i: usize| {
            let line = trailing.position[i] - leading.position[i];
            nearest_image(line, record.periods_m).length() / diameter
        };
        Some(Trajectory {
            time: trailing.time[..rows].iter().map(|t| t / unit).collect(),
            distance: (0..rows).map(distance).collect(),
            velocity: [velocity(trailing), velocity(leading)],
        })
    }

    /// Returns the points of a curve of `values` against time.
    pub fn points(&self, values: &[f64]) -> Vec<(f64, f64)> {
        self.time.iter().copied().zip(values.iter().copied()).collect()
    }
}

/// Reads the settling speed [m/s] against time [s], averaged over the measured grains in the box,
/// until all landed.
pub fn settling_curve(run: &Run, record: &RunRecord, study: &Path) -> Option<Vec<(f64, f64)>> {
    let grains = read_histories(run, record, study)?;
    let (up, unit) = record.up_and_time()?;
    let settling = record.settling.as_ref()?;
    let grains: Vec<&History> =
        settling.each.iter().filter_map(|measured| grains.get(measured.grain)).collect();
    // The row at the landing holds the speed of the rebound.
    let until = settling.last_landing.map_or(f64::INFINITY, |t| t * unit * (1.0 - 1e-6));
    let longest = grains.iter().max_by_key(|h| h.len())?;
    let speed = |row: usize| {
        let present = grains.iter().filter_map(|h| h.velocity.get(row));
        mean(present.map(|v| -v.dot(up)))
    };
    let rows = longest.time.iter().take_while(|time| **time < until).enumerate();
    rows.map(|(row, time)| Some((*time, speed(row)?))).collect()
}

/// Writes the thinned history of a finished run, if its run folder exists and is not damaged.
///
/// # Errors
/// If the file cannot be written.
pub fn write_thinned_history(
    run: &Run,
    record: &RunRecord,
    study: &Path,
) -> Result<(), StudyError> {
    let read = || histories(&run.folder(study).join("grains.csv"), &mut Vec::new());
    let Some(Ok(grains)) = (!record.unmeasured()).then(read) else {
        return Ok(());
    };
    let interval = record.up_and_time().map_or(0.0, |(_, unit)| INTERVAL * unit);
    let mut out = vec![HEADER.map(str::to_owned).to_vec()];
    // Grains that leave the box have shorter histories.
    let times = grains.iter().map(|h| &h.time).max_by_key(|times| times.len());
    let times = times.map_or(&[][..], Vec::as_slice);
    let mut next = f64::NEG_INFINITY;
    for (i, time) in times.iter().copied().enumerate() {
        if time < next && i + 1 < times.len() {
            continue;
        }
        next = time + interval * (1.0 - 1e-6);
        for (grain, h) in grains.iter().enumerate().filter(|(_, h)| i < h.len()) {
            let (x, v, w) = (h.position[i], h.velocity[i], h.angular_velocity[i]);
            let q = h.orientation[i];
            let values = [x.x, x.y, x.z, v.x, v.y, v.z, q.w, q.x, q.y, q.z, w.x, w.y, w.z];
            let mut row = vec![cell(time), grain.to_string()];
            row.extend(values.map(cell));
            row.push(h.contacts[i].map_or("NaN".into(), |n| n.to_string()));
            out.push(row);
        }
    }
    let folder = study.join(HISTORIES);
    disk::create_folder(&folder).at("create", &folder)?;
    write_csv(&folder.join(format!("{}.csv", run.name)), out)
}

/// Six significant digits, with an exponent for very small and very large values.
fn cell(value: f64) -> String {
    let rounded = rounded(value);
    if rounded == 0.0 {
        "0".into()
    } else if (1e-3..1e6).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}
