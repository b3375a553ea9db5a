//! Tables of numbers (`grains.csv`, `diagnostics.csv`) and the histories of the grains.

use std::path::Path;

use glam::{DQuat, DVec3};

use crate::error::ReportError;

/// A table of numbers with named columns, rows in order of time.
#[derive(Clone, Debug, Default)]
pub struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads a table; what had to be left out is added to `notes`.
    pub fn read(file: &Path, notes: &mut Vec<String>) -> Result<Table, ReportError> {
        let text = super::read_text(file)?;
        let damaged = |line: usize, what: String| ReportError::Line {
            file: file.to_owned(),
            line,
            what,
        };
        let whole = text.ends_with('\n');
        let lines: Vec<&str> = text.lines().collect();
        let header = lines.first().filter(|line| !line.trim().is_empty());
        let header = header.ok_or_else(|| damaged(1, "no header".to_owned()))?;
        let names: Vec<String> = header
            .split(',')
            .map(|name| name.trim().to_owned())
            .collect();
        if names.iter().any(String::is_empty) {
            return Err(damaged(1, "a column without a name".to_owned()));
        }
        let mut columns = vec![Vec::with_capacity(lines.len()); names.len()];
        for (i, line) in lines
            .iter()
            .enumerate()
            .skip(1)
            .filter(|(_, line)| !line.trim().is_empty())
        {
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let unfinished = i + 1 == lines.len() && !whole;
            if unfinished {
                notes.push(format!(
                    "{}: the last line (line {}) is unfinished and was left out",
                    name_of(file),
                    i + 1
                ));
                continue;
            }
            if cells.len() != names.len() {
                return Err(damaged(
                    i + 1,
                    format!("{} values under {} columns", cells.len(), names.len()),
                ));
            }
            for ((cell, column), name) in cells.iter().zip(&mut columns).zip(&names) {
                let value = if cell.is_empty() {
                    Ok(f64::NAN)
                } else {
                    cell.parse()
                };
                let value = value.map_err(|_| {
                    damaged(i + 1, format!("'{cell}' under '{name}' is not a number"))
                })?;
                column.push(value);
            }
        }
        Ok(Table { names, columns })
    }

    /// Names of the columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// A column by name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let index = self.names.iter().position(|n| n == name)?;
        self.columns.get(index).map(Vec::as_slice)
    }
}

/// The motion of one grain, SI units, space frame.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Times [s].
    pub time: Vec<f64>,
    /// Centroid [m].
    pub position: Vec<DVec3>,
    /// Velocity of the centroid [m/s].
    pub velocity: Vec<DVec3>,
    /// Orientation, body -> space.
    pub orientation: Vec<DQuat>,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vec<DVec3>,
    /// Hydrodynamic force [N].
    pub force: Vec<DVec3>,
    /// Number of contacts.
    pub contacts: Vec<f64>,
}

impl History {
    /// Row whose time is nearest to `time`; none for an empty history.
    pub fn nearest(&self, time: f64) -> Option<usize> {
        let after = self.time.partition_point(|t| *t < time);
        let before = after.saturating_sub(1);
        match (self.time.get(before), self.time.get(after)) {
            (Some(a), Some(b)) => Some(if time - a <= b - time { before } else { after }),
            (Some(_), None) => Some(before),
            _ => None,
        }
    }

