//! Decoding of volumes with a text header, NRRD and MetaImage: voxels are raw or compressed, in the
//! header's file or in a separate one.
//!
//! Headers are parsed here, because there is no dedicated crate for NRRD or MetaImage headers.

use super::geometry::{Geometry, StatedVoxel, mirror};
use super::npy::Number;
use super::volume::{Volume, count};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, read_bytes};
use flate2::read::{MultiGzDecoder, ZlibDecoder};
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Maximum header size [bytes].
pub(super) const LONGEST: usize = 1 << 16;

/// Content of a header.
#[derive(Default)]
pub(super) struct Header {
    pub sizes: Vec<u64>,
    /// Kind and width [bytes] of the numbers, as in [`Number`].
    pub number: Option<(u8, usize)>,
    /// Byte order of the numbers, if stated; true for big-endian.
    pub big: Option<bool>,
    pub packed: Packed,
    /// File with the voxels; `None` if they follow the header.
    pub data_file: Option<String>,
    /// Bytes before the voxels; -1 to read them from the end of the file.
    pub skip: i64,
    /// Voxel size and axes, if stated.
    pub geometry: Option<Geometry>,
}

/// Compression of the voxels.
#[derive(Default, PartialEq)]
pub(super) enum Packed {
    #[default]
    Raw,
    Gzip,
    Zlib,
    Other,
}

/// Parses the sizes of the axes.
pub(super) fn sizes(value: &str) -> Vec<u64> {
    // An unreadable number becomes 0 and is refused as an empty axis.
    value.split_whitespace().map(|n| n.parse().unwrap_or(0)).collect()
}

/// Parses a number of bytes to skip.
pub(super) fn skip(value: &str) -> Option<i64> {
    value.parse().ok().filter(|n| *n >= -1)
}

/// Parses `N` numbers separated by white space, commas or brackets.
pub(super) fn numbers<const N: usize>(value: &str) -> Option<[f64; N]> {
    let parts = value.split(|c: char| c.is_whitespace() || ",()".contains(c));
    let numbers = parts.filter(|part| !part.is_empty()).map(|part| part.parse().ok());
    numbers.collect::<Option<Vec<f64>>>()?.try_into().ok()
}

