//! Shapes from mesh files: formats, accuracy and located errors.

use crate::common::{close, shared};
use glam::{DQuat, DVec3};
use grainwake_shape::mesh::{
    MeshOptions, TriangleMesh, mesh_from_memory, read_mesh, shape_from_mesh,
};
use grainwake_shape::{
    Field, QualityBounds, ReadLimits, Shape, ShapeError, ShapeOptions, SourceFile, analytic,
};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::SplitMix64;
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A ball of radius 1 about `centre`, `n` by `2 n` facets, its poles single vertices.
fn ball(n: usize, centre: DVec3) -> TriangleMesh {
    let mut vertices = vec![centre + DVec3::Z];
    for i in 1..n {
        let (s, c) = (PI * i as f64 / n as f64).sin_cos();
        for j in 0..2 * n {
            let (t, u) = (PI * j as f64 / n as f64).sin_cos();
            vertices.push(centre + DVec3::new(s * u, s * t, c));
        }
    }
    vertices.push(centre - DVec3::Z);
    let last = vertices.len() as u32 - 1;
    let m = 2 * n as u32;
    let at = |i: u32, j: u32| 1 + (i - 1) * m + j % m;
    let mut triangles = Vec::new();
    for j in 0..m {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        for i in 1..n as u32 - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        triangles.push([at(n as u32 - 1, j), last, at(n as u32 - 1, j + 1)]);
    }
    TriangleMesh { vertices, triangles }
}

fn stl(mesh: &TriangleMesh) -> Vec<u8> {
    // The word that marks text files, as some programs write it into binary ones.
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, 0);
    bytes.extend_from_slice(&(mesh.triangles.len() as u32).to_le_bytes());
    for t in &mesh.triangles {
        bytes.extend_from_slice(&[0; 12]);
        for v in t {
            for x in mesh.vertices[*v as usize].to_array() {
                bytes.extend_from_slice(&(x as f32).to_le_bytes());
            }
        }
        bytes.extend_from_slice(&[0; 2]);
    }
    bytes
}

fn ascii_stl(mesh: &TriangleMesh) -> Vec<u8> {
    let mut text = String::from("solid ball\n");
    for t in &mesh.triangles {
        text += " facet normal 0 0 0\n  outer loop\n";
        for v in t {
            let p = mesh.vertices[*v as usize];
            writeln!(text, "   vertex {:e} {:e} {:e}", p.x as f32, p.y as f32, p.z as f32).unwrap();
        }
        text += "  endloop\n endfacet\n";
    }
    (text + "endsolid ball\n").into_bytes()
}

fn obj(mesh: &TriangleMesh) -> Vec<u8> {
    let mut text = String::from("# a ball\no ball\n");
    for v in &mesh.vertices {
        writeln!(text, "v {} {} {}", v.x, v.y, v.z).unwrap();
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    text.into_bytes()
}

fn ply(mesh: &TriangleMesh, ascii: bool) -> Vec<u8> {
    let format = if ascii { "ascii" } else { "binary_little_endian" };
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nproperty uchar red\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for v in &mesh.vertices {
        if ascii {
            bytes.extend_from_slice(format!("{} {} {} 7\n", v.x, v.y, v.z).as_bytes());
        } else {
            v.to_array().iter().for_each(|x| bytes.extend_from_slice(&x.to_le_bytes()));
            bytes.push(7);
        }
    }
    for [a, b, c] in &mesh.triangles {
        if ascii {
            bytes.extend_from_slice(format!("3 {a} {b} {c}\n").as_bytes());
        } else {
            bytes.push(3);
            [a, b, c].iter().for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
        }
    }
    bytes
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }
    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
    fn refusal(&self, name: &str, bytes: &[u8]) -> String {
        self.read(name, bytes).unwrap_err().to_string()
    }

    fn read(&self, name: &str, bytes: &[u8]) -> Result<TriangleMesh, ShapeError> {
        let path = self.write(name, bytes);
        read_mesh(&path, 1e-3, &ReadLimits::default()).map(|(mesh, _)| mesh)
    }
}

fn options() -> MeshOptions {
    let shape = ShapeOptions { cells: Some(32), nodes: Some(400), ..Default::default() };
    MeshOptions { shape, flip: false }
}

