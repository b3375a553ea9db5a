//! Writers of surface meshes: STL, PLY, OBJ and VTP.

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;
use grainwake_formats::disk::write_atomically;
use grainwake_formats::vtp::{self, Surface};

use crate::error::{Result, ShapeError};

/// Format of a written mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Binary STL, single precision.
    Stl,
    /// Binary PLY, double precision.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// VTK polygonal data, single precision.
    Vtp,
}

impl MeshFormat {
    /// Returns the format of a file with this ending (lower case, without the dot).
    pub fn of_ending(ending: &str) -> Option<MeshFormat> {
        match ending {
            "stl" => Some(MeshFormat::Stl),
            "ply" => Some(MeshFormat::Ply),
            "obj" => Some(MeshFormat::Obj),
            "vtp" => Some(MeshFormat::Vtp),
            _ => None,
        }
    }
}

/// Writes a triangle mesh with outward-facing triangles.
///
/// # Errors
/// Errors of the operating system.
pub fn write_mesh(
    path: &Path,
    format: MeshFormat,
    points: &[DVec3],
    triangles: &[[u32; 3]],
) -> Result<()> {
    let written = match format {
        MeshFormat::Stl => write_atomically(path, false, |out| stl(out, points, triangles)),
        MeshFormat::Ply => write_atomically(path, false, |out| ply(out, points, triangles)),
        MeshFormat::Obj => write_atomically(path, false, |out| obj(out, points, triangles)),
        MeshFormat::Vtp => {
            let triangles = triangles.iter().map(|t| t.map(|corner| corner as usize)).collect();
            let surface = Surface { points: points.to_vec(), triangles, ..Surface::default() };
            vtp::write(path, &surface)
        }
    };
    written.map_err(|error| ShapeError::io(path, error))
}

fn stl(out: &mut dyn Write, points: &[DVec3], triangles: &[[u32; 3]]) -> io::Result<()> {
    let mut header = [0; 80];
    let text = b"grainwake";
    header[..text.len()].copy_from_slice(text);
    out.write_all(&header)?;
    out.write_all(&(triangles.len() as u32).to_le_bytes())?;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| points[corner as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for vector in [normal, a, b, c] {
            for value in vector.as_vec3().to_array() {
                out.write_all(&value.to_le_bytes())?;
            }
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}

fn ply(out: &mut dyn Write, points: &[DVec3], triangles: &[[u32; 3]]) -> io::Result<()> {
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\n\
         property double y\nproperty double z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        points.len(),
        triangles.len()
    )?;
    for value in points.iter().flat_map(|point| point.to_array()) {
        out.write_all(&value.to_le_bytes())?;
    }
    for triangle in triangles {
        out.write_all(&[3])?;
        for corner in triangle {
            out.write_all(&(*corner as i32).to_le_bytes())?;
        }
    }
    Ok(())
}

fn obj(out: &mut dyn Write, points: &[DVec3], triangles: &[[u32; 3]]) -> io::Result<()> {
    for DVec3 { x, y, z } in points {
        writeln!(out, "v {x:?} {y:?} {z:?}")?;
    }
    for [a, b, c] in triangles.iter().map(|t| t.map(|corner| corner + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
