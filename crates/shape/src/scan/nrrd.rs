//! NRRD headers (`.nrrd`, `.nhdr`).

use super::geometry::{Geometry, StatedVoxel};
use super::header::{Header, LONGEST, Packed, numbers, sizes, skip, voxels};
use super::volume::Volume;
use crate::error::{Result, ShapeError};
use crate::limits::ReadLimits;
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;

pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    limits: &ReadLimits,
) -> Result<(Volume, Option<StatedVoxel>)> {
    let malformed = |reason: &str| ShapeError::malformed(path, reason);
    let refused = |key: &str, value: &str, what: &str| refused(path, key, value, what);
    if !bytes.starts_with(b"NRRD000") {
        return Err(malformed("it does not begin with the NRRD signature"));
    }
    // The header ends at the first empty line, or at the end of a detached header file.
    let head = &bytes[..bytes.len().min(LONGEST)];
    let end = head.windows(2).position(|w| w == b"\n\n").map(|n| (n, n + 2));
    let end = end.or_else(|| head.windows(4).position(|w| w == b"\r\n\r\n").map(|n| (n, n + 4)));
    let (text_end, start) = end.unwrap_or((head.len(), head.len()));
    let text = String::from_utf8_lossy(&bytes[..text_end]);
    let mut header = Header::default();
    let mut space = HashMap::new();
    for line in text.lines().skip(1).filter(|l| !l.starts_with('#')) {
        // Lines with `:=` are notes of the user.
        let Some((key, value)) = line.split_once(':').filter(|(_, v)| !v.starts_with('=')) else {
            continue;
        };
        let value = value.trim();
        match key.trim().to_ascii_lowercase().as_str() {
            "sizes" => header.sizes = sizes(value),
            "type" => header.number = number(value),
            "endian" => {
                header.big = match value.to_ascii_lowercase().as_str() {
                    "little" => Some(false),
                    "big" => Some(true),
                    _ => return Err(refused(key, value, "little or big")),
                }
            }
            "encoding" => {
                header.packed = match value.to_ascii_lowercase().as_str() {
                    "raw" => Packed::Raw,
                    "gzip" | "gz" => Packed::Gzip,
                    _ => Packed::Other,
                }
            }
            "data file" | "datafile" => header.data_file = Some(value.to_owned()),
            "byte skip" | "byteskip" => {
                header.skip =
                    skip(value).ok_or_else(|| malformed("byte skip is not 0, 1, ... or -1"))?;
            }
            "line skip" | "lineskip" if value != "0" => {
                let reason = format!(
                    "line skip: {value} is not supported; remove these lines from the data"
                );
                return Err(ShapeError::unsupported(path, reason));
            }
            key => {
                space.insert(key.to_owned(), value.to_owned());
            }
        }
    }
    if header.packed == Packed::Gzip && header.skip != 0 {
        let reason = format!(
            "byte skip: {} is not supported for gzipped voxels; save them without other data",
            header.skip
        );
        return Err(ShapeError::unsupported(path, reason));
    }
    if end.is_none() && header.data_file.is_none() {
        return Err(malformed("the NRRD header does not end"));
    }
    // Images of other dimensions are refused by their sizes.
    if header.sizes.len() == 3 {
        header.geometry = geometry(path, &space)?;
    }
    voxels(path, header, &bytes[start..], limits)
}

fn refused(path: &Path, key: &str, value: &str, what: &str) -> ShapeError {
    ShapeError::unsupported(path, format!("{key}: {value:?} is not {what}; correct the header"))
}

/// Returns the voxel size and the axes from the fields of the header.
fn geometry(path: &Path, fields: &HashMap<String, String>) -> Result<Option<Geometry>> {
    let field = |key: &str| fields.get(key).map(String::as_str).unwrap_or_default();
    let refused = |key: &str, value: &str, what: &str| refused(path, key, value, what);
    let unit = |key: &'static str| {
        // Each unit is in quotation marks.
        let mut units = field(key).split('"').skip(1).step_by(2);
        let first = units.next().unwrap_or_default().to_owned();
        let all = units.all(|unit| unit == first);
        all.then_some(first).ok_or_else(|| refused(key, field(key), "one unit for all axes"))
    };
    if let Some(value) = fields.get("space directions") {
        let key = "space directions";
        let Some([a, b, c, d, e, f, g, h, i]) = numbers(value) else {
            return Err(refused(key, value, "three vectors of three numbers"));
        };
        let steps = [DVec3::new(a, b, c), DVec3::new(d, e, f), DVec3::new(g, h, i)];
        let space = field("space").to_ascii_lowercase();
        let left_handed = ["left-anterior-superior", "las", "3d-left-handed"]
            .iter()
            .any(|s| space.starts_with(s));
        return Ok(Some(Geometry { key, steps, unit: unit("space units")?, left_handed }));
    }
    let Some(value) = fields.get("spacings") else {
        return Ok(None);
    };
    let Some(edges) = numbers(value) else {
        return Err(refused("spacings", value, "three numbers"));
    };
    // An unknown spacing is written as NaN.
    let known = edges.iter().any(|edge: &f64| !edge.is_nan());
    Ok(known.then_some(Geometry::of_edges("spacings", edges, unit("units")?)))
}

fn number(value: &str) -> Option<(u8, usize)> {
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
