//! Measures of rendered scans of bodies, against the closed forms:
//!
//! ```text
//! cargo run --release -p grainwake-shape --example scanned_bodies -- measures
//! cargo run --release -p grainwake-shape --example scanned_bodies -- roundness noise=0,5
//! ```
//!
//! `measures` goes over the voxels across the inscribed sphere. `roundness` takes settings, which
//! are lists: `bodies`, `voxels` (across the inscribed sphere), `noise` [percent of the contrast],
//! `blur` [voxels], `turns` (0: along the grid), `seeds` (how many).

#[path = "../tests/shape/bodies.rs"]
mod bodies;
#[path = "../tests/shape/render.rs"]
mod render;

use bodies::{Body, Scan};
use grainwake_shape::ShapeOptions;
use rayon::prelude::*;
use std::collections::HashMap;

const BODIES: &str = "sphere,cube0,cube.1,cube.2,cube.3,cube.4,cylinder,spheroid";

const SEEDS: u64 = 3;

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("measures") => measures(),
        Some("roundness") => roundness(std::env::args().skip(2)),
        _ => panic!("give `measures` or `roundness`"),
    }
}

/// Prints the mean of the roundness over seeds and turns, the extremes, and how many lie within the
/// bound, for every combination of the settings.
fn roundness(settings: impl Iterator<Item = String>) {
    let given: HashMap<String, String> = settings
        .filter_map(|arg| {
            let (name, list) = arg.split_once('=')?;
            Some((name.to_owned(), list.to_owned()))
        })
        .collect();
    let list = |name: &str, default: &str| -> Vec<String> {
        let list = given.get(name).map_or(default, String::as_str);
        list.split(',').map(str::to_owned).collect()
    };
    let numbers = |name: &str, default: &str| -> Vec<f64> {
        let parse = |s: String| s.parse().unwrap_or_else(|_| panic!("{name}: {s}?"));
        list(name, default).into_iter().map(parse).collect()
    };
    let seeds = numbers("seeds", "5")[0] as u64;
    let turns = numbers("turns", "0,1,2,3");
    println!(
        "{:<9} {:>5} {:>6} {:>6} {:>5} {:>6} {:>6} {:>6} {:>7}",
        "body", "exact", "voxels", "noise", "blur", "mean", "least", "most", "within"
    );
    for name in list("bodies", BODIES) {
        let body = Body::named(&name);
        for voxels in numbers("voxels", "40,80") {
            for blur in numbers("blur", "1") {
                for noise in numbers("noise", "5") {
                    let found: Vec<f64> = turns
                        .par_iter()
                        .flat_map(|turn| {
                            let scan = Scan::new(&body, *turn as u64, voxels, blur);
                            (0..seeds)
                                .into_par_iter()
                                .map(move |seed| scan.roundness(noise / 100.0, seed))
                        })
                        .collect();
                    let within = found.iter().filter(|r| body.holds(**r)).count();
                    println!(
                        "{name:<9} {:>5.3} {voxels:>6} {noise:>6} {blur:>5} {:>6.3} {:>6.3} {:>6.3} {within:>3}/{}",
                        body.roundness,
                        found.iter().sum::<f64>() / found.len() as f64,
                        found.iter().copied().fold(f64::INFINITY, f64::min),
                        found.iter().copied().fold(0.0, f64::max),
                        found.len()
                    );
                }
            }
        }
    }
}

/// Prints sphericities, convexity and roundness against the closed forms, by the voxels across the
/// inscribed sphere (blur 1 voxel, noise 5 percent; a turned body, mean of three seeds).
fn measures() {
    println!("| body | voxels | Krumbein | Krumbein by Feret | Wadell | convexity | roundness |");
    println!("|---|---|---|---|---|---|---|");
    for name in ["spheroid", "box.1", "box", "peanut"] {
        let body = Body::named(name);
        let Some([krumbein, wadell, convexity]) = body.others else {
            continue;
        };
        println!(
            "| {name} | exact | {krumbein:.3} | | {wadell:.3} | {convexity:.3} | {:.3} |",
            body.roundness
        );
        for across in [10.0, 20.0, 40.0, 80.0] {
            let scan = Scan::new(&body, 1, across, 1.0);
            let mut sums = [0.0; 5];
            for seed in 0..SEEDS {
                let record = scan.shape_with(0.05, seed, false, ShapeOptions::default()).record();
                let measures = [
                    Some(record.krumbein_sphericity),
                    record.krumbein_sphericity_feret,
                    Some(record.wadell_sphericity),
                    record.convexity,
                    record.wadell_roundness,
                ];
                for (sum, measure) in sums.iter_mut().zip(measures) {
                    *sum += measure.unwrap_or(f64::NAN) / SEEDS as f64;
                }
            }
            let [k, f, w, c, r] = sums;
            println!("| | {across} | {k:.3} | {f:.3} | {w:.3} | {c:.3} | {r:.3} |");
        }
    }
}
