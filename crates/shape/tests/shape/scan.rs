//! Shapes from voxels: accuracy relative to the voxelised bodies, and errors.

use crate::common::{close, shared};
use glam::{DQuat, DVec3};
use grainwake_shape::scan::{
    ScanOptions, Threshold, Volume, Voxels, read_volume, scan_volume, shapes_from_volume,
};
use grainwake_shape::{ReadLimits, Shape, ShapeError, ShapeOptions, SourceFile};
use std::f64::consts::PI;
use std::ops::ControlFlow;

const VOXEL: f64 = 2e-5;

/// Voxels whose centres lie in the ellipsoid with semi-axes `axes` [voxels].
fn voxelised(axes: DVec3, turn: DQuat, shift: DVec3) -> Volume {
    let n = (2.0 * axes.max_element()).ceil() as usize + 4;
    let centre = DVec3::splat(n as f64 / 2.0) + shift;
    let inside = |i: usize| {
        let x = DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64);
        let local = turn.inverse() * (x + DVec3::splat(0.5) - centre);
        u32::from((local / axes).length() < 1.0)
    };
    Volume::from_labels([n; 3], (0..n * n * n).map(inside).collect()).unwrap()
}

fn options() -> ScanOptions {
    let shape = ShapeOptions { cells: Some(32), nodes: Some(400), ..Default::default() };
    ScanOptions { shape, ..ScanOptions::new(VOXEL) }
}

fn only(volume: &Volume, options: &ScanOptions) -> Result<Shape, ShapeError> {
    let mut grains = shapes_from_volume(volume, &SourceFile::default(), options)?;
    assert_eq!(grains.len(), 1);
    grains.remove(0).shape
}

/// Compares several placements of a body with its closed form: volume within 0.5 %, inertia within
/// 1 %, distances within half a voxel, normals within 0.12 rad (rms). No placement is symmetric
/// about a voxel, where the mask itself misses the volume by up to 3 %.
fn check_ellipsoid(axes: DVec3) {
    for i in 1..=3 {
        let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
        let turn = DQuat::from_scaled_axis((u * 7.0).fract() * 5.0);
        let volume = voxelised(axes, turn, u.fract() - DVec3::splat(0.5));
        let shape = only(&volume, &options()).unwrap();
        let exact = 4.0 / 3.0 * PI * axes.element_product() * VOXEL.powi(3);
        close(shape.volume(), exact, 0.005);
        let squares = axes * axes * VOXEL * VOXEL;
        for (found, a, b) in [
            (shape.inertia().x, squares.y, squares.z),
            (shape.inertia().y, squares.z, squares.x),
            (shape.inertia().z, squares.x, squares.y),
        ] {
            close(found, exact / 5.0 * (a + b), 0.01);
        }
        let (mut sum, mut total) = (0.0, 0.0);
        for node in shape.nodes() {
            let x = node.position / VOXEL;
            let gradient = x / (axes * axes);
            let off = ((x / axes).length() - 1.0) / gradient.length();
            // A ball has no axes to compare with, but any frame will do for it.
            assert!(off.abs() < 0.5, "node {x} is {off} voxels off");
            let normal = shape.distance_and_gradient(node.position).1.normalize();
            sum += node.area * normal.angle_between(gradient).powi(2);
            total += node.area;
        }
        assert!((sum / total).sqrt() < 0.12, "normals off by {} rad", (sum / total).sqrt());
    }
}

#[test]
fn a_voxel_sphere_of_twenty_voxels_is_a_sphere() {
    check_ellipsoid(DVec3::splat(10.0));
}

#[test]
fn a_voxel_ellipsoid_has_its_volume_inertia_and_normals() {
    check_ellipsoid(DVec3::new(14.0, 10.5, 7.5));
}

#[test]
fn the_centroid_is_told_in_the_images_frame() {
    let shift = DVec3::new(0.3, -0.2, 0.1);
    let volume = voxelised(DVec3::new(12.0, 9.0, 7.0), DQuat::IDENTITY, shift);
    let shape = only(&volume, &options()).unwrap();
    let expected = (DVec3::splat(14.0) + shift) * VOXEL;
    assert!(shape.provenance().centroid.distance(expected) < 0.05 * VOXEL);
    // Unturned, the principal axes are the image's own.
    let turn = shape.provenance().rotation;
    assert!((turn * DVec3::X).x.abs() > 0.999 && (turn * DVec3::Y).y.abs() > 0.999);
}

