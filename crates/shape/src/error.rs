//! Errors of reading, building and saving shapes.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Reason why a shape was refused. Every message names the location and, if there is one, the
/// remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// The operating system could not read or write the file.
    #[error("cannot access {path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file declares more data than the reader may hold.
    #[error("{path}: {reason}; crop or coarsen the data")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Declared size and limit.
        reason: String,
    },
    /// The file ends early or is inconsistent.
    #[error("{path}: damaged or not what its name says: {reason}")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The inconsistency.
        reason: String,
    },
    /// The type or variant of the file is not supported.
    #[error("{path}: {reason}")]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The type or variant, and the remedy.
        reason: String,
    },
    /// A parameter is out of range.
    #[error("{name} = {}: {reason}", short(*value))]
    BadParameter {
        /// Parameter name.
        name: &'static str,
        /// Given value.
        value: f64,
        /// Requirement.
        reason: String,
    },
    /// The volume holds no solid voxel.
    #[error(
        "the volume holds no solid voxel: all values are background (zero, or below the threshold)"
    )]
    EmptyVolume,
    /// A median is asked for, and there is no threshold after it.
    #[error("the median filters grey values before the threshold, and there is no threshold")]
    MedianWithoutThreshold,
    /// The volume holds no background voxel.
    #[error("the volume is solid throughout: it has no background voxel, so no surface")]
    SolidVolume,
    /// The grain reaches the edge of the field of view.
    #[error("label {label} reaches the edge of the field of view, so part of the grain is missing")]
    CutByView {
        /// Label in the image.
        label: u32,
    },
    /// The grain touches the border of the image.
    #[error("label {label} touches the image border ({faces}), so part of the grain is missing")]
    CutByBorder {
        /// Label.
        label: u32,
        /// Faces of the image.
        faces: String,
    },
    /// A label consists of several separate bodies.
    #[error("label {label} consists of {count} separate pieces of {sizes} voxels")]
    SeveralPieces {
        /// Label.
        label: u32,
        /// Number of pieces.
        count: usize,
        /// Voxel counts, largest first.
        sizes: String,
    },
    /// The grain has too few voxels to define a shape.
    #[error("label {label} has {voxels} voxels; at least {needed} are needed for a usable surface")]
    TooFewVoxels {
        /// Label.
        label: u32,
        /// Number of voxels.
        voxels: u64,
        /// Required number of voxels.
        needed: u64,
    },
    /// The mesh is not one closed surface of consistent orientation without self-intersections.
    #[error("{defect}")]
    BadMesh {
        /// The defect with its position [units of the file], and the remedy.
        defect: String,
    },
    /// All normals point inwards.
    #[error("{}the mesh is inside out (its volume is {volume:.6e} m3)", prefix(file))]
    InsideOut {
        /// File; empty for a mesh in memory.
        file: String,
        /// Signed volume [m3].
        volume: f64,
    },
    /// The finished shape failed the quality check.
    #[error("{}the shape fails the quality check: {reason}", prefix(file))]
    Quality {
        /// File of the shape; empty for one in memory.
        file: String,
        /// Kind of the defect.
        defect: Defect,
        /// The bound, and the value that exceeds it.
        reason: String,
        /// Number of cells across the longest extent that passes, if it was searched and found.
        cells: Option<usize>,
    },
    /// The callback of the progress ended the work.
    #[error("interrupted")]
    Interrupted,
}

