//! PLY, text and binary, in both byte orders.

use super::{TriangleMesh, polygon};
use crate::error::{Result, ShapeError};
use crate::limits::{ReadLimits, too_many_elements};
use glam::DVec3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};
use std::io::{Cursor, ErrorKind};
use std::path::Path;

/// Properties read from a vertex or a face; others are skipped.
#[derive(Default)]
struct Element {
    position: DVec3,
    corners: Vec<i64>,
}

impl PropertyAccess for Element {
    fn new() -> Element {
        Element::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            "vertex_indices" | "vertex_index" => {
                self.corners = match property {
                    Property::ListChar(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUChar(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListShort(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUShort(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListInt(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUInt(v) => v.into_iter().map(i64::from).collect(),
                    _ => return PropertyAccessResult::Ignored,
                };
                return PropertyAccessResult::Set;
            }
            _ => return PropertyAccessResult::Ignored,
        };
        self.position[axis] = match property {
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            Property::Char(v) => f64::from(v),
            Property::UChar(v) => f64::from(v),
            Property::Short(v) => f64::from(v),
            Property::UShort(v) => f64::from(v),
            Property::Int(v) => f64::from(v),
            Property::UInt(v) => f64::from(v),
            _ => return PropertyAccessResult::Ignored,
        };
        PropertyAccessResult::Set
    }
}

pub(super) fn read(path: &Path, bytes: Vec<u8>, limits: &ReadLimits) -> Result<TriangleMesh> {
    if !bytes.starts_with(b"ply") {
        return Err(ShapeError::malformed(path, "the first line is not \"ply\""));
    }
    let size = bytes.len() as u64;
    let mut reader = Reader::new(Cursor::new(bytes));
    let parser = Parser::<Element>::new();
    let header = parser.read_header(&mut reader);
    let header = header.map_err(|error| {
        ShapeError::malformed(path, of_header(&error, reader.get_ref().get_ref()))
    })?;
    check_header(path, &header, size, limits)?;
    let payload = parser.read_payload(&mut reader, &header);
    let payload = payload.map_err(|error| {
        let reason = of_elements(&error, reader.get_ref().get_ref(), &header);
        ShapeError::malformed(path, reason)
    })?;
    let elements = |name: &str| payload.get(name).map_or(&[][..], Vec::as_slice);
    let vertices = elements("vertex").iter().map(|e| e.position).collect();
    let mut mesh = TriangleMesh { vertices, triangles: Vec::new() };
    for (face, element) in elements("face").iter().enumerate() {
        let number = |c: &i64| {
            let reason = || format!("face {face} (counted from 0) has corner number {c}");
            u32::try_from(*c).map_err(|_| ShapeError::malformed(path, reason()))
        };
        let corners = element.corners.iter().map(number).collect::<Result<Vec<u32>>>()?;
        polygon::push(path, &mut mesh, face, &corners)?;
    }
    if mesh.triangles.len() as u64 > limits.mesh_elements {
        return Err(too_many_elements(path, "more faces", limits));
    }
    Ok(mesh)
}

/// Describes an error in the header.
fn of_header(error: &ParseError, bytes: &[u8]) -> String {
    match error.line() {
        _ if error.kind() == ErrorKind::UnexpectedEof => {
            "the line \"end_header\" is missing".into()
        }
        Some(line) => format!("line {line} of the header cannot be read: {}", quoted(bytes, line)),
        None => "the header is not text, or lacks a line such as \"format ascii 1.0\"".into(),
    }
}

/// Describes an error in the elements.
fn of_elements(error: &ParseError, bytes: &[u8], header: &Header) -> String {
    if error.kind() == ErrorKind::UnexpectedEof {
        let count = |element: &ElementDef| format!("{} ({})", element.name, element.count);
        let counts: Vec<String> = header.elements.values().map(count).collect();
        return format!(
            "the file ends before the last element of its header: {}",
            counts.join(", ")
        );
    }
    // The parser counts the elements of a binary file as lines.
    match error.line().filter(|_| matches!(header.encoding, Encoding::Ascii)) {
        Some(line) => {
            let text = quoted(bytes, line);
            format!("line {line} does not hold the numbers that the header declares: {text}")
        }
        None => "the elements are not those that the header declares".into(),
    }
}

/// Quotes the start of a line, counted from 1.
fn quoted(bytes: &[u8], line: usize) -> String {
    let line = bytes.split(|byte| *byte == b'\n').nth(line.saturating_sub(1)).unwrap_or_default();
    format!("{:?}", String::from_utf8_lossy(line).trim().chars().take(60).collect::<String>())
}

/// Checks that the header declares vertices and faces, and no more than the file can hold.
fn check_header(path: &Path, header: &Header, size: u64, limits: &ReadLimits) -> Result<()> {
    for needed in ["vertex", "face"] {
        if !header.elements.contains_key(needed) {
            let reason = format!("no element named {needed:?}");
            return Err(ShapeError::malformed(path, reason));
        }
    }
    for axis in ["x", "y", "z"] {
        if !header.elements["vertex"].properties.contains_key(axis) {
            let reason = format!("vertices have no property {axis:?}");
            return Err(ShapeError::malformed(path, reason));
        }
    }
    let faces = &header.elements["face"].properties;
    if !faces.contains_key("vertex_indices") && !faces.contains_key("vertex_index") {
        let reason = "faces have no property \"vertex_indices\"";
        return Err(ShapeError::malformed(path, reason));
    }
    for element in header.elements.values() {
        let count = element.count as u64;
        let claimed = || format!("{count} elements {:?}", element.name);
        if count > limits.mesh_elements {
            return Err(too_many_elements(path, &claimed(), limits));
        }
        if count.saturating_mul(least_bytes(element, header)) > size {
            let claimed = claimed();
            let reason = format!("the header claims {claimed}, the file has only {size} bytes");
            return Err(ShapeError::malformed(path, reason));
        }
    }
    Ok(())
}

/// Returns the minimum number of bytes of an element.
fn least_bytes(element: &ElementDef, header: &Header) -> u64 {
    let text = matches!(header.encoding, Encoding::Ascii);
    let width = |scalar: &ScalarType| match scalar {
        _ if text => 2,
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let sum: u64 = element
        .properties
        .values()
        .map(|p| match &p.data_type {
            PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => width(scalar),
        })
        .sum();
    // The last line of a text file may lack its line ending.
    if text { sum.saturating_sub(1).max(1) } else { sum.max(1) }
}
