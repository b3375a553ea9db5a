//! Columns of numbers from a run folder: its tables, or a line through a slice.

use std::path::Path;

use glam::DVec3;
use grainwake_report::Table;
use grainwake_solver::output::vti::{self, Image};
use serde::Deserialize;

/// Which table a number is taken from.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum From {
    /// `grains.csv`: the columns of the chosen grain under their own names, those of grain i with
    /// the number behind them ("z1").
    #[default]
    Grains,
    /// `diagnostics.csv`.
    Diagnostics,
    /// A line through the last slice.
    Slice(Line),
}

/// A line along an axis through the last slice of a plane.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Name of the plane, as in `slices/PLANE_000000.vti`.
    pub plane: String,
    /// Axis along which it goes.
    pub along: Axis,
    /// A point on it [m].
    pub through: [f64; 3],
}

/// An axis of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// x
    X,
    /// y
    Y,
    /// z
    Z,
}

/// Named columns of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// Names.
    pub names: Vec<String>,
    /// Values.
    pub values: Vec<Vec<f64>>,
}

impl Columns {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    /// A column by name.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        let i = self.names.iter().position(|n| n == name)?;
        Some(&self.values[i])
    }

    fn push(&mut self, name: impl Into<String>, values: Vec<f64>) {
        self.names.push(name.into());
        self.values.push(values);
    }

    /// Reads the table of a run folder.
    pub fn of_run(folder: &Path, from: &From, grain: usize) -> Result<Columns, String> {
        let read = |name: &str| {
            Table::read(&folder.join(name), &mut Vec::new()).map_err(|e| e.to_string())
        };
        match from {
            From::Grains => by_grain(&read("grains.csv")?, grain),
            From::Diagnostics => Ok(whole(&read("diagnostics.csv")?)),
            From::Slice(line) => along(folder, line),
        }
    }

    /// Reads reference data: comma-separated, names in the first line, comments behind `#`.
    pub fn of_data(file: &Path) -> Result<Columns, String> {
        let problem = |what: String| format!("{}: {what}", file.display());
        let text = std::fs::read_to_string(file).map_err(|e| problem(e.to_string()))?;
        let mut lines = text
            .lines()
            .zip(1..)
            .map(|(line, number)| (line.trim(), number))
            .filter(|(line, _)| !line.is_empty() && !line.starts_with('#'));
        let mut columns = Columns::default();
        let (header, _) = lines.next().ok_or_else(|| problem("no header".into()))?;
        for name in header.split(',') {
            columns.push(name.trim(), Vec::new());
        }
        for (line, number) in lines {
            let fields: Vec<&str> = line.split(',').map(str::trim).collect();
            if fields.len() != columns.names.len() {
                let found = format!(
                    "{} values under {} names",
                    fields.len(),
                    columns.names.len()
                );
                return Err(problem(format!("line {number}: {found}")));
            }
            for (field, column) in fields.iter().zip(&mut columns.values) {
                let value = field
                    .parse()
                    .map_err(|_| problem(format!("line {number}: '{field}' is not a number")))?;
                column.push(value);
            }
        }
        Ok(columns)
    }
}

fn whole(table: &Table) -> Columns {
    let mut columns = Columns::default();
    for name in table.names() {
        columns.push(name, table.column(name).unwrap_or_default().to_vec());
    }
    columns
}

fn by_grain(table: &Table, chosen: usize) -> Result<Columns, String> {
    let missing = || "grains.csv has no column \"grain\"".to_string();
    let number = table.column("grain").ok_or_else(missing)?;
    let count = number.iter().fold(0.0, |a: f64, b| a.max(*b)) as usize + 1;
    if chosen >= count || number.is_empty() {
        return Err(format!("there is no grain {chosen} in grains.csv"));
    }
    let mut columns = Columns::default();
    for name in table.names().iter().filter(|name| *name != "grain") {
        let values = table.column(name).unwrap_or_default();
        for grain in 0..count {
            let of_grain = || -> Vec<f64> {
                let rows = values.iter().zip(number);
                rows.filter(|(_, n)| **n == grain as f64)
                    .map(|(v, _)| *v)
                    .collect()
            };
            if grain == chosen {
                columns.push(name, of_grain());
            }
            columns.push(format!("{name}{grain}"), of_grain());
        }
    }
    Ok(columns)
}

