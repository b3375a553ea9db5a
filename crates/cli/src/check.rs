//! `grainwake check`.

use grainwake_run::case::Case;
use grainwake_run::case::estimate::Estimate;
use grainwake_run::case::readable::quantity;
use grainwake_solver::dem::{ContactLawKind, Grain};

use crate::args::CheckArgs;
use crate::exit::Exit;
use crate::progress::{clock, count};
use crate::{kind, print, threads};

/// Checks a case and prints what to expect of it.
pub fn check(args: &CheckArgs) -> Result<(), Exit> {
    let case = kind::case(&args.case, &args.set)?;
    let threads = threads::resolve(args.threads.unwrap_or(case.threads));
    let estimate = Estimate::of(&case, threads);
    if args.json {
        return print(&serde_json::to_string(&estimate)?);
    }
    print(&table(&case, &estimate, threads))
}

/// What may spoil the results, a line each.
pub fn warnings(e: &Estimate) -> impl Iterator<Item = String> {
    e.warnings.iter().map(|w| format!("warning: {w}"))
}

fn table(case: &Case, e: &Estimate, threads: usize) -> String {
    let mesh = &case.setup.mesh;
    let extent = mesh.extent() * 1e3;
    let mut rows: Vec<(&str, String)> = Vec::new();
    if !case.title.is_empty() {
        rows.push(("case", case.title.clone()));
    }
    rows.push((
        "box",
        format!("{:.4} x {:.4} x {:.4} mm", extent.x, extent.y, extent.z),
    ));
    if case.setup.fluid.is_some() {
        rows.push((
            "cells",
            format!(
                "{} x {} x {} = {}",
                mesh.cells[0], mesh.cells[1], mesh.cells[2], e.cells
            ),
        ));
    } else {
        rows.push(("fluid", "none (contact only)".into()));
    }
    rows.push(("grains", grains(case)));
    let number = |name, value: Option<f64>, unit: &str| {
        value.map(|v| (name, format!("{v:.4} {unit}").trim_end().to_string()))
    };
    rows.extend(number("cells per diameter", e.cells_per_diameter, ""));
    // Where the grains differ it is that of one of them.
    let which = e.galileo_grain.filter(|_| differ(case));
    let which = which.map_or(String::new(), |i| format!("(grain {i}, the largest)"));
    rows.extend(number("Galileo number", e.galileo, &which));
    rows.extend(number(
        "expected Reynolds number",
        e.reynolds,
        "(equal-volume sphere)",
    ));
    rows.extend(number(
        "expected speed",
        e.settling_speed_m_per_s.map(|v| 1e3 * v),
        "mm/s (settling or rising)",
    ));
    rows.extend(number("blockage", e.blockage.map(|b| 100.0 * b), "%"));
    rows.push(match case.setup.contact.law {
        ContactLawKind::Linear => (
            "contact stiffness",
            quantity(case.setup.contact.normal_stiffness, "N/m"),
        ),
        ContactLawKind::HertzMindlin => ("contact law", "Hertz-Mindlin".into()),
    });
    if let (Some(time), Some(substeps)) = (e.contact_time_s, e.contact_substeps) {
        rows.push((
            "contact time",
            format!("{} ({substeps:.0} sub-steps a step)", quantity(time, "s")),
        ));
    }
    rows.push(("time step", quantity(e.time_step_s, "s")));
    rows.push(("steps", format!("{} to t = {} s", e.steps, case.plan.end)));
    rows.push(("memory", format!("{:.0} MB", e.memory_bytes as f64 / 1e6)));
    rows.push((
        "wall time",
        format!("about {} on {}", clock(e.wall_s), count(threads, "thread")),
    ));
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut lines: Vec<String> = rows
        .iter()
        .map(|(name, value)| format!("{name:width$}  {value}"))
        .collect();
    lines.extend(warnings(e));
    if e.warnings.is_empty() {
        lines.push("no warnings".into());
    }
    lines.join("\n")
}

/// Whether the grains have different diameters or densities.
fn differ(case: &Case) -> bool {
    let of = |pick: &dyn Fn(&Grain) -> f64| {
        let values = case.setup.grains.iter().map(pick);
        values.fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)))
    };
    let sizes = of(&|g| g.shape.equivalent_diameter());
    let densities = of(&|g| g.density);
    [sizes, densities].iter().any(|(a, b)| b - a > 1e-9 * b)
}

fn grains(case: &Case) -> String {
    let diameters = case
        .setup
        .grains
        .iter()
        .map(|g| 1e3 * g.shape.equivalent_diameter());
    let (least, most) = diameters.fold((f64::INFINITY, 0.0_f64), |(a, b), d| (a.min(d), b.max(d)));
    match case.setup.grains.len() {
        0 => "none".into(),
        n if most - least < 1e-9 * most => format!("{n}, equivalent diameter {most:.4} mm"),
        n => format!("{n}, equivalent diameters {least:.4} to {most:.4} mm"),
    }
}
