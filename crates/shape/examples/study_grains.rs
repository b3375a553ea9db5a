//! Makes the 16 grains of the morphology study and their table again:
//!
//! `cargo run --release -p grainwake-shape --example study_grains -- studies/dkt-morphology/grains`

use grainwake_shape::family::{FamilyTarget, family_grain, family_options};
use grainwake_shape::{Result, Shape, write_table};
use std::path::{Path, PathBuf};

/// Rows of Fig. 4, low to high, and its columns.
const SPHERICITY: [f64; 4] = [0.45, 0.60, 0.75, 0.90];
const ROUNDNESS: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
const DIAMETER: f64 = 2e-3;
const SEED: u64 = 1;

fn main() -> std::process::ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: study_grains FOLDER");
        return 2.into();
    };
    match make(&folder) {
        Ok(()) => 0.into(),
        Err(error) => {
            eprintln!("{error}");
            2.into()
        }
    }
}

fn make(folder: &Path) -> Result<()> {
    let mut rows = Vec::new();
    let mut number = 0;
    for sphericity in SPHERICITY {
        for roundness in ROUNDNESS {
            number += 1;
            let target = FamilyTarget::new(sphericity, roundness, DIAMETER);
            let shape = family_grain(&target, SEED, &family_options())?;
            let path = folder.join(format!("{number:02}.grain"));
            shape.save(&path)?;
            show(&path, &shape);
            rows.push((format!("{number:02}"), shape.record()));
        }
    }
    write_table(&folder.join("table.csv"), &rows, &[])
}

fn show(path: &Path, shape: &Shape) {
    let r = shape.record();
    let size = std::fs::metadata(path).map_or(0, |m| m.len());
    println!(
        "{}  S {:.4}  R {:?}  a b c {:.4} {:.4} {:.4} mm  Wadell S {:.4}  nodes {}  {:?}  gradient {:.3}  volume {:.5}  {size} bytes",
        path.display(),
        r.krumbein_sphericity,
        r.wadell_roundness,
        1e3 * r.a_m,
        1e3 * r.b_m,
        1e3 * r.c_m,
        r.wadell_sphericity,
        r.surface_nodes,
        r.field_samples.unwrap_or_default(),
        r.gradient_error.unwrap_or_default(),
        r.volume_error.unwrap_or_default(),
    );
}
