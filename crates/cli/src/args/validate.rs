//! Arguments of `validate`.

use clap::Args;
use std::path::PathBuf;

use super::Overrides;

/// Arguments of `validate`.
#[derive(Debug, Args)]
pub struct ValidateArgs {
    /// Validations, NAME or NAME/RUN [default: all]
    pub names: Vec<String>,
    /// Extent: ci for small runs, full for the published resolutions
    #[arg(long, default_value = "ci", value_parser = ["ci", "full"])]
    pub level: String,
    /// Folder of the validations [default: `validation` if it holds any, otherwise those in the
    /// program]
    #[arg(long, value_name = "DIR")]
    pub suites: Option<PathBuf>,
    /// Folder of the runs
    #[arg(short, long, value_name = "DIR", default_value = "runs/validation")]
    pub output: PathBuf,
    /// Add the results with their provenance to LEVEL.json and LEVEL.md in this folder, and draw
    /// the figures
    #[arg(long, value_name = "DIR", conflicts_with_all = ["set", "unset"])]
    pub save: Option<PathBuf>,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Keep finished runs of the same case and program version, resume interrupted ones
    #[arg(long)]
    pub resume: bool,
    /// Evaluate the finished runs of any program version, without running any
    #[arg(long, conflicts_with = "resume")]
    pub judge: bool,
    /// List the validations and their runs, without running any
    #[arg(long)]
    pub list: bool,
    /// Number of threads, 0 for all cores
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Print the table, warnings and errors only
    #[arg(long)]
    pub quiet: bool,
    /// Print the results, or the list of --list, as JSON; other messages go to standard error
    #[arg(long)]
    pub json: bool,
}
