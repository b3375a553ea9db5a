//! A folder of slices: one TIFF per slice, ordered by the numbers in the file names.

use super::geometry::StatedVoxel;
use super::tiff;
use super::volume::{Volume, Voxels, count};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, SourceFile, extension, read_bytes};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Volume of a folder, identity of the files, and the voxel edge that the first one states.
pub(super) type Slices = (Volume, SourceFile, Option<StatedVoxel>);

pub(super) fn read(folder: &Path, limits: &ReadLimits) -> Result<Slices> {
    let io = |e| ShapeError::io(folder, e);
    let mut files: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if matches!(extension(&path).as_str(), "tif" | "tiff") {
            files.push(path);
        }
    }
    files.sort_by_cached_key(|path| by_number(path));
    if let Some(reason) = gap(&files) {
        return Err(ShapeError::unsupported(folder, reason));
    }
    let mut dims = [0; 3];
    let mut voxels = Voxels::Labels(Vec::new());
    let mut digest = Sha256::new();
    let mut voxel = None;
    for path in &files {
        let (bytes, source) = read_bytes(path, limits)?;
        digest.update(source.sha256.as_bytes());
        let (slice, stated) = tiff::read(path, &bytes, limits)?;
        voxel = voxel.or(stated);
        if slice.dims[2] != 1 || (dims[2] > 0 && slice.dims[..2] != dims[..2]) {
            let reason = format!(
                "{} x {} voxels on {} pages, unlike the slice before; every slice must have one \
                 page of the same size",
                slice.dims[0], slice.dims[1], slice.dims[2]
            );
            return Err(ShapeError::malformed(path, reason));
        }
        dims = [slice.dims[0], slice.dims[1], dims[2] + 1];
        // The total is checked at the first slice, before the others are read.
        let all = [dims[0], dims[1], files.len()];
        count(folder, all.map(|n| n as u64), limits)?;
        voxels.append(slice.voxels);
    }
    if files.is_empty() {
        let reason = "the folder holds no .tif slices";
        return Err(ShapeError::unsupported(folder, reason));
    }
    let volume = Volume::from_voxels(folder, dims, voxels)?;
    Ok((volume, SourceFile::new(folder, digest), voxel))
}

/// Describes missing or duplicate numbers among slices whose names differ in one number only. The
/// numbers may have a constant increment such as two or ten.
fn gap(files: &[PathBuf]) -> Option<String> {
    let name = |n: usize| files[n].file_name().unwrap_or_default().to_string_lossy();
    let keys: Vec<_> = files.iter().map(|path| by_number(path)).collect();
    // Adjacent slices with the numbers that distinguish them.
    let adjacent = |(n, pair): (usize, &[Vec<(u128, String)>])| {
        let (one, next) = (&pair[0], &pair[1]);
        let alike = one.len() == next.len() && one.iter().zip(next).all(|(p, q)| p.1 == q.1);
        let numbers = one.iter().zip(next).map(|(p, q)| (p.0, q.0));
        let (low, high) = numbers.clone().find(|(p, q)| p != q).unwrap_or((0, 0));
        let differ = numbers.filter(|(p, q)| p != q).count();
        (alike && differ <= 1).then_some((n, low, high))
    };
    let pairs: Vec<_> = keys.windows(2).enumerate().filter_map(adjacent).collect();
    let step = pairs.iter().map(|(_, low, high)| high - low).min()?;
    if step == 0 {
        let (n, ..) = pairs.iter().find(|(_, low, high)| low == high)?;
        return Some(format!(
            "{} and {} have the same number; leave one of them",
            name(*n),
            name(n + 1)
        ));
    }
    let (n, ..) = pairs.iter().find(|(_, low, high)| high - low > step)?;
    let between = |(_, low, high): &(usize, u128, u128)| {
        let high = *high;
        std::iter::successors(Some(low + step), move |m| Some(m + step))
            .take_while(move |m| *m < high)
    };
    let missing: Vec<String> =
        pairs.iter().flat_map(between).take(11).map(|m| m.to_string()).collect();
    let more = if missing.len() > 10 { ", ..." } else { "" };
    Some(format!(
        "slices are missing after {}: numbers {}{more}; add them, or rename the slices so that they \
         count without a gap",
        name(*n),
        missing[..missing.len().min(10)].join(", ")
    ))
}

/// Sort key that orders slice 9 before slice 10: digit sequences compare as numbers, the rest as
/// text.
fn by_number(path: &Path) -> Vec<(u128, String)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
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
        write("slice_8.tif", 2, &[1, 2]);
        let (volume, source, _) = read(folder.path(), &limits).unwrap();
        assert_eq!(volume, Volume::from_labels([2, 1, 3], vec![1, 2, 3, 4, 5, 6]).unwrap());
        assert_eq!(source.sha256.len(), 64);
        write("slice_11.tif", 1, &[7]);
        let error = read(folder.path(), &limits).unwrap_err();
        assert!(error.to_string().contains("slice_11"), "{error}");
    }

    #[test]
    fn a_slice_that_is_missing_is_named() {
        let names = |names: &[&str]| -> Vec<PathBuf> { names.iter().map(PathBuf::from).collect() };
        let all: Vec<PathBuf> = (0..40).map(|n| format!("s{n}.tif").into()).collect();
        assert_eq!(gap(&all), None);
        let some = |keep: fn(usize) -> bool| -> Vec<PathBuf> {
            (0..40).filter(|n| keep(*n)).map(|n| all[n].clone()).collect()
        };
        let message = gap(&some(|n| n != 17)).unwrap();
        assert!(message.contains("after s16.tif: numbers 17;"), "{message}");
        let message = gap(&some(|n| n != 17 && n != 30)).unwrap();
        assert!(message.contains("after s16.tif: numbers 17, 30;"), "{message}");
        let message = gap(&some(|n| !(5..=35).contains(&n))).unwrap();
        assert!(message.contains("5, 6, 7, 8, 9, 10, 11, 12, 13, 14, ...;"), "{message}");
        // Increment of ten, with other constant numbers, and with several varying numbers.
        assert_eq!(gap(&some(|n| n % 10 == 0)), None);
        let message = gap(&some(|n| n % 4 == 0 && n != 8)).unwrap();
        assert!(message.contains("after s4.tif: numbers 8;"), "{message}");
        let message = gap(&names(&["2_5um_001.tif", "2_5um_002.tif", "2_5um_004.tif"])).unwrap();
        assert!(message.contains("numbers 3;"), "{message}");
        assert_eq!(gap(&names(&["a1.tif", "b2.tif", "c7.tif", "d.tif"])), None);
        assert_eq!(gap(&names(&["t1_s1.tif", "t1_s2.tif", "t2_s4.tif"])), None);
        let message = gap(&names(&["s1.tif", "s01.tif", "s2.tif"])).unwrap();
        assert!(message.contains("the same number"), "{message}");
        // Refused before a slice is read.
        let folder = tempfile::tempdir().unwrap();
        for name in ["s1.tif", "s2.tif", "s4.tif"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let error = read(folder.path(), &ReadLimits::default()).unwrap_err();
        assert!(error.to_string().contains("numbers 3;"), "{error}");
    }
}
