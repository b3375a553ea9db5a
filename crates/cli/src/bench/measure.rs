//! Time of the steps of a simulation.

use std::time::Duration;

use grainwake_solver::math::{Precision, Stopwatch, TimeSpent, instructions};
use grainwake_solver::sim::{Setup, Simulation};
use serde::Serialize;

use super::triad;
use crate::args::BenchArgs;
use crate::exit::Exit;

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

/// Measurement of one case. The JSON names are stable.
#[derive(Debug, Serialize)]
pub struct Measured {
    pub grains: usize,
    pub threads: usize,
    pub precision: Precision,
    pub instructions: &'static str,
    pub steps: u64,
    pub seconds_per_step: Times,
    pub substeps_per_step: Counts,
    pub contact_pairs: Counts,
    /// Measures per cell; none of a dry case.
    #[serde(flatten)]
    pub grid: Option<PerCell>,
    pub passes: Vec<Pass>,
}

/// Time of a step or pass.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Times {
    /// Shortest wall time.
    pub minimum: f64,
    /// Median wall time.
    pub median: f64,
    /// Mean CPU time of all threads; none if it is unknown.
    pub cpu: Option<f64>,
}

/// Mean and largest number in a step.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Counts {
    pub mean: f64,
    pub largest: usize,
}

/// Measures per cell.
#[derive(Debug, Serialize)]
pub struct PerCell {
    pub cells: [usize; 3],
    /// Median over the steps.
    pub ns_per_cell_step: f64,
    pub bytes_per_cell: f64,
    pub traffic_bytes_per_cell: f64,
    pub triad_gb_per_s: f64,
    pub limit_ns_per_cell_step: f64,
    pub ratio_to_limit: f64,
}

/// Time of one pass.
#[derive(Debug, Serialize)]
pub struct Pass {
    pub name: &'static str,
    pub seconds_per_step: Times,
    /// Median per cell; none of a dry case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ns_per_cell_step: Option<f64>,
    /// Time at the memory bandwidth; none for passes that depend on the grains alone.
    pub limit_ns_per_cell_step: Option<f64>,
}

/// Times the steps of a simulation on this many threads.
pub fn measure(setup: Setup, args: &BenchArgs, threads: usize) -> Result<Measured, Exit> {
    let wet = setup.fluid.is_some();
    let (cells, grains, precision) = (setup.mesh.cells, setup.grains.len(), setup.precision);
    let mut sim = Simulation::new(setup).map_err(|e| Exit::input(e.to_string()))?;
    let advance =
        |sim: &mut Simulation| sim.step(f64::INFINITY).map_err(|e| Exit::new(3, e.to_string()));
    for _ in 0..args.warm_up {
        advance(&mut sim)?;
    }
    let mut totals = Vec::new();
    let mut by_step = Vec::new();
    let (mut substeps, mut pairs) = (Vec::new(), Vec::new());
    for _ in 0..args.steps {
        let (before, start) = (sim.pass_times(), Stopwatch::start());
        advance(&mut sim)?;
        let total = start.elapsed();
        let after = sim.pass_times();
        let mut passes: Vec<(&str, TimeSpent)> = after
            .iter()
            .zip(&before)
            .map(|(after, before)| (after.0, after.1 - before.1))
            .collect();
        let named = passes.iter().fold(TimeSpent::default(), |sum, pass| sum + pass.1);
        passes.push(("other", total - named));
        totals.push(total);
        by_step.push(passes);
        substeps.push(sim.substeps());
        pairs.push(sim.contacts().len());
    }
    let bytes = sim.bytes();
    drop(sim);
    let count = cells.iter().product::<usize>() as f64;
    let seconds_per_step = Times::of(totals.iter());
    let size = precision.bytes() as f64;
    let triad = wet.then(|| triad::bandwidth(bytes / 24));
    let limit = |numbers: f64| triad.map(|triad| 1e9 * numbers * size / triad);
    let passes = by_step[0].iter().enumerate().map(|(pass, (name, _))| {
        let seconds_per_step = Times::of(by_step.iter().map(|step| &step[pass].1));
        let moved = TRAFFIC.iter().find(|(pass, _)| pass == name);
        Pass {
            name,
            seconds_per_step,
            ns_per_cell_step: wet.then(|| 1e9 * seconds_per_step.median / count),
            limit_ns_per_cell_step: moved.and_then(|(_, numbers)| limit(*numbers)),
        }
    });
    let passes = passes.collect();
    let grid = triad.map(|triad| {
        let traffic = size * TRAFFIC.iter().map(|(_, numbers)| numbers).sum::<f64>();
        let limit = 1e9 * traffic / triad;
        let ns = 1e9 * seconds_per_step.median / count;
        PerCell {
            cells,
            ns_per_cell_step: ns,
            bytes_per_cell: bytes as f64 / count,
            traffic_bytes_per_cell: traffic,
            triad_gb_per_s: triad * 1e-9,
            limit_ns_per_cell_step: limit,
            ratio_to_limit: ns / limit,
        }
    });
    Ok(Measured {
        grains,
        threads,
        precision,
        instructions: instructions().name(),
        steps: args.steps,
        seconds_per_step,
        substeps_per_step: Counts::of(&substeps),
        contact_pairs: Counts::of(&pairs),
        grid,
        passes,
    })
}

impl Times {
    /// Minimum, median and mean CPU time of at least one step.
    fn of<'a>(steps: impl Iterator<Item = &'a TimeSpent> + Clone) -> Times {
        let mut wall: Vec<f64> = steps.clone().map(|time| time.wall.as_secs_f64()).collect();
        wall.sort_by(f64::total_cmp);
        let n = wall.len();
        let cpu: Option<Duration> = steps.map(|time| time.cpu).sum();
        Times {
            minimum: wall[0],
            median: 0.5 * (wall[(n - 1) / 2] + wall[n / 2]),
            cpu: cpu.map(|cpu| cpu.as_secs_f64() / n as f64),
        }
    }
}

impl Counts {
    fn of(steps: &[usize]) -> Counts {
        Counts {
            mean: steps.iter().sum::<usize>() as f64 / steps.len() as f64,
            largest: steps.iter().copied().max().unwrap_or_default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_the_minimum_the_median_and_the_mean_cpu_time() {
        let step = |wall, cpu| TimeSpent {
            wall: Duration::from_millis(wall),
            cpu: Some(Duration::from_millis(cpu)),
        };
        let times = Times::of([step(5, 8), step(1, 2), step(3, 5), step(90, 9)].iter());
        assert_eq!((times.minimum, times.median, times.cpu), (1e-3, 4e-3, Some(6e-3)));
        let unknown = TimeSpent { wall: Duration::from_millis(2), cpu: None };
        assert_eq!(Times::of([unknown].iter()).cpu, None);
    }
}