#[test]
fn a_labelled_volume_gives_one_shape_each_and_skips_what_the_border_cuts() {
    let n = 48;
    let mut labels = vec![0u32; n * n * n];
    let balls = [(3, [12, 12, 12], 7.0), (5, [34, 34, 30], 9.0), (8, [2, 40, 10], 6.0)];
    for (label, centre, radius) in balls {
        let centre = DVec3::from_array(centre.map(f64::from)) + DVec3::new(0.21, 0.37, 0.11);
        for (i, voxel) in labels.iter_mut().enumerate() {
            let x = DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64);
            if x.distance(centre) < radius {
                *voxel = label;
            }
        }
    }
    let volume = Volume::from_labels([n; 3], labels).unwrap();
    let source = SourceFile::default();
    let grains = shapes_from_volume(&volume, &source, &options()).unwrap();
    assert_eq!(grains.iter().map(|g| g.label).collect::<Vec<_>>(), [3, 5, 8]);
    close(grains[0].shape.as_ref().unwrap().volume(), 4.0 / 3.0 * PI * (7.0 * VOXEL).powi(3), 0.02);
    close(grains[1].shape.as_ref().unwrap().volume(), 4.0 / 3.0 * PI * (9.0 * VOXEL).powi(3), 0.02);
    match &grains[2].shape {
        Err(ShapeError::CutByBorder { label: 8, faces }) => assert_eq!(faces, "low x"),
        other => panic!("{other:?}"),
    }
    let one = ScanOptions { label: Some(5), ..options() };
    assert_eq!(shapes_from_volume(&volume, &source, &one).unwrap().len(), 1);
    let none = ScanOptions { label: Some(4), ..options() };
    let error = shapes_from_volume(&volume, &source, &none).unwrap_err();
    assert!(error.to_string().contains("3, 5, 8"), "{error}");
    let padded = ScanOptions { label: Some(8), pad: true, ..options() };
    shapes_from_volume(&volume, &source, &padded).unwrap().remove(0).shape.unwrap();
    // The same volume as one binary image, split into its pieces.
    let binary = ScanOptions { threshold: Some(Threshold::Value(1.0)), split: true, ..options() };
    assert_eq!(shapes_from_volume(&volume, &source, &binary).unwrap().len(), 3);
    // Without splitting, three pieces under one label, one of them cut.
    let lumped = ScanOptions { threshold: Some(Threshold::Value(1.0)), pad: true, ..options() };
    assert!(matches!(only(&volume, &lumped), Err(ShapeError::SeveralPieces { count: 3, .. })));
    let largest = ScanOptions { largest_piece: true, ..lumped };
    close(only(&volume, &largest).unwrap().volume(), 4.0 / 3.0 * PI * (9.0 * VOXEL).powi(3), 0.02);
}

#[test]
fn cavities_are_filled_and_counted() {
    let mut volume = voxelised(DVec3::splat(10.0), DQuat::IDENTITY, DVec3::new(0.21, 0.37, 0.11));
    let n = volume.dims[0];
    let Voxels::Labels(labels) = &mut volume.voxels else { panic!() };
    for k in 11..13 {
        labels[12 + n * (12 + n * k)] = 0;
    }
    let shape = only(&volume, &options()).unwrap();
    close(shape.volume(), 4.0 / 3.0 * PI * (10.0 * VOXEL).powi(3), 0.005);
    let filled = ("cavity_voxels_filled".to_owned(), "2".to_owned());
    assert!(shape.provenance().parameters.contains(&filled));
    // Separation fills the cavities of the whole image before.
    let apart = ScanOptions { separate: Some(0.8), ..options() };
    let (volume, source) = (&volume, &SourceFile::default());
    for options in [options(), apart] {
        let grain = shapes_from_volume(volume, source, &options).unwrap().remove(0);
        let all = grain.voxels as f64 + if options.separate.is_some() { 0.0 } else { 2.0 };
        close(grain.cavities_filled(), 2.0 / all, 1e-9);
        assert!(grain.shape.unwrap().provenance().parameters.contains(&filled));
    }
}

#[test]
fn grey_values_without_a_threshold_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("signed.nrrd");
    let header = "NRRD0004\ntype: int8\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n\n";
    let mut values = [1i8; 24];
    values[9] = -7;
    std::fs::write(&path, [header.as_bytes(), &values.map(|v| v as u8)].concat()).unwrap();
    let (volume, source) = read_volume(&path, &ReadLimits::default()).unwrap();
    let error = shapes_from_volume(&volume, &source, &options()).unwrap_err().to_string();
    for words in ["-7 at voxel x 1, y 1, z 1", "whole numbers from 0 to 16777216"] {
        assert!(error.contains(words), "{words} is missing in {error}");
    }
}

