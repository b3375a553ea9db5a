//! Errors of reading, building and saving shapes.

use glam::DVec3;
use std::path::PathBuf;
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
    /// No reader supports the extension of the file.
    #[error("{path}: unknown file type; known here: {known}")]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Supported extensions.
        known: &'static str,
    },
    /// The file declares more data than the reader may hold.
    #[error("{path}: claims {claimed}, the limit is {limit} {unit}; crop or coarsen the data")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Declared size.
        claimed: String,
        /// Limit.
        limit: u64,
        /// Unit of the limit.
        unit: &'static str,
    },
    /// The file ends early or is inconsistent.
    #[error("{path}: damaged or not what its name says: {reason}")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The inconsistency.
        reason: String,
    },
    /// The file is valid, but its variant is not supported.
    #[error("{path}: {reason}")]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The variant, and the remedy.
        reason: String,
    },
    /// A coordinate or grey value is NaN or infinite.
    #[error("{what} is not a finite number")]
    NotFinite {
        /// The value concerned.
        what: String,
    },
    /// A parameter is out of range.
    #[error("{name} = {value}: {reason}")]
    BadParameter {
        /// Parameter name.
        name: &'static str,
        /// Given value.
        value: f64,
        /// Requirement.
        reason: &'static str,
    },
    /// The volume holds no solid voxel.
    #[error(
        "the volume holds no solid voxel: all values are background (zero, or below the threshold)"
    )]
    EmptyVolume,
    /// The volume holds no background voxel.
    #[error("the volume is solid throughout: it has no background voxel, so no surface")]
    SolidVolume,
    /// The requested label does not occur.
    #[error("label {label} does not occur; labels present: {present}")]
    NoSuchLabel {
        /// Requested label.
        label: u32,
        /// Labels that occur (the first few).
        present: String,
    },
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
    /// The mesh has no faces.
    #[error("the mesh has no faces")]
    EmptyMesh,
    /// A face has zero area.
    #[error(
        "face {face} near {} has no area; remove degenerate faces (in MeshLab: Remove Zero Area Faces)",
        point(at)
    )]
    ZeroAreaFace {
        /// Index of the face in the file.
        face: usize,
        /// One of its corners, in file units.
        at: DVec3,
    },
    /// An edge belongs to one face only.
    #[error(
        "the mesh is open: {edges} edges belong to one face only, the first near {}; close the hole (in MeshLab: Close Holes; in Blender: Fill Holes)",
        point(at)
    )]
    Hole {
        /// Midpoint of an open edge, in file units.
        at: DVec3,
        /// Number of open edges.
        edges: usize,
    },
    /// An edge belongs to more than two faces.
    #[error(
        "{faces} faces share the edge near {}; a closed surface has two at every edge (in MeshLab: Repair Non Manifold Edges)",
        point(at)
    )]
    NonManifoldEdge {
        /// Midpoint of the edge, in file units.
        at: DVec3,
        /// Number of faces at the edge.
        faces: usize,
    },
    /// Two neighbouring faces have opposite orientations.
    #[error(
        "faces {face} and {neighbour} near {} are wound in opposite senses; make the orientation coherent (in MeshLab: Re-Orient All Faces Coherently)",
        point(at)
    )]
    FlippedFace {
        /// Index of a face.
        face: usize,
        /// Index of the neighbouring face.
        neighbour: usize,
        /// Midpoint of the shared edge, in file units.
        at: DVec3,
    },
    /// The surface intersects itself.
    #[error(
        "faces {face} and {other} cross near {} ({pairs} pairs cross in all), so inside and outside are not told apart there; repair the mesh (in MeshLab: Select Self Intersecting Faces; in Blender: Remesh)",
        point(at)
    )]
    SelfIntersection {
        /// Index of a face.
        face: usize,
        /// Index of the intersecting face.
        other: usize,
        /// Number of intersecting pairs of faces.
        pairs: usize,
        /// A common point, in the units of the mesh.
        at: DVec3,
    },
    /// All normals point inwards.
    #[error("the mesh is inside out (its volume is {volume:.6e})")]
    InsideOut {
        /// Signed volume, in file units cubed.
        volume: f64,
    },
    /// The mesh consists of several closed surfaces.
    #[error(
        "the mesh consists of {count} separate surfaces of {sizes} faces; export one grain at a time"
    )]
    SeveralSurfaces {
        /// Number of surfaces.
        count: usize,
        /// Faces of each surface, largest first.
        sizes: String,
    },
    /// The finished shape failed the quality check.
    #[error("the shape fails its quality gate: {reason}")]
    Quality {
        /// The bound, and the value that exceeds it.
        reason: String,
    },
    /// Not a `.grain` file.
    #[error("{path}: not a grain file (it does not begin with the grain signature)")]
    NotAGrainFile {
        /// The file.
        path: PathBuf,
    },
    /// The file was written by a newer program.
    #[error(
        "{path}: grain file of version {found}, this program reads up to {supported}; update the program"
    )]
    FutureVersion {
        /// The file.
        path: PathBuf,
        /// Version of the file.
        found: u32,
        /// Newest supported version.
        supported: u32,
    },
    /// The checksum does not match.
    #[error("{path}: the grain file is damaged (checksum mismatch); make it again from its source")]
    Checksum {
        /// The file.
        path: PathBuf,
    },
}

impl ShapeError {
    pub(crate) fn malformed(path: &std::path::Path, reason: impl Into<String>) -> ShapeError {
        ShapeError::Malformed {
            path: path.to_owned(),
            reason: reason.into(),
        }
    }
    pub(crate) fn io(path: &std::path::Path, source: std::io::Error) -> ShapeError {
        ShapeError::Io {
            path: path.to_owned(),
            source,
        }
    }
}

/// Formats a point for messages.
fn point(at: &DVec3) -> String {
    let round = |x: f64| (1e6 * x).round() / 1e6 + 0.0;
    format!("({}, {}, {})", round(at.x), round(at.y), round(at.z))
}

/// Result of this crate's functions.
pub type Result<T> = std::result::Result<T, ShapeError>;

/// Refuses a length that is not finite and positive.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(ShapeError::BadParameter {
            name,
            value,
            reason: "must be finite and positive",
        })
    }
}
