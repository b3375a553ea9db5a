//! Sphericities, convexity and roundness of rendered scans against the closed forms, by the voxels
//! across the inscribed sphere (blur 1 voxel, noise 5 percent; a turned body, mean of three seeds):
//!
//! ```text
//! cargo run --release -p grainwake-shape --example measures_by_resolution
//! ```

#[path = "../tests/common/bodies.rs"]
mod bodies;
#[path = "../tests/common/render.rs"]
mod render;

use bodies::{Body, Scan};
use grainwake_shape::ShapeOptions;

const SEEDS: u64 = 3;

fn main() {
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