    /// Position and orientation at a time, between rows in proportion; none outside the history.
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
        Some((
            position,
            self.orientation[before].slerp(self.orientation[after], part),
        ))
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are no rows.
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

/// Histories of all grains in `grains.csv`, by grain index.
pub fn histories(file: &Path, notes: &mut Vec<String>) -> Result<Vec<History>, ReportError> {
    let table = Table::read(file, notes)?;
    let column = |name: &str| {
        table.column(name).ok_or_else(|| ReportError::Line {
            file: file.to_owned(),
            line: 1,
            what: format!(
                "the column '{name}' is missing; found: {}",
                table.names().join(", ")
            ),
        })
    };
    let (time, grain) = (column("time")?, column("grain")?);
    let three =
        |a: &str, b: &str, c: &str| Ok::<_, ReportError>([column(a)?, column(b)?, column(c)?]);
    let (x, v, w) = (
        three("x", "y", "z")?,
        three("vx", "vy", "vz")?,
        three("wx", "wy", "wz")?,
    );
    let q = [column("qw")?, column("qx")?, column("qy")?, column("qz")?];
    let contacts = table.column("contacts");
    let force = three("fx", "fy", "fz").ok();
    let vector = |columns: [&[f64]; 3], row: usize| {
        DVec3::new(columns[0][row], columns[1][row], columns[2][row])
    };
    let mut out: Vec<History> = Vec::new();
    let mut went_back = false;
    for row in 0..table.rows() {
        let damaged = |what: String| ReportError::Line {
            file: file.to_owned(),
            line: row + 2,
            what,
        };
        let index = grain[row];
        if !(index >= 0.0 && index.fract() == 0.0 && index < 1e7) {
            return Err(damaged(format!("{index} is not the index of a grain")));
        }
        if !time[row].is_finite() || !vector(x, row).is_finite() {
            return Err(damaged("time or position is not finite".to_owned()));
        }
        let index = index as usize;
        if index >= out.len() && index > out.len() + table.rows() {
            return Err(damaged(format!(
                "grain {index} in a table of {} rows",
                table.rows()
            )));
        }
        if index >= out.len() {
            out.resize_with(index + 1, History::default);
        }
        let history = &mut out[index];
        let kept = history.time.partition_point(|t| *t < time[row]);
        if kept < history.len() {
            went_back = true;
            history.truncate(kept);
        }
        let turn = DQuat::from_xyzw(q[1][row], q[2][row], q[3][row], q[0][row]);
        let turned = turn.is_finite() && turn.length() > 1e-6;
        history.time.push(time[row]);
        history.position.push(vector(x, row));
        history.velocity.push(vector(v, row));
        history.angular_velocity.push(vector(w, row));
        history.orientation.push(if turned {
            turn.normalize()
        } else {
            DQuat::IDENTITY
        });
        let force = force.map_or(DVec3::NAN, |columns| vector(columns, row));
        history.force.push(force);
        history
            .contacts
            .push(contacts.map_or(f64::NAN, |column| column[row]));
    }
    if went_back {
        notes.push(format!(
            "{}: times go back (a run resumed over old rows?); later rows replaced earlier ones",
            name_of(file)
        ));
    }
    Ok(out)
}

fn name_of(file: &Path) -> String {
    file.file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default()
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
        let (out, notes) = read(&format!(
            "{HEADER}\n{}{}",
            row(0.0, 0, 3.0),
            "0.1,0,0.0,0.0,2."
        ));
        assert_eq!(out.unwrap()[0].len(), 1);
        assert!(notes[0].contains("line 3"), "{notes:?}");
    }

    #[test]
    fn damage_is_named_with_its_line() {
        let message = |content: &str| read(content).0.unwrap_err().to_string();
        let text = message(&format!(
            "{HEADER}\n{}1,2,3\n{}",
            row(0.0, 0, 3.0),
            row(0.2, 0, 3.0)
        ));
        assert!(
            text.contains("grains.csv, line 3: 3 values under 22 columns"),
            "{text}"
        );
        let text = message(&format!(
            "{HEADER}\n{}",
            row(0.0, 0, 3.0).replace("-1", "fast")
        ));
        assert!(
            text.contains("line 2: 'fast' under 'vz' is not a number"),
            "{text}"
        );
        let text = message("time,grain,x\n");
        assert!(text.contains("line 1: the column 'y' is missing"), "{text}");
        let text = message(&format!("{HEADER}\n{}", row(f64::NAN, 0, 3.0)));
        assert!(
            text.contains("line 2: time or position is not finite"),
            "{text}"
        );
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
