//! Selection of the mesh reader by file extension.

use super::{TriangleMesh, harmonics, obj, ply, stl, weld};
use crate::error::{Result, ShapeError, positive};
use crate::limits::{ReadLimits, SourceFile, extension, read_bytes};
use sha2::{Digest, Sha256};
use std::path::Path;

/// Mark with which some editors begin text in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads STL, OBJ, PLY or spherical-harmonic coefficients (.anm), merges coincident vertices and
/// checks that the surface is closed and consistently oriented. `unit` is the length [m] of the
/// file's unit: 1e-3 for millimetres. Errors report positions in the file's own units.
///
/// # Errors
/// The file cannot be read, exceeds the limits, has no format of the list, or its surface is not
/// one closed surface.
pub fn read_mesh(
    path: &Path,
    unit: f64,
    limits: &ReadLimits,
) -> Result<(TriangleMesh, SourceFile)> {
    positive("unit", unit)?;
    let reader = match extension(path).as_str() {
        "stl" => stl::read,
        "obj" => obj::read,
        "ply" => ply::read,
        "anm" => harmonics::read,
        _ => {
            let reason = "unknown file type; supported: .stl, .obj, .ply, .anm";
            return Err(ShapeError::unsupported(path, reason));
        }
    };
    let (mut bytes, source) = read_bytes(path, limits)?;
    if bytes.starts_with(BYTE_ORDER_MARK) {
        bytes.drain(..BYTE_ORDER_MARK.len());
    }
    let raw = reader(path, bytes, limits)?;
    if raw.triangles.is_empty() {
        return Err(ShapeError::malformed(path, "the file has no faces"));
    }
    let mesh = closed(&raw, unit).map_err(|error| error.in_file(&path.to_string_lossy()))?;
    Ok((mesh, source))
}

/// Merges coincident vertices of a mesh in memory and checks it as [`read_mesh`] does. `unit` is
/// the length [m] of its unit. The source has no name, and the hash of the coordinates and faces.
///
/// # Errors
/// The unit is not positive, or the surface is not one closed surface.
pub fn mesh_from_memory(mesh: &TriangleMesh, unit: f64) -> Result<(TriangleMesh, SourceFile)> {
    positive("unit", unit)?;
    let mut hash = Sha256::new();
    for x in mesh.vertices.iter().flat_map(|v| v.to_array()) {
        hash.update(x.to_le_bytes());
    }
    for vertex in mesh.triangles.iter().flatten() {
        hash.update(vertex.to_le_bytes());
    }
    Ok((closed(mesh, unit)?, SourceFile::new(Path::new(""), hash)))
}

fn closed(raw: &TriangleMesh, unit: f64) -> Result<TriangleMesh> {
    raw.check_faces()?;
    let (mesh, _) = weld::weld(raw);
    // An inverted mesh is left to the builder, which can flip it on request.
    match mesh.check_closed() {
        Err(ShapeError::InsideOut { .. }) | Ok(()) => Ok(mesh.scaled(unit)),
        Err(error) => Err(error),
    }
}