/// Reads the voxels that a header describes, from the bytes after it or from another file. The x
/// axis is reversed if the axes are left-handed.
pub(super) fn voxels(
    path: &Path,
    header: Header,
    own: &[u8],
    limits: &ReadLimits,
) -> Result<(Volume, Option<StatedVoxel>)> {
    let unsupported = |reason: String| ShapeError::unsupported(path, reason);
    let [nx, ny, nz] = header.sizes[..] else {
        return Err(unsupported(format!("the image has sizes {:?}; a volume has 3", header.sizes)));
    };
    let voxels = count(path, [nx, ny, nz], limits)? as u64;
    let stated = header.geometry.as_ref().map(|geometry| geometry.voxel(path)).transpose()?;
    let Some((kind, width)) = header.number else {
        let reason = "the type of the voxels is missing or unknown; save integers or floating-point \
                      numbers";
        return Err(unsupported(reason.into()));
    };
    if header.big.is_none() && width > 1 {
        return Err(unsupported(format!(
            "the byte order of its {width}-byte numbers is not stated; add endian: little (NRRD) \
             or BinaryDataByteOrderMSB = False (MetaImage), or big and True"
        )));
    }
    let number = Number { big: header.big == Some(true), kind, width };
    let apart;
    let data_file = header.data_file.as_deref().map(|name| name.trim_start_matches("./"));
    let data = match data_file {
        None => own,
        Some(name) if name.contains(['/', '\\']) => {
            return Err(unsupported(format!(
                "its voxels lie in {name:?}, in another folder; put that file beside the header \
                 and write its name alone"
            )));
        }
        Some(name) if is_several(name) => {
            return Err(unsupported(format!(
                "its voxels lie in several files, {name:?}; join them to one file, or save them \
                 as a folder of .tif or .png slices"
            )));
        }
        Some(name) => {
            apart = match read_bytes(&path.with_file_name(name), limits) {
                Err(ShapeError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
                    return Err(unsupported(format!(
                        "its voxels lie in {name:?}, which is not there; put it in the same \
                         folder, or correct its name in the header"
                    )));
                }
                read => read?.0,
            };
            &apart
        }
    };
    let needed = voxels * width as u64;
    let raw = header.packed == Packed::Raw;
    let skip = match header.skip {
        -1 if raw => (data.len() as u64).saturating_sub(needed),
        -1 => return Err(unsupported("a byte skip of -1 is for raw voxels".into())),
        skip => skip as u64,
    };
    let data = data.get(usize::try_from(skip).unwrap_or(usize::MAX)..).unwrap_or(&[]);
    let mut plain = Vec::new();
    let unpacked = match header.packed {
        Packed::Raw => data,
        Packed::Gzip => unpack(path, MultiGzDecoder::new(data), needed, &mut plain)?,
        Packed::Zlib => unpack(path, ZlibDecoder::new(data), needed, &mut plain)?,
        Packed::Other => {
            let reason = "the voxels are neither raw nor gzipped; save them so";
            return Err(unsupported(reason.into()));
        }
    };
    let dims = [nx, ny, nz].map(|n| n as usize);
    if unpacked.len() as u64 > needed {
        let place = data_file.map_or("the file".to_owned(), |name| format!("{name:?}"));
        let has = if raw { unpacked.len().to_string() } else { "more".to_owned() };
        let has = format!("{place} has {has} after a byte skip of {skip}");
        return Err(unsupported(format!(
            "{}; correct the sizes (DimSize), or the byte skip (HeaderSize), which is -1 where the \
             voxels end the file",
            number.surplus(dims, &has)
        )));
    }
    let mut volume = number.volume(path, dims, false, unpacked)?;
    if header.geometry.is_some_and(|geometry| geometry.mirrored()) {
        mirror(&mut volume);
    }
    Ok((volume, stated))
}

/// Returns whether a name stands for several files: `LIST`, or a pattern such as `slice%03d.raw`.
fn is_several(name: &str) -> bool {
    let is_place = |rest: &str| rest.trim_start_matches(char::is_numeric).starts_with('d');
    name.split(' ').next() == Some("LIST") || name.split('%').skip(1).any(is_place)
}

/// Decompresses `needed` bytes, and one more if there are more.
fn unpack<'a>(
    path: &Path,
    packed: impl Read,
    needed: u64,
    plain: &'a mut Vec<u8>,
) -> Result<&'a [u8]> {
    let read = packed.take(needed + 1).read_to_end(plain);
    read.map_err(|e| ShapeError::malformed(path, format!("packed voxels: {e}")))?;
    Ok(plain)
}

#[cfg(test)]
mod tests {
    use super::super::volume::Voxels;
    use super::super::{meta, nrrd};
    use super::*;
    use std::io::Write;

