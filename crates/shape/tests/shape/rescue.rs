//! Scans that need care: specks, noise, masks and missing thresholds.

use crate::common::shared;
use crate::render::{Noise, blurred, greys, shares};
use glam::DVec3;
use grainwake_shape::scan::{
    Scan, ScanOptions, Threshold, Volume, Voxels, read_volume, scan_volume,
};
use grainwake_shape::{ReadLimits, ShapeError, ShapeOptions, SourceFile};
use std::f64::consts::PI;
use std::ops::ControlFlow;

fn options() -> ScanOptions {
    let shape = ShapeOptions { cells: Some(32), roundness: false, ..Default::default() };
    ScanOptions { shape, ..ScanOptions::new(1.0) }
}

fn scan(volume: &Volume, options: &ScanOptions) -> Result<Scan, ShapeError> {
    scan_volume(volume, &SourceFile::default(), options, &|_, _, _| ControlFlow::Continue(()))
}

fn accepted(scan: &Scan) -> Vec<u32> {
    scan.grains.iter().filter(|g| g.shape.is_ok()).map(|g| g.label).collect()
}

/// A ball of label 7 in 40^3 voxels, with these voxels added.
fn ball(more: &[[usize; 3]]) -> Volume {
    let centre = DVec3::new(17.3, 18.2, 16.6);
    let inside = |n: usize| {
        let at = [n % 40, n / 40 % 40, n / 1600];
        let x = DVec3::from_array(at.map(|i| i as f64 + 0.5));
        if x.distance(centre) < 10.0 || more.contains(&at) { 7 } else { 0 }
    };
    Volume::from_labels([40; 3], (0..64_000).map(inside).collect()).unwrap()
}

#[test]
fn a_speck_is_removed_and_a_second_body_is_not() {
    let clean = scan(&ball(&[]), &options()).unwrap();
    let volume = clean.grains[0].shape.as_ref().unwrap().volume();
    assert_eq!(clean.grains[0].specks_removed(), 0.0);
    // Eight voxels apart, and one that touches the ball by an edge.
    let mut specks: Vec<[usize; 3]> =
        (0..8).map(|n| [32 + n % 2, 32 + n / 2 % 2, 32 + n / 4]).collect();
    let Voxels::Labels(labels) = &ball(&[]).voxels else { panic!() };
    let solid = |[i, j, k]: [usize; 3]| labels[i + 40 * (j + 40 * k)] == 7;
    let edge = (20..36).map(|i| [i, i, 16]).find(|[i, j, k]| !solid([*i, *j, *k])).unwrap();
    assert!(!solid([edge[0] - 1, edge[1], 16]) && solid([edge[0] - 1, edge[1] - 1, 16]));
    specks.push(edge);
    let cleaned = scan(&ball(&specks), &options()).unwrap();
    let grain = &cleaned.grains[0];
    assert!((grain.specks_removed() - 9.0 / 4189.0).abs() < 2e-5, "{}", grain.specks_removed());
    let found = grain.shape.as_ref().unwrap().volume();
    assert!((found / volume - 1.0).abs() < 1e-3, "{found} {volume}");
    assert!(cleaned.refusals.is_empty());
    // 2.6 % of the volume is no speck; the advice names the option that takes the larger piece.
    let second: Vec<[usize; 3]> =
        (0..110).map(|n| [31 + n % 5, 31 + n / 5 % 5, 31 + n / 25]).collect();
    let advised = ScanOptions { advise: true, rescue: true, ..options() };
    let refused = scan(&ball(&second), &advised).unwrap();
    assert!(matches!(refused.grains[0].shape, Err(ShapeError::SeveralPieces { count: 2, .. })));
    let [refusal] = &refused.refusals[..] else { panic!("{:?}", refused.refusals) };
    assert_eq!(refusal.labels, [7]);
    let advice = refusal.advice.unwrap();
    assert_eq!((advice.tried, advice.accepted), (1, 1));
    assert_eq!(advice.cure.unwrap().to_string(), "--largest-piece");
}

/// Touching balls of 22 voxels across; rows, columns and layers of 2.
const CENTRES: [f64; 2] = [19.8, 40.6];
const RADIUS: f64 = 11.0;

