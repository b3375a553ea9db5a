//! Arguments of `run` and `check`.

use clap::Args;
use std::path::PathBuf;

use super::Overrides;

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Case file
    pub case: PathBuf,
    /// Run folder [default: runs/NAME; for a case.resolved.toml its own folder]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Number of threads, 0 for all cores, at most 4 per core [default: value of the case]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Continue from the last checkpoint
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Continue from the last checkpoint, or start if the folder holds no run (for job scripts)
    #[arg(long, conflicts_with_all = ["force", "resume"])]
    pub resume_or_start: bool,
    /// Replace an existing run
    #[arg(long)]
    pub force: bool,
    /// Start from a checkpoint of another run: the newest, or the newest at or before TIME, for
    /// example runs/heap@0.5
    #[arg(long, value_name = "DIR[@TIME]", conflicts_with = "resume")]
    pub from: Option<String>,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Do not draw the figures and report.html at the end of the run
    #[arg(long)]
    pub no_report: bool,
    /// Print errors only; `check` prints the warnings of a case
    #[arg(long)]
    pub quiet: bool,
    /// Print the summary as a JSON object; other messages go to standard error
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Case file
    pub case: PathBuf,
    /// Number of threads for the estimated wall time, 0 for all cores [default: value of the case]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}