#[test]
fn every_format_gives_the_same_mesh() {
    let folder = Folder::new();
    let mesh = ball(12, DVec3::new(3.0, -1.0, 2.0));
    let files = [
        ("a.stl", stl(&mesh)),
        ("b.STL", ascii_stl(&mesh)),
        ("c.obj", obj(&mesh)),
        ("d.ply", ply(&mesh, true)),
        ("e.ply", ply(&mesh, false)),
    ];
    for (name, bytes) in files {
        let read = folder.read(name, &bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(read.vertices.len(), mesh.vertices.len(), "{name}");
        assert_eq!(read.triangles.len(), mesh.triangles.len(), "{name}");
        close(read.signed_volume(), 1e-9 * mesh.signed_volume(), 1e-6);
    }
}

#[test]
fn a_sphere_mesh_agrees_with_the_analytic_sphere() {
    let centre = DVec3::new(3e-3, -1e-3, 2e-3);
    let mut mesh = ball(64, DVec3::ZERO);
    for v in &mut mesh.vertices {
        *v = 1e-3 * *v + centre;
    }
    let shape = shape_from_mesh(&mesh, &SourceFile::default(), &options()).unwrap();
    let exact = analytic::sphere(1e-3, &ShapeOptions::default()).unwrap();
    close(shape.volume(), exact.volume(), 2e-3);
    for axis in 0..3 {
        close(shape.inertia()[axis], exact.inertia()[axis], 4e-3);
    }
    close(shape.surface_area(), exact.surface_area(), 2e-3);
    close(shape.bounding_radius(), exact.bounding_radius(), 2e-3);
    close(shape.morphology().wadell_sphericity, 1.0, 2e-3);
    assert!(shape.provenance().centroid.distance(centre) < 1e-7);
    for i in 1..500 {
        let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
        let x = 1.25e-3 * (2.0 * u.fract() - DVec3::ONE);
        let (d, n) = shape.distance_and_gradient(x);
        // The tip of the cone at the centre is cut off by the interpolation.
        let tip = x.length() < 0.2e-3;
        let allowed = if tip { 1e-4 } else { 2e-6 };
        assert!((d - exact.distance(x)).abs() < allowed, "at {x}: {d}");
        if x.length() > 0.8e-3 {
            assert!(n.normalize().angle_between(x) < 0.05, "at {x}: {n}");
        }
    }
}

#[test]
fn a_turned_and_moved_mesh_gives_the_same_shape() {
    let stretch = |u: DVec3| {
        // Lopsided along every axis, so that the directions of the axes are decided by the body.
        let v = u * DVec3::new(1.6, 1.2, 0.8);
        v + DVec3::new(0.15 * v.x * v.x, 0.2 * v.y * v.y, 0.1 * v.z * v.z + 0.1 * v.x * v.y)
    };
    let mut mesh = ball(40, DVec3::ZERO);
    mesh.vertices.iter_mut().for_each(|v| *v = stretch(*v));
    let mut moved = mesh.clone();
    let turn = glam::DQuat::from_scaled_axis(DVec3::new(0.4, 2.0, -1.1));
    let shift = DVec3::new(10.0, 4.0, -7.0);
    moved.vertices.iter_mut().for_each(|v| *v = turn * *v + shift);
    let one = shape_from_mesh(&mesh, &SourceFile::default(), &options()).unwrap();
    let two = shape_from_mesh(&moved, &SourceFile::default(), &options()).unwrap();
    for i in 1..300 {
        let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
        let x = 4.0 * (u.fract() - DVec3::splat(0.5));
        assert!((one.distance(x) - two.distance(x)).abs() < 1e-3, "at {x}");
    }
    // The provenance tells where the shape lay: the same material point in both frames.
    let (p, q) = (one.provenance(), two.provenance());
    let x = DVec3::new(0.5, 0.2, -0.3);
    let first = turn * (p.centroid + p.rotation * x) + shift;
    let second = q.centroid + q.rotation * x;
    assert!(first.distance(second) < 1e-3);
}

#[test]
fn a_hole_is_refused_with_its_place_in_file_units() {
    let folder = Folder::new();
    let mut mesh = ball(12, DVec3::new(30.0, 0.0, 0.0));
    mesh.triangles.retain(|t| !t.contains(&0));
    let message = folder.refusal("hole.ply", &ply(&mesh, false));
    assert!(message.contains("24 edges"), "{message}");
    let (_, place) = message.split_once("near (").unwrap();
    let place: Vec<f64> =
        place[..place.find(')').unwrap()].split(", ").map(|x| x.parse().unwrap()).collect();
    let at = DVec3::from_slice(&place);
    assert!(at.distance(DVec3::new(30.0, 0.0, 1.0)) < 0.3, "{at}");
    let mut mesh = ball(12, DVec3::ZERO);
    mesh.triangles[0].swap(0, 1);
    let message = folder.refusal("flip.ply", &ply(&mesh, true));
    assert!(message.contains("opposite orientations"), "{message}");
}

#[test]
fn an_inside_out_mesh_is_turned_only_on_request() {
    let folder = Folder::new();
    let mut mesh = ball(24, DVec3::ZERO);
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let read = folder.read("inside_out.obj", &obj(&mesh)).unwrap();
    let source = SourceFile::default();
    let refused = shape_from_mesh(&read, &source, &options());
    assert!(matches!(refused, Err(ShapeError::InsideOut { .. })));
    let flipped = shape_from_mesh(&read, &source, &MeshOptions { flip: true, ..options() });
    close(flipped.unwrap().volume(), 4e-9 / 3.0 * PI, 0.02);
}

/// Truncated anywhere, or with any byte changed: read or refused, never a panic.
#[test]
fn damaged_files_are_refused() {
    let folder = Folder::new();
    let mesh = ball(4, DVec3::ZERO);
    let files = [
        ("a.stl", stl(&mesh)),
        ("b.stl", ascii_stl(&mesh)),
        ("c.obj", obj(&mesh)),
        ("d.ply", ply(&mesh, true)),
        ("e.ply", ply(&mesh, false)),
    ];
    let mut random = SplitMix64::seed_from_u64(3);
    for (name, good) in files {
        folder.read(name, &good).unwrap();
        for length in (0..good.len() - 12).step_by(good.len() / 60) {
            assert!(folder.read(name, &good[..length]).is_err(), "{name} cut to {length}");
        }
        for _ in 0..300 {
            let mut bad = good.clone();
            let at = random.random_range(0..bad.len());
            bad[at] = random.random();
            let _ = folder.read(name, &bad);
        }
    }
}

#[test]
fn errors_of_obj_files_have_their_line() {
    let folder = Folder::new();
    let vertices = "# a tetrahedron\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let (bad_vertex, bad_face) =
        (format!("{vertices}v 1 x 0\n{faces}"), |face: &str| format!("{vertices}{faces}{face}\n"));
    for (text, expected) in [
        (bad_vertex, "line 6: expected three numbers after \"v\""),
        (bad_face("v 1 2"), "line 10: expected three numbers after \"v\""),
        (bad_face("v 0 0 1 0"), "line 10: the fourth number after \"v\" must not be zero"),
        (bad_face("vn 1 2"), "line 10: expected three numbers after \"vn\""),
        (bad_face("f 1 2 three"), "line 10: expected the numbers of vertices after \"f\""),
        (bad_face("f 1 2 9"), "line 10: vertex 9 does not exist; the file has 4"),
        (bad_face("f 1/1 2/2 7/3"), "line 10: vertex 7/3 does not exist; the file has 4"),
    ] {
        let message = folder.refusal("a.obj", text.as_bytes());
        assert!(message.contains(expected), "{message}");
    }
    // Continued lines keep their numbers.
    let continued = vertices.replace("v 1 0 0", "v 1 \\\n 0 \\\r\n 0");
    let message = folder.refusal("a.obj", format!("{continued}{faces}f 1 2 9\n").as_bytes());
    assert!(message.contains("line 12: vertex 9 does not exist; the file has 4"), "{message}");
    let message = folder.refusal("a.obj", format!("{continued}v 1 x\n{faces}").as_bytes());
    assert!(message.contains("line 8: expected three numbers"), "{message}");
    let message = folder.refusal("a.obj", format!("{vertices}f 1 2 \\\nx\n{faces}").as_bytes());
    assert!(message.contains("line 6: expected the numbers of vertices"), "{message}");
    let not_text = [vertices.as_bytes(), b"v 0 \xff 0\n"].concat();
    let message = folder.refusal("a.obj", &not_text);
    assert!(message.contains("line 6: the file is not text"), "{message}");
}

#[test]
fn text_files_may_begin_with_a_byte_order_mark() {
    let folder = Folder::new();
    let mesh = ball(4, DVec3::ZERO);
    let files = [("a.stl", ascii_stl(&mesh)), ("a.obj", obj(&mesh)), ("a.ply", ply(&mesh, true))];
    for (name, plain) in files {
        let read = folder.read(name, &plain).unwrap();
        let marked = [b"\xef\xbb\xbf", &plain[..]].concat();
        assert_eq!(folder.read(name, &marked).unwrap().vertices, read.vertices, "{name}");
    }
    let coefficients = b"\xef\xbb\xbf0 0 3.5 0\n";
    folder.read("a.anm", coefficients).unwrap();
}

#[test]
fn a_backslash_continues_a_line_of_an_obj_file() {
    let folder = Folder::new();
    let plain = String::from_utf8(obj(&ball(4, DVec3::ZERO))).unwrap();
    let read = folder.read("a.obj", plain.as_bytes()).unwrap();
    for continuation in [" \\\n", " \\\r\n\t", "\\\n "] {
        let text = plain.replace(' ', continuation);
        let text = format!("# made in C:\\meshes\\\n{text}");
        let mesh = folder.read("a.obj", text.as_bytes()).unwrap();
        assert_eq!(
            (mesh.vertices, mesh.triangles),
            (read.vertices.clone(), read.triangles.clone())
        );
    }
}

/// Messages name the file and the defect in the terms of the format, not of a parser.
#[test]
fn errors_of_damaged_files_are_in_terms_of_their_format() {
    let folder = Folder::new();
    let mesh = ball(4, DVec3::ZERO);
    let (binary, text) = (ply(&mesh, false), String::from_utf8(ply(&mesh, true)).unwrap());
    let mut solid = stl(&mesh);
    solid[5..80].fill(b' ');
    let (counted, size) = (mesh.triangles.len(), solid.len());
    folder.read("solid.stl", &solid).unwrap();
    let facets = ascii_stl(&mesh);
    let cut = facets.windows(6).rposition(|word| word == b"vertex").unwrap();
    let facet = String::from_utf8(facets.clone()).unwrap().replacen("endloop", "endlop", 1);
    let bytes = |text: String| text.into_bytes();
    let text_facets = String::from_utf8(facets.clone()).unwrap();
    let first = text_facets.lines().find(|line| line.contains("vertex")).unwrap();
    let not_finite = bytes(text_facets.replacen(first, "vertex nan 0 0", 1));
    let vertices = mesh.vertices.len();
    for (name, file, expected) in [
        ("a.ply", facets.clone(), "the first line is not \"ply\"".to_owned()),
        ("a.ply", Vec::new(), "the first line is not \"ply\"".to_owned()),
        (
            "a.ply",
            bytes(text.replacen("element vertex", "elment vertex", 1)),
            format!("line 3 of the header cannot be read: \"elment vertex {vertices}\""),
        ),
        (
            "a.ply",
            bytes(text.replacen("end_header", "comment", 1)),
            "line 11 of the header cannot be read".to_owned(),
        ),
        ("a.ply", b"ply\nformat ascii 1.0\n".to_vec(), "\"end_header\" is missing".to_owned()),
        ("a.ply", b"ply\nend_header\n".to_vec(), "lacks a line such as \"format".to_owned()),
        (
            "a.ply",
            bytes(text.replacen("end_header\n0", "end_header\nx", 1)),
            "line 11 does not hold the numbers that the header declares: \"x".to_owned(),
        ),
        (
            "a.ply",
            binary[..binary.len() - 3].to_vec(),
            format!("ends before the last element of its header: vertex ({vertices}), face"),
        ),
        (
            "a.stl",
            solid[..size - 60].to_vec(),
            format!(
                "the header counts {counted} triangles, which take {size} bytes, but the file \
                 has {}",
                size - 60
            ),
        ),
        (
            "a.stl",
            facets[..cut].to_vec(),
            format!("the file ends after {} facets, without endsolid", counted - 1),
        ),
        ("a.stl", not_finite, "face 0 (counted from 0): a coordinate is NaN, not".to_owned()),
        ("a.stl", bytes(facet), "face 0 (counted from 0): expected [\"endloop\"]".to_owned()),
        ("a.obj", Vec::new(), "the file has no faces".to_owned()),
        ("a.obj", bytes(text.clone()), "the file has no faces".to_owned()),
        ("a.stl", b"solid a\nendsolid a\n".to_vec(), "the file has no faces".to_owned()),
    ] {
        let message = folder.refusal(name, &file);
        let is_clear = message.contains(name) && message.contains(&expected);
        assert!(is_clear && !message.contains('\n'), "`{expected}` is missing in:\n{message}");
    }
    let mut open = mesh.clone();
    open.triangles.pop();
    let message = folder.refusal("open.ply", &ply(&open, true));
    assert!(message.contains("open.ply: the mesh is open"), "{message}");
}

#[test]
fn absurd_headers_are_refused() {
    let folder = Folder::new();
    let mut bytes = stl(&ball(4, DVec3::ZERO));
    bytes[0] = b'x';
    bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(matches!(folder.read("a.stl", &bytes), Err(ShapeError::Malformed { .. })));
    for (count, large) in [("999999999999", true), ("1000000", false), ("-3", false)] {
        for properties in ["property float x\nproperty float y\nproperty float z\n", ""] {
            let header = format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{properties}\
                 element face 1\nproperty list uchar int vertex_indices\nend_header\n"
            );
            let error = folder.read("a.ply", header.as_bytes()).unwrap_err();
            if large && !properties.is_empty() {
                assert!(matches!(error, ShapeError::TooLarge { .. }), "{error}");
            }
        }
    }
    let nan = obj(&ball(4, DVec3::ZERO)).iter().map(|b| char::from(*b)).collect::<String>();
    let nan = nan.replacen("v 0 0 1", "v NaN 0 1", 1);
    let message = folder.refusal("nan.obj", nan.as_bytes());
    assert!(message.contains("not a finite number"), "{message}");
    let mut flat = ball(4, DVec3::ZERO);
    flat.triangles.push([0, 1, 1]);
    let message = folder.refusal("flat.ply", &ply(&flat, true));
    assert!(message.contains("no area"), "{message}");
    let message = folder.refusal("a.xyz", b"1 2 3");
    assert!(message.contains("unknown file type"), "{message}");
    let missing = read_mesh(Path::new("/nonexistent/a.stl"), 1.0, &ReadLimits::default());
    assert!(matches!(missing, Err(ShapeError::Io { .. })));
    let good = folder.write("good.ply", &ply(&ball(4, DVec3::ZERO), true));
    for unit in [0.0, f64::NAN, -1.0] {
        assert!(read_mesh(&good, unit, &ReadLimits::default()).is_err());
    }
    let small = ReadLimits { mesh_elements: 10, ..Default::default() };
    assert!(matches!(read_mesh(&good, 1.0, &small), Err(ShapeError::TooLarge { .. })));
    let small = ReadLimits { file_bytes: 10, ..Default::default() };
    assert!(matches!(read_mesh(&good, 1.0, &small), Err(ShapeError::TooLarge { .. })));
}

