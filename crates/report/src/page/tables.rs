//! Tables of the page: parameters with units, events, provenance.

use serde_json::Value;

use grainwake_formats::events::Event;

use crate::run_folder::RunFolder;
use crate::story::{Story, galileo, short};
use grainwake_plot::{escape, html, literal};

/// Most events that are listed.
const EVENTS: usize = 100;
/// Most entries of a list in the provenance that are listed.
const SESSIONS: usize = 8;

fn row(out: &mut String, name: &str, value: &str) {
    out.push_str(&format!(
        "<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n",
        html(name),
        html(value)
    ));
}

fn table(rows: &str) -> String {
    format!("<table><tbody>\n{rows}</tbody></table>\n")
}

/// What was run: two tables side by side, physics and numerics.
pub fn parameters(run: &RunFolder, story: &Story) -> String {
    let facts = &run.facts;
    let mut physics = String::new();
    if let Some(density) = facts.fluid_density {
        row(
            &mut physics,
            "fluid density *ρ*_{f}",
            &format!("{} kg/m^{{3}}", short(density)),
        );
    }
    if let Some(viscosity) = facts.viscosity {
        row(
            &mut physics,
            "kinematic viscosity *ν*",
            &format!("{} m^{{2}}/s", short(viscosity)),
        );
    }
    if let Some(gravity) = facts.gravity {
        row(
            &mut physics,
            "gravity *g*",
            &format!(
                "({}, {}, {}) m/s^{{2}}",
                short(gravity.x),
                short(gravity.y),
                short(gravity.z)
            ),
        );
    }
    grain_rows(&mut physics, run);
    let ratio = facts
        .grain_density()
        .zip(facts.fluid_density)
        .map(|(grain, fluid)| grain / fluid);
    if let Some(ratio) = ratio {
        row(&mut physics, "density ratio *ρ*_{p}/*ρ*_{f}", &short(ratio));
    }
    let differ = facts.grains.iter().any(|grain| {
        (grain.diameter, grain.density) != (facts.grains[0].diameter, facts.grains[0].density)
    });
    if let (Some(scales), Some(ratio), Some(viscosity)) = (story.scales, ratio, facts.viscosity) {
        row(
            &mut physics,
            &format!(
                "Galileo number √(|*ρ*_{{p}}/*ρ*_{{f}} − 1| *g* *d*^{{3}}) / *ν*{}",
                if differ {
                    ", of the mean diameter and density"
                } else {
                    ""
                }
            ),
            &short(galileo(scales, ratio, viscosity)),
        );
    }
    if let (Some(diameter), Some(viscosity)) = (facts.diameter(), facts.viscosity) {
        let fastest = run
            .grains
            .iter()
            .flat_map(|h| h.velocity.iter().map(|v| v.length()))
            .filter(|v| v.is_finite())
            .fold(0.0, f64::max);
        row(
            &mut physics,
            "Reynolds number at the largest speed, |*v*| *d* / *ν*",
            &short(fastest * diameter / viscosity),
        );
    }
    if let Some(scales) = story.scales {
        row(
            &mut physics,
            "time scale √(*d*/*g*)",
            &format!("{} s", short(scales.time())),
        );
        row(
            &mut physics,
            "velocity scale √(*d* *g*)",
            &format!("{} m/s", short(scales.velocity())),
        );
    }
    let mut numerics = String::new();
    if let Some(size) = facts.size {
        row(
            &mut numerics,
            "box",
            &format!(
                "{} × {} × {} mm",
                short(1e3 * size.x),
                short(1e3 * size.y),
                short(1e3 * size.z)
            ),
        );
    }
    if let Some([x, y, z]) = facts.cells {
        row(
            &mut numerics,
            "cells",
            &format!("{x} × {y} × {z} = {:.3} million", (x * y * z) as f64 / 1e6),
        );
    }
    if facts.single_precision {
        row(&mut numerics, "fields", "single precision");
    }
    if let Some(cell) = facts.cell() {
        row(
            &mut numerics,
            "cell edge *h*",
            &format!("{} mm", short(1e3 * cell)),
        );
        if let Some(diameter) = facts.diameter() {
            row(
                &mut numerics,
                "cells per diameter *d*/*h*",
                &short(diameter / cell),
            );
        }
    }
    if let Some(faces) = &facts.boundaries {
        for (axis, [lower, upper]) in ["x", "y", "z"].iter().zip(faces) {
            let text = if lower == upper {
                literal(lower)
            } else {
                format!("{} below, {} above", literal(lower), literal(upper))
            };
            row(&mut numerics, &format!("faces in *{axis}*"), &text);
        }
    }
    if let Some(scheme) = &facts.scheme {
        row(&mut numerics, "coupling", &literal(scheme));
    }
    row(
        &mut numerics,
        "simulated time",
        &format!("{} s", short(story.end)),
    );
    if let Some(scales) = story.scales {
        row(
            &mut numerics,
            "simulated time *t* √(*g*/*d*)",
            &short(story.end / scales.time()),
        );
    }
    let of_summary = |name: &str| run.summary.as_ref()?.get(name)?.as_f64();
    if let Some(steps) = of_summary("steps") {
        row(&mut numerics, "steps", &format!("{steps}"));
    }
    if let Some(wall) = of_summary("wall_s") {
        row(&mut numerics, "wall time", &duration(wall));
    }
    if let Some(divergence) = of_summary("max_divergence") {
        row(
            &mut numerics,
            "largest divergence after projection",
            &format!("{} 1/s", short(divergence)),
        );
    }
    format!(
        "<div class=\"pair\">\n<div>{}</div>\n<div>{}</div>\n</div>\n",
        table(&physics),
        table(&numerics)
    )
}