    fn read_nrrd(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Volume> {
        nrrd::read(path, bytes, limits).map(|(volume, _)| volume)
    }

    fn read_meta(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Volume> {
        meta::read(path, bytes, limits).map(|(volume, _)| volume)
    }

    fn limits() -> ReadLimits {
        ReadLimits { voxels: 1 << 20, ..Default::default() }
    }

    #[test]
    fn both_kinds_attached_and_apart_raw_and_packed() {
        let folder = tempfile::tempdir().unwrap();
        let expect = Volume::from_labels([3, 2, 1], vec![0, 1, 2, 3, 4, 500]).unwrap();
        let values: Vec<u16> = vec![0, 1, 2, 3, 4, 500];
        let little: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let big: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), Default::default());
        packer.write_all(&little).unwrap();
        let gzip = packer.finish().unwrap();
        let nrrd = |more: &str| {
            format!("NRRD0004\n# made by hand\ntype: ushort\ndimension: 3\nsizes: 3 2 1\n{more}")
        };
        let path = folder.path().join("a.nrrd");
        for (more, data) in [
            ("endian: little\nencoding: raw\n\n", &little),
            ("endian: big\nencoding: raw\n\n", &big),
            ("endian: little\nencoding: gzip\n\n", &gzip),
        ] {
            let mut bytes = nrrd(more).into_bytes();
            bytes.extend_from_slice(data);
            assert_eq!(read_nrrd(&path, &bytes, &limits()).unwrap(), expect, "{more}");
            for cut in 0..bytes.len() {
                assert!(read_nrrd(&path, &bytes[..cut], &limits()).is_err(), "{more} {cut}");
            }
        }
        std::fs::write(folder.path().join("a.raw"), [&[9; 5], &little[..]].concat()).unwrap();
        let apart = nrrd("endian: little\nencoding: raw\nbyte skip: 5\ndata file: a.raw\n");
        assert_eq!(read_nrrd(&path, apart.as_bytes(), &limits()).unwrap(), expect);
        let meta = "ObjectType = Image\nNDims = 3\nDimSize = 3 2 1\nElementType = MET_USHORT\n\
                    BinaryDataByteOrderMSB = False\nHeaderSize = 5\nElementDataFile = a.raw\n";
        assert_eq!(read_meta(&path, meta.as_bytes(), &limits()).unwrap(), expect);
        let mut local = meta.replace("HeaderSize = 5\n", "").replace("a.raw", "LOCAL").into_bytes();
        local.extend_from_slice(&little);
        assert_eq!(read_meta(&path, &local, &limits()).unwrap(), expect);
        // Bytes before the voxels are skipped only if the header declares them; undeclared slices
        // are never dropped silently.
        let ending = apart.replace("skip: 5", "skip: -1");
        assert_eq!(read_nrrd(&path, ending.as_bytes(), &limits()).unwrap(), expect);
        let message = |read: Result<Volume>| read.unwrap_err().to_string();
        let fewer =
            message(read_nrrd(&path, apart.replace("3 2 1", "3 1 1").as_bytes(), &limits()));
        for word in ["3 x 1 x 1", "6 bytes", "a.raw", "has 12", "skip of 5"] {
            assert!(fewer.contains(word), "`{word}` is missing in: {fewer}");
        }
        let fewer = meta.replace("HeaderSize = 5", "HeaderSize = 3");
        let fewer = message(read_meta(&path, fewer.as_bytes(), &limits()));
        assert!(fewer.contains("has 14"), "{fewer}");
        let none = apart.replace("a.raw", "none.raw");
        let none = message(read_nrrd(&path, none.as_bytes(), &limits()));
        assert!(none.contains("a.nrrd") && none.contains("none.raw"), "{none}");
        // Files in other folders are refused.
        let away = apart.replace("a.raw", "../a.raw");
        assert!(matches!(
            read_nrrd(&path, away.as_bytes(), &limits()),
            Err(ShapeError::Unsupported { .. })
        ));
        let huge = apart.replace("3 2 1", "300000 200000 100000");
        assert!(matches!(
            read_nrrd(&path, huge.as_bytes(), &limits()),
            Err(ShapeError::TooLarge { .. })
        ));
    }

    /// Reads `more` header lines with six labels of one byte: sizes, volume and stated voxel.
    fn nrrd_with(more: &str) -> Result<(Volume, Option<StatedVoxel>)> {
        let head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 3 2 1\nencoding: raw\n";
        let bytes = [format!("{head}{more}\n").as_bytes(), &[0, 1, 2, 3, 4, 5]].concat();
        nrrd::read(Path::new("a.nrrd"), &bytes, &limits())
    }

    fn meta_with(more: &str) -> Result<(Volume, Option<StatedVoxel>)> {
        let head = "NDims = 3\nDimSize = 3 2 1\nElementType = MET_UCHAR\n";
        let text = format!("{head}{more}ElementDataFile = LOCAL\n");
        let bytes = [text.as_bytes(), &[0, 1, 2, 3, 4, 5]].concat();
        meta::read(Path::new("a.mha"), &bytes, &limits())
    }

