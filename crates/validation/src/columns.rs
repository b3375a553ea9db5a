//! Named columns of values: tables of a run, lines through its slices, reference data.

use std::path::Path;

use glam::DVec3;
use grainwake_formats::bounded_file::{DATA, read_text};
use grainwake_formats::table::Table;
use grainwake_formats::vti::{self, Image};
use serde::Deserialize;

/// Table that a value is taken from.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TableSource {
    /// `grains.csv`: columns of the chosen grain under their names, of grain i with the suffix i
    /// ("z1").
    #[default]
    Grains,
    /// `diagnostics.csv`.
    Diagnostics,
    /// A line through the last slice.
    Slice(Line),
}

/// Line along an axis through the last slice of a plane.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Name of the plane, as in `slices/PLANE_000000.vti`.
    pub plane: String,
    /// Direction of the line.
    pub along: Axis,
    /// Point on the line [m].
    pub through: [f64; 3],
}

/// Coordinate axis.
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

const AXES: [&str; 3] = ["x", "y", "z"];

/// Named columns. Their i-th values belong together; the columns of a grain that has left the box
/// end before the others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// Names.
    pub names: Vec<String>,
    /// Values, one vector per column.
    pub values: Vec<Vec<f64>>,
}

impl Columns {
    /// Returns the number of rows of the longest column.
    pub fn rows(&self) -> usize {
        self.values.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Returns a column by name.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        let i = self.names.iter().position(|n| n == name)?;
        Some(&self.values[i])
    }

    fn push(&mut self, name: impl Into<String>, values: Vec<f64>) {
        self.names.push(name.into());
        self.values.push(values);
    }

    /// Reads a table of a run folder.
    pub fn read_run(folder: &Path, source: &TableSource, grain: usize) -> Result<Columns, String> {
        let read = |name: &str| {
            Table::read(&folder.join(name), &mut Vec::new()).map_err(|e| e.to_string())
        };
        match source {
            TableSource::Grains => split_by_grain(&read("grains.csv")?, grain),
            TableSource::Diagnostics => {
                let table = read("diagnostics.csv")?;
                let column = |name: &String| table.column(name).unwrap_or_default().to_vec();
                Ok(Columns {
                    names: table.names().to_vec(),
                    values: table.names().iter().map(column).collect(),
                })
            }
            TableSource::Slice(line) => sample_line(folder, line),
        }
    }

    /// Reads reference data: comma-separated, names in the first line, comments after `#`.
    pub fn read_reference(file: &Path) -> Result<Columns, String> {
        let problem = |what: String| format!("{}: {what}", file.display());
        let text = read_text(file, DATA).map_err(|e| problem(e.to_string()))?;
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| problem(e.to_string()))?;
        if header.is_empty() {
            return Err(problem("no header".into()));
        }
        let mut columns = Columns::default();
        for name in header {
            columns.push(name, Vec::new());
        }
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).map_err(|e| problem(e.to_string()))? {
            // The position of the record itself is that of the comments before it.
            let end = reader.position().byte() as usize;
            let line = || text.get(..end).unwrap_or(&text).trim_end().lines().count();
            let wrong = |what: String| problem(format!("line {}: {what}", line()));
            if record.len() != columns.names.len() {
                let (values, names) = (record.len(), columns.names.len());
                return Err(wrong(format!("{values} values under {names} names")));
            }
            for (field, column) in record.iter().zip(&mut columns.values) {
                let value = field.parse().map_err(|_| wrong(format!("'{field}' is not a number")));
                column.push(value?);
            }
        }
        Ok(columns)
    }
}

/// Columns without a number that are common to all grains.
const COMMON: [&str; 2] = ["time", "time_scaled"];

/// Separates the rows of the grains into numbered columns; the chosen grain also has unnumbered
/// columns. The unnumbered time is that of the grain with the most rows.
fn split_by_grain(table: &Table, chosen: usize) -> Result<Columns, String> {
    let index = table.column("grain").ok_or("grains.csv has no column \"grain\"")?;
    let count = index.iter().fold(0.0, |a: f64, b| a.max(*b)) as usize + 1;
    if chosen >= count || index.is_empty() {
        return Err(format!("grains.csv has no grain {chosen}"));
    }
    let mut columns = Columns::default();
    for name in table.names().iter().filter(|name| *name != "grain") {
        let values = table.column(name).unwrap_or_default();
        let of_grain = |grain: usize| -> Vec<f64> {
            let rows = values.iter().zip(index).filter(|(_, i)| **i == grain as f64);
            rows.map(|(value, _)| *value).collect()
        };
        let own: Vec<Vec<f64>> = (0..count).map(of_grain).collect();
        let longest = own.iter().max_by_key(|values| values.len()).cloned().unwrap_or_default();
        if name == "time" {
            check_times(&own, &longest)?;
        }
        let unnumbered = if COMMON.contains(&name.as_str()) { &longest } else { &own[chosen] };
        columns.push(name, unnumbered.clone());
        for (grain, values) in own.into_iter().enumerate() {
            columns.push(format!("{name}{grain}"), values);
        }
    }
    Ok(columns)
}

