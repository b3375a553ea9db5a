//! Writing of VTK polygonal data: points with vertices, lines or polygons, and arrays at both.

use std::io;
use std::path::Path;

use glam::DVec3;

use crate::disk::write_atomically;
use crate::vtk_xml::{ArrayElements, close_appended, open_appended, write_head, write_length};

/// Array of a file, little-endian.
pub struct Array {
    kind: &'static str,
    name: &'static str,
    components: usize,
    bytes: Vec<u8>,
}

impl Array {
    /// Returns an array of numbers in single precision.
    pub fn singles(name: &'static str, values: impl Iterator<Item = f32>) -> Array {
        let bytes = values.flat_map(f32::to_le_bytes).collect();
        Array { kind: "Float32", name, components: 1, bytes }
    }
    /// Returns an array of vectors in single precision.
    pub fn vectors(name: &'static str, values: impl Iterator<Item = DVec3>) -> Array {
        let numbers = values.flat_map(|v| v.as_vec3().to_array());
        Array { components: 3, ..Array::singles(name, numbers) }
    }
    /// Returns an array of integers.
    pub fn integers(name: &'static str, values: impl Iterator<Item = i64>) -> Array {
        let bytes = values.flat_map(|value| (value as i32).to_le_bytes()).collect();
        Array { kind: "Int32", name, components: 1, bytes }
    }
}

/// Writes points with their `data`, the arrays of each section by its name. The cells have a kind,
/// "Verts", "Lines" or "Polys", and a number of points each, which `corners` lists by index.
pub fn write(
    path: &Path,
    time: f64,
    points: &[DVec3],
    data: Vec<(&str, Vec<Array>)>,
    (kind, each): (&str, usize),
    corners: impl ExactSizeIterator<Item = usize>,
) -> io::Result<()> {
    let cells = corners.len() / each;
    let counts = ["Verts", "Lines", "Strips", "Polys"].map(|other| {
        let count = if other == kind { cells } else { 0 };
        format!(" NumberOf{other}=\"{count}\"")
    });
    let coordinates = Array::vectors("Points", points.iter().copied());
    let corners = Array::integers("connectivity", corners.map(|corner| corner as i64));
    let ends = Array::integers("offsets", (1..=cells).map(|n| (each * n) as i64));
    let mut sections = vec![("Points", vec![coordinates])];
    sections.extend(data);
    sections.push((kind, vec![corners, ends]));
    write_atomically(path, false, |out| {
        write_head(out, "PolyData", "", time)?;
        writeln!(out, "<Piece NumberOfPoints=\"{}\"{}>", points.len(), counts.concat())?;
        let mut elements = ArrayElements::default();
        for (name, arrays) in &sections {
            let element =
                |a: &Array| elements.next(a.kind, a.name, a.components, a.bytes.len() as u64);
            let elements: String = arrays.iter().map(element).collect();
            writeln!(out, "<{name}>{elements}</{name}>")?;
        }
        writeln!(out, "</Piece>\n</PolyData>")?;
        open_appended(out)?;
        for array in sections.iter().flat_map(|(_, arrays)| arrays) {
            write_length(out, array.bytes.len() as u64)?;
            out.write_all(&array.bytes)?;
        }
        close_appended(out)
    })
}
