//! Arguments of the command line; a command with many of them has a module.

mod bench;
mod grain;
mod run;
mod study;
mod validate;

use std::path::PathBuf;
use std::sync::LazyLock;

use clap::{Args, Parser, Subcommand};
use grainwake_run::provenance;

pub use bench::BenchArgs;
pub use grain::{
    Body, CompareArgs, ExportArgs, FamilyArgs, FromMeshArgs, FromScanArgs, GrainCommand, InfoArgs,
    NewGrain,
};
pub use run::{CheckArgs, RunArgs};
pub use study::StudyArgs;
pub use validate::ValidateArgs;

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
    #[command(subcommand)]
    Grain(GrainCommand),
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

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Run folder or study folder
    pub run: PathBuf,
    /// Write a film of a run folder instead: film.gif, and film/frame-0001.png, ... for ffmpeg
    #[arg(long)]
    pub film: bool,
}

/// Arguments of `view`.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Run folders, or one study folder; a run that is still going is followed
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,
    /// Port on 127.0.0.1; 0 takes any free port
    #[arg(long, value_name = "N", default_value_t = 8317, conflicts_with = "save")]
    pub port: u16,
    /// Open the page in the default browser
    #[arg(long, conflicts_with = "save")]
    pub open: bool,
    /// Write one self-contained page that works from disk, instead of serving
    #[arg(long, value_name = "PAGE.html")]
    pub save: Option<PathBuf>,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Write one page per command into this folder instead, for example share/man/man1
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
}

/// Options `--set` and `--unset`.
#[derive(Debug, Args)]
pub struct Overrides {
    /// Override a value of the case, or of every case, for example time.end=0.5 or
    /// grain.0.density=2600
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Remove a key of the case, so that its default applies, for example time.step; before --set
    #[arg(long = "unset", value_name = "KEY")]
    unset: Vec<String>,
}

impl Overrides {
    /// Returns the changes in the syntax of `Case::load`, removals first.
    pub fn list(&self) -> Vec<String> {
        self.unset.iter().map(|key| format!("-{key}")).chain(self.set.iter().cloned()).collect()
    }
}
