//! Tables of the report page: parameters, events, provenance.

use grainwake_formats::events::Event;
use grainwake_plot::equal_aspect::length_unit;
use grainwake_plot::literal;
use maud::{Markup, html};
use serde_json::Value;

use crate::features::{RunFeatures, galileo, length, short};
use crate::html::{label, number_column, properties, table, text_column};
use crate::run_folder::{Facts, RunFolder};

/// Largest number of events in the table.
const EVENTS: usize = 100;
/// Largest number of entries of a list in the provenance.
const SESSIONS: usize = 8;
/// Largest number of kinds of grains in the table of parameters.
const GRAIN_KINDS: usize = 6;

/// Names and values of a table of properties.
#[derive(Default)]
struct Rows(Vec<(Markup, Markup)>);

impl Rows {
    /// Adds a row, in label markup, if the value is known.
    fn add(&mut self, name: &str, value: impl Into<Option<String>>) {
        if let Some(value) = value.into() {
            self.0.push((label(name), label(&value)));
        }
    }

    /// Adds a row with a value, in label markup, in the font of code.
    fn add_code(&mut self, name: &str, value: &str) {
        let name = name.replace('_', " ");
        self.0.push((html! { (name) }, html! { code { (label(value)) } }));
    }
}

/// Returns two tables side by side: physics and numerics.
pub fn parameters(run: &RunFolder, features: &RunFeatures) -> Markup {
    html! {
        div.pair {
            div { (properties(&physics(run, features).0)) }
            div { (properties(&numerics(run, features).0)) }
        }
    }
}

fn physics(run: &RunFolder, features: &RunFeatures) -> Rows {
    let facts = &run.facts;
    let (diameter, viscosity) = (facts.diameter(), facts.viscosity);
    let mut rows = Rows::default();
    let with_unit = |unit: &'static str| move |value: f64| format!("{} {unit}", short(value));
    rows.add("fluid density *ρ*_{f}", facts.fluid_density.map(with_unit("kg/m^{3}")));
    rows.add("kinematic viscosity *ν*", viscosity.map(with_unit("m^{2}/s")));
    let gravity = facts.gravity.map(|g| g.to_array().map(short).join(", "));
    rows.add("gravity *g*", gravity.map(|g| format!("({g}) m/s^{{2}}")));
    add_grains(&mut rows, run);
    let ratio = facts.density_ratio();
    rows.add("density ratio *ρ*_{p}/*ρ*_{f}", ratio.map(short));
    let first = facts.grains.first().map(|g| (g.diameter, g.density));
    let differ = facts.grains.iter().any(|g| Some((g.diameter, g.density)) != first);
    let suffix = if differ { ", of the mean diameter and density" } else { "" };
    let name = format!("Galileo number √(|*ρ*_{{p}}/*ρ*_{{f}} − 1| *g* *d*^{{3}}) / *ν*{suffix}");
    let known = features.scales.zip(ratio).zip(viscosity);
    rows.add(&name, known.map(|((scales, ratio), nu)| short(galileo(scales, ratio, nu))));
    let velocities = run.grains.iter().flat_map(|h| &h.velocity);
    let speeds = velocities.filter_map(|v| facts.relative_speed(*v));
    let fastest = speeds.filter(|v| v.is_finite()).reduce(f64::max);
    let fastest = match run.has_curves() || facts.has_inflow() {
        true => fastest,
        false => run.peak_settling_speed(),
    };
    let fastest = fastest.filter(|speed| features.is_motion(run, *speed));
    let known = fastest.zip(diameter).zip(viscosity);
    let relative = if facts.has_inflow() { " relative to the inflow" } else { "" };
    let symbol = facts.relative_speed_symbol();
    let name = format!("Reynolds number at the largest speed{relative}, {symbol} *d* / *ν*");
    rows.add(&name, known.map(|((speed, d), nu)| short(speed * d / nu)));
    let (time, velocity) = features.scales.map(|s| (s.time(), s.velocity())).unzip();
    rows.add("time scale √(*d*/*g*)", time.map(with_unit("s")));
    rows.add("velocity scale √(*d* *g*)", velocity.map(with_unit("m/s")));
    rows
}

