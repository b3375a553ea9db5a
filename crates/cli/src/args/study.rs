//! Arguments of `study`.

use clap::Args;
use std::path::PathBuf;

use super::Overrides;

/// Arguments of `study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Study file
    pub study: PathBuf,
    /// Study folder [default: runs/NAME]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Number of concurrent runs
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub jobs: usize,
    /// Number of threads of each run, 0 to share all cores among the jobs
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Select runs: names with * and ?, separated by commas, or the i-th of N equal shares
    #[arg(long, value_name = "PATTERN|i/N")]
    pub only: Option<String>,
    /// List the runs and their states, without running any
    #[arg(long)]
    pub list: bool,
    /// Print the planned work with its estimated time and memory, without running any
    #[arg(long)]
    pub dry_run: bool,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Restart failed runs
    #[arg(long)]
    pub retry: bool,
    /// Count finished runs by this commit of the program (12 digits), if its results are identical;
    /// repeatable
    #[arg(long, value_name = "COMMIT")]
    pub accept: Vec<String>,
    /// Keep the checkpoints of finished runs
    #[arg(long)]
    pub keep_checkpoints: bool,
    /// Print the table, warnings and errors only
    #[arg(long)]
    pub quiet: bool,
    /// Print the table (or the list) as JSON; other messages go to standard error
    #[arg(long)]
    pub json: bool,
}