fn packing(noise: f64) -> (Volume, [usize; 3]) {
    let dims = [60; 3];
    let centres: Vec<DVec3> =
        (0..8).map(|n| DVec3::new(CENTRES[n % 2], CENTRES[n / 2 % 2], CENTRES[n / 4])).collect();
    let balls: Vec<_> =
        centres.iter().map(|centre| move |x: DVec3| x.distance(*centre) - RADIUS).collect();
    let bodies: Vec<&dyn Fn(DVec3) -> f64> = balls.iter().map(|ball| ball as _).collect();
    let boxes: Vec<(DVec3, f64)> = centres.iter().map(|centre| (*centre, RADIUS)).collect();
    let mut image = blurred(&shares(dims, &bodies, &boxes), dims, 0.8);
    // The noise of a reconstruction is correlated. Noise darkens the border, so that no
    // grain reaches it.
    let mut random = Noise::new(3);
    let rough: Vec<f32> = image.iter().map(|_| random.normal() as f32).collect();
    let rough = blurred(&rough, dims, 0.6);
    let square = rough.iter().map(|v| v * v).sum::<f32>() / rough.len() as f32;
    let scale = noise as f32 / square.sqrt();
    for (n, value) in image.iter_mut().enumerate() {
        let inner = [n % 60, n / 60 % 60, n / 3600].iter().all(|i| (3..57).contains(i));
        *value += scale * if inner { rough[n] } else { rough[n].min(0.0) };
    }
    let image = greys(&image, 0.0, 0);
    (Volume::from_labels(dims, image).unwrap(), dims)
}

fn separated() -> ScanOptions {
    ScanOptions { threshold: Some(Threshold::Otsu), separate: Some(0.87), ..options() }
}

#[test]
fn specks_of_the_distance_field_cost_no_grain() {
    let (volume, _) = packing(0.29);
    let found = scan(&volume, &separated()).unwrap();
    assert_eq!(accepted(&found).len(), 8, "{:?}", found.refusals);
    let name = "specks_removed";
    let cleaned = found
        .grains
        .iter()
        .filter_map(|g| g.shape.as_ref().ok())
        .filter(|shape| shape.provenance().parameters.iter().any(|(key, _)| key == name));
    assert!(cleaned.count() >= 3);
}

#[test]
fn noise_costs_grains_and_the_advice_names_what_saves_them() {
    let (volume, _) = packing(0.32);
    let large = |scan: &Scan| scan.grains.iter().filter(|g| g.voxels > 4000).count();
    let plain = scan(&volume, &ScanOptions { advise: true, ..separated() }).unwrap();
    let kept = accepted(&plain).len();
    for r in &plain.refusals {
        println!("{} {} {:?} {:?}", r.labels.len(), r.reason, r.voxels, r.advice);
    }
    assert_eq!(large(&plain), 8);
    assert!(kept < 8, "{kept}");
    let lost: Vec<_> = plain.refusals.iter().filter(|r| r.voxels[1] > 4000).collect();
    assert_eq!(lost.iter().map(|r| r.labels.len()).sum::<usize>(), 8 - kept);
    for refusal in &lost {
        let advice = refusal.advice.unwrap();
        assert_eq!((advice.tried, advice.accepted), (refusal.labels.len(), refusal.labels.len()));
        // What is promised holds for the whole image.
        let smoothing = advice.cure.unwrap().smoothing;
        let again = scan(&volume, &ScanOptions { smoothing, ..separated() }).unwrap();
        let now = accepted(&again);
        assert!(refusal.labels.iter().all(|label| now.contains(label)), "{now:?}");
    }
    // The rescue saves them all, leaves the others as they were, and the grain tells how.
    let rescued = scan(&volume, &ScanOptions { rescue: true, ..separated() }).unwrap();
    assert_eq!(accepted(&rescued).len(), 8);
    for (before, after) in plain.grains.iter().zip(&rescued.grains) {
        let Ok(shape) = &after.shape else { continue };
        let parameters = &shape.provenance().parameters;
        let told = parameters.iter().find(|(name, _)| name == "rescued");
        match &before.shape {
            Ok(before) => assert!(told.is_none() && before.digest() == shape.digest()),
            Err(_) => assert_eq!(told.unwrap().1, after.rescued.unwrap().to_string()),
        }
    }
}

/// Sets everything outside a cylinder along z to this value; a margin of one voxel at the border
/// keeps the largest balls whole.
fn mask(volume: &mut Volume, dims: [usize; 3], radius: f64, value: u32) {
    let Voxels::Labels(labels) = &mut volume.voxels else { panic!() };
    for (n, label) in labels.iter_mut().enumerate() {
        let [x, y] = [n % dims[0], n / dims[0] % dims[1]].map(|i| i as f64 + 0.5 - 30.2);
        if x.hypot(y) >= radius {
            *label = value;
        }
    }
}