    #[test]
    fn voxel_edges_are_read_and_must_be_equal() {
        let edge = |read: Result<(Volume, Option<StatedVoxel>)>| read.unwrap().1.unwrap();
        let stated = edge(nrrd_with("spacings: 0.01 0.01 0.01\nunits: \"mm\" \"mm\" \"mm\"\n"));
        assert_eq!(stated.to_string(), "0.01 mm");
        let space = "space directions: (0,0.01,0) (0,0,0.01) (0.01,0,0)\n\
                     space units: \"mm\" \"mm\" \"mm\"\n";
        assert_eq!(edge(nrrd_with(space)).to_string(), "0.01 mm");
        assert_eq!(edge(meta_with("ElementSpacing = 2 2 2\n")).to_string(), "2 (no unit)");
        let unit = "ElementSize = 2 2 2\nDistanceUnits = um\n";
        assert_eq!(edge(meta_with(unit)).to_string(), "2 um");
        assert_eq!(nrrd_with("spacings: NaN NaN NaN\n").unwrap().1, None);
        assert_eq!(nrrd_with("spacings:=1 1 2\n").unwrap().1, None);
        assert_eq!(meta_with("").unwrap().1, None);
        for (read, key) in [
            (nrrd_with("spacings: 1 1 2.5\n"), "spacings: the voxel is 1 x 1 x 2.5"),
            (
                nrrd_with("space directions: (1,0,0) (0,1,0) (0,0,2.5)\n"),
                "space directions: the voxel is 1 x 1 x 2.5",
            ),
            (nrrd_with("space directions: none (0,1,0) (0,0,1)\n"), "three vectors"),
            (nrrd_with("spacings: 1 1 1\nunits: \"mm\" \"mm\" \"um\"\n"), "one unit"),
            (meta_with("ElementSpacing = 1 1 2.5\n"), "ElementSpacing: the voxel is 1 x 1 x 2.5"),
            (meta_with("ElementSpacing = 1 1\n"), "ElementSpacing: \"1 1\" is not 3 numbers"),
            (meta_with("TransformMatrix = 1 0 0 0 1 0 0.6 0 0.8\n"), "not perpendicular"),
        ] {
            let message = read.unwrap_err().to_string();
            assert!(message.contains(key), "`{key}` is missing in: {message}");
        }
    }

    /// Left-handed axes hold the mirror image, right-handed ones the object.
    #[test]
    fn left_handed_axes_are_mirrored() {
        let labels = |read: Result<(Volume, Option<StatedVoxel>)>| read.unwrap().0.voxels;
        let (plain, mirrored) = (vec![0, 1, 2, 3, 4, 5], vec![2, 1, 0, 5, 4, 3]);
        let (plain, mirrored) = (Voxels::Labels(plain), Voxels::Labels(mirrored));
        let nrrd = |space: &str, steps: &str| {
            labels(nrrd_with(&format!("space: {space}\nspace directions: {steps}\n")))
        };
        let lps = "left-posterior-superior";
        assert_eq!(nrrd(lps, "(1,0,0) (0,1,0) (0,0,1)"), plain);
        assert_eq!(nrrd(lps, "(-1,0,0) (0,1,0) (0,0,1)"), mirrored);
        assert_eq!(nrrd(lps, "(-1,0,0) (0,-1,0) (0,0,1)"), plain);
        assert_eq!(nrrd(lps, "(0,1,0) (1,0,0) (0,0,1)"), mirrored);
        assert_eq!(nrrd("LAS", "(1,0,0) (0,1,0) (0,0,1)"), mirrored);
        let meta = |axes: &str| labels(meta_with(&format!("TransformMatrix = {axes}\n")));
        assert_eq!(meta("1 0 0 0 1 0 0 0 1"), plain);
        assert_eq!(meta("-1 0 0 0 1 0 0 0 1"), mirrored);
        assert_eq!(meta("0 1 0 0 0 1 1 0 0"), plain);
        assert_eq!(meta("0 1 0 1 0 0 0 0 1"), mirrored);
    }