/// Real meshes pass the quality check. They match their exact volume and the independent morphology
/// table, lie within a thousandth of the diameter of the mesh (except on the sharpest ridges), and
/// their nodes lie on the surface.
#[test]
fn real_grains_agree_with_the_table() {
    let (Some(folder), Some(table)) = (shared("grains/meshes"), shared("grains/table.csv")) else {
        return;
    };
    let table = std::fs::read_to_string(table).unwrap();
    let mut seen = 0;
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    for path in paths.iter().filter(|p| p.extension().is_some_and(|e| e == "ply")) {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let (mesh, source) = read_mesh(path, 1e-3, &ReadLimits::default()).unwrap();
        // The table holds no roundness, which takes longest.
        let mut options = MeshOptions::default();
        options.shape.roundness = false;
        let shape = shape_from_mesh(&mesh, &source, &options).unwrap();
        let quality = shape.quality().unwrap();
        let m = shape.morphology();
        let p = shape.provenance();
        let mut loss: Vec<f64> = mesh
            .vertices
            .iter()
            .map(|v| shape.distance(p.rotation.inverse() * (*v - p.centroid)).abs())
            .map(|d| d / shape.equivalent_diameter())
            .collect();
        loss.sort_by(f64::total_cmp);
        let rms = (loss.iter().map(|d| d * d).sum::<f64>() / loss.len() as f64).sqrt();
        let most = loss[loss.len() * 98 / 100];
        println!(
            "{name}: volume {:+.5} gradient {:.4} off rms {rms:.5} 0.98 quantile {most:.5} psi {:.4} convexity {:.4} S {:.4}, {} nodes, {} bytes",
            quality.volume_error.unwrap(),
            quality.gradient_error,
            m.wadell_sphericity,
            m.convexity.unwrap(),
            m.krumbein_sphericity,
            shape.nodes().len(),
            shape.to_bytes().len(),
        );
        assert!(quality.volume_error.unwrap().abs() < 1e-3);
        assert!(rms < 4e-4 && most < 1.2e-3, "{rms} {most}");
        assert!(shape.to_bytes().len() < 400_000);
        check_nodes(&shape);
        let row = table.lines().find(|l| l.starts_with(&format!("{name},"))).unwrap();
        // The source column is quoted and holds commas.
        let numbers: Vec<f64> =
            row.rsplit('"').next().unwrap().split(',').filter_map(|v| v.parse().ok()).collect();
        let [diameter, a, b, c, s, _, psi, convexity, ..] = numbers[..] else { panic!("{row}") };
        close(shape.equivalent_diameter(), diameter * 1e-3, 2e-3);
        close(m.a, a * 1e-3, 5e-3);
        close(m.b, b * 1e-3, 5e-3);
        close(m.c, c * 1e-3, 5e-3);
        close(m.krumbein_sphericity, s, 5e-3);
        close(m.wadell_sphericity, psi, 5e-3);
        close(m.convexity.unwrap(), convexity, 5e-3);
        seen += 1;
    }
    assert!(seen >= 12, "only {seen} meshes");
}