#[test]
fn hopeless_volumes_are_refused() {
    let run = |labels: Vec<u32>, options: &ScanOptions| {
        let volume = Volume::from_labels([10, 10, 10], labels).unwrap();
        only(&volume, options)
    };
    assert!(matches!(run(vec![0; 1000], &options()), Err(ShapeError::EmptyVolume)));
    assert!(matches!(run(vec![1; 1000], &options()), Err(ShapeError::SolidVolume)));
    let mut speck = vec![0; 1000];
    speck[555] = 1;
    assert!(matches!(run(speck.clone(), &options()), Err(ShapeError::TooFewVoxels { .. })));
    for voxel in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let bad = ScanOptions { voxel, ..options() };
        assert!(matches!(run(speck.clone(), &bad), Err(ShapeError::BadParameter { .. })));
    }
    let bad = ScanOptions { smoothing: Some(f64::NAN), ..options() };
    assert!(matches!(run(speck.clone(), &bad), Err(ShapeError::BadParameter { .. })));
    let bad = ScanOptions { median: true, ..options() };
    assert!(matches!(run(speck, &bad), Err(ShapeError::MedianWithoutThreshold)));
    assert!(Volume::from_labels([10, 10, 11], vec![0; 1000]).is_err());
    let grey = Volume { dims: [2, 1, 1], voxels: Voxels::Grey(vec![0.1, 0.2]) };
    let error = only(&grey, &options()).unwrap_err();
    assert!(error.to_string().contains("threshold"), "{error}");
}

#[test]
fn a_real_rock_becomes_a_shape() {
    let Some(path) = shared("grains/scans/tsquare_rock/rock_115x105x73.npy") else {
        return;
    };
    let (volume, source) = read_volume(&path, &ReadLimits::default()).unwrap();
    let Voxels::Labels(labels) = &volume.voxels else { panic!("not labels") };
    let solid = labels.iter().filter(|l| **l != 0).count();
    // It is cropped tightly: without padding it counts as cut.
    let tight = shapes_from_volume(&volume, &source, &ScanOptions::new(1e-4)).unwrap();
    assert!(matches!(tight[0].shape, Err(ShapeError::CutByBorder { .. })));
    let options = ScanOptions { pad: true, ..ScanOptions::new(1e-4) };
    let shape = only(&volume, &options).unwrap();
    close(shape.volume(), solid as f64 * 1e-12, 0.005);
    let m = shape.morphology();
    println!("{:#?}", shape.record());
    assert!(m.a > m.b && m.b > m.c && m.convexity.unwrap() > 0.8);
    assert!((0.6..1.0).contains(&m.wadell_sphericity));
}

#[test]
fn a_real_labelled_ct_grain_becomes_a_shape() {
    let Some(path) = shared("grains/scans/nrel_nmc/grains/nmc_0238.tif") else {
        return;
    };
    let (volume, source) = read_volume(&path, &ReadLimits::default()).unwrap();
    let options = ScanOptions { pad: true, ..ScanOptions::new(1e-6) };
    let grains = shapes_from_volume(&volume, &source, &options).unwrap();
    let [grain] = &grains[..] else { panic!("{} grains", grains.len()) };
    let shape = grain.shape.as_ref().unwrap();
    close(shape.volume(), grain.voxels as f64 * 1e-18, 0.02);
}

