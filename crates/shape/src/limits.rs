//! Limits on the size of input files and on memory.

use crate::error::{Result, ShapeError};
use grainwake_formats::bounded_file;
use sha2::{Digest, Sha256};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Limits on the size of input. Files that exceed them are refused before memory is allocated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadLimits {
    /// Maximum file size [bytes].
    pub file_bytes: u64,
    /// Maximum volume size [voxels].
    pub voxels: u64,
    /// Maximum mesh size [faces or vertices].
    pub mesh_elements: u64,
    /// Memory available for a volume, if known.
    pub memory: Option<Memory>,
}

/// Available memory, and the requirement of volume processing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// Available memory [bytes].
    pub available: u64,
    /// Memory per voxel [bytes].
    pub per_voxel: u64,
}

impl Memory {
    /// Returns the memory for this number of voxels [bytes] if it exceeds the available memory.
    fn lacking(&self, voxels: u64) -> Option<u64> {
        let needed = voxels.saturating_mul(self.per_voxel);
        (needed > self.available).then_some(needed)
    }
}

impl Default for ReadLimits {
    fn default() -> ReadLimits {
        ReadLimits { file_bytes: 4 << 30, voxels: 1 << 29, mesh_elements: 20_000_000, memory: None }
    }
}

impl ReadLimits {
    /// Returns limits for volumes that fit in the available memory at `per_voxel` [bytes]; the
    /// default if the available memory is unknown.
    pub fn of_this_machine(per_voxel: u64) -> ReadLimits {
        ReadLimits::default().within(crate::available_memory(), per_voxel)
    }

    fn within(self, available: Option<u64>, per_voxel: u64) -> ReadLimits {
        let Some(available) = available else {
            return self;
        };
        ReadLimits {
            file_bytes: self.file_bytes.min(available),
            // Voxel indices share 32 bits with a flag.
            voxels: (1 << 31) - 1,
            memory: Some(Memory { available, per_voxel }),
            ..self
        }
    }

    /// Refuses dimensions that exceed the limits; returns the number of voxels.
    pub(crate) fn admit(&self, path: &Path, dims: [u64; 3]) -> Result<u64> {
        let too_large = |more: String, limit, unit| {
            let claimed = format!("{} x {} x {} voxels{more}", dims[0], dims[1], dims[2]);
            ShapeError::too_large(path, &claimed, limit, unit)
        };
        let voxels = dims.iter().try_fold(1u64, |n, d| n.checked_mul(*d));
        let Some(voxels) = voxels.filter(|n| *n <= self.voxels) else {
            return Err(too_large(String::new(), self.voxels, "voxels"));
        };
        let lacking = self.memory.and_then(|m| Some((m.lacking(voxels)?, m)));
        if let Some((needed, memory)) = lacking {
            let needed = needed.div_ceil(1_000_000);
            return Err(too_large(
                format!(", which take {needed} MB of memory"),
                memory.available / 1_000_000,
                "MB that are free",
            ));
        }
        Ok(voxels)
    }
}

/// Name of a file and the SHA-256 of its content, for provenance, and its path, for messages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceFile {
    /// File name without the folder.
    pub name: String,
    /// Path as it was given; empty for data in memory.
    pub path: PathBuf,
    /// SHA-256 in hexadecimal, as `sha256sum` prints it.
    pub sha256: String,
}

impl SourceFile {
    pub(crate) fn new(path: &Path, content: Sha256) -> SourceFile {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        SourceFile { name, path: path.to_owned(), sha256: hex(&content.finalize()) }
    }
}

/// Reads a whole file within the size limit; returns content and identity.
pub(crate) fn read_bytes(path: &Path, limits: &ReadLimits) -> Result<(Vec<u8>, SourceFile)> {
    let bytes = bounded_file::read_bytes(path, limits.file_bytes).map_err(|e| match e.kind() {
        ErrorKind::FileTooLarge => {
            ShapeError::TooLarge { path: path.into(), reason: e.to_string() }
        }
        _ => ShapeError::io(path, e),
    })?;
    let source = SourceFile::new(path, Sha256::new_with_prefix(&bytes));
    Ok((bytes, source))
}

/// Returns the lower-case extension of a file name.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Returns the error of a mesh that claims more faces or vertices than the limits allow.
pub(crate) fn too_many_elements(path: &Path, claimed: &str, limits: &ReadLimits) -> ShapeError {
    ShapeError::too_large(path, claimed, limits.mesh_elements, "faces or vertices")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_volume_has_to_fit_into_the_memory_there_is() {
        let path = Path::new("a.npy");
        let read = |available, edge| {
            let limits = ReadLimits::default().within(available, 20);
            limits.admit(path, [edge; 3]).map_err(|e| e.to_string())
        };
        // Unknown memory: the fixed limit of 2^29 voxels applies.
        assert_eq!(read(None, 812), Ok(812 * 812 * 812));
        assert!(read(None, 813).is_err());
        // 400^3 voxels need 1.28 GB.
        assert_eq!(read(Some(1_280_000_000), 400), Ok(64_000_000));
        let message = read(Some(1_279_999_999), 400).unwrap_err();
        for word in ["a.npy", "400 x 400 x 400", "1280 MB", "1279 MB", "crop"] {
            assert!(message.contains(word), "`{word}` is missing in: {message}");
        }
        // Ample memory: the range of the indices is the limit.
        assert!(read(Some(1 << 40), 1290).is_ok());
        assert!(read(Some(1 << 40), 1291).is_err());
        assert!(read(Some(1 << 40), 1 << 40).is_err());
    }
}
