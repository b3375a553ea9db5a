//! Grain files of the cases: they load and agree with shapes built from their sources.

use crate::common::{close, shared};
use grainwake_shape::mesh::{MeshOptions, read_mesh, shape_from_mesh};
use grainwake_shape::scan::{ScanOptions, Threshold, read_volume, shapes_from_volume};
use grainwake_shape::{ReadLimits, Shape, ShapeError};
use std::path::{Path, PathBuf};

fn kept(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/grains").join(name)
}

#[test]
fn the_kept_files_load_and_are_small() {
    for (name, sphericity) in [("fdot57_D-00002.grain", 0.7746), ("tsquare_rock.grain", 0.8345)] {
        let path = kept(name);
        assert!(std::fs::metadata(&path).unwrap().len() < 400_000);
        let shape = Shape::load(&path).unwrap();
        close(shape.morphology().krumbein_sphericity, sphericity, 1e-3);
        let two = shape.scaled_to_equivalent_diameter(2e-3).unwrap();
        close(two.equivalent_diameter(), 2e-3, 1e-12);
        assert!(two.nodes().iter().all(|n| two.distance(n.position).abs() < 1e-9));
    }
}

#[test]
fn the_aggregate_is_what_its_mesh_gives() {
    let Some(path) = shared("grains/meshes/fdot57_D-00002.ply") else {
        return;
    };
    let (mesh, source) = read_mesh(&path, 1e-3, &ReadLimits::default()).unwrap();
    let made = shape_from_mesh(&mesh, &source, &MeshOptions::default()).unwrap();
    let file = Shape::load(&kept("fdot57_D-00002.grain")).unwrap();
    // Not the digest: it may differ in the last bit where another mathematics library is used.
    assert_eq!(file.provenance().source_sha256, made.provenance().source_sha256);
    close(file.volume(), made.volume(), 1e-9);
    close(file.inertia().x, made.inertia().x, 1e-9);
    assert_eq!(file.nodes().len(), made.nodes().len());
}

/// Two of the five grains in the volume of `cases/scan-pair` are complete and equal the committed
/// files.
#[test]
fn the_pair_of_the_scan_is_what_its_volume_gives() {
    let volume = kept("../scan-pair/powder-crop.tif");
    assert!(std::fs::metadata(&volume).unwrap().len() < 200_000);
    let (volume, source) = read_volume(&volume, &ReadLimits::default()).unwrap();
    let options = ScanOptions {
        threshold: Some(Threshold::Otsu),
        median: true,
        separate: Some(0.87),
        ..ScanOptions::new(2e-6)
    };
    let grains = shapes_from_volume(&volume, &source, &options).unwrap();
    assert_eq!(grains.len(), 5);
    for grain in grains {
        let path = kept(&format!("../scan-pair/grains/label-{:05}.grain", grain.label));
        match grain.shape {
            Ok(made) => {
                let file = Shape::load(&path).unwrap();
                close(file.volume(), made.volume(), 1e-9);
                close(file.surface_area(), made.surface_area(), 1e-6);
                let [old, new] = [&file, &made].map(|s| s.morphology().wadell_roundness.unwrap());
                close(old, new, 1e-6);
                assert!(grain.shared_surface > 0.1);
            }
            Err(error) => {
                assert!(matches!(error, ShapeError::CutByBorder { .. }), "{error}");
                assert!(!path.exists());
            }
        }
    }
}
