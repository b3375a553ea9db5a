//! How much a reader may hold.

use crate::error::{Result, ShapeError};
use sha2::{Digest, Sha256};
use std::io::Read;
use std::path::Path;

/// Bounds on what a reader takes on; exceeded, the file is refused before memory is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadLimits {
    /// Largest file [bytes].
    pub file_bytes: u64,
    /// Largest volume [voxels].
    pub voxels: u64,
    /// Largest mesh [faces or vertices].
    pub mesh_elements: u64,
}

impl Default for ReadLimits {
    fn default() -> ReadLimits {
        ReadLimits {
            file_bytes: 4 << 30,
            voxels: 1 << 29,
            mesh_elements: 20_000_000,
        }
    }
}

/// A file's name (without its folder) and the SHA-256 of its bytes, for provenance.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceFile {
    /// File name without the folder.
    pub name: String,
    /// SHA-256 in hexadecimal, as `sha256sum` prints it.
    pub sha256: String,
}

/// The whole file, if it is not over the limit, and its identity.
pub(crate) fn read_bytes(path: &Path, limits: &ReadLimits) -> Result<(Vec<u8>, SourceFile)> {
    let file = std::fs::File::open(path).map_err(|e| ShapeError::io(path, e))?;
    let claimed = file.metadata().map_err(|e| ShapeError::io(path, e))?.len();
    let too_large = |bytes: u64| ShapeError::TooLarge {
        path: path.to_owned(),
        claimed: format!("at least {bytes} bytes"),
        limit: limits.file_bytes,
        unit: "bytes",
    };
    if claimed > limits.file_bytes {
        return Err(too_large(claimed));
    }
    let mut bytes = Vec::new();
    // The size is asked again while reading: a pipe or a growing file states none in advance.
    file.take(limits.file_bytes + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| ShapeError::io(path, e))?;
    if bytes.len() as u64 > limits.file_bytes {
        return Err(too_large(bytes.len() as u64));
    }
    let name = path
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    let sha256 = hex(&Sha256::digest(&bytes));
    Ok((bytes, SourceFile { name, sha256 }))
}

/// Lower-case extension of a file name.
pub(crate) fn extension(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default()
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
