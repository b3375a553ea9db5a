//! Wavefront OBJ: positions and faces. Polygons are triangulated; materials are ignored.

use super::{TriangleMesh, polygon};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, too_many_elements};
use glam::DVec3;
use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;
use tobj::LoadError;

pub(super) fn read(path: &Path, bytes: Vec<u8>, limits: &ReadLimits) -> Result<TriangleMesh> {
    let options =
        tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let no_materials = |_: &Path| Ok((Vec::new(), Default::default()));
    let mut text = Cursor::new(joined(&bytes));
    let (models, _) = tobj::load_obj_buf(&mut text, &options, no_materials)
        .map_err(|error| ShapeError::malformed(path, described(error, &text)))?;
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

/// Joins lines that a backslash continues. As many empty lines follow a joined line as it had
/// continuations, so that the lines after it keep their numbers. Comments are not continued.
fn joined(bytes: &[u8]) -> Cow<'_, [u8]> {
    if !bytes.contains(&b'\\') {
        return bytes.into();
    }
    let mut text = Vec::with_capacity(bytes.len());
    let mut continuations = 0;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        let is_comment = continuations == 0 && line.trim_ascii_start().starts_with(b"#");
        let continued = line.trim_ascii_end().strip_suffix(b"\\").filter(|_| !is_comment);
        if let Some(start) = continued {
            text.extend_from_slice(start);
            text.push(b' ');
            continuations += 1;
        } else {
            text.extend_from_slice(line);
            text.extend(std::iter::repeat_n(b'\n', std::mem::take(&mut continuations)));
        }
    }
    text.into()
}

/// Describes an error that ended the reading of `text`, with its line if that is known.
fn described(error: LoadError, text: &Cursor<Cow<[u8]>>) -> String {
    let what = match error {
        LoadError::ReadError => "the file is not text in UTF-8",
        LoadError::PositionParseError => "expected three numbers after \"v\"",
        LoadError::ColorParseError => "expected three, four or six numbers after \"v\"",
        LoadError::ScalingByZeroError => "the fourth number after \"v\" must not be zero",
        LoadError::NormalParseError => "expected three numbers after \"vn\"",
        LoadError::TexcoordParseError => "expected two numbers after \"vt\"",
        LoadError::FaceParseError => "expected the numbers of vertices after \"f\"",
        LoadError::FaceVertexOutOfBounds => return missing_vertex(text.get_ref()),
        // Found at the end of an object, or not related to a line.
        other => return other.to_string(),
    };
    let read = &text.get_ref()[..text.position() as usize];
    // The line that was read last; its line ending belongs to it.
    let number = read.split_inclusive(|byte| *byte == b'\n').count();
    format!("line {number}: {what}")
}

/// Describes the first face with a vertex that the file does not have.
fn missing_vertex(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let count = text.lines().filter(|line| line.trim_start().starts_with("v ")).count();
    let is_missing = |corner: &str| {
        let number = corner.split('/').next().and_then(|number| number.parse::<i64>().ok());
        number.is_some_and(|n| n == 0 || n.unsigned_abs() > count as u64)
    };
    let place = text.lines().enumerate().find_map(|(n, line)| {
        let mut corners = line.trim_start().strip_prefix("f ")?.split_whitespace();
        corners.find(|corner| is_missing(corner)).map(|corner| (n + 1, corner))
    });
    match place {
        Some((n, corner)) => {
            format!("line {n}: vertex {corner} does not exist; the file has {count}")
        }
        None => format!("a face has a vertex that does not exist; the file has {count}"),
    }
}
