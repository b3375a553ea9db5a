//! A folder of slices: one TIFF a slice, in the order of the numbers in their names.

use super::tiff;
use super::volume::{Volume, Voxels, count};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, SourceFile, extension, hex, read_bytes};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

pub(super) fn read(folder: &Path, limits: &ReadLimits) -> Result<(Volume, SourceFile)> {
    let io = |e| ShapeError::io(folder, e);
    let mut files: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if matches!(extension(&path).as_str(), "tif" | "tiff") {
            files.push(path);
        }
    }
    files.sort_by_key(|path| by_number(path));
    let mut dims = [0; 3];
    let mut labels: Vec<u32> = Vec::new();
    let mut numbers: Option<Vec<f32>> = None;
    let mut digest = Sha256::new();
    for path in &files {
        let (bytes, source) = read_bytes(path, limits)?;
        digest.update(source.sha256.as_bytes());
        let slice = tiff::read(path, &bytes, limits)?;
        if slice.dims[2] != 1 || (dims[2] > 0 && slice.dims[..2] != dims[..2]) {
            let reason = format!(
                "{} x {} voxels on {} pages, unlike the slice before; every slice must have one \
                 page of the same size",
                slice.dims[0], slice.dims[1], slice.dims[2]
            );
            return Err(ShapeError::malformed(path, reason));
        }
        dims = [slice.dims[0], slice.dims[1], dims[2] + 1];
        count(folder, dims.map(|n| n as u64), limits)?;
        match (&mut numbers, slice.voxels) {
            (None, Voxels::Labels(v)) => labels.extend(v),
            (all, voxels) => {
                let all = all.get_or_insert_with(|| labels.iter().map(|v| *v as f32).collect());
                match voxels {
                    Voxels::Labels(v) => all.extend(v.iter().map(|v| *v as f32)),
                    Voxels::Grey(v) => all.extend(v),
                }
            }
        }
    }
    if files.is_empty() {
        return Err(ShapeError::Unsupported {
            path: folder.to_owned(),
            reason: "the folder holds no .tif slices".into(),
        });
    }
    let volume = match numbers {
        None => Volume {
            dims,
            voxels: Voxels::Labels(labels),
        },
        Some(numbers) => Volume::from_numbers(dims, numbers)?,
    };
    let name = folder
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    let sha256 = hex(&digest.finalize());
    Ok((volume, SourceFile { name, sha256 }))
}

/// Key that puts slice 9 before slice 10: digits count by their number, the rest as text.
fn by_number(path: &Path) -> Vec<(u128, String)> {
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let mut key = vec![(0, String::new())];
    let mut digits = String::new();
    for c in name.chars().chain(['.']) {
        if c.is_ascii_digit() && digits.len() < 38 {
            digits.push(c);
            continue;
        }
        if !digits.is_empty() {
            key.push((digits.parse().unwrap_or(0), String::new()));
            digits.clear();
        }
        if let Some(last) = key.last_mut() {
            last.1.push(c);
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::tiff::encoder::{TiffEncoder, colortype::Gray8};

    #[test]
    fn slices_come_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, width: u32, values: &[u8]| {
            let mut file = std::fs::File::create(folder.path().join(name)).unwrap();
            let mut encoder = TiffEncoder::new(&mut file).unwrap();
            encoder.write_image::<Gray8>(width, 1, values).unwrap();
        };
        let limits = ReadLimits::default();
        assert!(read(folder.path(), &limits).is_err());
        write("slice_10.tif", 2, &[5, 6]);
        write("slice_9.tif", 2, &[3, 4]);
        write("slice_1.tif", 2, &[1, 2]);
        let (volume, source) = read(folder.path(), &limits).unwrap();
        assert_eq!(
            volume,
            Volume::from_labels([2, 1, 3], vec![1, 2, 3, 4, 5, 6]).unwrap()
        );
        assert_eq!(source.sha256.len(), 64);
        write("slice_11.tif", 1, &[7]);
        let error = read(folder.path(), &limits).unwrap_err();
        assert!(error.to_string().contains("slice_11"), "{error}");
    }
}
