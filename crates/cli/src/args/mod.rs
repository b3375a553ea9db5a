//! Arguments of the command line; those of `grain` have a module of their own.

mod grain;

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::LazyLock;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use grainwake_run::provenance;
use grainwake_solver::math::{InstructionSet, Precision};

pub use grain::{
    Body, CompareArgs, ExportArgs, FamilyArgs, FromMeshArgs, FromScanArgs, GrainCommand, InfoArgs,
    NewGrain,
};

/// Version and commit, as in `provenance.json`.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let commit = provenance::commit().unwrap_or("unknown");
    format!("{} (commit {commit})", env!("CARGO_PKG_VERSION"))
});

/// Returns the words of the command line, for `provenance.json`. Bytes that are not UTF-8, as in a
/// name of a folder, become replacement characters.
pub fn words() -> Vec<String> {
    std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect()
}

/// Reads a whole number, 0 or more.
fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| "expected a whole number, 0 or more".to_owned())
}

/// Command line of Grainwake; its description is that of the package.
#[derive(Debug, Parser)]
#[command(name = "grainwake", version, long_version = VERSION.as_str(), about)]
#[command(propagate_version = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

impl Cli {
    /// Reads the command line. Ends the program with a message if it is wrong.
    pub fn read() -> Cli {
        let matches = with_negative_values(Cli::command()).get_matches();
        Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
    }
}

/// Lets all options take negative numbers, so that a number out of range is reported as such and
/// not as an unknown option.
fn with_negative_values(command: clap::Command) -> clap::Command {
    let takes_value = |arg: &clap::Arg| arg.get_action().takes_values() && !arg.is_positional();
    let accept = |arg| if takes_value(&arg) { arg.allow_negative_numbers(true) } else { arg };
    command.mut_args(accept).mut_subcommands(with_negative_values)
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

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Case file
    pub case: PathBuf,
    /// Run folder [default: runs/NAME; for a case.resolved.toml its own folder]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Number of threads, 0 for all cores, at most 4 per core [default: value of the case]
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
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
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Study file
    pub study: PathBuf,
    /// Study folder [default: runs/NAME]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Number of concurrent runs
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<usize>)]
    pub jobs: usize,
    /// Number of threads of each run, 0 to share all cores among the jobs
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<usize>)]
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
    /// With --dry-run: time the first steps of one run per size of grid, as many copies at once as
    /// there are jobs, and estimate the time from them
    #[arg(long, requires = "dry_run")]
    pub measure: bool,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Restart failed runs
    #[arg(long)]
    pub retry: bool,
    /// Replace finished runs of another case or end
    #[arg(long)]
    pub force: bool,
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
    /// Number of concurrent runs
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<usize>)]
    pub jobs: usize,
    /// Number of threads of each run, 0 to share all cores among the jobs
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<usize>)]
    pub threads: usize,
    /// Print the table, warnings and errors only
    #[arg(long)]
    pub quiet: bool,
    /// Print the results, or the list of --list, as JSON; other messages go to standard error
    #[arg(long)]
    pub json: bool,
}

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
    #[arg(
        long,
        num_args = 3,
        value_names = ["NX", "NY", "NZ"],
        default_values_t = [100, 100, 390],
        value_parser = whole::<usize>
    )]
    pub size: Vec<usize>,
    /// Number of grains, 8 cells across, evenly distributed
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole::<usize>)]
    pub grains: usize,
    /// Number of timed steps
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole::<u64>)]
    pub steps: u64,
    /// Number of untimed steps before
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole::<u64>)]
    pub warm_up: u64,
    /// Number of threads, 0 for all cores
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole::<usize>)]
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
