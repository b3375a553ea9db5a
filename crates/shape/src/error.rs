//! What can go wrong when a shape is read, built or saved.

use glam::DVec3;
use std::path::PathBuf;
use thiserror::Error;

/// Why a shape was refused. Every message names the place and, where there is one, the remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// The operating system could not read or write the file.
    #[error("cannot access {path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The file name ends in something no reader knows.
    #[error("{path}: unknown file type; known here: {known}")]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Extensions that are read.
        known: &'static str,
    },
    /// The file claims more than the reader is allowed to hold.
    #[error("{path}: claims {claimed}, the limit is {limit} {unit}; crop or coarsen the data")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What it claims.
        claimed: String,
        /// What is allowed.
        limit: u64,
        /// Of what.
        unit: &'static str,
    },
    /// The file ends early or contradicts itself.
    #[error("{path}: damaged or not what its name says: {reason}")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        reason: String,
    },
    /// The file is sound but of a kind that is not read.
    #[error("{path}: {reason}")]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// Which kind, and what to do.
        reason: String,
    },
    /// A coordinate or grey value is NaN or infinite.
    #[error("{what} is not a finite number")]
    NotFinite {
        /// Which one.
        what: String,
    },
    /// A parameter is out of its range.
    #[error("{name} = {value}: {reason}")]
    BadParameter {
        /// Parameter.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What it must be.
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
    /// The label asked for does not occur.
    #[error("label {label} does not occur; labels present: {present}")]
    NoSuchLabel {
        /// Label asked for.
        label: u32,
        /// The labels there are (the first few).
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
        /// Which faces of the image.
        faces: String,
    },
    /// One label, several separate bodies.
    #[error("label {label} consists of {count} separate pieces of {sizes} voxels")]
    SeveralPieces {
        /// Label.
        label: u32,
        /// How many.
        count: usize,
        /// Voxel counts, largest first.
        sizes: String,
    },
    /// Too few voxels to carry a shape.
    #[error("label {label} has {voxels} voxels; at least {needed} are needed for a usable surface")]
    TooFewVoxels {
        /// Label.
        label: u32,
        /// Voxels it has.
        voxels: u64,
        /// Voxels needed.
        needed: u64,
    },
    /// The mesh has no faces.
    #[error("the mesh has no faces")]
    EmptyMesh,
    /// A face has no area.
    #[error(
        "face {face} near {} has no area; remove degenerate faces (in MeshLab: Remove Zero Area Faces)",
        point(at)
    )]
    ZeroAreaFace {
        /// Index of the face in the file.
        face: usize,
        /// A corner of it, in file units.
        at: DVec3,
    },
    /// An edge with one face only.
    #[error(
        "the mesh is open: {edges} edges belong to one face only, the first near {}; close the hole (in MeshLab: Close Holes; in Blender: Fill Holes)",
        point(at)
    )]
    Hole {
        /// Middle of an open edge, in file units.
        at: DVec3,
        /// Number of open edges.
        edges: usize,
    },
    /// An edge with more than two faces.
    #[error(
        "{faces} faces share the edge near {}; a closed surface has two at every edge (in MeshLab: Repair Non Manifold Edges)",
        point(at)
    )]
    NonManifoldEdge {
        /// Middle of the edge, in file units.
        at: DVec3,
        /// Number of faces at it.
        faces: usize,
    },
    /// Two neighbours wound in opposite senses.
    #[error(
        "faces {face} and {neighbour} near {} are wound in opposite senses; make the orientation coherent (in MeshLab: Re-Orient All Faces Coherently)",
        point(at)
    )]
    FlippedFace {
        /// Index of a face.
        face: usize,
        /// Index of its neighbour.
        neighbour: usize,
        /// Middle of the shared edge, in file units.
        at: DVec3,
    },
    /// The surface runs through itself.
    #[error(
        "faces {face} and {other} cross near {} ({pairs} pairs cross in all), so inside and outside are not told apart there; repair the mesh (in MeshLab: Select Self Intersecting Faces; in Blender: Remesh)",
        point(at)
    )]
    SelfIntersection {
        /// Index of a face.
        face: usize,
        /// Index of the face that it crosses.
        other: usize,
        /// Pairs of faces that cross.
        pairs: usize,
        /// A point that they share, in the mesh's units.
        at: DVec3,
    },
    /// Normals point inwards everywhere.
    #[error("the mesh is inside out (its volume is {volume:.6e})")]
    InsideOut {
        /// Signed volume, in file units cubed.
        volume: f64,
    },
    /// Several closed surfaces in one mesh.
    #[error(
        "the mesh consists of {count} separate surfaces of {sizes} faces; export one grain at a time"
    )]
    SeveralSurfaces {
        /// How many.
        count: usize,
        /// Faces in each, largest first.
        sizes: String,
    },
    /// The finished shape failed the quality gate.
    #[error("the shape fails its quality gate: {reason}")]
    Quality {
        /// Which bound, and by how much.
        reason: String,
    },
    /// Not a `.grain` file.
    #[error("{path}: not a grain file (it does not begin with the grain signature)")]
    NotAGrainFile {
        /// The file.
        path: PathBuf,
    },
    /// Written by a newer program.
    #[error(
        "{path}: grain file of version {found}, this program reads up to {supported}; update the program"
    )]
    FutureVersion {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// The newest version known here.
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

/// A point as a person writes it.
fn point(at: &DVec3) -> String {
    let round = |x: f64| (1e6 * x).round() / 1e6 + 0.0;
    format!("({}, {}, {})", round(at.x), round(at.y), round(at.z))
}

/// Short alias used throughout the crate.
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
