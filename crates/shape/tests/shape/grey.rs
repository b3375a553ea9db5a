//! Accuracy of surfaces from grey values, compared with surfaces from a mask.

use crate::render::{blurred, greys, shares};
use glam::{DQuat, DVec3};
use grainwake_shape::scan::{ScanOptions, Threshold, Volume, shapes_from_volume};
use grainwake_shape::{Shape, ShapeOptions, SourceFile};
use std::f64::consts::PI;

/// Errors of a shape relative to the rendered body.
#[derive(Debug)]
struct Errors {
    /// Relative.
    volume: f64,
    /// Root mean square [voxels].
    surface: f64,
    /// Relative, the worst of three.
    inertia: f64,
}

fn ellipsoid(axes: DVec3, turn: DQuat, centre: DVec3) -> impl Fn(DVec3) -> f64 {
    move |x| {
        let y = turn.inverse() * (x - centre);
        let gradient = (y / (axes * axes)).length();
        let level = (y / axes).length();
        // First order off the surface, exact on it.
        if gradient > 0.0 { (level - 1.0) * level / gradient } else { -axes.min_element() }
    }
}

fn errors(shape: &Shape, axes: DVec3, body: &dyn Fn(DVec3) -> f64) -> Errors {
    let exact = 4.0 / 3.0 * PI * axes.element_product();
    let squares = axes * axes;
    let moments = exact / 5.0
        * DVec3::new(squares.y + squares.z, squares.z + squares.x, squares.x + squares.y);
    let place = shape.provenance();
    let (mut sum, mut total) = (0.0, 0.0);
    for node in shape.nodes() {
        let off = body(place.centroid + place.rotation * node.position);
        sum += node.area * off * off;
        total += node.area;
    }
    Errors {
        volume: shape.volume() / exact - 1.0,
        surface: (sum / total).sqrt(),
        inertia: (shape.inertia() / moments - 1.0).abs().max_element(),
    }
}

/// Grey and mask routes for one body, blurred by `blur` voxels, with noise as a share of the
/// contrast.
fn both(axes: DVec3, turn: DQuat, off: DVec3, [blur, noise]: [f64; 2], seed: u64) -> [Errors; 2] {
    let n = (2.0 * axes.max_element()).ceil() as usize + 16;
    let dims = [n; 3];
    let centre = DVec3::splat(0.5 * n as f64) + off;
    let body = ellipsoid(axes, turn, centre);
    let exact = shares(dims, &[&body], &[(centre, axes.max_element())]);
    let image = greys(&blurred(&exact, dims, blur), noise, seed);
    let volume = Volume::from_labels(dims, image).unwrap();
    [true, false].map(|sub_voxel| {
        let options = ScanOptions {
            threshold: Some(Threshold::Otsu),
            sub_voxel,
            largest_piece: true,
            shape: ShapeOptions {
                cells: Some(28),
                nodes: Some(250),
                roundness: false,
                ..Default::default()
            },
            // In voxels.
            ..ScanOptions::new(1.0)
        };
        let mut grains = shapes_from_volume(&volume, &SourceFile::default(), &options).unwrap();
        errors(&grains.remove(0).shape.unwrap(), axes, &body)
    })
}

/// Twenty voxels across, blur 1 voxel, noise 5 percent, at symmetric places and others.
#[test]
fn a_blurred_noisy_body_of_twenty_voxels_is_found_to_a_twentieth_of_a_voxel() {
    let turn = DQuat::from_scaled_axis(DVec3::new(0.7, -0.4, 1.1));
    let places =
        [(DQuat::IDENTITY, DVec3::splat(0.5)), (turn.inverse(), DVec3::new(-0.4, 0.13, 0.29))];
    for axes in [DVec3::splat(10.0), DVec3::new(13.0, 10.0, 7.7)] {
        for (seed, (turn, off)) in places.into_iter().enumerate() {
            let [grey, mask] = both(axes, turn, off, [1.0, 0.05], seed as u64);
            println!(
                "{axes}: grey: volume {:+.4}, surface {:.3}, inertia {:.4}; mask: {:+.4}, {:.3}, {:.4}",
                grey.volume, grey.surface, grey.inertia, mask.volume, mask.surface, mask.inertia
            );
            assert!(grey.volume.abs() < 3e-3, "{grey:?}");
            assert!(grey.surface < 0.05, "{grey:?}");
            assert!(grey.inertia < 0.01, "{grey:?}");
        }
    }
}

#[test]
fn the_blur_need_not_be_known() {
    for (radius, blur) in [(10.0, 0.6), (10.0, 1.5)] {
        let axes = DVec3::new(1.2, 1.0, 0.85) * radius;
        let [grey, mask] =
            both(axes, DQuat::from_rotation_x(0.4), DVec3::new(0.2, 0.1, 0.4), [blur, 0.05], 5);
        println!("{radius} {blur}: {grey:?} {mask:?}");
        assert!(grey.volume.abs() < 4e-3 && grey.surface < 0.06, "{grey:?}");
    }
}

