//! Wavefront OBJ: positions and faces. Polygons are triangulated; materials are ignored.

use super::{TriangleMesh, polygon};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, too_many_elements};
use glam::DVec3;
use std::io::Cursor;
use std::path::Path;

pub(super) fn read(path: &Path, bytes: Vec<u8>, limits: &ReadLimits) -> Result<TriangleMesh> {
    let options =
        tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let no_materials = |_: &Path| Ok((Vec::new(), Default::default()));
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials)
        .map_err(|e| ShapeError::malformed(path, e))?;
    let mut mesh = TriangleMesh::default();
    let mut face = 0;
    for model in models {
        let first = mesh.vertices.len() as u32;
        let positions = model.mesh.positions.chunks_exact(3);
        mesh.vertices.extend(positions.map(|p| DVec3::new(p[0], p[1], p[2])));
        let mut rest = &model.mesh.indices[..];
        let mut sizes = model.mesh.face_arities.iter();
        while !rest.is_empty() {
            // Sizes are omitted if all faces are triangles.
            let size = sizes.next().map_or(3, |n| *n as usize);
            let corners: Vec<u32> = rest[..size].iter().map(|c| first + c).collect();
            polygon::push(path, &mut mesh, face, &corners)?;
            (face, rest) = (face + 1, &rest[size..]);
        }
        if mesh.vertices.len().max(mesh.triangles.len()) as u64 > limits.mesh_elements {
            return Err(too_many_elements(path, "more faces or vertices", limits));
        }
    }
    Ok(mesh)
}