fn numerics(run: &RunFolder, features: &RunFeatures) -> Rows {
    let facts = &run.facts;
    let mut rows = Rows::default();
    let size = facts.size.map(|size| {
        let (unit, factor) = length_unit(size.max_element());
        let edges = (factor * size).to_array().map(short);
        format!("{} {unit}", edges.join(" × "))
    });
    rows.add("box", size);
    let cells = |[x, y, z]: [usize; 3]| {
        format!("{x} × {y} × {z} = {:.3} million", (x * y * z) as f64 / 1e6)
    };
    rows.add("cells", facts.cells.map(cells));
    if facts.single_precision {
        rows.add("fields", "single precision".to_owned());
    }
    let cell = facts.cell();
    rows.add("cell edge *h*", cell.map(length));
    let resolution = facts.diameter().zip(cell).map(|(d, h)| d / h);
    rows.add("cells per diameter *d*/*h*", resolution.map(short));
    if let Some(ratio) = facts.refinement {
        let finer = resolution.map(|n| format!(", {} cells per diameter", short(ratio as f64 * n)));
        let text = format!("cell edge *h*/{ratio}{}", finer.unwrap_or_default());
        rows.add("refined box around the grains", text);
    }
    for (axis, [lower, upper]) in ["x", "y", "z"].iter().zip(facts.boundaries.iter().flatten()) {
        let text = match lower == upper {
            true => literal(lower),
            false => format!("{} below, {} above", literal(lower), literal(upper)),
        };
        rows.add(&format!("faces in *{axis}*"), text);
    }
    if !facts.grains.is_empty() {
        rows.add("coupling", facts.scheme.as_deref().map(literal));
        rows.add("contact", contact(run));
    }
    rows.add("simulated time", format!("{} s", short(features.end)));
    let scaled = features.scales.map(|scales| short(features.end / scales.time()));
    rows.add("simulated time *t* √(*g*/*d*)", scaled);
    rows.add("steps", run.summary_number("steps").map(|steps| steps.to_string()));
    rows.add("wall time", run.summary_number("wall_s").map(duration));
    rows.add("CPU time of all threads", run.summary_number("cpu_s").map(duration));
    rows.add("scales of the columns ending in _scaled", table_scales(run));
    let divergence = run.summary_number("max_divergence").filter(|_| facts.fluid_density.is_some());
    let divergence = divergence.map(|d| format!("{} 1/s", short(d)));
    rows.add("largest divergence after projection", divergence);
    rows
}

/// Returns the contact law and its parameters: "linear, stiffness 100 N/m, friction 0.5".
fn contact(run: &RunFolder) -> Option<String> {
    let Facts { contact, contact_law, .. } = &run.facts;
    let mut parts = vec![contact_law.clone().unwrap_or_else(|| "linear".into())];
    for (key, name, unit) in [
        ("stiffness", "stiffness", " N/m"),
        ("friction", "friction", ""),
        ("wall_friction", "wall friction", ""),
        ("restitution", "restitution", ""),
        ("lubrication_gap", "lubrication below", "m"),
        ("roughness", "roughness", "m"),
        ("global_damping", "global damping", " 1/s"),
    ] {
        let is_off = |value: f64| value == 0.0 && matches!(unit, "m" | " 1/s");
        if let Some(value) = contact.get(key).copied().filter(|value| !is_off(*value)) {
            parts.push(match unit {
                "m" => format!("{name} {}", length(value)),
                _ => format!("{name} {}{unit}", short(value)),
            });
        }
    }
    (!contact.is_empty()).then(|| parts.join(", "))
}

/// Returns the scales of the dimensionless columns of the tables, if they have them.
fn table_scales(run: &RunFolder) -> Option<String> {
    let scales = run.summary.as_ref()?.get("scales")?;
    let number = |name: &str| scales.get(name)?.as_f64().map(short);
    Some(format!(
        "{} m, {} s, {} m/s, {} kg/m^{{3}}",
        number("length_m")?,
        number("time_s")?,
        number("velocity_m_per_s")?,
        number("density_kg_per_m3")?
    ))
}

/// Adds one row per kind of grain, with the number of the grain or the count of equal grains.
fn add_grains(rows: &mut Rows, run: &RunFolder) {
    let mut kinds: Vec<(String, Vec<usize>)> = Vec::new();
    for (index, grain) in run.facts.grains.iter().enumerate() {
        let mut text = literal(grain.shape.as_deref().unwrap_or("shape not known"));
        if let Some(diameter) = grain.diameter {
            text += &format!(", *d* = {}", length(diameter));
        }
        if let Some(density) = grain.density {
            text += &format!(", *ρ*_{{p}} = {} kg/m^{{3}}", short(density));
        }
        match kinds.iter_mut().find(|(kind, _)| *kind == text) {
            Some((_, members)) => members.push(index),
            None => kinds.push((text, vec![index])),
        }
    }
    let rest = kinds.len().saturating_sub(GRAIN_KINDS);
    for (text, members) in kinds.into_iter().take(GRAIN_KINDS) {
        let name = match members[..] {
            [one] => format!("grain {one}"),
            _ => format!("{} grains", members.len()),
        };
        rows.add(&name, text);
    }
    if rest > 0 {
        rows.add("grains", format!("and {rest} more kinds; see case.resolved.toml"));
    }
}

