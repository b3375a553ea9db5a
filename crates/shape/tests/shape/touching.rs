//! Roundness of grains that were cut from their neighbours: that of their own surface.

use crate::render::{blurred, greys, shares};
use glam::DVec3;
use grainwake_shape::scan::{ScanOptions, Threshold, Volume, shapes_from_volume};
use grainwake_shape::{ShapeOptions, SourceFile};

/// Roundness and shared surface of every grain found in a scan of these bodies.
fn measured(
    dims: [usize; 3],
    bodies: &[&dyn Fn(DVec3) -> f64],
    boxes: &[(DVec3, f64)],
    noise: f64,
) -> Vec<(Option<f64>, f64)> {
    let image = greys(&blurred(&shares(dims, bodies, boxes), dims, 1.0), noise, 7);
    let volume = Volume::from_labels(dims, image).unwrap();
    let options = ScanOptions {
        threshold: Some(Threshold::Otsu),
        median: true,
        separate: Some(0.87),
        shape: ShapeOptions { cells: Some(24), nodes: Some(60), ..Default::default() },
        ..ScanOptions::new(1.0)
    };
    let grains = shapes_from_volume(&volume, &SourceFile::default(), &options).unwrap();
    grains
        .into_iter()
        .map(|grain| {
            let roundness = grain.shape.unwrap().morphology().wadell_roundness;
            (roundness, grain.shared_surface)
        })
        .collect()
}

/// Three in a row, with necks of half their radius.
#[test]
fn touching_spheres_stay_round() {
    let radius = 13.0;
    let places = [0.0, 1.0, 2.0].map(|n| {
        let apart = DVec3::new(22.5, 1.2, -0.8);
        DVec3::new(18.3, 18.1, 19.4) + n * apart
    });
    let spheres = places.map(|place| move |x: DVec3| x.distance(place) - radius);
    let bodies: Vec<&dyn Fn(DVec3) -> f64> = spheres.iter().map(|s| s as _).collect();
    let boxes = places.map(|place| (place, radius));
    let found = measured([82, 39, 37], &bodies, &boxes, 0.05);
    println!("{found:.3?}");
    assert_eq!(found.len(), 3);
    for (roundness, shared) in found {
        assert!(shared > 0.05, "{shared}");
        assert!(roundness.unwrap() >= 0.95, "{roundness:?}");
    }
}
