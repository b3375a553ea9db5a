//! Tables of grain measures (CSV, SI units).

use crate::Record;
use crate::error::{Result, ShapeError};
use grainwake_formats::disk::write_atomically;
use std::path::Path;

/// Returns the columns after the grain name; values that were not measured are `None`.
fn columns(r: &Record) -> [(&'static str, Option<f64>); 19] {
    [
        ("volume_m3", Some(r.volume_m3)),
        ("equivalent_diameter_m", Some(r.equivalent_diameter_m)),
        ("a_m", Some(r.a_m)),
        ("b_m", Some(r.b_m)),
        ("c_m", Some(r.c_m)),
        ("feret_long_m", r.feret_m.map(|l| l[0])),
        ("feret_middle_m", r.feret_m.map(|l| l[1])),
        ("feret_short_m", r.feret_m.map(|l| l[2])),
        ("elongation", Some(r.elongation)),
        ("flatness", Some(r.flatness)),
        ("krumbein_sphericity", Some(r.krumbein_sphericity)),
        ("wadell_sphericity", Some(r.wadell_sphericity)),
        ("wadell_roundness", r.wadell_roundness),
        ("inscribed_radius_m", r.inscribed_radius_m),
        ("convexity", r.convexity),
        ("surface_area_m2", Some(r.surface_area_m2)),
        ("inertia_x_m5", Some(r.inertia_m5[0])),
        ("inertia_y_m5", Some(r.inertia_m5[1])),
        ("inertia_z_m5", Some(r.inertia_m5[2])),
    ]
}

/// Writes one row per grain: its name, its measures, and the columns `more` (name and one value per
/// grain). Values that were not measured are left empty. After an error an existing file is
/// unchanged.
///
/// # Errors
/// Errors of the operating system.
pub fn write_table(
    path: &Path,
    rows: &[(String, Record)],
    more: &[(&str, Vec<f64>)],
) -> Result<()> {
    let written = write_atomically(path, true, |out| {
        let mut writer = csv::Writer::from_writer(out);
        for (row, (name, record)) in rows.iter().enumerate() {
            let columns = columns(record).into_iter();
            let more = more.iter().map(|(name, values)| (*name, values.get(row).copied()));
            let (names, values): (Vec<_>, Vec<_>) = columns.chain(more).unzip();
            if row == 0 {
                writer.write_record(std::iter::once("grain").chain(names))?;
            }
            let values =
                values.into_iter().map(|v| v.map_or(String::new(), |v| format!("{v:.7e}")));
            writer.write_record(std::iter::once(name.clone()).chain(values))?;
        }
        writer.flush()
    });
    written.map_err(|e| ShapeError::io(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shape;
    use crate::disk_tests::fails_as_a_whole;

    #[test]
    fn a_failed_table_leaves_the_earlier_one() {
        let rows = [("a".to_owned(), Shape::sphere(1e-3, 100).record())];
        fails_as_a_whole("table.csv", |path| write_table(path, &rows, &[("more", vec![1.0])]));
    }
}
