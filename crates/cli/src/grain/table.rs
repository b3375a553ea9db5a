//! The record of a shape as text.

use std::path::Path;

use grainwake_shape::Record;

use crate::out::columns;

/// Returns the record as lines of names and values.
pub fn of(r: &Record, path: &Path) -> String {
    let mm = |x: f64| format!("{:.5} mm", 1e3 * x);
    let lengths = |lengths: [f64; 3]| {
        let [a, b, c] = lengths.map(|x| format!("{:.5}", 1e3 * x));
        format!("{a}, {b}, {c} mm")
    };
    let missing = || "not measured".to_string();
    let optional = |x: Option<f64>| x.map_or_else(missing, |x| format!("{x:.4}"));
    let from = if r.source.is_empty() { "" } else { " from " };
    let extents = lengths([r.a_m, r.b_m, r.c_m]);
    let feret = r.krumbein_sphericity_feret;
    let feret = feret.map_or(String::new(), |s| format!(", by Feret diameters {s:.4}"));
    let cutoff = r.roundness_cutoff_m.filter(|_| r.wadell_roundness.is_some());
    let cutoff = cutoff.map_or(String::new(), |c| format!(" (cut-off {})", mm(c)));
    let radius = |x: f64| format!("radius {}", mm(x));
    let [ix, iy, iz] = r.inertia_m5.map(|i| format!("{i:.5e}"));
    let mut rows = vec![
        ("file", path.display().to_string()),
        ("source", format!("{}{from}{}", r.method, r.source)),
        ("volume", format!("{:.6e} m3", r.volume_m3)),
        ("equivalent diameter", mm(r.equivalent_diameter_m)),
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
        let samples = format!("{nx} x {ny} x {nz} samples, spacing {}", mm(spacing));
        rows.push(("distance field", samples));
    }
    if let Some(error) = r.volume_error {
        rows.push(("volume error", format!("{:.3} %", 100.0 * error)));
    }
    columns(&rows)
}
