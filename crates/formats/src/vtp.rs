//! VTK polygonal files (`.vtp`): surfaces of grains.
//!
//! Triangles are written with raw appended data; polygons with ascii or appended data are read.

use std::io;
use std::path::Path;

use glam::DVec3;
use roxmltree::Document;

use crate::bounded_file::{DATA, read_bytes};
use crate::polygonal::{self, Array};
use crate::vtk_xml::{ArrayReader, child, split};

/// Triangulated surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Points [m].
    pub points: Vec<DVec3>,
    /// Velocity of each point [m/s], if known.
    pub velocity: Option<Vec<DVec3>>,
    /// Triangles as indices of points.
    pub triangles: Vec<[usize; 3]>,
    /// Index of the grain of each triangle, if known.
    pub grains: Option<Vec<usize>>,
    /// Simulated time [s], if known.
    pub time: Option<f64>,
}

/// Writes a surface in single precision.
///
/// # Errors
/// Errors of the operating system.
pub fn write(path: &Path, surface: &Surface) -> io::Result<()> {
    let mut data = Vec::new();
    if let Some(velocity) = &surface.velocity {
        data.push(("PointData", vec![Array::vectors("velocity", velocity.iter().copied())]));
    }
    if let Some(grains) = &surface.grains {
        let grains = grains.iter().map(|grain| *grain as i64);
        data.push(("CellData", vec![Array::integers("grain", grains)]));
    }
    let (time, corners) = (surface.time.unwrap_or(f64::NAN), surface.triangles.as_flattened());
    polygonal::write(path, time, &surface.points, data, ("Polys", 3), corners.iter().copied())
}

/// Reads a surface; polygons of more than three corners are cut into triangles.
///
/// # Errors
/// A description of the damage, or the error of the operating system.
pub fn read(file: &Path) -> Result<Surface, String> {
    let bytes = read_bytes(file, DATA).map_err(|error| error.to_string())?;
    let (xml, data) = split(&bytes)?;
    let document = Document::parse(&xml).map_err(|error| format!("not XML: {error}"))?;
    let reader = ArrayReader::new(&document, "PolyData", data)?;
    let data_set = child(document.root_element(), "PolyData")?;
    let piece = child(data_set, "Piece")?;
    let points = reader.arrays::<f64>(child(piece, "Points")?)?;
    let (_, points) = points.into_iter().next().ok_or("no points")?;
    if points.components != 3 {
        return Err("points without three coordinates".to_owned());
    }
    let vectors = |values: &[f64]| values.chunks_exact(3).map(DVec3::from_slice).collect();
    let points: Vec<DVec3> = vectors(&points.values);
    if points.iter().any(|p| !p.is_finite()) {
        return Err("a point is not finite".to_owned());
    }
    let polygons = reader.by_name::<f64>(child(piece, "Polys")?)?;
    let list =
        |name: &str| polygons.get(name).ok_or_else(|| format!("the polygons have no '{name}'"));
    let (corners, ends) = (list("connectivity")?, list("offsets")?);
    let mut triangles = Vec::new();
    let mut polygon_of = Vec::new();
    let mut start = 0;
    for (polygon, end) in ends.values.iter().enumerate() {
        let end = *end as usize;
        let ring = corners.values.get(start..end).ok_or("polygon offsets point outside")?;
        let ring: Vec<usize> = ring.iter().map(|i| *i as usize).collect();
        if ring.iter().any(|i| *i >= points.len()) {
            return Err("a polygon names a point that is not there".to_owned());
        }
        for i in 2..ring.len() {
            triangles.push([ring[0], ring[i - 1], ring[i]]);
            polygon_of.push(polygon);
        }
        start = end;
    }
    let optional = |name: &str| match child(piece, name) {
        Ok(node) => reader.by_name::<f64>(node),
        Err(_) => Ok(Default::default()),
    };
    let (of_points, of_cells) = (optional("PointData")?, optional("CellData")?);
    let grains = of_cells.get("grain").and_then(|grain| {
        let of = |polygon: &usize| grain.values.get(*polygon).map(|g| *g as usize);
        polygon_of.iter().map(of).collect()
    });
    let velocity = of_points.get("velocity").filter(|v| v.components == 3);
    Ok(Surface {
        velocity: velocity.map(|v| vectors(&v.values)),
        points,
        triangles,
        grains,
        time: reader.time(data_set)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn appended() -> Vec<u8> {
        let mut out = b"<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">0.75</DataArray></FieldData>\n<Piece><Points><DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points>\n<Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"appended\" offset=\"44\"/><DataArray type=\"Int32\" Name=\"offsets\" format=\"appended\" offset=\"64\"/></Polys></Piece></PolyData>\n<AppendedData encoding=\"raw\">\n_".to_vec();
        out.extend(36u64.to_le_bytes());
        out.extend((0..9).flat_map(|i| (i as f32).to_le_bytes()));
        out.extend(12u64.to_le_bytes());
        out.extend([0i32, 1, 2].into_iter().flat_map(i32::to_le_bytes));
        out.extend(4u64.to_le_bytes());
        out.extend(3i32.to_le_bytes());
        out.extend(b"\n</AppendedData></VTKFile>\n");
        out
    }

    fn with_file<T>(bytes: &[u8], read: impl Fn(&Path) -> T) -> T {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, bytes).unwrap();
        read(&file)
    }

    #[test]
    fn a_surface_survives_a_round_trip() {
        let corner = |x: f64, y: f64| DVec3::new(x, y, 0.25);
        let surface = Surface {
            points: vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)],
            velocity: Some(vec![DVec3::X; 3]),
            triangles: vec![[0, 1, 2], [2, 1, 0]],
            grains: Some(vec![0, 1]),
            time: Some(0.1),
        };
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("surface.vtp");
        write(&file, &surface).unwrap();
        assert_eq!(read(&file).unwrap(), surface);
    }

    #[test]
    fn appended_arrays_are_read() {
        let surface = with_file(&appended(), read).unwrap();
        assert_eq!(surface.points[1], DVec3::new(3.0, 4.0, 5.0));
        assert_eq!((surface.triangles.as_slice(), surface.time), (&[[0, 1, 2]][..], Some(0.75)));
        assert!(surface.grains.is_none());
    }

    #[test]
    fn no_damage_brings_the_reader_down() {
        let whole = appended();
        for cut in 0..whole.len() - 30 {
            assert!(with_file(&whole[..cut], read).is_err(), "cut at {cut}");
        }
        let text = String::from_utf8_lossy(&whole).into_owned();
        let refused =
            |from: &str, to: &str| with_file(text.replace(from, to).as_bytes(), read).unwrap_err();
        assert!(refused("Float32", "Float16").contains("'Float16' is not read"));
        assert!(refused("PolyData", "ImageData").contains("not a VTK file of type PolyData"));
        assert!(refused("offset=\"0\"", "offset=\"99\"").contains("cut off"));
    }

    #[test]
    fn polygons_become_triangles() {
        let text = "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"><PolyData><Piece>\
            <CellData><DataArray type=\"Int32\" Name=\"grain\" format=\"ascii\">5 6</DataArray></CellData>\
            <Points><DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>\
            <Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 0 1 3</DataArray>\
            <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 7</DataArray></Polys></Piece></PolyData></VTKFile>";
        let surface = with_file(text.as_bytes(), read).unwrap();
        assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 3]]);
        assert_eq!(surface.grains, Some(vec![5, 5, 6]));
        let outside = text.replace("0 1 2 3 0 1 3", "0 1 2 9 0 1 3");
        assert!(with_file(outside.as_bytes(), read).unwrap_err().contains("not there"));
    }
}
