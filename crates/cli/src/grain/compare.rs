//! `grain compare`.

use comfy_table::Table;
use grainwake_report::grain_sheet::{self, GrainPanel};
use grainwake_shape::{Comparison, Record, Shape};
use serde_json::json;

use super::drawn;
use super::may_draw;
use super::table::{LengthUnit, significant};
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
        let unit = unit(&one, &other);
        print(&surfaces(&comparison, first.equivalent_diameter(), unit))?;
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

/// Significant digits of lengths and areas.
const DIGITS: i32 = 5;

/// A measure, and its text in the unit of the table.
struct Measure {
    value: Option<f64>,
    text: Option<String>,
}

/// Returns the unit suited to the larger grain.
fn unit(first: &Record, second: &Record) -> LengthUnit {
    LengthUnit::of(first.equivalent_diameter_m.max(second.equivalent_diameter_m))
}

fn measures(first: &Record, second: &Record) -> Table {
    let unit = unit(first, second);
    let size = |x: f64| Some(significant(x, DIGITS));
    let rows = |r: &Record| {
        let length = |x: f64| Measure { value: Some(x), text: size(unit.per_metre * x) };
        let ratio = |x: Option<f64>| Measure { value: x, text: x.map(|x| format!("{x:.4}")) };
        let area = unit.per_metre.powi(2) * r.surface_area_m2;
        [
            (format!("equivalent diameter [{}]", unit.name), length(r.equivalent_diameter_m)),
            (format!("a [{}]", unit.name), length(r.a_m)),
            (format!("b [{}]", unit.name), length(r.b_m)),
            (format!("c [{}]", unit.name), length(r.c_m)),
            ("elongation b/a".to_owned(), ratio(Some(r.elongation))),
            ("flatness c/b".to_owned(), ratio(Some(r.flatness))),
            ("Krumbein sphericity".to_owned(), ratio(Some(r.krumbein_sphericity))),
            ("Wadell sphericity".to_owned(), ratio(Some(r.wadell_sphericity))),
            ("Wadell roundness".to_owned(), ratio(r.wadell_roundness)),
            ("convexity".to_owned(), ratio(r.convexity)),
            (
                format!("surface area [{}2]", unit.name),
                Measure { value: Some(area), text: size(area) },
            ),
        ]
    };
    let text = |measure: &Measure| measure.text.clone().unwrap_or("not measured".into());
    let cells = rows(first).into_iter().zip(rows(second)).map(|((name, p), (_, q))| {
        let both = p.value.zip(q.value);
        let difference = both.map(|(p, q)| format!("{:+.2} %", 100.0 * (q / p - 1.0)));
        vec![name, text(&p), text(&q), difference.unwrap_or("-".into())]
    });
    markdown(["", "first", "second", "difference"], cells, 1..4)
}

fn surfaces(comparison: &Comparison, diameter: f64, unit: LengthUnit) -> String {
    // Decimals of 1/100000 of the diameter: smaller distances are round-off.
    let size = unit.per_metre * diameter;
    let decimals = (5 - size.log10().floor() as i32).clamp(0, 9);
    let step = 10f64.powi(-decimals);
    let line = |name: &str, x: f64| {
        // The sum turns -0 into 0.
        let rounded = (unit.per_metre * x / step).round() * step + 0.0;
        format!(
            "{name:31} {:>10} {}  {:>8.3} % of the first diameter",
            format!("{rounded:.*}", decimals as usize),
            unit.name,
            100.0 * rounded / size
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
