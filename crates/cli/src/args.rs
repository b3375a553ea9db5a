//! Arguments of the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use grainwake_solver::math::{InstructionSet, Precision};

/// Drops real grains into real fluid.
#[derive(Debug, Parser)]
#[command(name = "grainwake", version, about, propagate_version = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a case
    Run(RunArgs),
    /// Check a case without running it: derived numbers and warnings
    Check(CheckArgs),
    /// Make and look at grain shapes
    Grain(GrainArgs),
    /// Compare with experiments, closed forms and published computations
    Validate(ValidateArgs),
    /// Run all models of a study: what is missing, from where it stopped
    Study(StudyArgs),
    /// Draw the figures and the page of a run folder or a study folder
    Report(ReportArgs),
    /// Measure speed and memory of the solver on this machine
    Bench(BenchArgs),
    /// Print the JSON schema of the case file
    Schema,
    /// Print shell completions
    Completions {
        /// Shell
        shell: clap_complete::Shell,
    },
}

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Case file
    pub case: PathBuf,
    /// Run folder [default: runs/NAME; for a case.resolved.toml its own folder]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Threads; 0 takes all cores [default: what the case says]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Continue from the last checkpoint
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Replace a run that is already there
    #[arg(long)]
    pub force: bool,
    /// Change a value of the case, for example time.end=0.5 or grain.0.density=2600
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Do not draw the figures and the page when the run has ended
    #[arg(long)]
    pub no_report: bool,
    /// No progress, only problems
    #[arg(long)]
    pub quiet: bool,
    /// Print the summary as one JSON object; everything else goes to standard error
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Case file
    pub case: PathBuf,
    /// Threads, for the estimated wall time; 0 takes all cores
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Change a value of the case
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `validate`.
#[derive(Debug, Args)]
pub struct ValidateArgs {
    /// Validations, NAME or NAME/RUN; all if none is given
    pub names: Vec<String>,
    /// How much: small runs, or all at the published resolutions
    #[arg(long, default_value = "ci", value_parser = ["ci", "full"])]
    pub level: String,
    /// Folder of the validations
    #[arg(long, value_name = "DIR", default_value = "validation")]
    pub suites: PathBuf,
    /// Folder of the runs
    #[arg(short, long, value_name = "DIR", default_value = "runs/validation")]
    pub output: PathBuf,
    /// Add the results to LEVEL.json and LEVEL.md in this folder, with their provenance, and draw the figures
    #[arg(long, value_name = "DIR")]
    pub save: Option<PathBuf>,
    /// Change a value of every case, for example run.precision="f32"
    #[arg(long = "set", value_name = "KEY=VALUE", conflicts_with = "save")]
    pub set: Vec<String>,
    /// Keep what is already there of the same cases and program
    #[arg(long)]
    pub resume: bool,
    /// Run nothing, judge the finished runs that are there, of whatever program
    #[arg(long, conflicts_with = "resume")]
    pub judge: bool,
    /// List the validations and their runs, and run nothing
    #[arg(long)]
    pub list: bool,
    /// Threads; 0 takes all cores
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// No progress, only the table and problems
    #[arg(long)]
    pub quiet: bool,
    /// Print a JSON list of the results; everything else goes to standard error
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
    /// Runs at once
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub jobs: usize,
    /// Threads of each run; 0 shares all cores among the jobs
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub threads: usize,
    /// Only these runs: names with * and ?, separated by commas, or a share i/N of all
    #[arg(long, value_name = "PATTERN|i/N")]
    pub only: Option<String>,
    /// List the runs and how far they are, and run nothing
    #[arg(long)]
    pub list: bool,
    /// Say what would be done, how long it takes and what it needs, and do nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Change a value of every case, for example domain.cell_size="0.5 mm"
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Start failed runs over
    #[arg(long)]
    pub retry: bool,
    /// Keep the checkpoints of finished runs
    #[arg(long)]
    pub keep_checkpoints: bool,
    /// No progress, only the table and problems
    #[arg(long)]
    pub quiet: bool,
    /// Print the table (or the list) as JSON; everything else goes to standard error
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Run folder or study folder
    pub run: PathBuf,
}