/// One row for each kind of grain, called by its number or, where there are several, by how many
/// they are.
fn grain_rows(out: &mut String, run: &RunFolder) {
    let mut kinds: Vec<(String, Vec<usize>)> = Vec::new();
    for (index, grain) in run.facts.grains.iter().enumerate() {
        let mut text = literal(grain.shape.as_deref().unwrap_or("shape not known"));
        if let Some(diameter) = grain.diameter {
            text.push_str(&format!(", *d* = {} mm", short(1e3 * diameter)));
        }
        if let Some(density) = grain.density {
            text.push_str(&format!(", *ρ*_{{p}} = {} kg/m^{{3}}", short(density)));
        }
        match kinds.iter_mut().find(|(kind, _)| *kind == text) {
            Some((_, members)) => members.push(index),
            None => kinds.push((text, vec![index])),
        }
    }
    let rest = kinds.len().saturating_sub(6);
    for (text, members) in kinds.iter().take(6) {
        let name = match members[..] {
            [one] => format!("grain {one}"),
            _ => format!("{} grains", members.len()),
        };
        row(out, &name, text);
    }
    if rest > 0 {
        row(
            out,
            "grains",
            &format!("and {rest} more kinds; see case.resolved.toml"),
        );
    }
}

/// What happened.
pub fn events(run: &RunFolder, story: &Story) -> String {
    let (label, factor) = story.time_axis();
    let scaled = factor != 1.0;
    let mut out =
        String::from("<div class=\"scroll\"><table><thead><tr><th class=\"number\">time [s]</th>");
    if scaled {
        out.push_str(&format!(
            "<th class=\"number\">{}</th>",
            html(label.split("  ").next().unwrap_or(label))
        ));
    }
    out.push_str("<th>event</th><th>grains</th><th>details</th></tr></thead><tbody>\n");
    for event in run.events.iter().take(EVENTS) {
        out.push_str(&format!(
            "<tr><td class=\"number\">{}</td>",
            html(&precise(event.time))
        ));
        if scaled {
            out.push_str(&format!(
                "<td class=\"number\">{}</td>",
                html(&precise(event.time * factor))
            ));
        }
        let grains: Vec<String> = event.grains.iter().map(usize::to_string).collect();
        let details: Vec<String> = details(event).iter().map(|text| html(text)).collect();
        out.push_str(&format!(
            "<td>{}</td><td>{}</td><td>{}</td></tr>\n",
            escape(event.kind.name()),
            grains.join(", "),
            details.join("; ")
        ));
    }
    out.push_str("</tbody></table></div>\n");
    if run.events.len() > EVENTS {
        out.push_str(&format!(
            "<p>and {} more in <code>events.jsonl</code>.</p>\n",
            run.events.len() - EVENTS
        ));
    }
    out
}

/// Five digits for times that one may want to compare.
fn precise(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (4 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.digits$}")
}

/// A detail of an event with its unit, where that is known; else as it stands.
fn details(event: &Event) -> Vec<String> {
    let confirmed = format!("certain at {} s", precise(event.confirmed));
    let gap = event.gap.map(|gap| format!("gap {} mm", short(1e3 * gap)));
    let tilt =
        (event.tilt).map(|tilt| format!("pair {}° from the vertical", short(tilt.to_degrees())));
    [Some(confirmed), gap, tilt].into_iter().flatten().collect()
}

/// Who made this, with what.
pub fn provenance(run: &RunFolder) -> String {
    let mut rows = String::new();
    match &run.provenance {
        Some(value) => flatten(&mut rows, "", value, 0),
        None => row(&mut rows, "provenance", "provenance.json is missing"),
    }
    let known = "case.resolved.toml runs again as it is; grains.csv and diagnostics.csv hold the numbers of the curves; run.pvd opens in ParaView";
    row(&mut rows, "files", &literal(known));
    table(&rows)
}

fn flatten(out: &mut String, name: &str, value: &Value, depth: usize) {
    let nested = |key: &str| {
        if name.is_empty() {
            key.to_owned()
        } else {
            format!("{name}, {key}")
        }
    };
    let plain = |value: &Value| !value.is_object() && !value.is_array();
    match value {
        Value::Null => code_row(out, name, "not known"),
        Value::Object(map) if depth < 4 => {
            map.iter()
                .for_each(|(key, value)| flatten(out, &nested(key), value, depth + 1));
        }
        Value::Array(list) if list.iter().all(plain) => {
            let texts: Vec<String> = list.iter().map(text).collect();
            code_row(out, name, &texts.join(" "));
        }
        Value::Array(list) if depth < 4 => {
            let (first, rest) = list.split_at(list.len().min(SESSIONS));
            for (i, value) in first.iter().enumerate() {
                let name = format!("{} {}", name.trim_end_matches('s'), i + 1);
                flatten(out, &name, value, depth + 1);
            }
            if !rest.is_empty() {
                code_row(out, name, &format!("and {} more", rest.len()));
            }
        }
        other => code_row(out, name, &text(other)),
    }
}

fn text(value: &Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), str::to_owned)
}

fn code_row(out: &mut String, name: &str, value: &str) {
    let name = escape(&name.replace('_', " "));
    out.push_str(&format!(
        "<tr><th scope=\"row\">{name}</th><td><code>{}</code></td></tr>\n",
        escape(value)
    ));
}

/// A wall time for people.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{} s", short(s)),
        s if s < 7200.0 => format!(
            "{:.0} min {:02.0} s",
            (s / 60.0).floor(),
            (s % 60.0).floor()
        ),
        s => format!(
            "{:.0} h {:02.0} min",
            (s / 3600.0).floor(),
            ((s % 3600.0) / 60.0).floor()
        ),
    }
}

#[cfg(test)]
mod tests;