fn mesh_area(shape: &Shape) -> f64 {
    let (vertices, triangles) = shape.surface_mesh();
    let mesh = TriangleMesh { vertices, triangles };
    mesh.area()
}

fn check_nodes(shape: &Shape) {
    let size = shape.equivalent_diameter();
    let area: f64 = shape.nodes().iter().map(|n| n.area).sum();
    close(area, shape.surface_area(), 1e-9);
    let mean = area / shape.nodes().len() as f64;
    let mut nearest_sum = 0.0;
    for node in shape.nodes() {
        assert!(shape.distance(node.position).abs() < 1e-6 * size);
        assert!(node.area > 0.2 * mean && node.area < 2.5 * mean, "{} of {mean}", node.area);
        assert!(node.position.length() <= shape.bounding_radius());
        assert!(node.position.cmpge(shape.lower() - DVec3::splat(1e-4 * size)).all());
        assert!(node.position.cmple(shape.upper() + DVec3::splat(1e-4 * size)).all());
        let nearest = shape
            .nodes()
            .iter()
            .map(|o| o.position.distance_squared(node.position))
            .filter(|d| *d > 0.0)
            .fold(f64::INFINITY, f64::min)
            .sqrt();
        assert!(nearest > 0.4 * mean.sqrt(), "two nodes {nearest} apart, spacing {}", mean.sqrt());
        nearest_sum += nearest;
    }
    // A hexagonal pattern has its nearest neighbours 1.07 spacings apart.
    let evenness = nearest_sum / shape.nodes().len() as f64 / mean.sqrt();
    assert!(evenness > 0.8, "{evenness}");
}

