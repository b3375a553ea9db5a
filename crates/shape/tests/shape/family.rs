//! Generated grains: the measures agree with the targets; the committed grains of the study.

use crate::common::close;
use glam::{DMat3, DQuat, DVec3};
use grainwake_shape::family::{FamilyTarget, family_grain, family_options};
use grainwake_shape::{Shape, ShapeOptions};
use std::f64::consts::FRAC_PI_4;
use std::path::{Path, PathBuf};

fn kept(number: usize) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../studies/dkt-morphology/grains")
        .join(format!("{number:02}.grain"))
}

fn parameter(shape: &Shape, name: &str) -> f64 {
    let found = shape.provenance().parameters.iter().find(|p| p.0 == name);
    found.unwrap().1.parse().unwrap()
}

/// Projected area of a convex grain: half the sum of its faces' projections.
fn shadow(shape: &Shape, body_direction: DVec3) -> f64 {
    let (vertices, triangles) = shape.surface_mesh();
    let corner = |v: u32| vertices[v as usize];
    let projected = triangles.iter().map(|[a, b, c]| {
        let twice = (corner(*b) - corner(*a)).cross(corner(*c) - corner(*a));
        0.5 * twice.dot(body_direction).abs()
    });
    0.5 * projected.sum::<f64>()
}

#[test]
fn the_studys_grains_are_what_their_place_in_the_chart_says() {
    for (row, sphericity) in [0.45, 0.60, 0.75, 0.90].into_iter().enumerate() {
        for (column, roundness) in [0.2, 0.4, 0.6, 0.8].into_iter().enumerate() {
            let path = kept(4 * row + column + 1);
            assert!(std::fs::metadata(&path).unwrap().len() < 200_000);
            let shape = Shape::load(&path).unwrap();
            let m = shape.morphology();
            assert!((m.krumbein_sphericity - sphericity).abs() < 0.005, "{}", path.display());
            close(shape.equivalent_diameter(), 2e-3, 1e-9);
            // The inscribed sphere is the body's before it was worn, and the edges have the radius
            // that makes R.
            let inscribed = parameter(&shape, "inscribed_radius_m");
            close(parameter(&shape, "edge_radius_m"), roundness * inscribed, 1e-12);
            let measured = m.wadell_roundness.unwrap();
            println!(
                "{}: S {:.4}, R {measured:.3}, caliper S {:.3}",
                path.file_name().unwrap().display(),
                m.krumbein_sphericity,
                shape.record().krumbein_sphericity_feret.unwrap()
            );
            assert!((measured - roundness).abs() < 0.04, "{measured} for {roundness}");
            close(m.inscribed_radius.unwrap(), inscribed, 1e-4);
            assert!(m.convexity.unwrap() > 0.99);
            assert!(shape.quality().unwrap().gradient_error < 0.05);
            assert!(shape.quality().unwrap().volume_error.unwrap().abs() < 1e-3);
        }
    }
}

#[test]
fn equal_targets_and_seeds_give_equal_grains_and_other_seeds_others() {
    let options =
        ShapeOptions { cells: Some(24), least_cells: 12, nodes: Some(200), ..Default::default() };
    let target = FamilyTarget::new(0.7, 0.5, 1e-3);
    let one = family_grain(&target, 7, &options).unwrap();
    assert_eq!(one.digest(), family_grain(&target, 7, &options).unwrap().digest());
    assert_ne!(one.digest(), family_grain(&target, 8, &options).unwrap().digest());
}