    #[test]
    fn surplus_voxels_are_refused_in_every_encoding() {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), Default::default());
        gzip.write_all(&[7; 10]).unwrap();
        let gzip = gzip.finish().unwrap();
        let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), Default::default());
        zlib.write_all(&[7; 10]).unwrap();
        let zlib = zlib.finish().unwrap();
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("my a.raw.gz"), &gzip).unwrap();
        let head = "NRRD0004\ntype: uchar\nsizes: 3 2 1\n";
        let refused = |more: &str, data: &[u8], words: &str| {
            let bytes = [format!("{head}{more}\n").as_bytes(), data].concat();
            let read = nrrd::read(&folder.path().join("a.nrrd"), &bytes, &limits());
            let message = read.unwrap_err().to_string();
            assert!(message.contains(words), "`{words}` is missing in: {message}");
        };
        refused("encoding: raw\n", &[7; 10], "6 bytes; the file has 10 after");
        refused("encoding: gzip\n", &gzip, "6 bytes; the file has more after");
        let apart = "encoding: gzip\ndata file: ./my a.raw.gz\n";
        refused(apart, &[], "6 bytes; \"my a.raw.gz\" has more after");
        let text = "DimSize = 3 2 1\nElementType = MET_UCHAR\nCompressedData = T\n\
                    ElementDataFile = LOCAL\n";
        let bytes = [text.as_bytes(), &zlib].concat();
        let message = read_meta(Path::new("a.mha"), &bytes, &limits()).unwrap_err().to_string();
        assert!(message.contains("the file has more"), "{message}");
    }

    #[test]
    fn keys_that_change_the_meaning_are_read_or_refused() {
        for (more, words) in [
            ("line skip: 2\n", "line skip: 2"),
            ("encoding: gzip\nbyte skip: 3\n", "byte skip: 3"),
            ("encoding: ascii\n", "neither raw nor gzipped"),
            ("endian: middle\n", "endian: \"middle\""),
            ("type: short\n", "byte order of its 2-byte numbers"),
            ("data file: slice%03d.raw 1 9 1\n", "several files"),
            ("data file: LIST\n", "several files"),
            ("data file: ../a.raw\n", "another folder"),
            ("data file: no such file.raw\n", "\"no such file.raw\", which is not there"),
        ] {
            let message = nrrd_with(more).unwrap_err().to_string();
            assert!(message.contains(words), "`{words}` is missing in: {message}");
        }
        nrrd_with("line skip: 0\n").unwrap();
        for (more, words) in [
            ("ElementNumberOfChannels = 3\n", "ElementNumberOfChannels = 3"),
            ("BinaryData = False\n", "BinaryData = False"),
            ("CompressedData = maybe\n", "CompressedData = maybe"),
            ("ElementType = MET_SHORT\n", "byte order of its 2-byte numbers"),
        ] {
            let message = meta_with(more).unwrap_err().to_string();
            assert!(message.contains(words), "`{words}` is missing in: {message}");
        }
        meta_with("ElementNumberOfChannels = 1\nBinaryData = True\n").unwrap();
        let big = |word: &str| {
            let text = format!(
                "DimSize = 1 1 1\nElementType = MET_USHORT\nBinaryDataByteOrderMSB = {word}\n\
                 ElementDataFile = LOCAL\n"
            );
            read_meta(Path::new("a.mha"), &[text.as_bytes(), &[1, 0]].concat(), &limits())
        };
        for (word, value) in [("True", 256), ("T", 256), ("1", 256), ("False", 1), ("0", 1)] {
            let voxels = Voxels::Labels(vec![value]);
            assert_eq!(big(word).unwrap().voxels, voxels, "{word}");
        }
    }
}
