//! `grain compare`.

use comfy_table::Table;
use grainwake_report::grain_sheet::{self, GrainPanel};
use grainwake_shape::{Comparison, Record, Shape};
use serde_json::json;

use super::drawn;
use super::may_draw;
use crate::args::CompareArgs;
use crate::exit::Exit;
use crate::out::{markdown, print};

/// Prints the morphology of two grains and the distance of their surfaces.
pub fn compare(args: &CompareArgs) -> Result<(), Exit> {
    if let Some(picture) = &args.picture {
        may_draw("--picture", picture, &[&args.first, &args.second])?;
    }
    let first = Shape::load(&args.first)?;
    let mut second = Shape::load(&args.second)?;
    if args.same_size {
        second = second.scaled_to_equivalent_diameter(first.equivalent_diameter())?;
    }
    let comparison = Comparison::of(&first, &second);
    let (one, other) = (first.record(), second.record());
    if args.json {
        let object = json!({ "first": one, "second": other, "comparison": comparison });
        print(&serde_json::to_string(&object)?)?;
    } else {
        print(&measures(&one, &other).to_string())?;
        print(&surfaces(&comparison, first.equivalent_diameter()))?;
    }
    if let Some(path) = &args.picture {
        let width = grain_sheet::window(&first).max(grain_sheet::window(&second));
        let names = drawn::names(&[&args.first, &args.second]);
        let panels = vec![
            GrainPanel::sides(&names[0], &first, glam::DMat3::IDENTITY, drawn::SIDE, width, false),
            GrainPanel::sides(&names[1], &second, comparison.turn, drawn::SIDE, width, false),
        ];
        drawn::save(path, panels, 1)?;
    }
    Ok(())
}

fn measures(first: &Record, second: &Record) -> Table {
    let rows = |r: &Record| {
        [
            ("equivalent diameter [mm]", Some(1e3 * r.equivalent_diameter_m)),
            ("a [mm]", Some(1e3 * r.a_m)),
            ("b [mm]", Some(1e3 * r.b_m)),
            ("c [mm]", Some(1e3 * r.c_m)),
            ("elongation b/a", Some(r.elongation)),
            ("flatness c/b", Some(r.flatness)),
            ("Krumbein sphericity", Some(r.krumbein_sphericity)),
            ("Wadell sphericity", Some(r.wadell_sphericity)),
            ("Wadell roundness", r.wadell_roundness),
            ("convexity", r.convexity),
            ("surface area [mm2]", Some(1e6 * r.surface_area_m2)),
        ]
    };
    let value = |x: Option<f64>| x.map_or("not measured".into(), |x| format!("{x:.4}"));
    let cells = rows(first).into_iter().zip(rows(second)).map(|((name, p), (_, q))| {
        let difference = p.zip(q).map(|(p, q)| format!("{:+.2} %", 100.0 * (q / p - 1.0)));
        vec![name.to_owned(), value(p), value(q), difference.unwrap_or("-".into())]
    });
    markdown(["", "first", "second", "difference"], cells, 1..4)
}

fn surfaces(comparison: &Comparison, diameter: f64) -> String {
    let line = |name: &str, x: f64| {
        format!(
            "{name:31} {:>10.5} mm  {:>8.3} % of the first diameter",
            1e3 * x,
            100.0 * x / diameter
        )
    };
    [
        "Distance of the surfaces, with centroids and principal axes aligned:".to_string(),
        line("mean (positive: first outside)", comparison.mean_distance_m),
        line("root mean square", comparison.rms_distance_m),
        line("largest", comparison.largest_distance_m),
    ]
    .join("\n")
}
