//! Volumes with a text header: NRRD (`.nrrd`, `.nhdr`) and MetaImage (`.mha`, `.mhd`). Voxels are
//! raw or gzipped, in the header's file or in a separate one.
//!
//! Parsed here, because there is no dedicated crate for NRRD or MetaImage headers.

use super::npy::Number;
use super::volume::{Volume, count};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, read_bytes};
use flate2::read::{MultiGzDecoder, ZlibDecoder};
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Maximum header size [bytes].
const LONGEST: usize = 1 << 16;

/// Content of a header.
#[derive(Default)]
struct Fields {
    sizes: Vec<u64>,
    /// Kind and width [bytes] of the numbers, as in [`Number`].
    number: Option<(u8, usize)>,
    big: bool,
    packed: Packed,
    /// File with the voxels; `None` if they follow the header.
    data_file: Option<String>,
    /// Bytes before the voxels; -1 to read them from the end of the file.
    skip: i64,
}

#[derive(Default, PartialEq)]
enum Packed {
    #[default]
    Raw,
    Gzip,
    Zlib,
    Other,
}

pub(super) fn read_nrrd(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Volume> {
    let malformed = |reason: &str| ShapeError::malformed(path, reason);
    if !bytes.starts_with(b"NRRD000") {
        return Err(malformed("it does not begin with the NRRD signature"));
    }
    // The header ends at the first empty line, or at the end of a detached header file.
    let head = &bytes[..bytes.len().min(LONGEST)];
    let end = head.windows(2).position(|w| w == b"\n\n").map(|n| (n, n + 2));
    let end = end.or_else(|| head.windows(4).position(|w| w == b"\r\n\r\n").map(|n| (n, n + 4)));
    let (text_end, start) = end.unwrap_or((head.len(), head.len()));
    let text = String::from_utf8_lossy(&bytes[..text_end]);
    let mut fields = Fields::default();
    for line in text.lines().skip(1).filter(|l| !l.starts_with('#')) {
        let Some((key, value)) = line.split_once(": ") else {
            continue;
        };
        let value = value.trim();
        match key.trim().to_ascii_lowercase().as_str() {
            "sizes" => fields.sizes = sizes(value),
            "type" => fields.number = nrrd_type(value),
            "endian" => fields.big = value.eq_ignore_ascii_case("big"),
            "encoding" => {
                fields.packed = match value.to_ascii_lowercase().as_str() {
                    "raw" => Packed::Raw,
                    "gzip" | "gz" => Packed::Gzip,
                    _ => Packed::Other,
                }
            }
            "data file" | "datafile" => fields.data_file = Some(value.to_owned()),
            "byte skip" | "byteskip" => {
                fields.skip =
                    skip(value).ok_or_else(|| malformed("byte skip is not 0, 1, ... or -1"))?;
            }
            _ => {}
        }
    }
    if end.is_none() && fields.data_file.is_none() {
        return Err(malformed("the NRRD header does not end"));
    }
    voxels(path, fields, &bytes[start..], limits)
}

pub(super) fn read_meta(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Volume> {
    let malformed = |reason: &str| ShapeError::malformed(path, reason);
    let mut fields = Fields::default();
    let mut at = 0;
    // The data file name is the last line of the header.
    while fields.data_file.is_none() {
        let rest = &bytes[at..bytes.len().min(LONGEST).max(at)];
        let Some(end) = rest.iter().position(|b| *b == b'\n') else {
            return Err(malformed("the MetaImage header names no ElementDataFile"));
        };
        let line = String::from_utf8_lossy(&rest[..end]).into_owned();
        at += end + 1;
        let Some((key, value)) = line.split_once('=') else {
            continue;
        };
        let value = value.trim();
        let yes = value.eq_ignore_ascii_case("true");
        match key.trim() {
            "DimSize" => fields.sizes = sizes(value),
            "ElementType" => fields.number = meta_type(value),
            "BinaryDataByteOrderMSB" | "ElementByteOrderMSB" => fields.big = yes,
            "CompressedData" if yes => fields.packed = Packed::Zlib,
            "HeaderSize" => {
                fields.skip =
                    skip(value).ok_or_else(|| malformed("HeaderSize is not 0, 1, ... or -1"))?;
            }
            "ElementDataFile" => fields.data_file = Some(value.to_owned()),
            _ => {}
        }
    }
    if fields.data_file.as_deref() == Some("LOCAL") {
        fields.data_file = None;
    }
    voxels(path, fields, &bytes[at..], limits)
}

fn sizes(value: &str) -> Vec<u64> {
    // An unreadable number becomes 0 and is refused as an empty axis.
    value.split_whitespace().map(|n| n.parse().unwrap_or(0)).collect()
}

fn skip(value: &str) -> Option<i64> {
    value.parse().ok().filter(|n| *n >= -1)
}

fn nrrd_type(value: &str) -> Option<(u8, usize)> {
    let (kind, width) = match value.to_ascii_lowercase().as_str() {
        "signed char" | "int8" | "int8_t" => (b'i', 1),
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => (b'u', 1),
        "short" | "short int" | "signed short" | "int16" | "int16_t" => (b'i', 2),
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => (b'u', 2),
        "int" | "signed int" | "int32" | "int32_t" => (b'i', 4),
        "uint" | "unsigned int" | "uint32" | "uint32_t" => (b'u', 4),
        "float" => (b'f', 4),
        "double" => (b'f', 8),
        _ => return None,
    };
    Some((kind, width))
}

fn meta_type(value: &str) -> Option<(u8, usize)> {
    let (kind, width) = match value {
        "MET_CHAR" => (b'i', 1),
        "MET_UCHAR" => (b'u', 1),
        "MET_SHORT" => (b'i', 2),
        "MET_USHORT" => (b'u', 2),
        "MET_INT" => (b'i', 4),
        "MET_UINT" => (b'u', 4),
        "MET_FLOAT" => (b'f', 4),
        "MET_DOUBLE" => (b'f', 8),
        _ => return None,
    };
    Some((kind, width))
}

fn voxels(path: &Path, fields: Fields, own: &[u8], limits: &ReadLimits) -> Result<Volume> {
    let unsupported = |reason: String| ShapeError::unsupported(path, reason);
    let [nx, ny, nz] = fields.sizes[..] else {
        return Err(unsupported(format!("the image has sizes {:?}; a volume has 3", fields.sizes)));
    };
    let voxels = count(path, [nx, ny, nz], limits)? as u64;
    let Some((kind, width)) = fields.number else {
        let reason = "the type of the voxels is missing or unknown; save integers or floating-point \
                      numbers";
        return Err(unsupported(reason.into()));
    };
    let number = Number { big: fields.big, kind, width };
    let apart;
    let data = match &fields.data_file {
        None => own,
        Some(name) if name.contains(['/', '\\', ' ']) || name == "LIST" || name.contains('%') => {
            return Err(unsupported(format!(
                "its voxels lie in {name:?}; they must lie in one file in the same folder"
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
    let needed = voxels * number.width as u64;
    let raw = fields.packed == Packed::Raw;
    let skip = match fields.skip {
        -1 if raw => (data.len() as u64).saturating_sub(needed),
        -1 => return Err(unsupported("a byte skip of -1 is for raw voxels".into())),
        skip => skip as u64,
    };
    let data = data.get(usize::try_from(skip).unwrap_or(usize::MAX)..).unwrap_or(&[]);
    // Surplus data indicates slices that would be lost without notice.
    if let Some(name) = fields.data_file.filter(|_| raw && data.len() as u64 > needed) {
        return Err(unsupported(format!(
            "the header states {nx} x {ny} x {nz} voxels of {} bytes, {needed} bytes; {name:?} \
             has {} after a byte skip of {skip}; correct the sizes (DimSize), or the byte skip \
             (HeaderSize), which is -1 where the voxels end the file",
            number.width,
            data.len()
        )));
    }
    let dims = [nx, ny, nz].map(|n| n as usize);
    let unpacked: &mut dyn Read = match fields.packed {
        Packed::Raw => return number.volume(path, dims, false, data),
        Packed::Gzip => &mut MultiGzDecoder::new(data),
        Packed::Zlib => &mut ZlibDecoder::new(data),
        Packed::Other => {
            let reason = "the voxels are neither raw nor gzipped; save them so";
            return Err(unsupported(reason.into()));
        }
    };
    let mut plain = Vec::new();
    let read = unpacked.take(needed + 1).read_to_end(&mut plain);
    read.map_err(|e| ShapeError::malformed(path, format!("packed voxels: {e}")))?;
    number.volume(path, dims, false, &plain)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

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
                    HeaderSize = 5\nElementDataFile = a.raw\n";
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
}
