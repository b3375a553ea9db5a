//! The record of a shape as a table.

use std::path::Path;

use grainwake_shape::Record;

/// The record as lines "name  value".
pub fn of(r: &Record, path: &Path) -> String {
    let mm = |x: f64| format!("{:.5} mm", 1e3 * x);
    let optional = |x: Option<f64>| x.map_or("not measured".to_string(), |x| format!("{x:.4}"));
    let mut rows = vec![
        ("file", path.display().to_string()),
        (
            "made by",
            if r.source.is_empty() {
                r.method.clone()
            } else {
                format!("{} from {}", r.method, r.source)
            },
        ),
        ("volume", format!("{:.6e} m3", r.volume_m3)),
        ("equivalent diameter", mm(r.equivalent_diameter_m)),
        (
            "a, b, c",
            format!("{}, {}, {}", mm(r.a_m), mm(r.b_m), mm(r.c_m)),
        ),
        (
            "caliper lengths",
            r.feret_m.map_or("not measured".to_string(), |[l, w, t]| {
                format!("{}, {}, {}", mm(l), mm(w), mm(t))
            }),
        ),
        ("elongation b/a", format!("{:.4}", r.elongation)),
        ("flatness c/b", format!("{:.4}", r.flatness)),
        (
            "Krumbein sphericity",
            format!("{:.4}", r.krumbein_sphericity),
        ),
        ("Wadell sphericity", format!("{:.4}", r.wadell_sphericity)),
        ("Wadell roundness", {
            let cutoff = r
                .roundness_cutoff_m
                .filter(|_| r.wadell_roundness.is_some());
            let cutoff = cutoff.map_or(String::new(), |c| format!(" (cut-off {})", mm(c)));
            optional(r.wadell_roundness) + &cutoff
        }),
        ("convexity", optional(r.convexity)),
        ("surface area", format!("{:.6e} m2", r.surface_area_m2)),
        ("surface nodes", r.surface_nodes.to_string()),
    ];
    if let (Some(n), Some(h)) = (r.field_samples, r.field_spacing_m) {
        rows.push((
            "distance field",
            format!("{} x {} x {} samples of {}", n[0], n[1], n[2], mm(h)),
        ));
    }
    if let Some(error) = r.volume_error {
        rows.push(("volume error", format!("{:.3} %", 100.0 * error)));
    }
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    rows.iter()
        .map(|(name, value)| format!("{name:width$}  {value}"))
        .collect::<Vec<_>>()
        .join("\n")
}
