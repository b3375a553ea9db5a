//! STL, binary and text.

use super::TriangleMesh;
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, too_many_elements};
use glam::DVec3;
use std::io::Cursor;
use std::path::Path;

/// Size of the header of a binary file [bytes].
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

pub(super) fn read(path: &Path, mut bytes: Vec<u8>, limits: &ReadLimits) -> Result<TriangleMesh> {
    let binary = bytes.len() >= HEADER && {
        let count = u32::from_le_bytes([bytes[80], bytes[81], bytes[82], bytes[83]]);
        let needed = HEADER as u64 + TRIANGLE as u64 * u64::from(count);
        let size = bytes.len() as u64;
        if needed != size && !bytes.starts_with(b"solid") {
            let reason = format!(
                "the header counts {count} triangles, which take {needed} bytes, but the file has \
                 {size}"
            );
            return Err(ShapeError::malformed(path, reason));
        }
        needed == size
    };
    if binary {
        // Binary files often begin with the keyword that identifies text files.
        bytes[0] = b' ';
    } else if !bytes.starts_with(b"solid") {
        return Err(ShapeError::malformed(path, "too short for an STL file"));
    }
    let mut cursor = Cursor::new(bytes);
    let triangles =
        stl_io::create_stl_reader(&mut cursor).map_err(|e| ShapeError::malformed(path, e))?;
    let mut mesh = TriangleMesh::default();
    for triangle in triangles {
        let triangle = triangle.map_err(|e| ShapeError::malformed(path, e))?;
        if mesh.triangles.len() as u64 >= limits.mesh_elements {
            return Err(too_many_elements(path, "more faces", limits));
        }
        let first = mesh.vertices.len() as u32;
        let corner = |v: stl_io::Vector<f32>| DVec3::from_array(v.0.map(f64::from));
        mesh.vertices.extend(triangle.vertices.map(corner));
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    Ok(mesh)
}
