//! A folder of slices: one TIFF or PNG per slice, ordered by the numbers in the file names.

use super::geometry::StatedVoxel;
use super::volume::{Volume, Voxels, count};
use super::{png, tiff};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, SourceFile, extension, read_bytes};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Volume of a folder, identity of the files, and the voxel edge that the first one states.
pub(super) type Slices = (Volume, SourceFile, Option<StatedVoxel>);

pub(super) fn read(folder: &Path, limits: &ReadLimits) -> Result<Slices> {
    let files = slice_files(folder)?;
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
        let (slice, stated) = match extension(path).as_str() {
            "png" => (png::read(path, &bytes, limits)?, None),
            _ => tiff::read(path, &bytes, limits)?,
        };
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
    let volume = Volume::from_voxels(folder, dims, voxels)?;
    Ok((volume, SourceFile::new(folder, digest), voxel))
}

/// Returns the slices of a folder in their order: its TIFF files, or its PNG files if it has no
/// TIFF.
fn slice_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let io = |e| ShapeError::io(folder, e);
    let mut all: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        all.push(entry.map_err(io)?.path());
    }
    let of = |extensions: &[&str]| -> Vec<PathBuf> {
        all.iter().filter(|path| extensions.contains(&&*extension(path))).cloned().collect()
    };
    let mut files = of(&["tif", "tiff"]);
    if files.is_empty() {
        files = of(&["png"]);
    }
    if files.is_empty() {
        let mut reason = "the folder holds no .tif or .png slices".to_owned();
        if let Some(other) = ["bmp", "jpg", "jpeg", "dcm"].iter().find(|e| !of(&[e]).is_empty()) {
            let count = of(&[other]).len();
            reason += &format!(", but {count} .{other}; convert them to 8- or 16-bit TIFF");
        }
        return Err(ShapeError::unsupported(folder, reason));
    }
    files.sort_by_cached_key(|path| by_number(path));
    Ok(files)
}

/// Describes what keeps the files from being one series of slices: names that differ in more than
/// one number, and missing or duplicate numbers. The numbers may have a constant increment such as
/// two or ten.
fn gap(files: &[PathBuf]) -> Option<String> {
    let name = |n: usize| files[n].file_name().unwrap_or_default().to_string_lossy();
    let keys: Vec<_> = files.iter().map(|path| by_number(path)).collect();
    let first = keys.first()?;
    // Place of the slice number in the key.
    let mut place = None;
    for (n, key) in keys.iter().enumerate().skip(1) {
        let alike = key.len() == first.len() && key.iter().zip(first).all(|(p, q)| p.1 == q.1);
        let mut differ = (0..first.len().min(key.len())).filter(|m| key[*m].0 != first[*m].0);
        if !alike || differ.any(|m| *place.get_or_insert(m) != m) {
            return Some(format!(
                "{} and {} differ in more than the slice number; keep one series of slices in the \
                 folder, with names that differ in one number",
                name(0),
                name(n)
            ));
        }
    }
    let number = |n: usize| keys[n][place.unwrap_or(0)].0;
    let pairs = || (1..files.len()).map(|n| (n - 1, number(n - 1), number(n)));
    let step = pairs().map(|(_, low, high)| high - low).min()?;
    if step == 0 {
        let (n, ..) = pairs().find(|(_, low, high)| low == high)?;
        return Some(format!(
            "{} and {} have the same number; leave one of them",
            name(n),
            name(n + 1)
        ));
    }
    let (n, ..) = pairs().find(|(_, low, high)| high - low > step)?;
    let between = |(_, low, high): (usize, u128, u128)| {
        std::iter::successors(Some(low + step), move |m| Some(m + step))
            .take_while(move |m| *m < high)
    };
    let missing: Vec<String> = pairs().flat_map(between).take(11).map(|m| m.to_string()).collect();
    let more = if missing.len() > 10 { ", ..." } else { "" };
    Some(format!(
        "slices are missing after {}: numbers {}{more}; add them, or rename the slices so that they \
         count without a gap",
        name(n),
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
    fn png_slices_are_read_if_there_is_no_tiff() {
        let folder = tempfile::tempdir().unwrap();
        let limits = ReadLimits::default();
        std::fs::write(folder.path().join("s1.bmp"), "").unwrap();
        let error = read(folder.path(), &limits).unwrap_err().to_string();
        assert!(error.contains("but 1 .bmp; convert them"), "{error}");
        for (name, values) in [("s10.png", [3u8, 4]), ("s9.png", [1, 2])] {
            let file = std::fs::File::create(folder.path().join(name)).unwrap();
            let mut encoder = ::png::Encoder::new(file, 2, 1);
            encoder.set_color(::png::ColorType::Grayscale);
            encoder.write_header().unwrap().write_image_data(&values).unwrap();
        }
        let (volume, ..) = read(folder.path(), &limits).unwrap();
        assert_eq!(volume, Volume::from_labels([2, 1, 2], vec![1, 2, 3, 4]).unwrap());
        // A picture beside TIFF slices is no slice.
        let mut file = std::fs::File::create(folder.path().join("s1.tif")).unwrap();
        TiffEncoder::new(&mut file).unwrap().write_image::<Gray8>(1, 1, &[7]).unwrap();
        let (volume, ..) = read(folder.path(), &limits).unwrap();
        assert_eq!(volume, Volume::from_labels([1, 1, 1], vec![7]).unwrap());
    }

    fn names(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn two_series_in_a_folder_are_refused() {
        let two = |a: &str, b: &str| format!("{a} and {b} differ in more than the slice number");
        for (files, expected) in [
            (&["a_000.tif", "a_001.tif", "b_000.tif", "b_001.tif"], two("a_000.tif", "b_000.tif")),
            (&["average.tif", "s1.tif", "s2.tif", "s3.tif"], two("average.tif", "s1.tif")),
            (&["t1_s1.tif", "t1_s2.tif", "t2_s1.tif", "t2_s2.tif"], two("t1_s1.tif", "t2_s1.tif")),
            (&["t1_s1.tif", "t1_s2.tif", "t1_s3.tif", "t2_s4.tif"], two("t1_s1.tif", "t2_s4.tif")),
        ] {
            let message = gap(&names(files)).unwrap();
            assert!(message.starts_with(&expected), "{message}");
        }
        assert_eq!(gap(&names(&["only.tif"])), None);
        assert_eq!(gap(&names(&["2024_s08.tif", "2024_s09.tif", "2024_s10.tif"])), None);
    }

    #[test]
    fn a_slice_that_is_missing_is_named() {
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
        // Increment of ten, and with other constant numbers.
        assert_eq!(gap(&some(|n| n % 10 == 0)), None);
        let message = gap(&some(|n| n % 4 == 0 && n != 8)).unwrap();
        assert!(message.contains("after s4.tif: numbers 8;"), "{message}");
        let message = gap(&names(&["2_5um_001.tif", "2_5um_002.tif", "2_5um_004.tif"])).unwrap();
        assert!(message.contains("numbers 3;"), "{message}");
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