#[test]
fn nodes_and_surface_meshes_of_simple_bodies() {
    let options = ShapeOptions { cells: Some(32), ..Default::default() };
    let bodies = [
        analytic::ellipsoid(1.0, 1.0, 1.0, &options).unwrap(),
        analytic::rounded_box(2.0, 1.5, 1.0, 0.1, &options).unwrap(),
        analytic::rounded_box(2.0, 2.0, 0.4, 0.05, &options).unwrap(),
        analytic::cylinder(0.5, 2.0, &options).unwrap(),
    ];
    for shape in &bodies {
        check_nodes(shape);
        let (vertices, triangles) = shape.surface_mesh();
        let mesh = TriangleMesh { vertices, triangles };
        mesh.check_closed().unwrap();
        close(mesh.signed_volume(), shape.volume(), 0.02);
        // Area is exact where it is known; the mesh cuts sharp edges off.
        close(mesh.area(), shape.surface_area(), 0.03);
    }
    close(mesh_area(&bodies[0]), bodies[0].surface_area(), 1e-9);
    close(bodies[0].nodes().len() as f64, 1257.0, 0.01);
    let asked = ShapeOptions { nodes: Some(300), ..options };
    let few = analytic::ellipsoid(1.0, 0.8, 0.7, &asked).unwrap();
    close(few.nodes().len() as f64, 300.0, 0.03);
    let (vertices, triangles) = Shape::sphere(1.0, 10).surface_mesh();
    let mesh = TriangleMesh { vertices, triangles };
    mesh.check_closed().unwrap();
    close(mesh.signed_volume(), 4.0 / 3.0 * PI, 5e-3);
}

