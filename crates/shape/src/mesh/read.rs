//! Selection of the mesh reader by file extension.

use super::{TriangleMesh, harmonics, obj, ply, stl, weld};
use crate::error::{Result, ShapeError, positive};
use crate::limits::{ReadLimits, SourceFile, extension, read_bytes};
use std::path::Path;

/// Reads STL, OBJ, PLY or spherical-harmonic coefficients (.anm), merges coincident vertices and
/// checks that the surface is closed and consistently oriented. `unit` is the length [m] of the
/// file's unit: 1e-3 for millimetres. Errors report positions in the file's own units.
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
    let (bytes, source) = read_bytes(path, limits)?;
    let raw = reader(path, bytes, limits)?;
    raw.check_faces()?;
    let (mesh, _) = weld::weld(&raw);
    // An inverted mesh is left to the builder, which can flip it on request.
    match mesh.check_closed() {
        Err(ShapeError::InsideOut { .. }) | Ok(()) => Ok((mesh.scaled(unit), source)),
        Err(error) => Err(error),
    }
}
