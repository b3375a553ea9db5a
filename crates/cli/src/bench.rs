//! `grainwake bench`: time and memory per cell, compared with the memory bandwidth.

mod case;

use std::time::Instant;

use grainwake_solver::immersed::Scheme;
use grainwake_solver::math::{InstructionSet, Precision, instructions, limit_instructions};
use grainwake_solver::sim::Simulation;
use rayon::prelude::*;
use serde::Serialize;

use crate::args::BenchArgs;
use crate::exit::{BAD_INPUT, Exit};
use crate::{print, threads};
use case::BenchCase;

/// Numbers per cell that each pass reads from and writes to memory (write-allocate traffic is not
/// counted, as in the triad):
///
/// - predict: reads u (3), the old tendency (3), p; writes the tendency (3) and u* (3);
/// - divergence: reads u* (3), writes the modes;
/// - columns: reads and writes the modes;
/// - correct: reads the modes, u* (3) and p; writes u (3) and p.
///
/// The passes cannot be merged: rigidity changes u* between the first two, every column needs all
/// planes of modes, and every plane needs all columns.
const TRAFFIC: [(&str, f64); 4] =
    [("predict", 13.0), ("divergence", 4.0), ("columns", 2.0), ("correct", 9.0)];
/// Cells along each edge of the cubes of `--scaling`: powers of two, round numbers, and primes.
const CUBES: [usize; 14] = [32, 48, 64, 67, 80, 96, 97, 100, 128, 131, 160, 192, 200, 256];
/// Smallest number of doubles in each array of the triad, 64 MiB. The three arrays are as large as
/// the fields, so that caches act alike, and large enough to hide the scheduling of threads.
const MIN_TRIAD_LENGTH: usize = 1 << 23;
const TRIAD_REPEATS: usize = 8;

/// Measurement of one case. The JSON names are stable.
#[derive(Debug, Serialize)]
struct Measured {
    cells: [usize; 3],
    grains: usize,
    threads: usize,
    precision: Precision,
    instructions: &'static str,
    steps: u64,
    /// Median over the steps.
    ns_per_cell_step: f64,
    bytes_per_cell: f64,
    traffic_bytes_per_cell: f64,
    triad_gb_per_s: f64,
    limit_ns_per_cell_step: f64,
    ratio_to_limit: f64,
    passes: Vec<Pass>,
}

/// Time of one pass.
#[derive(Debug, Serialize)]
struct Pass {
    name: &'static str,
    ns_per_cell_step: f64,
    /// Time at the memory bandwidth; none for passes that depend on the grains alone.
    limit_ns_per_cell_step: Option<f64>,
}

/// Runs the benchmark and prints the measurements.
pub fn bench(args: &BenchArgs) -> Result<(), Exit> {
    let &[nx, ny, nz] = &args.size[..] else {
        return Err(Exit::new(BAD_INPUT, "--size takes three numbers"));
    };
    if [nx, ny, nz].iter().any(|n| !(16..=4096).contains(n)) || args.steps == 0 {
        return Err(Exit::new(
            BAD_INPUT,
            "--size takes 16 to 4096 cells along each axis, --steps at least one step",
        ));
    }
    if let Some(set) = args.instructions {
        let widest = InstructionSet::widest();
        if set > widest {
            return Err(Exit::new(
                BAD_INPUT,
                format!(
                    "--instructions {}: this processor has at most {}",
                    set.name(),
                    widest.name()
                ),
            ));
        }
        limit_instructions(set);
    }
    let threads = threads::resolve(args.threads);
    let scheme = if args.scheme == "paper" { Scheme::Paper } else { Scheme::Aperture };
    let sizes = if args.scaling { CUBES.map(|n| [n; 3]).to_vec() } else { vec![[nx, ny, nz]] };
    let measured: Vec<Measured> = threads::on(threads, || {
        let each = sizes.into_iter();
        each.map(|cells| {
            let case = BenchCase { cells, grains: args.grains, scheme, precision: args.precision };
            measure(&case, args.steps, threads)
        })
        .collect::<Result<_, Exit>>()
    })??;
    match (args.json, &measured[..]) {
        (true, [one]) => print(&serde_json::to_string(one)?),
        (true, all) => print(&serde_json::to_string(all)?),
        (false, [one]) => print(&table(one)),
        (false, all) => print(&scaling(all)),
    }
}