/// The last slice of a plane: the frame at the end, else the one with the highest number.
pub(crate) fn last_slice(folder: &Path, plane: &str) -> Result<Image, String> {
    let slices = folder.join("slices");
    let entries = std::fs::read_dir(&slices).map_err(|e| format!("{}: {e}", slices.display()))?;
    let mut latest: Option<Image> = None;
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.starts_with(&format!("{plane}_")) || !name.ends_with(".vti") {
            continue;
        }
        let image = vti::read(&entry.path()).map_err(|e| format!("{name}: {e}"))?;
        if latest.as_ref().is_none_or(|l| l.time < image.time) {
            latest = Some(image);
        }
    }
    latest.ok_or_else(|| format!("there is no slice of the plane \"{plane}\""))
}

/// Values along a line, interpolated across it between the cell centres of the slice.
fn along(folder: &Path, line: &Line) -> Result<Columns, String> {
    let image = last_slice(folder, &line.plane)?;
    let axis = line.along as usize;
    let through = DVec3::from(line.through);
    let mut weights = vec![(0usize, 1.0f64)];
    let strides = [1, image.cells[0], image.cells[0] * image.cells[1]];
    for other in (0..3).filter(|a| *a != axis && image.cells[*a] > 1) {
        let n = image.cells[other];
        let s = (through[other] - image.origin[other]) / image.spacing[other] - 0.5;
        if s < -0.5 || s > n as f64 - 0.5 {
            return Err(format!(
                "the line lies outside the slice \"{}\"",
                line.plane
            ));
        }
        let low = s.clamp(0.0, n as f64 - 1.0).floor() as usize;
        let high = (low + 1).min(n - 1);
        let part = (s - low as f64).clamp(0.0, 1.0);
        weights = weights
            .iter()
            .flat_map(|(at, w)| {
                [
                    (at + low * strides[other], w * (1.0 - part)),
                    (at + high * strides[other], w * part),
                ]
            })
            .collect();
    }
    let mut columns = Columns::default();
    let n = image.cells[axis];
    let name = ["x", "y", "z"][axis];
    let start = image.origin[axis];
    let centre = |i: usize| start + (i as f64 + 0.5) * image.spacing[axis];
    columns.push(name, (0..n).map(centre).collect());
    for array in &image.arrays {
        for c in 0..array.components {
            let value = |i: usize| -> f64 {
                let at = |(base, w): &(usize, f64)| {
                    w * f64::from(array.data[(base + i * strides[axis]) * array.components + c])
                };
                weights.iter().map(at).sum()
            };
            let label = match (array.components, array.name.as_str()) {
                (1, name) => name.to_string(),
                (_, "velocity") => format!("v{}", ["x", "y", "z"][c]),
                (_, name) => format!("{name}_{}", ["x", "y", "z"][c]),
            };
            columns.push(label, (0..n).map(value).collect());
        }
    }
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(name: &str, text: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(name), text).unwrap();
        folder
    }

    #[test]
    fn grains_stand_side_by_side() {
        let text = "time,grain,z\n0,0,1\n0,1,2\n1,0,3\n1,1,4\n";
        let folder = folder_with("grains.csv", text);
        let columns = Columns::of_run(folder.path(), &From::Grains, 1).unwrap();
        assert_eq!(columns.get("z0").unwrap(), [1.0, 3.0]);
        assert_eq!(columns.get("z").unwrap(), [2.0, 4.0]);
        assert_eq!(columns.get("time").unwrap(), [0.0, 1.0]);
        assert!(Columns::of_run(folder.path(), &From::Grains, 2).is_err());
    }

    #[test]
    fn data_may_carry_comments_and_errors_name_the_line() {
        let folder = folder_with("d.csv", "# source\nt, u\n0, 1\n# more\n1, x\n");
        let error = Columns::of_data(&folder.path().join("d.csv")).unwrap_err();
        assert!(error.contains("line 5: 'x'"), "{error}");
        let folder = folder_with("d.csv", "# source\nt, u\n0, 1\n1, 2\n");
        let data = Columns::of_data(&folder.path().join("d.csv")).unwrap();
        assert_eq!(data.get("u").unwrap(), [1.0, 2.0]);
    }
}