/// Shapes have equal bits for any number of threads, and scaling is exact.
#[test]
fn threads_do_not_matter_and_scaling_is_exact() {
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            shape_from_mesh(&ball(24, DVec3::X), &SourceFile::default(), &options()).unwrap()
        })
    };
    let one = build(1);
    for threads in [2, 3] {
        assert_eq!(build(threads).to_bytes(), one.to_bytes());
    }
    let half = one.scaled_to_equivalent_diameter(0.5 * one.equivalent_diameter()).unwrap();
    close(half.volume(), one.volume() / 8.0, 1e-12);
    close(half.inertia().x, one.inertia().x / 32.0, 1e-12);
    close(half.surface_area(), one.surface_area() / 4.0, 1e-12);
    let x = DVec3::new(0.3, 0.9, 0.4);
    close(half.distance(0.5 * x), 0.5 * one.distance(x), 1e-12);
    assert!(one.scaled(0.0).is_err() && one.scaled(f64::NAN).is_err());
    assert!(one.scaled_to_equivalent_diameter(-1.0).is_err());
}

/// Coefficients and the mesh made from them elsewhere describe the same grain.
#[test]
fn harmonic_coefficients_give_the_grain_of_their_mesh() {
    for name in ["fdot57_D-00002", "ma160_01520", "sika-cement07_00418"] {
        let (Some(series), Some(mesh)) = (
            shared(&format!("grains/sh/{name}.anm")),
            shared(&format!("grains/meshes/{name}.ply")),
        ) else {
            return;
        };
        let read = |path: &Path| read_mesh(path, 1e-3, &ReadLimits::default()).unwrap().0;
        let (series, mesh) = (read(&series), read(&mesh));
        close(series.signed_volume(), mesh.signed_volume(), 2e-3);
        close(series.area(), mesh.area(), 5e-3);
        let (a, b) = (series.bounds(), mesh.bounds());
        let size = (b.1 - b.0).length();
        assert!(a.0.distance(b.0) < 0.01 * size && a.1.distance(b.1) < 0.01 * size);
    }
}

