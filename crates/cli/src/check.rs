//! `grainwake check`.

use grainwake_run::case::Case;
use grainwake_run::case::{Estimate, cells_for_drag_error, drag_error_text};
use grainwake_run::number_format::{number, quantity, size, vector};
use grainwake_run::{Probe, ProbePlace, admit_memory};
use grainwake_solver::dem::{ContactLawKind, Grain};

use crate::args::CheckArgs;
use crate::exit::Exit;
use crate::out::columns;
use crate::progress::{clock, count};
use crate::{kind, print, threads};

/// Checks a case and prints its derived numbers, cost and warnings.
pub fn check(args: &CheckArgs) -> Result<(), Exit> {
    let case = kind::case(&args.case, &args.overrides)?;
    let threads = threads::resolve(args.threads.unwrap_or(case.threads), false);
    let estimate = case.estimate(threads);
    if args.json {
        print(&serde_json::to_string(&estimate)?)?;
    } else {
        print(&table(&case, &estimate, threads))?;
    }
    admit_memory(&case.setup, Some(&case.plan)).map_err(Exit::from)
}

/// Returns one line per warning.
pub fn warnings(e: &Estimate) -> impl Iterator<Item = String> {
    e.warnings.iter().map(|w| format!("warning: {w}"))
}

fn table(case: &Case, e: &Estimate, threads: usize) -> String {
    let mesh = &case.setup.mesh;
    let (unit, factor) = length_unit(mesh.extent().max_element());
    let [x, y, z] = (mesh.extent() * factor).to_array().map(short);
    let mut rows: Vec<(&str, String)> = Vec::new();
    if !case.title.is_empty() {
        rows.push(("case", case.title.clone()));
    }
    rows.push(("box", format!("{x} x {y} x {z} {unit}")));
    let [nx, ny, nz] = mesh.cells;
    rows.push(match case.setup.fluid {
        Some(_) => ("cells", format!("{nx} x {ny} x {nz} = {}", e.cells)),
        None => ("fluid", "none (contact only)".into()),
    });
    if let Some(refined) = case.setup.refined_mesh() {
        let ([nx, ny, nz], count) = (refined.cells, refined.cell_count());
        rows.push(("refined box", format!("{nx} x {ny} x {nz} = {count} of half the size")));
    }
    rows.push(("grains", grains(case)));
    let with_unit = |name, value: Option<f64>, unit: &str| {
        value.map(|v| (name, format!("{} {unit}", short(v)).trim_end().to_string()))
    };
    rows.extend(with_unit("cells per diameter", e.cells_per_diameter, ""));
    let thin = |(n, thin): &(f64, f64)| *thin < 0.95 * n;
    let shortest = e.cells_per_diameter.zip(e.cells_across_shortest_axis).filter(thin);
    rows.extend(with_unit("cells across shortest axis", shortest.map(|(_, thin)| thin), ""));
    if let Some((error, reynolds)) = e.drag_error.zip(e.largest_reynolds()) {
        let [five, two] = [0.05, 0.02].map(|error| cells_for_drag_error(error, reynolds));
        // The text of an error beyond the formula is no limit.
        let text = match drag_error_text(error, 1) {
            more if more.starts_with("more") => more,
            limit => format!("at most {limit}"),
        };
        let looser = if five < two { format!("5 % from {five} cells, ") } else { String::new() };
        let text = format!("{text}; at most {looser}2 % from {two} cells");
        rows.push(("error of the drag", text));
    }
    // For unequal grains the number refers to one of them.
    let which = e.galileo_grain.filter(|_| differ(case));
    let which = which.map_or(String::new(), |i| format!("(grain {i}, the largest)"));
    rows.extend(with_unit("Galileo number", e.galileo, &which));
    let sphere = "(sphere of equal volume)";
    rows.extend(with_unit("expected Reynolds number", e.reynolds, sphere));
    let faster = e.start_reynolds.filter(|re| *re > e.reynolds.unwrap_or(0.0));
    rows.extend(with_unit("Reynolds number at the start", faster, ""));
    let speed = e.settling_speed_m_per_s;
    let (unit, factor) = if speed.is_some_and(|v| v >= 1.0) { ("m/s", 1.0) } else { ("mm/s", 1e3) };
    let unit = format!("{unit} (settling or rising)");
    rows.extend(with_unit("expected speed", speed.map(|v| factor * v), &unit));
    rows.extend(with_unit("blockage", e.blockage.map(|b| 100.0 * b), "%"));
    let contact = &case.setup.contact;
    rows.push(match contact.law {
        ContactLawKind::Linear => ("contact stiffness", quantity(contact.normal_stiffness, "N/m")),
        ContactLawKind::HertzMindlin => ("contact law", "Hertz-Mindlin".into()),
    });
    if let (Some(time), Some(substeps)) = (e.contact_time_s, e.contact_substeps) {
        let time = quantity(time, "s");
        rows.push(("contact time", format!("{time} ({substeps:.0} sub-steps per time step)")));
    }
    rows.push(("time step", quantity(e.time_step_s, "s")));
    rows.push(("steps", format!("{} to t = {}", e.steps, end(case, e))));
    rows.extend(case.plan.probes.iter().map(|p| ("probe", probe(p))));
    let free =
        e.memory_free_bytes.map_or(String::new(), |free| format!(" ({} are free)", size(free)));
    rows.push(("memory", format!("{}{free}", size(e.memory_bytes))));
    let checkpoints = size(e.checkpoint_bytes);
    let disk = format!("{}, and {checkpoints} of checkpoints", size(e.disk_bytes));
    rows.push(("disk space", disk));
    let (wall, threads) = (clock(e.wall_s), count(threads, "thread"));
    rows.push(("wall time", format!("about {wall} on {threads}")));
    let mut lines = vec![columns(&rows)];
    lines.extend(warnings(e));
    if e.warnings.is_empty() {
        lines.push("no warnings".into());
    }
    lines.join("\n")
}

