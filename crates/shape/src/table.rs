//! Tables of grain measures (CSV, SI units).

use crate::Record;
use crate::error::{Result, ShapeError};
use std::path::Path;

/// Columns after the grain name.
const COLUMNS: [&str; 19] = [
    "volume_m3",
    "equivalent_diameter_m",
    "a_m",
    "b_m",
    "c_m",
    "feret_long_m",
    "feret_middle_m",
    "feret_short_m",
    "elongation",
    "flatness",
    "krumbein_sphericity",
    "wadell_sphericity",
    "wadell_roundness",
    "inscribed_radius_m",
    "convexity",
    "surface_area_m2",
    "inertia_x_m5",
    "inertia_y_m5",
    "inertia_z_m5",
];

/// Writes one row per grain: its name, its measures, and the columns `more` (name and one value per
/// grain). Values that were not measured are left empty.
pub fn write_table(
    path: &Path,
    rows: &[(String, Record)],
    more: &[(&str, Vec<f64>)],
) -> Result<()> {
    let failed = |e: csv::Error| ShapeError::io(path, std::io::Error::other(e));
    let mut writer = csv::Writer::from_path(path).map_err(failed)?;
    writer
        .write_record(
            std::iter::once("grain")
                .chain(COLUMNS)
                .chain(more.iter().map(|(name, _)| *name)),
        )
        .map_err(failed)?;
    for (row, (name, r)) in rows.iter().enumerate() {
        let values = [
            Some(r.volume_m3),
            Some(r.equivalent_diameter_m),
            Some(r.a_m),
            Some(r.b_m),
            Some(r.c_m),
            r.feret_m.map(|l| l[0]),
            r.feret_m.map(|l| l[1]),
            r.feret_m.map(|l| l[2]),
            Some(r.elongation),
            Some(r.flatness),
            Some(r.krumbein_sphericity),
            Some(r.wadell_sphericity),
            r.wadell_roundness,
            r.inscribed_radius_m,
            r.convexity,
            Some(r.surface_area_m2),
            Some(r.inertia_m5[0]),
            Some(r.inertia_m5[1]),
            Some(r.inertia_m5[2]),
        ];
        let more = more.iter().map(|(_, values)| values.get(row).copied());
        let values = values.into_iter().chain(more);
        let texts: Vec<String> = values
            .map(|v| v.map_or(String::new(), |v| format!("{v:.7e}")))
            .collect();
        writer
            .write_record(std::iter::once(name).chain(&texts))
            .map_err(failed)?;
    }
    writer.flush().map_err(|e| ShapeError::io(path, e))
}