#[test]
fn a_mesh_in_memory_is_merged_and_checked_as_a_file_is() {
    let whole = ball(12, DVec3::ZERO);
    // Triangles without shared vertices, as in an STL file.
    let soup = TriangleMesh {
        vertices: whole.triangles.iter().flatten().map(|v| whole.vertices[*v as usize]).collect(),
        triangles: (0..whole.triangles.len() as u32)
            .map(|t| [0, 1, 2].map(|v| 3 * t + v))
            .collect(),
    };
    let (merged, source) = mesh_from_memory(&soup, 1e-3).unwrap();
    assert_eq!(merged.vertices.len(), whole.vertices.len());
    close(merged.signed_volume(), 1e-9 * whole.signed_volume(), 1e-10);
    assert_eq!((source.name.as_str(), source.sha256.len()), ("", 64));
    let (_, other) = mesh_from_memory(&whole, 1e-3).unwrap();
    assert_ne!(source, other);
    let mut open = whole.clone();
    open.triangles.pop();
    let message = mesh_from_memory(&open, 1.0).unwrap_err().to_string();
    assert!(message.contains("edge"), "{message}");
    open.triangles[0][1] = 10_000;
    let message = mesh_from_memory(&open, 1.0).unwrap_err().to_string();
    assert!(message.contains("has vertex 10000"), "{message}");
    assert!(mesh_from_memory(&whole, 0.0).is_err());
}

/// A prism of height 2 over a polygon, its caps single faces that begin with corner `first`.
fn prism(polygon: &[[i32; 2]], first: usize) -> (Vec<DVec3>, Vec<Vec<usize>>) {
    let n = polygon.len();
    let corner =
        |z: f64| polygon.iter().map(move |[x, y]| DVec3::new(f64::from(*x), f64::from(*y), z));
    let mut top: Vec<usize> = (n..2 * n).collect();
    top.rotate_left(first);
    let bottom = top.iter().rev().map(|v| v - n).collect();
    let sides = (0..n).map(|i| vec![i, (i + 1) % n, n + (i + 1) % n, n + i]);
    (corner(0.0).chain(corner(2.0)).collect(), [bottom, top].into_iter().chain(sides).collect())
}

#[test]
fn concave_polygons_do_not_depend_on_their_first_corner() {
    let folder = Folder::new();
    let ell: &[[i32; 2]] = &[[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]];
    let horseshoe: &[[i32; 2]] = &[[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]];
    for (polygon, volume, area) in [(ell, 6.0, 22.0), (horseshoe, 14.0, 46.0)] {
        for first in 0..polygon.len() {
            let (vertices, faces) = prism(polygon, first);
            let mut obj = String::new();
            let mut ply = format!(
                "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
                 property float z\nelement face {}\nproperty list uchar int vertex_indices\n\
                 end_header\n",
                vertices.len(),
                faces.len()
            );
            for v in &vertices {
                writeln!(obj, "v {} {} {}", v.x, v.y, v.z).unwrap();
                writeln!(ply, "{} {} {}", v.x, v.y, v.z).unwrap();
            }
            for face in &faces {
                let numbers = |from: usize| {
                    face.iter().map(|v| (v + from).to_string()).collect::<Vec<_>>().join(" ")
                };
                writeln!(obj, "f {}", numbers(1)).unwrap();
                writeln!(ply, "{} {}", face.len(), numbers(0)).unwrap();
            }
            for (name, text) in [("a.obj", obj), ("a.ply", ply)] {
                let mesh = folder.read(name, text.as_bytes()).unwrap();
                close(mesh.signed_volume(), 1e-9 * volume, 1e-12);
                close(mesh.area(), 1e-6 * area, 1e-12);
                mesh.check_crossings().unwrap();
            }
        }
    }
}

/// Samples at the tips of the tetrahedron that are no neighbours of other samples do not count.
#[test]
fn a_regular_tetrahedron_is_accepted_for_any_position_of_its_tips() {
    let vertices = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]];
    let vertices = vertices.map(|v| DVec3::from_array(v.map(f64::from))).to_vec();
    let triangles = vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    let mesh = TriangleMesh { vertices, triangles };
    for cells in [33, 40, 48, 56, 77, 100] {
        let shape = ShapeOptions {
            cells: Some(cells),
            nodes: Some(200),
            roundness: false,
            ..Default::default()
        };
        let options = MeshOptions { shape, flip: false };
        let shape = shape_from_mesh(&mesh, &SourceFile::default(), &options).unwrap();
        println!("{cells}: {:+.5}", shape.volume() / (8.0 / 3.0) - 1.0);
        close(shape.volume(), 8.0 / 3.0, 0.01);
    }
}

