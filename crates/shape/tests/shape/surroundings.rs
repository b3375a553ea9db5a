//! Grey values around and inside grains: images of several phases, and grains without deep voxels.

use crate::render::{blurred, greys, shares};
use glam::{DQuat, DVec3};
use grainwake_shape::scan::{
    Assumed, ScanOptions, ScannedGrain, Threshold, Volume, grey_notes, shapes_from_volume,
};
use grainwake_shape::{ShapeOptions, SourceFile};
use std::f64::consts::PI;

/// Grey of the resin between void (0) and solid (1).
const RESIN: f32 = 0.44;

/// Fractions of a body in a cubic image of `n` voxels.
fn solid(n: usize, centre: DVec3, reach: f64, body: &dyn Fn(DVec3) -> f64) -> Vec<f32> {
    shares([n; 3], &[body], &[(centre, reach)])
}

fn ball(n: usize, centre: DVec3, radius: f64) -> Vec<f32> {
    solid(n, centre, radius, &|x| x.distance(centre) - radius)
}

/// Grains of an image with this blur [voxels] and noise of 3 %.
fn scanned(n: usize, contrast: &[f32], blur: f64, options: &ScanOptions) -> Vec<ScannedGrain> {
    let image = greys(&blurred(contrast, [n; 3], blur), 0.03, 3);
    let volume = Volume::from_labels([n; 3], image).unwrap();
    shapes_from_volume(&volume, &SourceFile::default(), options).unwrap()
}

/// Grains of an image with this fraction of resin outside the solid.
fn in_resin(
    n: usize,
    solid: &[f32],
    resin: impl Fn(DVec3) -> f32,
    separate: Option<f64>,
) -> Vec<ScannedGrain> {
    let at = |m: usize| DVec3::new((m % n) as f64, (m / n % n) as f64, (m / n / n) as f64) + 0.5;
    let grey = |(m, s): (usize, &f32)| s + (1.0 - s) * RESIN * resin(at(m));
    let contrast: Vec<f32> = solid.iter().enumerate().map(grey).collect();
    let threshold = Threshold::Value(9000.0 + 0.7 * 21000.0);
    scanned(n, &contrast, 1.0, &ScanOptions { separate, ..options(threshold) })
}

fn options(threshold: Threshold) -> ScanOptions {
    ScanOptions {
        threshold: Some(threshold),
        split: true,
        shape: ShapeOptions { nodes: Some(100), roundness: false, ..Default::default() },
        ..ScanOptions::new(1.0)
    }
}

/// Relative error of the volume of a ball.
fn error(grain: &ScannedGrain, radius: f64) -> f64 {
    grain.shape.as_ref().unwrap().volume() / (4.0 / 3.0 * PI * radius.powi(3)) - 1.0
}

/// A round specimen of resin in air, with a ball inside.
#[test]
fn a_grain_in_resin_has_the_volume_of_a_grain_in_air() {
    let (n, radius, centre) = (52, 11.0, DVec3::new(27.2, 24.9, 26.3));
    let body = ball(n, centre, radius);
    // Resin nowhere, in a cylinder, and in the half of the image that holds half of the ball.
    let none = |_: DVec3| 0.0f32;
    let round = |x: DVec3| f32::from((x - DVec3::splat(26.0)).truncate().length() < 20.0);
    let half = |x: DVec3| f32::from(x.x < centre.x);
    for (name, resin, bound) in [
        ("none", &none as &dyn Fn(DVec3) -> f32, 0.005),
        ("round", &round, 0.005),
        ("half", &half, 0.015),
    ] {
        let found = in_resin(n, &body, resin, None);
        assert_eq!(found.len(), 1, "{name}");
        let error = error(&found[0], radius);
        println!("{name}: {error:+.4}");
        assert!(error.abs() < bound, "{name}: {error}");
        assert!(found[0].assumed().is_empty() && grey_notes(&found).is_empty());
    }
}

/// Two balls that touch, in a specimen of resin in air.
#[test]
fn separated_grains_in_resin_have_their_volumes() {
    let (n, radius) = (56, 10.0);
    let centres = [DVec3::new(18.1, 27.7, 28.4), DVec3::new(37.9, 28.6, 27.5)];
    let mut body = ball(n, centres[0], radius);
    body.iter_mut().zip(ball(n, centres[1], radius)).for_each(|(a, b)| *a = (*a + b).min(1.0));
    let resin = |x: DVec3| f32::from((x - DVec3::splat(28.0)).truncate().length() < 26.0);
    let found = in_resin(n, &body, resin, Some(0.87));
    assert_eq!(found.len(), 2);
    for grain in &found {
        let error = error(grain, radius);
        println!("{error:+.4}");
        assert!(error.abs() < 0.01, "{error}");
    }
}