/// Returns the label of the dimensionless time and its value for one second; none if the figures
/// show seconds.
pub fn scaled_time(features: &RunFeatures) -> Option<(&'static str, f64)> {
    let (label, factor) = features.time_axis();
    let label = label.split("  ").next().unwrap_or(label);
    (factor != 1.0).then_some((label, factor))
}

/// Returns the table of events.
pub fn events(run: &RunFolder, features: &RunFeatures) -> Markup {
    let scaled = scaled_time(features);
    let mut columns = vec![number_column("time [s]")];
    columns.extend(scaled.map(|(label, _)| number_column(label)));
    columns.extend(["event", "grains", "details"].map(text_column));
    let row = |event: &Event| {
        let mut row = vec![label(&precise(event.time))];
        row.extend(scaled.map(|(_, factor)| label(&precise(event.time * factor))));
        let grains: Vec<String> = event.grains.iter().map(usize::to_string).collect();
        row.push(html! { (event.kind.label()) });
        row.push(html! { (grains.join(", ")) });
        row.push(label(&details(event).join("; ")));
        row
    };
    html! {
        (table(&columns, run.events.iter().take(EVENTS).map(row)))
        @if run.events.len() > EVENTS {
            p { "and " (run.events.len() - EVENTS) " more in " code { "events.jsonl" } "." }
        }
    }
}

/// Returns five significant digits, so that times of events can be compared.
fn precise(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (4 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.digits$}")
}

/// Returns the details of an event, in label markup.
fn details(event: &Event) -> Vec<String> {
    let confirmed = format!("certain at {} s", precise(event.confirmed));
    let gap = event.gap.map(|gap| format!("gap {}", length(gap)));
    let tilt = event.tilt.map(|tilt| short(tilt.to_degrees()));
    let tilt = tilt.map(|degrees| format!("pair {degrees}° from the vertical"));
    let wall = event.wall.as_ref().map(|wall| format!("{wall} wall"));
    [wall, Some(confirmed), gap, tilt].into_iter().flatten().collect()
}

/// Returns the provenance of the run and the files for further use.
pub fn provenance(run: &RunFolder) -> Markup {
    let mut rows = Rows::default();
    match &run.provenance {
        Some(value) => flatten(&mut rows, "", value, 0),
        None => rows.add("provenance", "provenance.json is missing".to_owned()),
    }
    let files = "case.resolved.toml can be run as it is; grains.csv and diagnostics.csv hold the \
                 values of the curves; run.pvd opens in ParaView";
    rows.add("files", literal(files));
    properties(&rows.0)
}

/// Adds the entries of a JSON value as rows; nested names are joined by commas.
fn flatten(rows: &mut Rows, name: &str, value: &Value, depth: usize) {
    let simple = |value: &Value| !value.is_object() && !value.is_array();
    match value {
        Value::Null => rows.add_code(name, "not known"),
        Value::Object(map) if depth < 4 => {
            for (key, value) in map {
                let nested = match name {
                    "" => key.clone(),
                    _ => format!("{name}, {key}"),
                };
                flatten(rows, &nested, value, depth + 1);
            }
        }
        Value::Array(list) if list.iter().all(simple) => {
            let texts: Vec<String> = list.iter().map(text).collect();
            rows.add_code(name, &literal(&texts.join(" ")));
        }
        Value::Array(list) if name.ends_with("passes") => {
            let pass = |pass: &Value| {
                let name = literal(&pass.get("name").map(text).unwrap_or_default());
                let wall = pass.get("wall_s").and_then(Value::as_f64);
                format!("{name} {}", wall.map_or("not known".to_owned(), duration))
            };
            rows.add_code(name, &list.iter().map(pass).collect::<Vec<_>>().join(", "));
        }
        Value::Array(list) if depth < 4 => {
            for (i, value) in list.iter().take(SESSIONS).enumerate() {
                let name = format!("{} {}", name.trim_end_matches('s'), i + 1);
                flatten(rows, &name, value, depth + 1);
            }
            if list.len() > SESSIONS {
                rows.add_code(name, &format!("and {} more", list.len() - SESSIONS));
            }
        }
        other => rows.add_code(name, &literal(&text(other))),
    }
}

fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Returns a wall time in seconds, minutes or hours, in label markup.
pub fn duration(seconds: f64) -> String {
    let parts =
        |unit: f64, small: f64| ((seconds / unit).floor(), (seconds % unit / small).floor());
    match seconds {
        s if s < 120.0 => format!("{} s", short(s)),
        s if s < 7200.0 => {
            let (minutes, seconds) = parts(60.0, 1.0);
            format!("{minutes:.0} min {seconds:02.0} s")
        }
        _ => {
            let (hours, minutes) = parts(3600.0, 60.0);
            format!("{hours:.0} h {minutes:02.0} min")
        }
    }
}

#[cfg(test)]
mod tests;