#[test]
fn targets_at_the_edge_of_the_chart_are_met_or_refused() {
    let options =
        ShapeOptions { cells: Some(40), least_cells: 20, nodes: Some(300), ..Default::default() };
    for (sphericity, roundness, flatness) in
        [(0.3, 0.3, 1.0), (0.5, 0.9, 0.4), (0.95, 0.3, 0.9), (0.97, 0.9, 1.0)]
    {
        let target = FamilyTarget { flatness, ..FamilyTarget::new(sphericity, roundness, 1e-3) };
        let shape = family_grain(&target, 3, &options).unwrap();
        let m = shape.morphology();
        assert!((m.krumbein_sphericity - sphericity).abs() < 0.01, "{}", m.krumbein_sphericity);
        close(m.flatness(), flatness, 0.02);
    }
    for (sphericity, roundness) in
        [(0.1, 0.5), (1.0, 0.5), (f64::NAN, 0.5), (0.5, 0.0), (0.5, 1.0), (0.5, f64::INFINITY)]
    {
        let target = FamilyTarget::new(sphericity, roundness, 1e-3);
        assert!(family_grain(&target, 1, &family_options()).is_err());
    }
    // The cube of the sphericity is 0.857.
    let mut target = FamilyTarget::new(0.95, 0.5, 1e-3);
    assert!(target.flatness > 0.857);
    target.flatness = 0.8;
    let error = family_grain(&target, 1, &options).unwrap_err();
    assert!(error.to_string().contains("flatness = 0.8"), "{error}");
    let target = FamilyTarget::new(0.5, 0.5, f64::NAN);
    assert!(family_grain(&target, 1, &family_options()).is_err());
}

/// Initial orientation `number` (1 to 4) of the morphology study: body to space, z up.
///
/// Number 1 has the long axis along z and the short axis along x. The others follow by rotations of
/// 45 degrees about y: number 3 has the long axis along x and the broad side, seen along the short
/// axis, normal to z (Fig. 5 of the paper).
fn study_orientation(number: u32) -> DQuat {
    let upright = DMat3::from_cols(DVec3::Z, DVec3::NEG_Y, DVec3::X);
    let angle = f64::from(number.saturating_sub(1)) * FRAC_PI_4;
    DQuat::from_rotation_y(angle) * DQuat::from_mat3(&upright)
}

/// Orientation 1 is upright, orientation 3 lies on its broad side, 2 and 4 are in between.
#[test]
fn the_four_orientations_show_the_areas_they_should() {
    for number in 1..=4 {
        let turn = DQuat::from_rotation_y(f64::from(number - 1) * FRAC_PI_4);
        // The case file's { long_axis = "z", short_axis = "x" }, then the turn.
        let orientation = study_orientation(number);
        assert!((orientation * DVec3::X).distance(turn * DVec3::Z) < 1e-12);
        assert!((orientation * DVec3::Z).distance(turn * DVec3::X) < 1e-12);
    }
    for grain in 1..=16 {
        let shape = Shape::load(&kept(grain)).unwrap();
        // What the flow along z meets: the shadow along z, taken in the body's frame.
        let seen: Vec<f64> =
            (1..=4).map(|n| shadow(&shape, study_orientation(n).inverse() * DVec3::Z)).collect();
        close(seen[0], shadow(&shape, DVec3::X), 1e-9);
        close(seen[2], shadow(&shape, DVec3::Z), 1e-9);
        // The mean of all four about y must lie between the ends; an ellipsoid of these extents
        // has the areas pi/4 b c, pi/4 a b, and their root mean square in between.
        let m = shape.morphology();
        let ellipse = |p: f64, q: f64| FRAC_PI_4 * p * q;
        close(seen[0], ellipse(m.b, m.c), 0.2);
        close(seen[2], ellipse(m.a, m.b), 0.2);
        let between = (0.5 * (seen[0] * seen[0] + seen[2] * seen[2])).sqrt();
        close(seen[1], between, 0.15);
        close(seen[3], between, 0.15);
        assert!(seen[0] < seen[1] && seen[0] < seen[3], "grain {grain}: {seen:?}");
        assert!(seen[2] > seen[1] && seen[2] > seen[3], "grain {grain}: {seen:?}");
        println!(
            "{grain:2} {:?}",
            seen.iter().map(|a| (a * 1e8).round() / 100.0).collect::<Vec<_>>()
        );
    }
}