/// The tetrahedron between the origin and one unit along each axis. Two of its principal moments
/// are equal.
fn corner(unit: f64) -> TriangleMesh {
    let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|v| unit * v).to_vec();
    TriangleMesh { vertices, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] }
}

#[test]
fn the_quality_does_not_depend_on_the_unit() {
    let bounds = QualityBounds { gradient_error: 1.0, volume_error: 1.0 };
    for cells in [40, 56, 100] {
        let built = |unit: f64| {
            let nodes = Some(200);
            let shape = ShapeOptions { cells: Some(cells), nodes, bounds, ..options().shape };
            let options = MeshOptions { shape, flip: false };
            shape_from_mesh(&corner(unit), &SourceFile::default(), &options).unwrap()
        };
        let one = built(1.0);
        for unit in [1e-3, 1e-6, 0.3, 25.4e-3, 17.0] {
            let other = built(unit);
            let turn = one.provenance().rotation.dot(other.provenance().rotation);
            assert!(turn.abs() > 1.0 - 1e-9, "{unit}: {turn}");
            let [a, b] = [&one, &other].map(|shape| shape.quality().unwrap().gradient_error);
            println!("{cells} cells, {unit}: {a:.5} and {b:.5}");
            close(b, a, 0.01);
            close(other.volume(), unit.powi(3) * one.volume(), 1e-4);
        }
    }
}

/// Cells and margins add up to 50, 42 and 34 cells, which rounding makes 51 or 43 in some units.
#[test]
fn the_grid_does_not_depend_on_the_unit() {
    let built = |unit: f64| {
        let [a, b, c] = [1.0, 0.8, 0.6].map(|axis| 0.5 * unit * axis);
        let (cells, nodes) = (Some(40), Some(200));
        let options = ShapeOptions { cells, nodes, roundness: false, ..Default::default() };
        let shape = analytic::ellipsoid(a, b, c, &options).unwrap();
        let error = shape.quality().unwrap().gradient_error;
        let Field::Sampled(field) = shape.field() else { panic!("an ellipsoid is sampled") };
        (field.dims(), error, shape.volume() / unit.powi(3))
    };
    let (dims, gradient, volume) = built(1.0);
    for unit in [1e-3, 25.4e-3, 0.7e-3, 0.7, 3.0] {
        let (other_dims, other, scaled) = built(unit);
        println!("{unit}: {other} {gradient}, {}, {other_dims:?}", scaled / volume - 1.0);
        assert_eq!(other_dims, dims, "{unit}");
        close(other, gradient, 0.01);
        close(scaled, volume, 1e-5);
    }
}

#[test]
fn a_mesh_that_is_resolved_too_poorly_is_refused_with_a_number_of_cells_that_is_enough() {
    let built = |unit: f64, cells: Option<usize>| {
        let shape = ShapeOptions { cells, roundness: false, ..Default::default() };
        let options = MeshOptions { shape, flip: false };
        shape_from_mesh(&corner(unit), &SourceFile::default(), &options)
    };
    for unit in [1.0, 1e-3, 1e-6] {
        let Err(ShapeError::Quality { cells, .. }) = built(unit, Some(32)) else {
            panic!("32 cells pass");
        };
        println!("{unit}: {cells:?}");
        assert!(cells.is_some_and(|cells| built(unit, Some(cells)).is_ok()));
    }
}

/// The longest Feret diameter of a cube is its diagonal, which sampling would truncate.
#[test]
fn feret_diameters_of_a_mesh_are_those_of_its_vertices() {
    let cube = |turn: DQuat| {
        let corner = |n: usize| {
            turn * (DVec3::new((n & 1) as f64, (n >> 1 & 1) as f64, (n >> 2) as f64) - 0.5)
        };
        let sides =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        TriangleMesh { vertices: (0..8).map(corner).collect(), triangles: halves.collect() }
    };
    let how = MeshOptions { shape: ShapeOptions { cells: None, ..options().shape }, flip: false };
    for turn in [DQuat::IDENTITY, DQuat::from_scaled_axis(DVec3::new(0.4, -0.3, 0.7))] {
        let shape = shape_from_mesh(&cube(turn), &SourceFile::default(), &how).unwrap();
        let feret = shape.morphology().feret.unwrap();
        println!("{feret:?}");
        close(feret[0], 3f64.sqrt(), 1e-9);
        close(feret[1], 8f64.sqrt() / 3f64.sqrt(), 1e-3);
    }
}