/// Arguments of `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Cells along x, y, z
    #[arg(long, num_args = 3, value_names = ["NX", "NY", "NZ"], default_values_t = [100, 100, 390])]
    pub size: Vec<usize>,
    /// Grains, 8 cells across, spread evenly
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub grains: usize,
    /// Steps that are timed, after two that are not
    #[arg(long, default_value_t = 10)]
    pub steps: u64,
    /// Threads; 0 takes all cores
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
    /// Measure cubes of 32 to 256 cells along each edge instead, awkward sizes among them
    #[arg(long, conflicts_with = "size")]
    pub scaling: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `grain`.
#[derive(Debug, Args)]
pub struct GrainArgs {
    /// What to do.
    #[command(subcommand)]
    pub command: GrainCommand,
}

/// Commands of `grain`.
#[derive(Debug, Subcommand)]
pub enum GrainCommand {
    /// Grains from a 3-D image: grey, binary or labelled
    FromScan(FromScanArgs),
    /// A grain from a closed surface mesh (STL, PLY, OBJ)
    FromMesh(FromMeshArgs),
    /// A grain of closed form
    Make(MakeArgs),
    /// Grains of given sphericity and roundness, one for each pair
    Family(FamilyArgs),
    /// Sizes and morphology of a grain file
    Info(InfoArgs),
    /// How far two grains are from each other, in measures and in surface
    Compare(CompareArgs),
}

