//! Readers against arbitrary and damaged bytes: a refusal or a result, never a panic, and no more
//! memory than the limits allow.

use grainwake_shape::mesh::read_mesh;
use grainwake_shape::scan::{Volume, read_volume};
use grainwake_shape::{ReadLimits, Shape};
use proptest::prelude::*;
use std::path::Path;

/// Small, so that a file that claims much is refused.
fn limits() -> ReadLimits {
    ReadLimits {
        file_bytes: 1 << 20,
        voxels: 1 << 16,
        mesh_elements: 1 << 14,
        ..Default::default()
    }
}

/// Hands the bytes to the reader of this extension.
fn open(extension: &str, bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("a.{extension}"));
    std::fs::write(&path, bytes).unwrap();
    match extension {
        "grain" => Shape::load(&path).is_ok(),
        "stl" | "obj" | "ply" | "anm" => read_mesh(&path, 1e-3, &limits()).is_ok(),
        _ => read_volume(&path, &limits()).is_ok(),
    }
}

/// A sound file of each kind.
fn sound() -> Vec<(&'static str, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    let labels = (0..60).map(|n| n % 7).collect();
    Volume::from_labels([5, 4, 3], labels)
        .unwrap()
        .save_labels(&path)
        .unwrap();
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
        ("npy", npy),
        ("nrrd", nrrd),
        ("mha", meta),
        ("ply", ply.into()),
        ("obj", obj.into()),
        ("stl", stl),
        ("anm", anm.into()),
        ("grain", Shape::sphere(1e-3, 20).to_bytes()),
    ]
}

#[test]
fn sound_files_are_read() {
    for (extension, bytes) in sound() {
        assert!(open(extension, &bytes), "{extension}");
    }
    assert!(!Path::new("a.tif").exists());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..Default::default() })]

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
        }
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