/// One voxel of void around a block: none is free of blur.
#[test]
fn grains_without_surroundings_have_a_note() {
    let (n, half) = (22, 10.0);
    let body = solid(n, DVec3::splat(11.0), half, &|x| ((x - 11.0).abs() - half).max_element());
    let found = scanned(n, &body, 1.0, &options(Threshold::Otsu));
    assert_eq!(found[0].assumed(), [Assumed::Void]);
    let notes = grey_notes(&found);
    assert!(notes.len() == 1 && notes[0].contains("for 1 grain with"), "{notes:?}");
    assert!(notes[0].ends_with("percent: label 1"), "{notes:?}");
}

/// A plate of 28 x 20 voxels and this thickness, alone in its image or beside a ball. Returns the
/// relative error of its volume and the grains.
fn plate(thickness: f64, blur: f64, alone: bool) -> (f64, Vec<ScannedGrain>) {
    let n = 56;
    let turn = DQuat::from_scaled_axis(DVec3::new(0.7, -0.4, 1.1));
    let (centre, half) = (DVec3::new(28.2, 27.7, 28.4), DVec3::new(14.0, 10.0, 0.5 * thickness));
    let mut body = solid(n, centre, half.length(), &|x| {
        ((turn.inverse() * (x - centre)).abs() - half).max_element()
    });
    if !alone {
        let other = ball(n, DVec3::splat(10.0), 7.5);
        body.iter_mut().zip(other).for_each(|(a, b)| *a = (*a + b).min(1.0));
    }
    let found = scanned(n, &body, blur, &options(Threshold::Otsu));
    let last = found.last().unwrap();
    let error = last.shape.as_ref().unwrap().volume() / (8.0 * half.element_product()) - 1.0;
    (error, found)
}

#[test]
fn thin_plates_have_a_note_and_a_bounded_error() {
    let bounds = [
        (3.0, [0.07, 0.13, 0.4], [0.02, 0.02, 0.4]),
        (4.0, [0.02, 0.03, 0.2], [0.01, 0.01, 0.2]),
        (5.0, [0.01, 0.01, 0.13], [0.01, 0.01, 0.13]),
        (8.0, [0.01, 0.01, 0.02], [0.01, 0.01, 0.02]),
    ];
    for (thickness, alone, among) in bounds {
        for (n, blur) in [0.7, 1.0, 1.5].into_iter().enumerate() {
            let (single, grains) = plate(thickness, blur, true);
            let (other, both) = plate(thickness, blur, false);
            println!("{thickness}, blur {blur}: alone {single:+.4}, beside a ball {other:+.4}");
            assert!(single.abs() < alone[n] && other.abs() < among[n], "{thickness} {blur}");
            assert_eq!(both.len(), 2);
            let notes = grey_notes(&grains);
            // With little blur a plate of 5 voxels has some free of it.
            if thickness < 5.0 || thickness < 6.0 && blur > 1.2 {
                assert_eq!(grains[0].assumed(), [Assumed::Solid]);
                assert!(notes[0].contains("for 1 grain with") && notes[0].ends_with("label 1"));
            } else if thickness > 6.0 {
                assert!(notes.is_empty(), "{notes:?}");
            }
        }
    }
}

/// Small grains of another grey beside a large one, and of its own.
#[test]
fn small_grains_are_estimated() {
    let n = 52;
    let large = ball(n, DVec3::new(18.2, 18.4, 17.9), 14.0);
    for radius in [3.8, 4.4, 5.0, 5.5] {
        let small = ball(n, DVec3::new(42.3, 42.1, 41.8), radius);
        for blur in [0.7, 1.0, 1.5] {
            let errors = [0.667, 1.0, 1.667].map(|grey| {
                let both: Vec<f32> = large.iter().zip(&small).map(|(l, s)| l + grey * s).collect();
                let image = greys(&blurred(&both, [n; 3], blur), 0.05, 7);
                let volume = Volume::from_labels([n; 3], image).unwrap();
                let how = options(Threshold::Value(9000.0 + 0.4 * 21000.0));
                let found = shapes_from_volume(&volume, &SourceFile::default(), &how).unwrap();
                error(found.iter().rfind(|grain| grain.shape.is_ok()).unwrap(), radius)
            });
            println!("R = {radius}, blur {blur}: {errors:+.3?}");
            let bounds = [0.2, 0.05, 0.35];
            assert!(errors.iter().zip(bounds).all(|(e, b)| e.abs() < b), "{radius} {errors:?}");
        }
    }
}
