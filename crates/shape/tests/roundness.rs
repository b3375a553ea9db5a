//! Roundness of scanned bodies: what noise does to it, at two resolutions.

#[path = "common/render.rs"]
mod render;

use glam::{DQuat, DVec2, DVec3};
use grainwake_shape::scan::{ScanOptions, Threshold, Volume, shapes_from_volume};
use grainwake_shape::{ShapeOptions, SourceFile};
use render::{blurred, greys, shares};

/// Half side 1, edges of this radius.
fn rounded_cube(radius: f64) -> impl Fn(DVec3) -> f64 {
    move |x| {
        let q = x.abs() - DVec3::splat(1.0 - radius);
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - radius
    }
}

/// Radius 1, height 2.
fn cylinder(x: DVec3) -> f64 {
    let q = DVec2::new(x.truncate().length(), x.z.abs()) - DVec2::ONE;
    q.max(DVec2::ZERO).length() + q.max_element().min(0.0)
}

fn spheroid(x: DVec3) -> f64 {
    let axes = DVec3::new(1.5, 1.0, 1.0);
    let gradient = (x / (axes * axes)).length();
    let level = (x / axes).length();
    if gradient > 0.0 {
        (level - 1.0) * level / gradient
    } else {
        -1.0
    }
}

/// Roundness of a body of inscribed radius 1 that lies within `reach`, turned, rendered with its
/// inscribed sphere so many voxels across, blur 1 voxel, 5 percent noise.
fn scanned(body: impl Fn(DVec3) -> f64, reach: f64, across: f64, from_mask: bool) -> f64 {
    let turn = DQuat::from_scaled_axis(DVec3::new(0.37, 0.81, -0.52));
    let radius = 0.5 * across;
    let n = (2.0 * reach * radius).ceil() as usize + 16;
    let dims = [n; 3];
    let centre = DVec3::splat(0.5 * n as f64) + DVec3::new(-0.4, 0.13, 0.29);
    let placed = |x: DVec3| radius * body(turn * (x - centre) / radius);
    let exact = shares(dims, &[&placed], &[(centre, reach * radius)]);
    let image = greys(&blurred(&exact, dims, 1.0), 0.05, 1);
    let volume = Volume::from_labels(dims, image).unwrap();
    let options = ScanOptions {
        threshold: Some(Threshold::Otsu),
        sub_voxel: !from_mask,
        largest_piece: true,
        shape: ShapeOptions {
            nodes: Some(250),
            ..Default::default()
        },
        ..ScanOptions::new(1.0)
    };
    let mut grains = shapes_from_volume(&volume, &SourceFile::default(), &options).unwrap();
    let shape = grains.remove(0).shape.unwrap();
    shape.morphology().wadell_roundness.unwrap()
}

#[test]
fn noise_makes_no_corners_on_a_scanned_sphere() {
    for across in [40.0, 80.0] {
        let found = scanned(|x| x.length() - 1.0, 1.0, across, false);
        println!("sphere, {across} voxels: {found:.3}");
        assert!(found > 0.98, "{found}");
    }
    let found = scanned(|x| x.length() - 1.0, 1.0, 40.0, true);
    println!("sphere, 40 voxels, mask: {found:.3}");
    assert!(found > 0.95, "{found}");
}

#[test]
fn scanned_bodies_with_corners_keep_them() {
    let mut missed = Vec::new();
    for (name, exact, bound) in [
        ("cube", 0.0, [0.11, 0.04]),
        ("cube", 0.2, [0.05, 0.05]),
        ("cube", 0.4, [0.05, 0.05]),
        ("cube", 0.6, [0.05, 0.05]),
        ("cube", 0.8, [0.05, 0.05]),
        ("cylinder", 0.0, [0.16, 0.02]),
        ("spheroid 1.5", 0.874, [0.065, 0.04]),
    ] {
        for (across, bound) in [40.0, 80.0].into_iter().zip(bound) {
            let found = match name {
                "cube" => {
                    let reach = 3f64.sqrt() * (1.0 - exact) + exact;
                    scanned(rounded_cube(exact), reach, across, false)
                }
                "cylinder" => scanned(cylinder, 2f64.sqrt(), across, false),
                _ => scanned(spheroid, 1.5, across, false),
            };
            println!("{name} of {exact}, {across} voxels: {found:.3}");
            if (found - exact).abs() >= bound {
                missed.push(format!("{name} of {exact}, {across} voxels: {found:.3}"));
            }
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}
