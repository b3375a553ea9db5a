//! MetaImage headers (`.mha`, `.mhd`).

use super::geometry::{Geometry, StatedVoxel};
use super::header::{Header, LONGEST, Packed, numbers, sizes, skip, voxels};
use super::volume::Volume;
use crate::error::{Result, ShapeError};
use crate::limits::ReadLimits;
use glam::DVec3;
use std::path::Path;

pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    limits: &ReadLimits,
) -> Result<(Volume, Option<StatedVoxel>)> {
    let malformed = |reason: &str| ShapeError::malformed(path, reason);
    let mut header = Header::default();
    let (mut spacing, mut size, mut axes, mut unit) = (None, None, None, String::new());
    let mut at = 0;
    // The data file name is the last line of the header.
    while header.data_file.is_none() {
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
        let key = key.trim();
        let refused =
            |remedy: &str| ShapeError::unsupported(path, format!("{key} = {value} {remedy}"));
        // Only the first character counts.
        let flag = || match value.chars().next() {
            Some('T' | 't' | '1') => Ok(true),
            Some('F' | 'f' | '0') => Ok(false),
            _ => Err(refused("is neither True nor False; correct the header")),
        };
        match key {
            "DimSize" => header.sizes = sizes(value),
            "ElementType" => header.number = number(value),
            "BinaryDataByteOrderMSB" | "ElementByteOrderMSB" => header.big = Some(flag()?),
            "CompressedData" if flag()? => header.packed = Packed::Zlib,
            "BinaryData" if !flag()? => {
                return Err(refused("means voxels as text; save them in binary form"));
            }
            "ElementNumberOfChannels" if value != "1" => {
                return Err(refused("is not supported; save one channel alone"));
            }
            "HeaderSize" => {
                header.skip =
                    skip(value).ok_or_else(|| malformed("HeaderSize is not 0, 1, ... or -1"))?;
            }
            "ElementSpacing" => spacing = Some(("ElementSpacing", value.to_owned())),
            "ElementSize" => size = Some(("ElementSize", value.to_owned())),
            "TransformMatrix" | "Rotation" | "Orientation" => axes = Some(value.to_owned()),
            "DistanceUnits" => value.trim_matches('?').clone_into(&mut unit),
            "ElementDataFile" => header.data_file = Some(value.to_owned()),
            _ => {}
        }
    }
    if header.data_file.as_deref() == Some("LOCAL") {
        header.data_file = None;
    }
    // Images of other dimensions are refused by their sizes.
    if header.sizes.len() == 3 {
        header.geometry = geometry(path, spacing.or(size), axes, unit)?;
    }
    voxels(path, header, &bytes[at..], limits)
}

/// Returns the voxel size and the axes. The spacing is 1 if it is not stated.
fn geometry(
    path: &Path,
    spacing: Option<(&'static str, String)>,
    axes: Option<String>,
    unit: String,
) -> Result<Option<Geometry>> {
    let refused = |key: &str, value: &str, count: usize| {
        let reason = format!("{key}: {value:?} is not {count} numbers; correct the header");
        ShapeError::unsupported(path, reason)
    };
    let edges = match &spacing {
        Some((key, value)) => numbers::<3>(value).ok_or_else(|| refused(key, value, 3))?,
        None => [1.0; 3],
    };
    let Some(axes) = axes else {
        return Ok(spacing.map(|(key, _)| Geometry::of_edges(key, edges, unit)));
    };
    let Some([a, b, c, d, e, f, g, h, i]) = numbers(&axes) else {
        return Err(refused("TransformMatrix", &axes, 9));
    };
    let axes = [DVec3::new(a, b, c), DVec3::new(d, e, f), DVec3::new(g, h, i)];
    let steps = std::array::from_fn(|n| axes[n] * edges[n]);
    let key = "ElementSpacing and TransformMatrix";
    Ok(Some(Geometry { key, steps, unit, left_handed: false }))
}

fn number(value: &str) -> Option<(u8, usize)> {
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