/// Where the new grain goes, and how fine it is.
#[derive(Debug, Args)]
pub struct NewGrain {
    /// Grain file to write (from-scan: or a folder, for every grain of the image)
    #[arg(short, long, value_name = "FILE.grain")]
    pub output: PathBuf,
    /// Rescale to this equal-volume diameter, for example "2 mm"
    #[arg(long, value_name = "LENGTH")]
    pub equivalent_diameter: Option<String>,
    /// Surface nodes [default: one in every (diameter / 20)^2 of surface]
    #[arg(long, value_name = "N")]
    pub nodes: Option<usize>,
    /// Cells of the distance field across the longest extent
    #[arg(long, value_name = "N")]
    pub cells: Option<usize>,
    /// Replace the file if it is there
    #[arg(long)]
    pub force: bool,
    /// Print the record as one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `grain from-mesh`.
#[derive(Debug, Args)]
pub struct FromMeshArgs {
    /// Mesh file: .stl, .ply or .obj, or spherical-harmonic coefficients: .anm
    pub mesh: PathBuf,
    /// Length of one unit of the file, for example "1 mm"
    #[arg(long, value_name = "LENGTH")]
    pub unit: String,
    /// Invert the faces of a mesh that is inside out
    #[arg(long)]
    pub flip: bool,
    /// Where the grain goes.
    #[command(flatten)]
    pub new: NewGrain,
}

/// Arguments of `grain from-scan`.
#[derive(Debug, Args)]
pub struct FromScanArgs {
    /// Image: multi-page .tif, .npy, .npz, .nrrd, .mha, or a folder of .tif slices
    pub image: PathBuf,
    /// Edge of a voxel, for example "12 um"
    #[arg(long, value_name = "LENGTH")]
    pub voxel: String,
    /// The one label that is wanted; without it every grain of the image
    #[arg(long, value_name = "N")]
    pub label: Option<u32>,
    /// How solid is told from void in a grey image: a grey value, "otsu", or "otsu3" (the upper of
    /// two thresholds)
    #[arg(long, value_name = "VALUE|otsu|otsu3", allow_negative_numbers = true)]
    pub threshold: Option<String>,
    /// Take a median of 27 voxels before the threshold
    #[arg(long)]
    pub median: bool,
    /// Separate grains that touch: two where the neck is thinner than this share of the smaller
    #[arg(long, value_name = "NECK", num_args = 0..=1, default_missing_value = "0.87")]
    pub separate: Option<f64>,
    /// Take surfaces from the mask although there are grey values
    #[arg(long)]
    pub from_mask: bool,
    /// Do not measure roundness, which takes long
    #[arg(long)]
    pub no_roundness: bool,
    /// Take each connected piece of solid as a grain
    #[arg(long)]
    pub split: bool,
    /// Take grains that touch the border of the image, as cut there: for tight crops
    #[arg(long)]
    pub pad: bool,
    /// Of a label with several pieces keep the largest
    #[arg(long)]
    pub largest_piece: bool,
    /// Standard deviation of the smoothing, in voxels [default: 1.1 from grey values, 1.5 from a mask]
    #[arg(long, value_name = "VOXELS")]
    pub smoothing: Option<f64>,
    /// Where the grain goes; a folder for several grains.
    #[command(flatten)]
    pub new: NewGrain,
}

/// Arguments of `grain family`.
#[derive(Debug, Args)]
pub struct FamilyArgs {
    /// Krumbein sphericities, 0.3 to 0.97: the rows
    #[arg(long, value_delimiter = ',', required = true, value_name = "S,...")]
    pub sphericity: Vec<f64>,
    /// Wadell roundnesses, 0.05 to 0.95: the columns
    #[arg(long, value_delimiter = ',', required = true, value_name = "R,...")]
    pub roundness: Vec<f64>,
    /// Flatness c/b, 0.2 to 1, no less than S^3 [default: 0.8, or more where the sphericity demands it]
    #[arg(long, value_name = "RATIO")]
    pub flatness: Option<f64>,
    /// The same seed gives the same grains
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Diameter of the sphere of equal volume, the same for all
    #[arg(long, default_value = "2 mm", value_name = "LENGTH")]
    pub equivalent_diameter: String,
    /// Folder for 01.grain, 02.grain, ... (row by row), table.csv and sheet.png
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Surface nodes [default: one in every (diameter / 20)^2 of surface]
    #[arg(long, value_name = "N")]
    pub nodes: Option<usize>,
    /// Cells of the distance field across the longest extent, at least
    #[arg(long, value_name = "N")]
    pub cells: Option<usize>,
    /// Replace files that are there
    #[arg(long)]
    pub force: bool,
    /// Print one JSON object for each grain
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `grain make`.
#[derive(Debug, Args)]
pub struct MakeArgs {
    /// Which body
    #[command(subcommand)]
    pub body: Body,
}

/// Bodies of closed form.
#[derive(Debug, Subcommand)]
pub enum Body {
    /// Sphere
    Sphere {
        /// Diameter
        diameter: String,
        /// Where the grain goes.
        #[command(flatten)]
        new: NewGrain,
    },
    /// Ellipsoid
    Ellipsoid {
        /// Full axes, three lengths
        #[arg(num_args = 3)]
        axes: Vec<String>,
        /// Where the grain goes.
        #[command(flatten)]
        new: NewGrain,
    },
    /// Box with rounded edges
    RoundedBox {
        /// Full edges, three lengths
        #[arg(num_args = 3)]
        edges: Vec<String>,
        /// Radius of the edges
        #[arg(long)]
        radius: String,
        /// Where the grain goes.
        #[command(flatten)]
        new: NewGrain,
    },
    /// Cylinder with sharp rims
    Cylinder {
        /// Diameter
        diameter: String,
        /// Height
        height: String,
        /// Where the grain goes.
        #[command(flatten)]
        new: NewGrain,
    },
    /// Cylinder with half spheres on its ends
    Capsule {
        /// Diameter
        diameter: String,
        /// Distance of the centres of the caps
        height: String,
        /// Where the grain goes.
        #[command(flatten)]
        new: NewGrain,
    },
    /// Superquadric
    Superquadric {
        /// Full axes, three lengths
        #[arg(num_args = 3)]
        axes: Vec<String>,
        /// Exponents e1 and e2, 0.1 to 2
        #[arg(long, num_args = 2, required = true)]
        exponents: Vec<f64>,
        /// Where the grain goes.
        #[command(flatten)]
        new: NewGrain,
    },
}

/// Arguments of `grain info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Grain files
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// Print one JSON object for each file
    #[arg(long)]
    pub json: bool,
    /// Draw the three sides of each grain with its surface nodes into this PNG, one row a grain
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

/// Arguments of `grain compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Grain file
    pub first: PathBuf,
    /// Another
    pub second: PathBuf,
    /// Scale the second to the volume of the first: compare form alone
    #[arg(long)]
    pub same_size: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// Draw the three sides of both, as they were laid upon each other, into this PNG
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}
