//! Arguments of `bench`.

use std::path::PathBuf;

use clap::Args;
use grainwake_solver::math::{InstructionSet, Precision};

use super::Overrides;

/// Arguments of `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Case file to measure, dry or with fluid, instead of grains in a box of water
    #[arg(value_name = "CASE.toml", conflicts_with_all = ["size", "grains", "scheme", "precision",
        "scaling"])]
    pub case: Option<PathBuf>,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Number of cells along x, y and z
    #[arg(long, num_args = 3, value_names = ["NX", "NY", "NZ"], default_values_t = [100, 100, 390])]
    pub size: Vec<usize>,
    /// Number of grains, 8 cells across, evenly distributed
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub grains: usize,
    /// Number of timed steps
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub steps: u64,
    /// Number of untimed steps before
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub warm_up: u64,
    /// Number of threads, 0 for all cores
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub threads: usize,
    /// Coupling scheme
    #[arg(long, default_value = "aperture", value_parser = ["aperture", "paper"])]
    pub scheme: String,
    /// Floating-point type of the fields
    #[arg(long, value_name = "f64|f32", default_value_t = Precision::Double)]
    pub precision: Precision,
    /// Instruction set; one that the processor lacks is an error [default: the widest it has]
    #[arg(long, value_name = "baseline|avx2|avx512")]
    pub instructions: Option<InstructionSet>,
    /// Measure cubes of 32 to 256 cells along an edge instead, some with large prime factors
    #[arg(long, conflicts_with = "size")]
    pub scaling: bool,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}