#[test]
fn the_mask_of_a_scan_is_neither_void_nor_solid() {
    let (whole, dims) = packing(0.05);
    let plain = scan(&whole, &separated()).unwrap();
    assert_eq!((plain.masked, accepted(&plain).len()), (None, 8));
    let size = |scan: &Scan| -> Vec<f64> {
        scan.grains.iter().filter_map(|g| Some(g.shape.as_ref().ok()?.volume())).collect()
    };
    // Black and white masks around all balls.
    for value in [0, 65_535] {
        let mut masked = whole.clone();
        mask(&mut masked, dims, 29.5, value);
        let found = scan(&masked, &separated()).unwrap();
        let exterior = found.masked.unwrap();
        assert_eq!(exterior.value, value as f32);
        assert!((exterior.share - (1.0 - PI * 29.5f64.powi(2) / 3600.0)).abs() < 0.02);
        let thresholds = [plain.threshold.unwrap(), found.threshold.unwrap()];
        assert!((thresholds[0] - thresholds[1]).abs() < 300.0, "{thresholds:?}");
        assert_eq!(accepted(&found).len(), 8, "{value}: {:?}", found.refusals);
        for (one, other) in size(&plain).iter().zip(size(&found)) {
            assert!((other / one - 1.0).abs() < 8e-3, "{value}: {one} {other}");
        }
    }
    // A narrower mask cuts all of them.
    let mut cut = whole.clone();
    mask(&mut cut, dims, 24.0, 0);
    let found = scan(&cut, &separated()).unwrap();
    assert!(accepted(&found).is_empty());
    let refused = found.refusals.iter().find(|r| r.voxels[1] > 4000).unwrap();
    assert_eq!(refused.reason, "cut by the edge of the field of view");
}

#[test]
fn one_noisy_grain_in_a_black_image_is_no_field_of_view() {
    let dims = [60; 3];
    let centre = DVec3::new(30.3, 29.8, 30.1);
    let ball = move |x: DVec3| x.distance(centre) - 20.0;
    let shares = blurred(&shares(dims, &[&ball], &[(centre, 20.0)]), dims, 0.8);
    for noise in [0.02, 0.2] {
        // The user has set the void to 0.
        let mut image = greys(&shares, noise, 5);
        image.iter_mut().zip(&shares).filter(|(_, s)| **s < 0.3).for_each(|(v, _)| *v = 0);
        let volume = Volume::from_labels(dims, image).unwrap();
        let found = scan(&volume, &separated()).unwrap();
        assert_eq!(found.masked, None, "{noise}");
        assert_eq!(accepted(&found).len(), 1, "{noise}");
    }
}

#[test]
fn a_grey_image_without_a_threshold_is_refused() {
    // A cube with rounded edges of 8 bits, as in a tomogram without noise.
    let body = |x: DVec3| {
        let q = (x - DVec3::splat(40.0)).abs() - DVec3::splat(18.0);
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - 6.0
    };
    let grey = |n: usize| {
        let at = [n % 80, n / 80 % 80, n / 6400];
        let level = 0.5 - 0.5 * (body(DVec3::from_array(at.map(|i| i as f64 + 0.5))) / 2.0).tanh();
        (220.0 * level).round() as u32
    };
    let volume = Volume::from_labels([80; 3], (0..512_000).map(grey).collect()).unwrap();
    let error = scan(&volume, &options()).unwrap_err().to_string();
    for word in ["looks grey", "--threshold otsu", "--labels"] {
        assert!(error.contains(word), "`{word}` is missing in: {error}");
    }
    let labels = scan(&volume, &ScanOptions { labels: true, ..options() }).unwrap();
    assert_eq!(accepted(&labels), [219, 220]);
    let otsu = ScanOptions { threshold: Some(Threshold::Otsu), ..options() };
    assert_eq!(accepted(&scan(&volume, &otsu).unwrap()), [1]);
}

/// Labels of real scans: a single grain, and a packing of many grains.
#[test]
fn real_labels_are_not_taken_for_grey() {
    let [powder, one] = ["imppy3d_powder_synthetic/powder_256.tif", "nrel_nmc/grains/nmc_0238.tif"]
        .map(|file| shared(&format!("grains/scans/{file}")));
    let Some((powder, one)) = powder.zip(one) else {
        return;
    };
    let (volume, _) = read_volume(&one, &ReadLimits::default()).unwrap();
    scan(&volume, &options()).unwrap();
    let (volume, _) = read_volume(&powder, &ReadLimits::default()).unwrap();
    let error = scan(&volume, &options()).unwrap_err().to_string();
    assert!(error.contains("looks grey"), "{error}");
    // Its own labels, with thousands of specks of noise.
    let found = scan(&volume, &ScanOptions { label: None, ..separated() }).unwrap();
    let labelled = ScanOptions { label: Some(18), ..options() };
    scan(&found.labels, &labelled).unwrap();
}
