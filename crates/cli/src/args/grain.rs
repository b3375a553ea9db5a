//! Arguments of `grain`.

use clap::{Args, Subcommand};
use std::path::PathBuf;

use super::whole;

/// Commands of `grain`.
#[derive(Debug, Subcommand)]
pub enum GrainCommand {
    /// Create grains from a 3-D image: grey, binary or labelled
    FromScan(FromScanArgs),
    /// Create a grain from a closed surface mesh or from spherical harmonics
    FromMesh(FromMeshArgs),
    /// Create a grain of closed form: sphere, ellipsoid, box, cylinder, capsule, superquadric
    #[command(subcommand)]
    Make(Body),
    /// Generate grains of given sphericity and roundness, one for each pair
    Family(FamilyArgs),
    /// Print the size and morphology of grain files
    Info(InfoArgs),
    /// Compare two grains by their morphology and the distance of their surfaces
    Compare(CompareArgs),
    /// Write the surface of a grain as a mesh for other programs
    Export(ExportArgs),
}

/// Output and resolution of new grains.
#[derive(Debug, Args)]
pub struct NewGrain {
    /// Grain file; for from-scan also a folder, which receives all grains
    #[arg(short, long, value_name = "FILE.grain")]
    pub output: PathBuf,
    /// Rescale to this diameter of the sphere of equal volume, for example "2 mm"
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub equivalent_diameter: Option<String>,
    #[command(flatten)]
    pub common: GrainOptions,
}

/// Options of all commands that create grains.
#[derive(Debug, Args)]
pub struct GrainOptions {
    /// Number of surface nodes [default: one per (diameter / 20)^2 of surface]
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
    pub nodes: Option<usize>,
    /// Number of cells of the distance field across the longest extent
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
    pub cells: Option<usize>,
    /// Replace existing files
    #[arg(long)]
    pub force: bool,
    /// Print the record of each grain as a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `grain from-mesh`.
#[derive(Debug, Args)]
pub struct FromMeshArgs {
    /// Mesh (.stl, .ply, .obj) or spherical-harmonic coefficients (.anm)
    pub mesh: PathBuf,
    /// Length of one unit of the file, for example "1 mm"
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub unit: String,
    /// Invert a mesh with inward normals
    #[arg(long)]
    pub flip: bool,
    #[command(flatten)]
    pub new: NewGrain,
}

/// Arguments of `grain from-scan`.
#[derive(Debug, Args)]
pub struct FromScanArgs {
    /// Image: multi-page .tif, .npy, .npz, .nrrd, .mha, or a folder of .tif or .png slices
    pub image: PathBuf,
    /// Edge length of a voxel, for example "12 um"
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub voxel: String,
    /// Label of a single grain [default: all]
    #[arg(long, value_name = "N")]
    pub label: Option<u32>,
    /// Read integers as labels even if the image looks grey
    #[arg(long, conflicts_with = "threshold")]
    pub labels: bool,
    /// Threshold between void and solid in a grey image: a grey value, "otsu", or "otsu3" (the
    /// upper of two thresholds)
    #[arg(long, value_name = "VALUE|otsu|otsu3")]
    pub threshold: Option<String>,
    /// Apply a median filter of 27 voxels before the threshold
    #[arg(long)]
    pub median: bool,
    /// Separate touching grains where the neck is narrower than this fraction of the smaller grain,
    /// 0.87 if no value is given
    #[arg(long, value_name = "NECK", num_args = 0..=1, default_missing_value = "0.87")]
    pub separate: Option<f64>,
    /// Locate surfaces by the mask even if there are grey values
    #[arg(long)]
    pub from_mask: bool,
    /// Do not measure roundness, which is slow
    #[arg(long)]
    pub no_roundness: bool,
    /// Treat each connected piece of solid as a grain
    #[arg(long)]
    pub split: bool,
    /// Include grains at the image border, truncated there (for tight crops)
    #[arg(long)]
    pub pad: bool,
    /// Keep the largest piece of a label with several pieces
    #[arg(long)]
    pub largest_piece: bool,
    /// Standard deviation of the smoothing, in voxels [default: 1.1 with grey values, 1.5 with a
    /// mask]
    #[arg(long, value_name = "VOXELS")]
    pub smoothing: Option<f64>,
    /// Try rejected labels again with more smoothing or a median, each with the
    /// least that works
    #[arg(long)]
    pub rescue: bool,
    /// Draw slices with the labels that would be kept and rejected into this PNG; write no grain
    #[arg(long, value_name = "FILE.png")]
    pub preview: Option<PathBuf>,
    #[command(flatten)]
    pub new: NewGrain,
}

/// Arguments of `grain family`.
#[derive(Debug, Args)]
pub struct FamilyArgs {
    /// Krumbein sphericities S, 0.3 to 0.97, one per row of the family
    #[arg(long, value_delimiter = ',', required = true, value_name = "S,...")]
    pub sphericity: Vec<f64>,
    /// Wadell roundnesses R, 0.05 to 0.95, one per column of the family
    #[arg(long, value_delimiter = ',', required = true, value_name = "R,...")]
    pub roundness: Vec<f64>,
    /// Flatness c/b, 0.2 to 1 and at least S^3 [default: 0.8, or S^3 if that is larger]
    #[arg(long, value_name = "RATIO")]
    pub flatness: Option<f64>,
    /// Seed of the generator; equal seeds give equal grains
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = whole::<u64>)]
    pub seed: u64,
    /// Diameter of the sphere of equal volume of all grains
    #[arg(long, default_value = "2 mm", value_name = "LENGTH", allow_hyphen_values = true)]
    pub equivalent_diameter: String,
    /// Folder for 01.grain, 02.grain, ... (row by row), table.csv and sheet.png
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub common: GrainOptions,
}

/// Analytic shapes.
#[derive(Debug, Subcommand)]
pub enum Body {
    /// Sphere
    Sphere {
        /// Diameter
        diameter: String,
        #[command(flatten)]
        new: NewGrain,
    },
    /// Ellipsoid
    Ellipsoid {
        /// Full axes, three lengths
        #[arg(num_args = 3)]
        axes: Vec<String>,
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
        #[command(flatten)]
        new: NewGrain,
    },
    /// Circular cylinder
    Cylinder {
        /// Diameter
        diameter: String,
        /// Height
        height: String,
        #[command(flatten)]
        new: NewGrain,
    },
    /// Circular cylinder with hemispherical caps
    Capsule {
        /// Diameter
        diameter: String,
        /// Distance between the centres of the caps
        height: String,
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
    /// Print the record of each file as a JSON object
    #[arg(long)]
    pub json: bool,
    /// Render three sides of each grain with its surface nodes into this PNG, one row per grain
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}

/// Arguments of `grain export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// Grain file
    pub grain: PathBuf,
    /// Mesh; the ending gives the format: .stl, .ply, .obj or .vtp
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Length of one unit of the mesh, for example "1 mm"
    #[arg(long, value_name = "LENGTH", default_value = "1 m", allow_hyphen_values = true)]
    pub unit: String,
    /// Replace an existing file
    #[arg(long)]
    pub force: bool,
}

/// Arguments of `grain compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// First grain file
    pub first: PathBuf,
    /// Second grain file
    pub second: PathBuf,
    /// Scale the second grain to the volume of the first, to compare the form alone
    #[arg(long)]
    pub same_size: bool,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
    /// Render three sides of both grains, aligned as compared, into this PNG
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
}
