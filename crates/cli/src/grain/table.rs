//! The record of a shape as a table.

use std::path::Path;

use grainwake_shape::Record;

/// The record as lines "name  value".
pub fn of(r: &Record, path: &Path) -> String {
    let mm = |x: f64| format!("{:.5} mm", 1e3 * x);
    let lengths = |[a, b, c]: [f64; 3]| {
        let [a, b, c] = [a, b, c].map(|x| format!("{:.5}", 1e3 * x));
        format!("{a}, {b}, {c} mm")
    };
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
            format!(
                "{} (along the axes of inertia)",
                lengths([r.a_m, r.b_m, r.c_m])
            ),
        ),
        (
            "a, b, c by calipers",
            r.feret_m.map_or("not measured".to_string(), lengths),
        ),
        ("elongation b/a", format!("{:.4}", r.elongation)),
        ("flatness c/b", format!("{:.4}", r.flatness)),
        ("Krumbein sphericity", {
            let calipers = r.krumbein_sphericity_feret;
            let calipers = calipers.map_or(String::new(), |s| format!(", by calipers {s:.4}"));
            format!("{:.4}{calipers}", r.krumbein_sphericity)
        }),
        ("Wadell sphericity", format!("{:.4}", r.wadell_sphericity)),
        ("Wadell roundness", {
            let cutoff = r
                .roundness_cutoff_m
                .filter(|_| r.wadell_roundness.is_some());
            let cutoff = cutoff.map_or(String::new(), |c| format!(" (cut-off {})", mm(c)));
            optional(r.wadell_roundness) + &cutoff
        }),
        (
            "inscribed sphere",
            r.inscribed_radius_m
                .map_or("not measured".to_string(), |x| format!("radius {}", mm(x))),
        ),
        ("convexity", optional(r.convexity)),
        ("surface area", format!("{:.6e} m2", r.surface_area_m2)),
        ("principal moments", {
            let [x, y, z] = r.inertia_m5.map(|i| format!("{i:.5e}"));
            format!("{x}, {y}, {z} m5 (of unit density)")
        }),
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
