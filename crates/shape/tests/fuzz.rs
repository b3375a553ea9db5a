//! Readers against arbitrary and damaged bytes: a refusal or a result, never a panic, and no more
//! memory than the limits allow. `PROPTEST_CASES` sets the number of cases.

#[path = "../../formats/tests/common/peak_memory.rs"]
mod peak_memory;
#[path = "common/renewed.rs"]
mod renewed;
#[path = "shape/tiled.rs"]
mod tiled;

use grainwake_shape::mesh::read_mesh;
use grainwake_shape::scan::{Volume, read_volume};
use grainwake_shape::{ReadLimits, Shape, ShapeOptions, analytic};
use proptest::prelude::*;
use renewed::renewed;
use std::io::Write;
use std::path::Path;
use tiled::Layout;

/// Most memory that these tests may take [bytes].
const MOST_MEMORY: usize = 512 << 20;

/// Small, so that a file that claims much is refused.
fn limits() -> ReadLimits {
    ReadLimits {
        file_bytes: 1 << 20,
        voxels: 1 << 16,
        mesh_elements: 1 << 14,
        ..Default::default()
    }
}

/// Data beside a detached header.
const RAW: [u8; 60] = [7; 60];

/// Passes the bytes to the reader of this extension: `slices` is the second of three in a folder,
/// `pngs` the second of two.
fn open(extension: &str, bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("a.{extension}"));
    match extension {
        "slices" => {
            std::fs::create_dir(&path).unwrap();
            for slice in ["1", "3"] {
                std::fs::write(path.join(format!("a_{slice}.tif")), slice_file()).unwrap();
            }
            std::fs::write(path.join("a_2.tif"), bytes).unwrap();
        }
        "pngs" => {
            std::fs::create_dir(&path).unwrap();
            std::fs::write(path.join("a_1.png"), png_file()).unwrap();
            std::fs::write(path.join("a_2.png"), bytes).unwrap();
        }
        "tiled" | "big" => {
            let path = folder.path().join("a.tif");
            std::fs::write(&path, bytes).unwrap();
            return read_volume(&path, &limits()).is_ok();
        }
        _ => std::fs::write(&path, bytes).unwrap(),
    }
    if matches!(extension, "nhdr" | "mhd") {
        std::fs::write(folder.path().join("a.raw"), RAW).unwrap();
    }
    match extension {
        "grain" => Shape::load(&path).is_ok(),
        "stl" | "obj" | "ply" | "anm" => read_mesh(&path, 1e-3, &limits()).is_ok(),
        _ => read_volume(&path, &limits()).is_ok(),
    }
}

/// One PNG slice of a folder.
fn png_file() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 3, 2);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&[1, 2, 3, 4, 5, 6]).unwrap();
    bytes
}

/// One slice of a folder.
fn slice_file() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let labels = (0..20).collect();
    let slice = Volume::from_labels([5, 4, 1], labels).unwrap();
    slice.save_labels(&path).unwrap();
    std::fs::read(&path).unwrap()
}

fn zipped(name: &str, bytes: &[u8]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    archive.start_file(name, options).unwrap();
    archive.write_all(bytes).unwrap();
    archive.finish().unwrap().into_inner()
}

fn small_ellipsoid() -> Shape {
    let options = ShapeOptions {
        cells: Some(8),
        least_cells: 8,
        nodes: Some(16),
        roundness: false,
        ..Default::default()
    };
    analytic::ellipsoid(1e-3, 0.9e-3, 0.8e-3, &options).unwrap()
}

/// A sound file of each kind.
fn sound() -> Vec<(&'static str, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let labels = (0..60).map(|n| n % 7).collect();
    Volume::from_labels([5, 4, 3], labels).unwrap().save_labels(&path).unwrap();
    let tiff = std::fs::read(&path).unwrap();
    let data: Vec<u8> = (0..60).collect();
    let header = "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 4, 5), }\n";
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend((header.len() as u16).to_le_bytes());
    npy.extend(header.bytes().chain(data.iter().copied()));
    let mut nrrd = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 4 3\nencoding: raw\n\n".to_vec();
    nrrd.extend(&data);
    let mut meta =
        b"NDims = 3\nDimSize = 5 4 3\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n".to_vec();
    meta.extend(&data);
    let apart =
        b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 4 3\nencoding: raw\ndata file: a.raw\n";
    let meta_apart =
        b"NDims = 3\nDimSize = 5 4 3\nElementType = MET_UCHAR\nElementDataFile = a.raw\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
               property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n\
               0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    let mut stl = vec![b' '; 80];
    stl.extend(4u32.to_le_bytes());
    let corners = [[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    for face in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]] {
        stl.extend([0; 12]);
        for corner in face {
            stl.extend(corners[corner].iter().flat_map(|x: &f32| x.to_le_bytes()));
        }
        stl.extend([0; 2]);
    }
    let anm = "0 0 3.0 0\n1 0 0.3 0\n1 1 0.2 -0.1\n";
    vec![
        ("tif", tiff),
        ("tiled", Layout { wide: false }.file()),
        ("big", Layout { wide: true }.file()),
        ("slices", slice_file()),
        ("pngs", png_file()),
        ("npz", zipped("a.npy", &npy)),
        ("npy", npy),
        ("nhdr", apart.to_vec()),
        ("mhd", meta_apart.to_vec()),
        ("nrrd", nrrd),
        ("mha", meta),
        ("ply", ply.into()),
        ("obj", obj.into()),
        ("stl", stl),
        ("anm", anm.into()),
        ("grain", Shape::sphere(1e-3, 20).to_bytes()),
        ("grain", small_ellipsoid().to_bytes()),
    ]
}

#[test]
fn sound_files_are_read() {
    for (extension, bytes) in sound() {
        assert!(open(extension, &bytes), "{extension}");
    }
    assert!(!Path::new("a.tif").exists());
}

/// Cases without `PROPTEST_CASES`.
const CASES: u32 = 150;

fn config() -> ProptestConfig {
    let default = ProptestConfig::default();
    let asked = std::env::var_os("PROPTEST_CASES").is_some();
    ProptestConfig {
        cases: if asked { default.cases } else { CASES },
        failure_persistence: None,
        ..default
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn damaged_files_do_not_bring_the_readers_down(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::weighted(0.3, any::<prop::sample::Index>()),
    ) {
        for (extension, mut bytes) in sound() {
            for (at, value) in &changes {
                let at = at.index(bytes.len());
                bytes[at] = *value;
            }
            if let Some(cut) = cut {
                bytes.truncate(cut.index(bytes.len()));
            }
            open(extension, &bytes);
            // A checksum gives damage away: also what it protects is damaged.
            match extension {
                "npy" => open("npz", &zipped("a.npy", &bytes)),
                "grain" => open("grain", &renewed(&bytes)),
                _ => true,
            };
        }
        let peak = peak_memory::peak();
        prop_assert!(peak < MOST_MEMORY, "{} MB", peak >> 20);
    }

    #[test]
    fn arbitrary_bytes_are_refused_or_read(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        for (extension, start) in sound() {
            open(extension, &bytes);
            // Behind a sound beginning, so that the signature does not give it away.
            let mut joined = start[..start.len() / 2].to_vec();
            joined.extend(&bytes);
            open(extension, &joined);
        }
    }
}