/// Describes the expected end of a run.
fn end(case: &Case, e: &Estimate) -> String {
    if e.expected_end_s < case.plan.end {
        format!("{} (expected landing)", quantity(e.expected_end_s, "s"))
    } else {
        format!("{} s", case.plan.end)
    }
}

/// Describes a probe: place, interval and file.
fn probe(probe: &Probe) -> String {
    let place = match &probe.place {
        ProbePlace::Points(points) => match points[..] {
            [p] => format!("point {}", vector(p, "m")),
            _ => format!("{} points", points.len()),
        },
        ProbePlace::Plane { axis, at } => {
            format!("plane {} = {}", ["x", "y", "z"][*axis], quantity(*at, "m"))
        }
    };
    let every = match probe.every {
        0.0 => "turned off".into(),
        every => format!("every {}", quantity(every, "s")),
    };
    format!("{place}, {every} ({})", probe.file())
}

/// Formats a number with four significant digits.
fn short(value: f64) -> String {
    number(format!("{value:.3e}").parse().unwrap_or(value))
}

/// Returns the unit of lengths up to `size` [m], and the number of units per metre.
fn length_unit(size: f64) -> (&'static str, f64) {
    if size < 1.0 { ("mm", 1e3) } else { ("m", 1.0) }
}

/// Returns the least and the largest value of a positive property of the grains.
fn range(case: &Case, property: fn(&Grain) -> f64) -> (f64, f64) {
    let values = case.setup.grains.iter().map(property);
    values.fold((f64::INFINITY, 0.0), |(a, b), v| (a.min(v), b.max(v)))
}

/// Returns whether the grains have different diameters or densities.
fn differ(case: &Case) -> bool {
    let ranges = [range(case, |g| g.shape.equivalent_diameter()), range(case, |g| g.density)];
    ranges.iter().any(|(a, b)| b - a > 1e-9 * b)
}

fn grains(case: &Case) -> String {
    let (least, most) = range(case, |g| g.shape.equivalent_diameter());
    let (unit, factor) = length_unit(most);
    let (least, most) = (factor * least, factor * most);
    match case.setup.grains.len() {
        0 => "none".into(),
        n if most - least < 1e-9 * most => {
            format!("{n}, equivalent diameter {} {unit}", short(most))
        }
        n => {
            let [least, most] = [least, most].map(short);
            format!("{n}, equivalent diameters {least} to {most} {unit}")
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Table of a sphere that settles, with the given lengths and viscosity.
    fn shown(scale: f64, cells: u32, viscosity: &str) -> String {
        let size = 10.0 * scale;
        let text = format!(
            "[fluid]\ndensity = 1000\nviscosity = \"{viscosity}\"\n[domain]\n\
             size = [{size}, {size}, {size}]\ncells = [{cells}, {cells}, {cells}]\n[[grain]]\n\
             shape = {{ kind = \"sphere\", diameter = {scale} }}\nnodes = 200\ndensity = 1100\n\
             position = [{0}, {0}, {0}]\n[time]\nend = \"1 s\"\n",
            5.0 * scale
        );
        let case = Case::parse(&text, "case.toml", Path::new("."), &[]).unwrap();
        table(&case, &case.estimate(1), 1)
    }

    #[test]
    fn the_error_of_the_drag_is_an_upper_limit_with_the_stricter_number_of_cells() {
        let slow = shown(2e-3, 80, "20 mPa s");
        assert!(slow.contains("at most 2.0 %; at most 2 % from 8 cells\n"), "{slow}");
        let fast = shown(4e-3, 80, "1 mPa s");
        assert!(fast.contains("at most 5 % from ") && fast.contains(", 2 % from "), "{fast}");
        assert!(!fast.contains("% expected"), "{fast}");
    }

    #[test]
    fn lengths_have_the_unit_of_their_size() {
        let metres = shown(1.5, 20, "2000 Pa s");
        assert!(metres.contains("15 x 15 x 15 m\n"), "{metres}");
        assert!(metres.contains("equivalent diameter 1.5 m\n"), "{metres}");
        assert!(shown(2e-3, 80, "20 mPa s").contains("20 x 20 x 20 mm"));
    }
}
