//! Surfaces of bumpy grains.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use glam::{DQuat, DVec3};

pub const D: f64 = 2e-3;

/// A bumpy ellipsoid in its own frame.
pub fn bumpy() -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let (rows, columns) = (24, 40);
    let mut points = Vec::new();
    for i in 0..=rows {
        let theta = PI * i as f64 / rows as f64;
        for j in 0..columns {
            let phi = TAU * j as f64 / columns as f64;
            let n = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let bump = 1.0
                + theta.sin()
                    * (0.07 * (3.0 * phi + 1.0).sin()
                        + 0.06 * (5.0 * n.z).cos() * (2.0 * phi).sin());
            points.push(0.5 * D * bump * n * DVec3::new(1.3, 1.0, 0.75));
        }
    }
    let mut triangles = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let at = |i: usize, j: usize| i * columns + j % columns;
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    (points, triangles)
}

pub fn write_surfaces(file: &Path, grains: &[(DVec3, DQuat)], time: f64) {
    let (points, triangles) = bumpy();
    let (mut all, mut corners, mut ends, mut owner) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (grain, (position, turn)) in grains.iter().enumerate() {
        let first = all.len() / 3;
        all.extend(points.iter().flat_map(|p| (*position + *turn * *p).to_array()));
        for triangle in &triangles {
            corners.extend(triangle.map(|i| i + first));
            ends.push(corners.len());
            owner.push(grain);
        }
    }
    let mut out = Appended::new();
    let (n, m) = (all.len() / 3, ends.len());
    let parts = [
        out.reals("Points", 3, &all),
        out.integers("connectivity", &corners),
        out.integers("offsets", &ends),
        out.integers("grain", &owner),
    ];
    let body = format!(
        "<PolyData>\n<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time:?}</DataArray></FieldData>\n<Piece NumberOfPoints=\"{n}\" NumberOfPolys=\"{m}\"><CellData>\n{}</CellData><Points>\n{}</Points><Polys>\n{}{}</Polys></Piece></PolyData>",
        parts[3], parts[0], parts[1], parts[2]
    );
    std::fs::write(file, out.file("PolyData", &body)).unwrap();
}

/// One VTK file with raw appended arrays of 32-bit reals.
struct Appended {
    data: Vec<u8>,
}

impl Appended {
    fn new() -> Appended {
        Appended { data: Vec::new() }
    }
    fn head(&mut self, kind: &str, name: &str, components: usize, bytes: Vec<u8>) -> String {
        let offset = self.data.len();
        self.data.extend((bytes.len() as u64).to_le_bytes());
        self.data.extend(bytes);
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>\n"
        )
    }
    fn reals(&mut self, name: &str, components: usize, values: &[f64]) -> String {
        self.head(
            "Float32",
            name,
            components,
            values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect(),
        )
    }
    fn integers(&mut self, name: &str, values: &[usize]) -> String {
        self.head("Int32", name, 1, values.iter().flat_map(|v| (*v as i32).to_le_bytes()).collect())
    }
    fn file(&self, kind: &str, body: &str) -> Vec<u8> {
        let mut out = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n{body}\n<AppendedData encoding=\"raw\">\n_"
        )
        .into_bytes();
        out.extend(&self.data);
        out.extend(b"\n</AppendedData>\n</VTKFile>\n");
        out
    }
}
