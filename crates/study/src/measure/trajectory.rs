//! Motions of a pair for the figures, and their thinned-out copies in `histories/`.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use grainwake_report::run_folder::{History, histories};

use crate::error::{StudyError, write_whole};
use crate::measure::record::RunRecord;
use crate::plan::Run;

/// Folder of the thinned-out histories in a study folder.
pub const HISTORIES: &str = "histories";
/// Time between rows of a thinned-out history, in sqrt(d/g).
const INTERVAL: f64 = 0.25;
const HEADER: &str = "time,grain,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,contacts\n";

/// The motion of a pair in dimensionless numbers, until the first landing.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Times [sqrt(d/g)].
    pub time: Vec<f64>,
    /// Distance of the centres [d].
    pub distance: Vec<f64>,
    /// Vertical velocity of the grain that trails at the start and of the one that leads, up positive [sqrt(d g)].
    pub velocity: [Vec<f64>; 2],
}

impl Trajectory {
    /// Of a finished run: from its run folder, else from the thinned-out copy.
    pub fn read(run: &Run, row: &RunRecord, study: &Path) -> Option<Trajectory> {
        let whole = run.folder(study).join("grains.csv");
        let thin = study.join(HISTORIES).join(format!("{}.csv", run.name));
        let found = [whole, thin]
            .iter()
            .find_map(|file| histories(file, &mut Vec::new()).ok())?;
        let [a, b] = found.as_slice() else {
            return None;
        };
        let (up, unit) = row.up_and_time()?;
        let landing = row.pair.as_ref()?.landing_time;
        Trajectory::of(
            [a, b],
            up,
            row.diameter_m?,
            unit,
            landing.map_or(f64::INFINITY, |t| t * unit),
        )
    }

    fn of(
        [a, b]: [&History; 2],
        up: DVec3,
        diameter: f64,
        unit: f64,
        until: f64,
    ) -> Option<Trajectory> {
        let height = |h: &History| Some(h.position.first()?.dot(up));
        let (behind, ahead) = if height(a)? >= height(b)? {
            (a, b)
        } else {
            (b, a)
        };
        let rows = behind.time.partition_point(|t| *t < until).min(ahead.len());
        let velocity = |h: &History| {
            h.velocity[..rows]
                .iter()
                .map(|v| v.dot(up) * unit / diameter)
                .collect()
        };
        Some(Trajectory {
            time: behind.time[..rows].iter().map(|t| t / unit).collect(),
            distance: (0..rows)
                .map(|i| behind.position[i].distance(ahead.position[i]) / diameter)
                .collect(),
            velocity: [velocity(behind), velocity(ahead)],
        })
    }

    /// Points of a curve.
    pub fn points(&self, values: &[f64]) -> Vec<(f64, f64)> {
        self.time
            .iter()
            .copied()
            .zip(values.iter().copied())
            .collect()
    }
}

/// Writes the thinned-out history of a finished run, if its run folder is there.
///
/// # Errors
/// If it cannot be written.
pub fn write_thinned_history(run: &Run, row: &RunRecord, study: &Path) -> Result<bool, StudyError> {
    let Ok(all) = histories(&run.folder(study).join("grains.csv"), &mut Vec::new()) else {
        return Ok(false);
    };
    let unit = row.up_and_time().map_or(0.0, |(_, unit)| unit);
    let mut out = String::from(HEADER);
    let rows = all.iter().map(History::len).min().unwrap_or(0);
    let mut next = f64::NEG_INFINITY;
    for i in 0..rows {
        let time = all[0].time[i];
        if time < next && i + 1 < rows {
            continue;
        }
        next = time + (INTERVAL * unit) * (1.0 - 1e-6);
        for (grain, h) in all.iter().enumerate() {
            let (x, v, q, w) = (
                h.position[i],
                h.velocity[i],
                h.orientation[i],
                h.angular_velocity[i],
            );
            let numbers = [
                x.x, x.y, x.z, v.x, v.y, v.z, q.w, q.x, q.y, q.z, w.x, w.y, w.z,
            ];
            let cells: Vec<String> = numbers.iter().map(|n| digits(*n)).collect();
            // Writing to a text does not fail.
            let _ = writeln!(
                out,
                "{},{grain},{},{}",
                digits(time),
                cells.join(","),
                h.contacts[i]
            );
        }
    }
    let folder = study.join(HISTORIES);
    std::fs::create_dir_all(&folder).map_err(|source| StudyError::Io {
        action: "create",
        path: folder.clone(),
        source,
    })?;
    write_whole(&folder.join(format!("{}.csv", run.name)), out.as_bytes())?;
    Ok(true)
}

/// Six significant digits.
fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if rounded == 0.0 {
        "0".into()
    } else if (1e-3..1e6).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}
