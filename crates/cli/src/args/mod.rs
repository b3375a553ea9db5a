//! Arguments of the command line, one module per command.

mod bench;
mod grain;
mod man;
mod overrides;
mod report;
mod run;
mod study;
mod validate;
mod view;

use std::sync::LazyLock;

use clap::{Parser, Subcommand};
use grainwake_run::provenance;

pub use bench::BenchArgs;
pub use grain::{
    Body, CompareArgs, ExportArgs, FamilyArgs, FromMeshArgs, FromScanArgs, GrainArgs, GrainCommand,
    InfoArgs, NewGrain,
};
pub use man::ManArgs;
pub use overrides::Overrides;
pub use report::ReportArgs;
pub use run::{CheckArgs, RunArgs};
pub use study::StudyArgs;
pub use validate::ValidateArgs;
pub use view::ViewArgs;

/// Version and commit, as in `provenance.json`.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let commit = provenance::commit().unwrap_or("unknown");
    format!("{} (commit {commit})", env!("CARGO_PKG_VERSION"))
});

/// Command line of Grainwake; its description is that of the package.
#[derive(Debug, Parser)]
#[command(name = "grainwake", version, long_version = VERSION.as_str(), about)]
#[command(propagate_version = true)]
pub struct Cli {
    /// Command.
    #[command(subcommand)]
    pub command: Command,
}

/// Commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a case
    Run(RunArgs),
    /// Check a case without running it: derived numbers, cost and warnings
    Check(CheckArgs),
    /// Create, inspect and compare grain shapes
    Grain(GrainArgs),
    /// Run the validation cases and compare them with references
    Validate(ValidateArgs),
    /// Run a parameter study; finished runs are kept, interrupted runs are resumed
    Study(StudyArgs),
    /// Draw the figures and report.html of a run folder or a study folder
    Report(ReportArgs),
    /// Show runs as an interactive 3-D page, served on this machine or saved as one file
    View(ViewArgs),
    /// Measure the speed and memory of the solver on this machine
    Bench(BenchArgs),
    /// Print the JSON schema of the case file
    Schema,
    /// Print a shell completion script
    Completions {
        /// Shell
        shell: clap_complete::Shell,
    },
    /// Print the manual page (roff)
    Man(ManArgs),
}