fn measure(case: &BenchCase, steps: u64, threads: usize) -> Result<Measured, Exit> {
    let BenchCase { cells, grains, precision, .. } = *case;
    let count = cells.iter().product::<usize>() as f64;
    let mut sim =
        Simulation::new(case.setup()?).map_err(|e| Exit::new(BAD_INPUT, e.to_string()))?;
    let advance =
        |sim: &mut Simulation| sim.step(f64::INFINITY).map_err(|e| Exit::new(3, e.to_string()));
    for _ in 0..2 {
        advance(&mut sim)?;
    }
    let per_cell = 1e9 / count;
    let mut totals = Vec::new();
    let mut times = Vec::new();
    for _ in 0..steps {
        let (before, start) = (sim.pass_times(), Instant::now());
        advance(&mut sim)?;
        totals.push(per_cell * start.elapsed().as_secs_f64());
        let after = sim.pass_times();
        times.push(std::array::from_fn::<_, 7, _>(|pass| {
            per_cell * (after[pass].1 - before[pass].1)
        }));
    }
    let ns = median(totals);
    let bytes = sim.bytes();
    let bytes_per_cell = bytes as f64 / count;
    let names = sim.pass_times().map(|(name, _)| name);
    drop(sim);
    let (triad, size) = (triad_bandwidth(bytes / 24), precision.bytes() as f64);
    let limit = |name: &str| {
        let moved = TRAFFIC.iter().find(|(pass, _)| *pass == name);
        moved.map(|(_, numbers)| 1e9 * numbers * size / triad)
    };
    let mut passes: Vec<Pass> = names
        .into_iter()
        .enumerate()
        .map(|(pass, name)| Pass {
            name,
            ns_per_cell_step: median(times.iter().map(|step| step[pass]).collect()),
            limit_ns_per_cell_step: limit(name),
        })
        .collect();
    let named: f64 = passes.iter().map(|p| p.ns_per_cell_step).sum();
    passes.push(Pass {
        name: "other",
        ns_per_cell_step: (ns - named).max(0.0),
        limit_ns_per_cell_step: None,
    });
    let traffic = size * TRAFFIC.iter().map(|(_, numbers)| numbers).sum::<f64>();
    let limit = 1e9 * traffic / triad;
    Ok(Measured {
        cells,
        grains,
        threads,
        precision,
        instructions: instructions().name(),
        steps,
        ns_per_cell_step: ns,
        bytes_per_cell,
        traffic_bytes_per_cell: traffic,
        triad_gb_per_s: triad * 1e-9,
        limit_ns_per_cell_step: limit,
        ratio_to_limit: ns / limit,
        passes,
    })
}

/// Median of the values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

/// Bandwidth of a = b + s c over three arrays of `length` doubles, best of several [bytes/s].
fn triad_bandwidth(length: usize) -> f64 {
    const CHUNK: usize = 1 << 16;
    let length = length.max(MIN_TRIAD_LENGTH);
    let make = |value: f64| {
        let mut array = vec![0.0; length];
        array.par_chunks_mut(CHUNK).for_each(|chunk| chunk.fill(value));
        array
    };
    let (mut a, b, c) = (make(0.0), make(1.0), make(2.0));
    let mut best = f64::INFINITY;
    for repeat in 0..TRIAD_REPEATS {
        let s = std::hint::black_box(repeat as f64);
        let start = Instant::now();
        a.par_chunks_mut(CHUNK).zip(b.par_chunks(CHUNK)).zip(c.par_chunks(CHUNK)).for_each(
            |((a, b), c)| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + s * c;
                }
            },
        );
        best = best.min(start.elapsed().as_secs_f64());
        std::hint::black_box(&a);
    }
    (3 * 8 * length) as f64 / best
}

fn table(m: &Measured) -> String {
    let mut lines = vec![
        format!(
            "{} x {} x {} cells of {} bytes a number, {} grains, {} threads, {} steps, {}",
            m.cells[0],
            m.cells[1],
            m.cells[2],
            m.precision.bytes(),
            m.grains,
            m.threads,
            m.steps,
            m.instructions
        ),
        format!("time        {:8.2} ns per cell per step", m.ns_per_cell_step),
    ];
    for p in &m.passes {
        let limit = p.limit_ns_per_cell_step;
        let limit = limit.map_or(String::new(), |ns| format!("   limit {ns:6.2}"));
        lines.push(format!("  {:10}{:8.2}{limit}", p.name, p.ns_per_cell_step));
    }
    lines.push(format!("memory      {:8.1} bytes per cell", m.bytes_per_cell));
    lines.push(format!("triad       {:8.2} GB/s", m.triad_gb_per_s));
    lines.push(format!(
        "limit       {:8.2} ns per cell per step ({:.0} bytes per cell at that bandwidth)",
        m.limit_ns_per_cell_step, m.traffic_bytes_per_cell
    ));
    lines.push(format!("ratio       {:8.2}", m.ratio_to_limit));
    lines.join("\n")
}

/// Table with one line per size; the last column is the ratio to the preceding cube.
fn scaling(all: &[Measured]) -> String {
    let mut lines = vec![format!(
        "{:>5} {:>10} {:>9} {:>7} {:>7} {:>9}",
        "edge", "ns/cell", "columns", "bytes", "ratio", "to before"
    )];
    let mut before = all[0].ns_per_cell_step;
    for m in all {
        let columns = m.passes.iter().find(|p| p.name == "columns");
        lines.push(format!(
            "{:5} {:10.2} {:9.2} {:7.1} {:7.2} {:9.2}",
            m.cells[0],
            m.ns_per_cell_step,
            columns.map_or(0.0, |p| p.ns_per_cell_step),
            m.bytes_per_cell,
            m.ratio_to_limit,
            m.ns_per_cell_step / before
        ));
        before = m.ns_per_cell_step;
    }
    lines.join("\n")
}
