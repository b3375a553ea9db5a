//! Motion of each grain against time.

use std::path::Path;

use glam::{DQuat, DVec3};
use grainwake_formats::grains;
use grainwake_formats::table::Damage;

use crate::error::ReportError;

/// Motion of one grain, SI units, space frame.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Times [s].
    pub time: Vec<f64>,
    /// Centroid [m].
    pub position: Vec<DVec3>,
    /// Velocity of the centroid [m/s].
    pub velocity: Vec<DVec3>,
    /// Rotations from the body frame to the space frame.
    pub orientation: Vec<DQuat>,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vec<DVec3>,
    /// Hydrodynamic force [N], if known.
    pub force: Vec<Option<DVec3>>,
    /// Number of contacts, if known.
    pub contacts: Vec<Option<u32>>,
}

impl History {
    /// Returns the row whose time is nearest to `time` [s]; none for an empty history.
    pub fn nearest(&self, time: f64) -> Option<usize> {
        let after = self.time.partition_point(|t| *t < time);
        let before = after.saturating_sub(1);
        match (self.time.get(before), self.time.get(after)) {
            (Some(a), Some(b)) => Some(if time - a <= b - time { before } else { after }),
            (Some(_), None) => Some(before),
            _ => None,
        }
    }

    /// Returns position and orientation at a time [s], interpolated between rows; none outside the
    /// history.
    pub fn pose(&self, time: f64) -> Option<(DVec3, DQuat)> {
        let row = self.nearest(time)?;
        if self.time[row] == time {
            return Some((self.position[row], self.orientation[row]));
        }
        let after = self.time.partition_point(|t| *t < time);
        if after == 0 || after >= self.len() {
            return None;
        }
        let before = after - 1;
        let part = (time - self.time[before]) / (self.time[after] - self.time[before]);
        let position = self.position[before].lerp(self.position[after], part);
        Some((position, self.orientation[before].slerp(self.orientation[after], part)))
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Returns whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn truncate(&mut self, rows: usize) {
        self.time.truncate(rows);
        self.position.truncate(rows);
        self.velocity.truncate(rows);
        self.orientation.truncate(rows);
        self.angular_velocity.truncate(rows);
        self.force.truncate(rows);
        self.contacts.truncate(rows);
    }
}

/// Reads the motion of all grains from `grains.csv`, by grain index.
///
/// Rows of a run that was resumed over old rows replace them; a note says so.
///
/// # Errors
/// [`ReportError`] with the first damaged line.
pub fn histories(file: &Path, notes: &mut Vec<String>) -> Result<Vec<History>, ReportError> {
    histories_with(file, notes, Damage::Refuse)
}

/// Reads the motion of all grains with the given treatment of a damaged line.
///
/// # Errors
/// [`ReportError`] if the file is unreadable, or with the first damaged line if damage is refused.
pub fn histories_with(
    file: &Path,
    notes: &mut Vec<String>,
    damage: Damage,
) -> Result<Vec<History>, ReportError> {
    let mut out: Vec<History> = Vec::new();
    let mut went_back = false;
    for row in grains::read_with(file, notes, damage)? {
        if row.grain >= out.len() {
            out.resize_with(row.grain + 1, History::default);
        }
        let history = &mut out[row.grain];
        let kept = history.time.partition_point(|t| *t < row.time);
        if kept < history.len() {
            went_back = true;
            history.truncate(kept);
        }
        history.time.push(row.time);
        history.position.push(row.position);
        history.velocity.push(row.velocity);
        history.angular_velocity.push(row.angular_velocity);
        history.orientation.push(row.orientation);
        history.force.push(row.force);
        history.contacts.push(row.contacts);
    }
    if went_back {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        notes.push(format!(
            "{name}: times go back (a run resumed over old rows?); later rows replaced earlier ones"
        ));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str =
        "time,grain,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,fx,fy,fz,tx,ty,tz,contacts";

    fn row(time: f64, grain: usize, z: f64) -> String {
        format!("{time},{grain},0,0,{z},0,0,-1,1,0,0,0,0,0,0,0,0,0,0,0,0,0\n")
    }

    fn read(content: &str) -> (Result<Vec<History>, ReportError>, Vec<String>) {
        let folder = crate::testing::folder();
        let file = folder.join("grains.csv");
        std::fs::write(&file, content).unwrap();
        let mut notes = Vec::new();
        let out = histories(&file, &mut notes);
        std::fs::remove_dir_all(folder).unwrap();
        (out, notes)
    }

    #[test]
    fn rows_are_sorted_by_grain() {
        let (out, notes) = read(&format!(
            "{HEADER}\n{}{}{}{}",
            row(0.0, 0, 3.0),
            row(0.0, 1, 1.0),
            row(0.1, 0, 2.9),
            row(0.1, 1, 0.9)
        ));
        let out = out.unwrap();
        assert_eq!(out.len(), 2);
        assert_eq!(out[1].position[1].z, 0.9);
        assert_eq!(out[0].nearest(0.04), Some(0));
        assert_eq!(out[0].nearest(7.0), Some(1));
        assert!((out[0].pose(0.05).unwrap().0.z - 2.95).abs() < 1e-12);
        assert!(out[0].pose(7.0).is_none() && out[0].pose(0.1).is_some());
        assert!(notes.is_empty(), "{notes:?}");
    }

    #[test]
    fn an_unfinished_last_line_is_left_out_and_noted() {
        let (out, notes) = read(&format!("{HEADER}\n{}{}", row(0.0, 0, 3.0), "0.1,0,0.0,0.0,2."));
        assert_eq!(out.unwrap()[0].len(), 1);
        assert!(notes[0].contains("line 3"), "{notes:?}");
    }

    #[test]
    fn damage_is_named_with_its_line() {
        let message = |content: &str| read(content).0.unwrap_err().to_string();
        let text = message(&format!("{HEADER}\n{}1,2,3\n{}", row(0.0, 0, 3.0), row(0.2, 0, 3.0)));
        assert!(text.contains("grains.csv, line 3: 3 values under 22 columns"), "{text}");
        let text = message(&format!("{HEADER}\n{}", row(0.0, 0, 3.0).replace("-1", "fast")));
        assert!(text.contains("line 2: 'fast' under 'vz' is not a number"), "{text}");
        let text = message("time,grain,x\n");
        assert!(text.contains("line 1: the column 'y' is missing"), "{text}");
        let text = message(&format!("{HEADER}\n{}", row(f64::NAN, 0, 3.0)));
        assert!(text.contains("line 2: time or position is not finite"), "{text}");
        let text = message(&format!("{HEADER}\n{}", row(0.0, 4_000_000, 3.0)));
        assert!(text.contains("line 2: grain 4000000"), "{text}");
        assert!(message("").contains("line 1: no header"));
    }

    #[test]
    fn rows_of_a_resumed_run_replace_what_they_repeat() {
        let (out, notes) = read(&format!(
            "{HEADER}\n{}{}{}{}",
            row(0.0, 0, 3.0),
            row(0.1, 0, 2.0),
            row(0.2, 0, 1.0),
            row(0.1, 0, 2.5)
        ));
        let out = out.unwrap();
        assert_eq!(out[0].time, [0.0, 0.1]);
        assert_eq!(out[0].position[1].z, 2.5);
        assert!(notes[0].contains("times go back"), "{notes:?}");
    }
}
