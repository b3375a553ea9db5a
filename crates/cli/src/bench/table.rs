//! Tables of measurements.

use super::measure::{Counts, Measured, Times};
use crate::progress::count;

/// Returns the table of one measurement: per cell with fluid, per step without.
pub fn one(m: &Measured) -> String {
    let (grains, threads) = (count(m.grains, "grain"), count(m.threads, "thread"));
    let steps = count(m.steps as usize, "step");
    let end = format!("{grains}, {threads}, {steps}, {}", m.instructions);
    let (what, unit, scale) = match &m.grid {
        Some(grid) => {
            let [nx, ny, nz] = grid.cells;
            let bytes = m.precision.bytes();
            let what = format!("{nx} x {ny} x {nz} cells of {bytes} bytes a number");
            (what, "ns per cell and step", 1e9 / grid.cells.iter().product::<usize>() as f64)
        }
        // A step of a few grains takes microseconds.
        None if m.seconds_per_step.median < 1e-4 => ("dry".into(), "us per step", 1e6),
        None => ("dry".into(), "ms per step", 1e3),
    };
    let row = |name: &str, times: &Times, limit: Option<f64>| {
        let cpu = times.cpu.map_or("-".into(), |cpu| format!("{:.2}", scale * cpu));
        let limit = limit.map_or(String::new(), |ns| format!("{ns:.2}"));
        let (minimum, median) = (scale * times.minimum, scale * times.median);
        format!("{name:12}{minimum:9.2}{median:9.2}{cpu:>9}{limit:>9}").trim_end().to_owned()
    };
    let limit = m.grid.as_ref().map(|grid| grid.limit_ns_per_cell_step);
    let last = if limit.is_some() { "limit" } else { "" };
    let header = format!("{:12}{:>9}{:>9}{:>9}{last:>9}", "", "minimum", "median", "CPU");
    let mut lines = vec![
        format!("{what}, {end}"),
        format!("{}   {unit}", header.trim_end()),
        row("step", &m.seconds_per_step, limit),
    ];
    for pass in &m.passes {
        let name = format!("  {}", pass.name);
        lines.push(row(&name, &pass.seconds_per_step, pass.limit_ns_per_cell_step));
    }
    let per_step = |name: &str, counts: &Counts| {
        format!("{name:14}{:7.1} per step, at most {}", counts.mean, counts.largest)
    };
    lines.push(per_step("sub-steps", &m.substeps_per_step));
    lines.push(per_step("contact pairs", &m.contact_pairs));
    if let Some(grid) = &m.grid {
        lines.push(format!("memory        {:7.1} bytes per cell", grid.bytes_per_cell));
        lines.push(format!(
            "triad         {:7.2} GB/s; limit: {:.0} bytes per cell at that bandwidth",
            grid.triad_gb_per_s, grid.traffic_bytes_per_cell
        ));
        lines.push(format!("ratio         {:7.2} (median over limit)", grid.ratio_to_limit));
    }
    lines.join("\n")
}

/// Table with one line per size; the last column is the ratio to the preceding cube.
pub fn scaling(all: &[Measured]) -> String {
    let mut lines = vec![format!(
        "{:>5} {:>10} {:>9} {:>9} {:>9} {:>7} {:>7} {:>9}",
        "edge", "ns/cell", "minimum", "CPU", "columns", "bytes", "ratio", "to before"
    )];
    let mut before = None;
    for m in all {
        let Some(grid) = &m.grid else { continue };
        let columns = m.passes.iter().find(|p| p.name == "columns");
        let per_cell = 1e9 / grid.cells.iter().product::<usize>() as f64;
        let cpu = m.seconds_per_step.cpu;
        lines.push(format!(
            "{:5} {:10.2} {:9.2} {:>9} {:9.2} {:7.1} {:7.2} {:9.2}",
            grid.cells[0],
            grid.ns_per_cell_step,
            per_cell * m.seconds_per_step.minimum,
            cpu.map_or("-".into(), |cpu| format!("{:.2}", per_cell * cpu)),
            columns.and_then(|p| p.ns_per_cell_step).unwrap_or(0.0),
            grid.bytes_per_cell,
            grid.ratio_to_limit,
            grid.ns_per_cell_step / before.unwrap_or(grid.ns_per_cell_step)
        ));
        before = Some(grid.ns_per_cell_step);
    }
    lines.join("\n")
}
