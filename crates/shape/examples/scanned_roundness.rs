//! Wadell roundness of rendered scans of bodies whose roundness is known, over noise, blur,
//! resolution, orientation and seeds:
//!
//! ```text
//! cargo run --release -p grainwake-shape --example scanned_roundness -- voxels=40,80 noise=0,5
//! ```
//!
//! Settings are lists, and every combination is tried: `bodies`, `voxels` (across the inscribed
//! sphere), `noise` [percent of the contrast], `blur` [voxels], `turns` (0: along the grid),
//! `seeds` (how many). A line tells the mean over seeds and turns, the extremes, and how many
//! lie within the bound.

#[path = "../tests/common/bodies.rs"]
mod bodies;
#[path = "../tests/common/render.rs"]
mod render;

use bodies::{Body, Scan};
use rayon::prelude::*;
use std::collections::HashMap;

const BODIES: &str = "sphere,cube0,cube.1,cube.2,cube.3,cube.4,cylinder,spheroid";

fn main() {
    let given: HashMap<String, String> = std::env::args()
        .skip(1)
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