impl ShapeError {
    pub(crate) fn io(path: &Path, source: impl Into<std::io::Error>) -> ShapeError {
        let (path, source) = (path.to_owned(), source.into());
        ShapeError::Io { path, source }
    }
    pub(crate) fn too_large(path: &Path, claimed: &str, limit: u64, unit: &str) -> ShapeError {
        let path = path.to_owned();
        let reason = format!("claims {claimed}, the limit is {limit} {unit}");
        ShapeError::TooLarge { path, reason }
    }
    pub(crate) fn malformed(path: &Path, reason: impl ToString) -> ShapeError {
        let (path, reason) = (path.to_owned(), reason.to_string());
        ShapeError::Malformed { path, reason }
    }
    pub(crate) fn unsupported(path: &Path, reason: impl Into<String>) -> ShapeError {
        let (path, reason) = (path.to_owned(), reason.into());
        ShapeError::Unsupported { path, reason }
    }
    pub(crate) fn parameter(name: &'static str, value: f64, reason: &str) -> ShapeError {
        let reason = reason.to_owned();
        ShapeError::BadParameter { name, value, reason }
    }
    /// Names the `file` of a refused mesh; an empty name stands for a mesh in memory.
    pub(crate) fn in_file(self, file: &str) -> ShapeError {
        match self {
            ShapeError::BadMesh { defect } => {
                ShapeError::bad_mesh(format!("{}{defect}", prefix(file)))
            }
            ShapeError::InsideOut { volume, .. } => {
                ShapeError::InsideOut { file: file.to_owned(), volume }
            }
            ShapeError::Quality { defect, reason, cells, .. } => {
                ShapeError::Quality { file: file.to_owned(), defect, reason, cells }
            }
            other => other,
        }
    }
    pub(crate) fn bad_mesh(defect: impl Into<String>) -> ShapeError {
        let defect = defect.into();
        ShapeError::BadMesh { defect }
    }
    pub(crate) fn quality(defect: Defect, reason: impl Into<String>) -> ShapeError {
        let reason = reason.into();
        ShapeError::Quality { file: String::new(), defect, reason, cells: None }
    }
}

/// Beginning of a message about a `file`; nothing for a mesh in memory.
fn prefix(file: &str) -> String {
    if file.is_empty() { String::new() } else { format!("{file}: ") }
}

/// Defect of a shape that failed the quality check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Defect {
    /// The gradient of the distance field deviates from 1 at the surface.
    Gradient,
    /// The volume of the distance field deviates from that of the source.
    Volume,
    /// The distance field is not in its principal frame.
    Axes,
    /// The smoothed surface of a scan falls into pieces.
    Broken,
    /// The surface of the distance field is not one closed surface.
    Surface,
    /// The generator of grains missed its target.
    Target,
    /// The distance field has no inside, or values that are not finite.
    Empty,
}

/// Lists at most `count` items for messages, with dots if there are more.
pub(crate) fn first_few<T: ToString>(items: impl IntoIterator<Item = T>, count: usize) -> String {
    let mut items = items.into_iter().map(|item| item.to_string());
    let mut shown: Vec<String> = items.by_ref().take(count).collect();
    shown.extend(items.next().map(|_| "...".to_owned()));
    shown.join(", ")
}

/// Result of this crate's functions.
pub type Result<T> = std::result::Result<T, ShapeError>;

/// Writes a number in full, or with an exponent if it is very large or small.
fn short(value: f64) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-6..1e10).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// Refuses a length that is not finite and positive.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    let reason = "must be finite and positive";
    Err(ShapeError::parameter(name, value, reason))
}

/// Lengths of grains that are accepted [m]. Beyond them moments of inertia, which scale with the
/// fifth power, lose their digits.
const SIZES: RangeInclusive<f64> = 1e-9..=1e6;

/// Refuses a length that no grain has [m].
///
/// # Errors
/// [`ShapeError::BadParameter`] with this name and value.
pub fn check_length(name: &'static str, value: f64) -> Result<()> {
    positive(name, value)?;
    within(name, value, SIZES, "a length must lie between 1e-9 m and 1e6 m; was a unit forgotten?")
}

/// Refuses a value outside `range`.
pub(crate) fn within(
    name: &'static str,
    value: f64,
    range: RangeInclusive<f64>,
    reason: &str,
) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(ShapeError::parameter(name, value, reason))
}