/// A real packing of touching powder grains: as many interior grains, of the same size, as an
/// independent watershed found (1058, median diameter 21.6 voxels).
#[test]
fn a_real_packing_is_separated_as_others_do() {
    let Some(path) = shared("grains/scans/nrel_nmc/nmc-1-cal_generatedCBD_bridge.tif") else {
        return;
    };
    let (mut volume, source) = read_volume(&path, &ReadLimits::default()).unwrap();
    let Voxels::Labels(labels) = &mut volume.voxels else { panic!("not labels") };
    // Label 2 is a phase that was made up.
    labels.iter_mut().filter(|l| **l == 2).for_each(|l| *l = 0);
    for neck in [0.8, 0.87] {
        // One shape only: the labels are what is looked at.
        let options = ScanOptions {
            threshold: Some(Threshold::Value(1.0)),
            separate: Some(neck),
            label: Some(1),
            ..options()
        };
        let scan =
            scan_volume(&volume, &source, &options, &|_, _, _| ControlFlow::Continue(())).unwrap();
        let Voxels::Labels(labels) = &scan.labels.voxels else { panic!() };
        let dims = volume.dims;
        let most = *labels.iter().max().unwrap() as usize;
        let (mut sizes, mut cut) = (vec![0usize; most + 1], vec![false; most + 1]);
        for (n, label) in labels.iter().enumerate() {
            let place = [n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]];
            sizes[*label as usize] += 1;
            cut[*label as usize] |= (0..3).any(|a| place[a] == 0 || place[a] + 1 == dims[a]);
        }
        let inner = (1..=most).filter(|l| !cut[*l] && sizes[*l] >= 64);
        let mut diameters: Vec<f64> = inner.map(|l| (6.0 * sizes[l] as f64 / PI).cbrt()).collect();
        diameters.sort_by(f64::total_cmp);
        let median = diameters[diameters.len() / 2];
        println!(
            "neck {neck}: {} interior grains, median diameter {median:.1} voxels",
            diameters.len()
        );
        if neck == 0.87 {
            close(diameters.len() as f64, 1058.0, 0.1);
            close(median, 21.6, 0.1);
        }
    }
}

/// Two touching cubes of different labels and a separate piece of the first label.
#[test]
fn touching_labels_stay_apart_when_they_are_split() {
    let n = 24;
    let label = |at: usize| match (at % n, at / n % n, at / n / n) {
        (3..11, 4..12, 4..12) | (3..11, 4..12, 15..22) => 3,
        (11..19, 4..12, 4..12) => 900,
        _ => 0,
    };
    let labels: Vec<u32> = (0..n * n * n).map(label).collect();
    let volume = Volume::from_labels([n; 3], labels).unwrap();
    let split = ScanOptions { split: true, ..options() };
    let grains = shapes_from_volume(&volume, &SourceFile::default(), &split).unwrap();
    assert_eq!(grains.iter().map(|g| g.voxels).collect::<Vec<_>>(), [512, 512, 448]);
}

#[test]
fn the_default_number_of_cells_is_lowered_for_small_grains_and_a_given_one_is_kept() {
    let volume = voxelised(DVec3::splat(10.0), DQuat::IDENTITY, DVec3::new(0.21, 0.37, 0.11));
    let across = |cells: Option<usize>| {
        let shape =
            ShapeOptions { cells, nodes: Some(100), roundness: false, ..Default::default() };
        let record = only(&volume, &ScanOptions { shape, ..options() }).unwrap().record();
        record.a_m / record.field_spacing_m.unwrap()
    };
    assert!((24.0..27.0).contains(&across(None)));
    assert!((55.0..58.0).contains(&across(Some(56))));
    assert!((88.0..92.0).contains(&across(Some(90))));
}

/// A mask is one for any two values: no grey value lies between them.
#[test]
fn images_of_two_values_are_masks() {
    let labels = voxelised(DVec3::new(12.0, 9.0, 7.0), DQuat::from_rotation_x(0.4), DVec3::ZERO);
    let Voxels::Labels(mask) = &labels.voxels else { panic!("labels") };
    let shape = |void: u32, solid: u32| {
        let values = mask.iter().map(|m| if *m == 0 { void } else { solid }).collect();
        let volume = Volume::from_labels(labels.dims, values).unwrap();
        let how = ScanOptions { threshold: Some(Threshold::Otsu), ..options() };
        only(&volume, &how).unwrap()
    };
    let expect = only(&labels, &options()).unwrap().volume();
    for (void, solid) in [(0, 1), (0, 255), (0, 200), (0, 254), (1, 2), (40, 110)] {
        let shape = shape(void, solid);
        assert_eq!(shape.volume(), expect, "{void} and {solid}");
        assert!(!shape.provenance().parameters.iter().any(|(name, _)| name == "surface"));
    }
}

/// A scan of many grains takes long: the callback of its progress ends it.
#[test]
fn the_callback_of_the_progress_ends_a_scan() {
    let volume = voxelised(DVec3::splat(10.0), DQuat::IDENTITY, DVec3::ZERO);
    let stop = |what: &str, done: u64, _: u64| match (what, done) {
        ("shapes", 1) => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    };
    let error = scan_volume(&volume, &SourceFile::default(), &options(), &stop).unwrap_err();
    assert!(matches!(error, ShapeError::Interrupted), "{error}");
}
