//! STL, binary and text.

use super::TriangleMesh;
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, too_many_elements};
use glam::DVec3;
use std::io::{Cursor, ErrorKind};
use std::path::Path;

/// Size of the header of a binary file [bytes].
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

pub(super) fn read(path: &Path, mut bytes: Vec<u8>, limits: &ReadLimits) -> Result<TriangleMesh> {
    let text = text(&bytes);
    let binary = bytes.len() >= HEADER && {
        let count = u32::from_le_bytes([bytes[80], bytes[81], bytes[82], bytes[83]]);
        let needed = HEADER as u64 + TRIANGLE as u64 * u64::from(count);
        let size = bytes.len() as u64;
        if needed != size && text.is_none() {
            let hint = match is_named_solid(&bytes) {
                true => "",
                false => "; a text file begins with the word solid",
            };
            let reason = format!(
                "the header counts {count} triangles, which take {needed} bytes, but the file has \
                 {size}{hint}"
            );
            return Err(ShapeError::malformed(path, reason));
        }
        needed == size
    };
    if binary {
        // Binary files often begin with the keyword that identifies text files.
        bytes[0] = b' ';
    } else if let Some(text) = text {
        bytes = text;
    } else {
        return Err(ShapeError::malformed(path, "too short for an STL file"));
    }
    let mut cursor = Cursor::new(bytes);
    let mut mesh = TriangleMesh::default();
    let damaged = |error: std::io::Error, facets: usize| {
        let reason = match error.kind() {
            ErrorKind::UnexpectedEof => {
                format!("the file ends after {facets} facets, without endsolid")
            }
            _ => format!("face {facets} (counted from 0): {}", plain(&error.to_string())),
        };
        ShapeError::malformed(path, reason)
    };
    let triangles = stl_io::create_stl_reader(&mut cursor).map_err(|error| damaged(error, 0))?;
    for triangle in triangles {
        let triangle = triangle.map_err(|error| damaged(error, mesh.triangles.len()))?;
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

/// Rewords a message of `stl_io` about a coordinate that is not finite.
fn plain(message: &str) -> String {
    match message.strip_prefix("expected finite f32, got ") {
        Some(found) => {
            let value = found.split(' ').next().unwrap_or_default();
            format!("a coordinate is {value}, not a finite number")
        }
        None => message.to_owned(),
    }
}

/// Returns whether a file begins with the word "solid", as text files and many binary ones do.
fn is_named_solid(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

/// Returns a text file in the form that `stl_io` reads: lower case, and no blanks or name before
/// the facets. `None` for other files. The highest byte of the number of triangles is zero in
/// binary files; text has no such byte.
fn text(bytes: &[u8]) -> Option<Vec<u8>> {
    let is_binary = bytes.get(..HEADER).is_some_and(|header| header.contains(&0));
    if is_binary || !is_named_solid(bytes) {
        return None;
    }
    let name = &bytes.trim_ascii_start()[5..];
    let facets = name.iter().position(|b| *b == b'\n').unwrap_or(name.len());
    Some([b"solid ", &name[facets..].to_ascii_lowercase()[..]].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_files_of_all_writers() {
        let text = "solid a b\n  facet normal 0 0 1\n    outer loop\n      vertex 0 0 0\n      \
                    vertex 1E0 0 0\n      vertex 0 1.5e0 0\n    endloop\n  endfacet\nendsolid a\n";
        let read = |bytes: &[u8]| read(Path::new("a.stl"), bytes.to_vec(), &ReadLimits::default());
        let expected = read(text.as_bytes()).unwrap();
        assert_eq!(expected.vertices[2], DVec3::new(0.0, 1.5, 0.0));
        for variant in [
            format!(" \t{text}"),
            format!("\n{text}"),
            text.to_ascii_uppercase(),
            text.replace("solid a b", "solid"),
            text.replace('\n', "\r\n"),
        ] {
            let mesh = read(variant.as_bytes()).unwrap();
            assert_eq!(mesh.vertices, expected.vertices, "{variant}");
        }
        let message = read(&[b'x'; 200]).unwrap_err().to_string();
        assert!(message.contains("a text file begins with the word solid"), "{message}");
    }
}