/// Checks that the rows of every grain are at the first of the common times: a grain that has left
/// the box does not return. Otherwise the i-th rows of two grains would be at different times.
fn check_times(times: &[Vec<f64>], common: &[f64]) -> Result<(), String> {
    for (grain, own) in times.iter().enumerate() {
        if let Some((found, expected)) = own.iter().zip(common).find(|(a, b)| a != b) {
            return Err(format!(
                "grains.csv has a row of grain {grain} at {found} s, and one of another grain at \
                 {expected} s instead: rows are missing"
            ));
        }
    }
    Ok(())
}

/// Reads the slice of a plane with the latest time.
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
        if latest.as_ref().is_none_or(|l| l.frame.time < image.frame.time) {
            latest = Some(image);
        }
    }
    latest.ok_or_else(|| format!("there is no slice of the plane \"{plane}\""))
}

/// Samples a slice along a line, at the cell centres along it and linearly interpolated across it.
fn sample_line(folder: &Path, line: &Line) -> Result<Columns, String> {
    let image = last_slice(folder, &line.plane)?;
    let axis = line.along as usize;
    let through = DVec3::from(line.through);
    // Offsets and weights of the cells around the line.
    let mut weights = vec![(0usize, 1.0f64)];
    let strides = [1, image.frame.cells[0], image.frame.cells[0] * image.frame.cells[1]];
    for other in (0..3).filter(|a| *a != axis && image.frame.cells[*a] > 1) {
        let n = image.frame.cells[other];
        let s = (through[other] - image.frame.origin[other]) / image.frame.spacing[other] - 0.5;
        if s < -0.5 || s > n as f64 - 0.5 {
            return Err(format!("the line lies outside the slice \"{}\"", line.plane));
        }
        let low = s.clamp(0.0, n as f64 - 1.0).floor() as usize;
        let high = (low + 1).min(n - 1);
        let part = (s - low as f64).clamp(0.0, 1.0);
        let split = |(at, w): (usize, f64)| {
            let (below, above) = (at + low * strides[other], at + high * strides[other]);
            [(below, w * (1.0 - part)), (above, w * part)]
        };
        weights = weights.into_iter().flat_map(split).collect();
    }
    let mut columns = Columns::default();
    let n = image.frame.cells[axis];
    let centre = |i: usize| image.frame.origin[axis] + (i as f64 + 0.5) * image.frame.spacing[axis];
    columns.push(AXES[axis], (0..n).map(centre).collect());
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
                (_, "velocity") => format!("v{}", AXES[c]),
                (_, name) => format!("{name}_{}", AXES[c]),
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
    fn grain_columns_are_side_by_side() {
        let text = "time,grain,z\n0,0,1\n0,1,2\n1,0,3\n1,1,4\n";
        let folder = folder_with("grains.csv", text);
        let columns = Columns::read_run(folder.path(), &TableSource::Grains, 1).unwrap();
        assert_eq!(columns.get("z0").unwrap(), [1.0, 3.0]);
        assert_eq!(columns.get("z").unwrap(), [2.0, 4.0]);
        assert_eq!(columns.get("time").unwrap(), [0.0, 1.0]);
        assert!(Columns::read_run(folder.path(), &TableSource::Grains, 2).is_err());
    }

    /// Grain 0 has left after 1 s; its columns end, and the time goes on.
    #[test]
    fn the_columns_of_a_grain_that_leaves_end() {
        let text = "time,grain,z\n0,0,1\n0,1,2\n1,0,3\n1,1,4\n2,1,6\n";
        let folder = folder_with("grains.csv", text);
        for chosen in [0, 1] {
            let columns = Columns::read_run(folder.path(), &TableSource::Grains, chosen).unwrap();
            assert_eq!(columns.get("time").unwrap(), [0.0, 1.0, 2.0]);
            assert_eq!(columns.get("time0").unwrap(), [0.0, 1.0]);
            assert_eq!(columns.get("z0").unwrap(), [1.0, 3.0]);
            assert_eq!(columns.get("z1").unwrap(), [2.0, 4.0, 6.0]);
            assert_eq!(columns.rows(), 3);
        }
        // A row of grain 0 is missing in the middle.
        let text = "time,grain,z\n0,0,1\n0,1,2\n1,1,4\n2,0,5\n2,1,6\n";
        let folder = folder_with("grains.csv", text);
        let error = Columns::read_run(folder.path(), &TableSource::Grains, 0).unwrap_err();
        assert!(error.contains("grain 0 at 2 s") && error.contains("1 s instead"), "{error}");
    }

    #[test]
    fn comments_are_skipped_and_errors_name_the_line() {
        let folder = folder_with("d.csv", "# source\nt, u\n0, 1\n# more\n1, x\n");
        let error = Columns::read_reference(&folder.path().join("d.csv")).unwrap_err();
        assert!(error.contains("line 5: 'x'"), "{error}");
        let folder = folder_with("d.csv", "# source\nt, u\n0, 1\n1, 2\n");
        let data = Columns::read_reference(&folder.path().join("d.csv")).unwrap();
        assert_eq!(data.get("u").unwrap(), [1.0, 2.0]);
    }
}