/// Convergence of the surface position with the voxels per diameter. From grey values the relative
/// error decreases until noise dominates; from a mask it stays a constant fraction of a voxel.
#[test]
fn the_surface_converges_with_the_voxels() {
    let places = [
        (0.4, DVec3::new(0.2, 0.1, 0.4)),
        (1.3, DVec3::new(-0.35, 0.27, 0.05)),
        (2.2, DVec3::new(0.11, -0.43, 0.31)),
    ];
    for (noise, least) in [(0.0, [1.5, 0.8]), (0.05, [0.8, 0.8])] {
        // Root mean square over the places [voxels], grey and mask.
        let found = [10.0, 20.0, 40.0].map(|across| {
            let axes = DVec3::new(1.2, 1.0, 0.85) * (0.5 * across);
            let mut squares = [0.0; 2];
            for (seed, (angle, off)) in places.into_iter().enumerate() {
                let turn = DQuat::from_scaled_axis(DVec3::new(0.5, -0.3, 0.8) * angle);
                let errors = both(axes, turn, off, [1.0, noise], seed as u64);
                for (square, error) in squares.iter_mut().zip(errors) {
                    *square += error.surface * error.surface / places.len() as f64;
                }
            }
            squares.map(f64::sqrt)
        });
        for (n, route) in ["grey", "mask"].into_iter().enumerate() {
            let errors = found.map(|f| f[n]);
            // Of the error over the diameter.
            let order = 1.0 + 0.5 * (errors[0] / errors[2]).log2();
            println!("noise {noise}, {route}: {errors:.4?} voxel, order {order:.2}");
            assert!(order > least[n], "{route}: order {order}");
        }
        assert!(found.iter().all(|[grey, mask]| grey < mask), "{found:?}");
    }
}

/// Fractions of a ball in a cubic image of `n` voxels.
fn ball(n: usize, centre: DVec3, radius: f64) -> Vec<f32> {
    shares([n; 3], &[&|x: DVec3| x.distance(centre) - radius], &[(centre, radius)])
}

/// Volumes of the grains of a blurred image with noise of 2 % of the contrast.
fn volumes(n: usize, contrast: &[f32], threshold: f64) -> Vec<f64> {
    let image = greys(&blurred(contrast, [n; 3], 1.0), 0.02, 7);
    let volume = Volume::from_labels([n; 3], image).unwrap();
    let options = ScanOptions {
        threshold: Some(Threshold::Value(9000.0 + 21000.0 * threshold)),
        split: true,
        shape: ShapeOptions { nodes: Some(100), roundness: false, ..Default::default() },
        ..ScanOptions::new(1.0)
    };
    let grains = shapes_from_volume(&volume, &SourceFile::default(), &options).unwrap();
    grains.into_iter().map(|grain| grain.shape.unwrap().volume()).collect()
}

/// A cavity neither darkens the grain's own grey nor loses volume, for thick and thin walls and for
/// many pores close to the surface.
#[test]
fn closed_pores_do_not_change_the_outer_volume() {
    let (n, radius, centre) = (44, 15.0, DVec3::new(22.2, 21.7, 22.1));
    let solid = ball(n, centre, radius);
    let near_the_surface = (0..12).map(|k| {
        let (angle, z) = (2.4 * f64::from(k), f64::from(k) / 6.0 - 0.9);
        let along = DVec3::new(angle.cos(), angle.sin(), 0.0) * (1.0 - z * z).sqrt();
        (centre + (along + z * DVec3::Z) * (radius - 5.0), 3.0)
    });
    for pores in [
        vec![],
        vec![(centre, 4.0)],
        vec![(centre, 8.0)],
        vec![(centre, 9.0)],
        near_the_surface.collect(),
    ] {
        let mut contrast = solid.clone();
        for (place, size) in &pores {
            let pore = ball(n, *place, *size);
            contrast.iter_mut().zip(pore).for_each(|(c, p)| *c = (*c - p).max(0.0));
        }
        let [found] = volumes(n, &contrast, 0.5)[..] else { panic!("one grain") };
        let error = found / (4.0 / 3.0 * PI * radius.powi(3)) - 1.0;
        println!("{pores:?}: {error:+.4}");
        assert!(error.abs() < 0.01, "{pores:?}: {error}");
    }
}

/// A grain of another mineral next to a large one is measured by its own grey.
#[test]
fn small_grains_of_another_mineral_have_their_own_grey() {
    let n = 60;
    let large = ball(n, DVec3::new(24.2, 24.4, 23.9), 16.0);
    for radius in [5.5, 7.0] {
        let small = ball(n, DVec3::new(48.3, 48.1, 47.8), radius);
        for grey in [0.67, 1.0, 1.67] {
            let contrast: Vec<f32> = large.iter().zip(&small).map(|(l, s)| l + grey * s).collect();
            let [_, found] = volumes(n, &contrast, 0.33)[..] else { panic!("two grains") };
            let error = found / (4.0 / 3.0 * PI * radius.powi(3)) - 1.0;
            println!("R = {radius}, grey {grey}: {error:+.4}");
            assert!(error.abs() < 0.03, "R = {radius}, grey {grey}: {error}");
        }
    }
}
