//! Makes the grain files of `cases/grains` again from their sources:
//!
//! `cargo run --release -p grainwake-shape --example case_grains -- SHARED/grains cases/grains`

use grainwake_shape::mesh::{MeshOptions, read_mesh, shape_from_mesh};
use grainwake_shape::scan::{ScanOptions, read_volume, shapes_from_volume};
use grainwake_shape::{ReadLimits, Result, Shape};
use std::path::{Path, PathBuf};

fn main() -> std::process::ExitCode {
    let folders: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [from, to] = folders.as_slice() else {
        eprintln!("usage: case_grains FOLDER_OF_SOURCES FOLDER_OF_GRAIN_FILES");
        return 2.into();
    };
    let made = aggregate(from)
        .and_then(|shape| keep(&shape, &to.join("fdot57_D-00002.grain")))
        .and_then(|()| rock(from))
        .and_then(|shape| keep(&shape, &to.join("tsquare_rock.grain")));
    match made {
        Ok(()) => 0.into(),
        Err(error) => {
            eprintln!("{error}");
            2.into()
        }
    }
}

/// Coarse aggregate, a mesh in millimetres.
fn aggregate(from: &Path) -> Result<Shape> {
    let path = from.join("meshes/fdot57_D-00002.ply");
    let (mesh, source) = read_mesh(&path, 1e-3, &ReadLimits::default())?;
    shape_from_mesh(&mesh, &source, &MeshOptions::default())
}

/// Rock fragment, a tightly cropped volume of 5 micrometre voxels.
fn rock(from: &Path) -> Result<Shape> {
    let path = from.join("scans/tsquare_rock/rock_115x105x73.npy");
    let (volume, source) = read_volume(&path, &ReadLimits::default())?;
    let options = ScanOptions { pad: true, label: Some(1), ..ScanOptions::new(5e-6) };
    shapes_from_volume(&volume, &source, &options)?.remove(0).shape
}

fn keep(shape: &Shape, path: &Path) -> Result<()> {
    shape.save(path)?;
    println!("{}: {:#?}", path.display(), shape.record());
    Ok(())
}
