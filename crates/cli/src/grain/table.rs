//! The record of a shape as text.

use std::path::Path;

use grainwake_plot::equal_aspect::length_unit;
use grainwake_shape::Record;

use crate::out::columns;

/// Unit of the lengths of a grain, suited to its size.
#[derive(Clone, Copy)]
pub struct LengthUnit {
    /// Name: um, mm or m.
    pub name: &'static str,
    /// Units per metre.
    pub per_metre: f64,
}

impl LengthUnit {
    /// Returns the unit suited to lengths of `size` [m].
    pub fn of(size: f64) -> LengthUnit {
        let (name, per_metre) = length_unit(size);
        // Terminals may lack the micro sign.
        LengthUnit { name: if name == "µm" { "um" } else { name }, per_metre }
    }

    /// Returns a length [m] with its unit.
    pub fn text(self, length: f64, digits: i32) -> String {
        format!("{} {}", significant(self.per_metre * length, digits), self.name)
    }
}

/// Returns a value with this number of significant digits, or with all digits before the point.
pub fn significant(value: f64, digits: i32) -> String {
    let power = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    format!("{value:.*}", (digits - 1 - power).clamp(0, 15) as usize)
}

/// Significant digits of a length.
const DIGITS: i32 = 6;

/// Returns the record as lines of names and values.
pub fn of(r: &Record, path: &Path) -> String {
    let unit = LengthUnit::of(r.equivalent_diameter_m);
    let length = |x: f64| unit.text(x, DIGITS);
    let lengths = |lengths: [f64; 3]| {
        let [a, b, c] = lengths.map(|x| significant(unit.per_metre * x, DIGITS));
        format!("{a}, {b}, {c} {}", unit.name)
    };
    let missing = || "not measured".to_string();
    let optional = |x: Option<f64>| x.map_or_else(missing, |x| format!("{x:.4}"));
    let from = if r.source.is_empty() { "" } else { " from " };
    let extents = lengths([r.a_m, r.b_m, r.c_m]);
    let feret = r.krumbein_sphericity_feret;
    let feret = feret.map_or(String::new(), |s| format!(", by Feret diameters {s:.4}"));
    let cutoff = r.roundness_cutoff_m.filter(|_| r.wadell_roundness.is_some());
    let cutoff = cutoff.map_or(String::new(), |c| format!(" (cut-off {})", length(c)));
    let radius = |x: f64| format!("radius {}", length(x));
    let [ix, iy, iz] = r.inertia_m5.map(|i| format!("{i:.5e}"));
    let mut rows = vec![
        ("file", path.display().to_string()),
        ("source", format!("{}{from}{}", r.method, r.source)),
        ("volume", format!("{:.6e} m3", r.volume_m3)),
        ("equivalent diameter", length(r.equivalent_diameter_m)),
        ("a, b, c", format!("{extents} (along the principal axes)")),
        ("Feret diameters", r.feret_m.map_or_else(missing, lengths)),
        ("elongation b/a", format!("{:.4}", r.elongation)),
        ("flatness c/b", format!("{:.4}", r.flatness)),
        ("Krumbein sphericity", format!("{:.4}{feret}", r.krumbein_sphericity)),
        ("Wadell sphericity", format!("{:.4}", r.wadell_sphericity)),
        ("Wadell roundness", optional(r.wadell_roundness) + &cutoff),
        ("inscribed sphere", r.inscribed_radius_m.map_or_else(missing, radius)),
        ("convexity", optional(r.convexity)),
        ("surface area", format!("{:.6e} m2", r.surface_area_m2)),
        ("principal moments", format!("{ix}, {iy}, {iz} m5 (per unit density)")),
        ("surface nodes", r.surface_nodes.to_string()),
    ];
    if let (Some([nx, ny, nz]), Some(spacing)) = (r.field_samples, r.field_spacing_m) {
        let samples = format!("{nx} x {ny} x {nz} samples, spacing {}", length(spacing));
        rows.push(("distance field", samples));
    }
    if let Some(error) = r.volume_error {
        rows.push(("volume error", format!("{:.3} %", 100.0 * error)));
    }
    columns(&rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_keep_their_digits_at_any_size() {
        let text = |x: f64| LengthUnit::of(x).text(x, DIGITS);
        assert_eq!(text(5.123456e-6), "5.12346 um");
        assert_eq!(text(2e-3), "2.00000 mm");
        assert_eq!(text(0.75), "0.750000 m");
        assert_eq!(significant(1234567.8, 4), "1234568");
        assert_eq!(significant(0.0, 4), "0.000");
    }
}
