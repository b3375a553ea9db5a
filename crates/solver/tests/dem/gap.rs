//! Gaps between surfaces, initial overlaps and grains outside the box.

use crate::clouds::Random;
use crate::support::{floor, open_box, sphere};
use std::sync::Arc;

use glam::{DQuat, DVec3};
use grainwake_shape::{ShapeOptions, analytic};
use grainwake_solver::dem::{
    Enclosure, Grain, Partner, Side, gaps, initial_overlaps, outside, surface_gap, wall_gap,
};

#[test]
fn gap_of_spheres_is_exact_at_any_distance() {
    let mut random = Random(2);
    for _ in 0..40 {
        let a = sphere(0.3 + random.next(), 1.0, 60, random.vector() * 2.0);
        let b = sphere(0.3 + random.next(), 1.0, 90, random.vector() * 4.0);
        let radii = a.shape.bounding_radius() + b.shape.bounding_radius();
        let apart = a.pose.position.distance(b.pose.position);
        if apart < 0.9 * radii {
            continue;
        }
        let gap = surface_gap(&a, &b, &open_box(10.0));
        assert!((gap - (apart - radii)).abs() < 1e-9, "{gap} v {}", apart - radii);
        assert_eq!(gap.to_bits(), surface_gap(&a, &b, &open_box(10.0)).to_bits());
        assert!((gap - surface_gap(&b, &a, &open_box(10.0))).abs() < 1e-9);
    }
}

#[test]
fn gap_takes_the_nearest_image() {
    let enclosure = Enclosure {
        lower: DVec3::ZERO,
        upper: DVec3::new(1.0, 2.0, 2.0),
        periodic: [true, true, false],
        sides: Default::default(),
    };
    let a = sphere(0.1, 1.0, 60, DVec3::new(0.1, 0.2, 0.5));
    let b = sphere(0.1, 1.0, 60, DVec3::new(0.9, 1.9, 0.6));
    let expected = DVec3::new(0.2, 0.3, 0.1).length() - 0.2;
    assert!((surface_gap(&a, &b, &enclosure) - expected).abs() < 1e-9);
}

/// Turned ellipsoids at random places of a box that is periodic along x and z.
fn turned_ellipsoids([a, b, c]: [f64; 3], nodes: usize) -> (Vec<Grain>, Enclosure) {
    let options = ShapeOptions { nodes: Some(nodes), ..ShapeOptions::default() };
    let shape = Arc::new(analytic::ellipsoid(a, b, c, &options).unwrap());
    let mut random = Random(5);
    let mut turned = || {
        Grain::new(shape.clone(), 1.0)
            .with_position(3.0 * random.vector())
            .with_orientation(DQuat::from_scaled_axis(3.0 * random.vector()))
    };
    let grains = (0..40).map(|_| turned()).collect();
    let enclosure = Enclosure {
        lower: DVec3::splat(-1.5),
        upper: DVec3::splat(1.5),
        periodic: [true, false, true],
        sides: Default::default(),
    };
    (grains, enclosure)
}

#[test]
fn gaps_below_a_limit_are_those_of_all_pairs() {
    let grains = [turned_ellipsoids([0.5, 0.3, 0.2], 400), turned_ellipsoids([0.8, 0.1, 0.1], 60)];
    grains.iter().for_each(|(grains, enclosure)| compare_with_all_pairs(grains, enclosure));
}

fn compare_with_all_pairs(grains: &[Grain], enclosure: &Enclosure) {
    let found = gaps(grains, enclosure, 0.15);
    let mut expected = Vec::new();
    for (j, b) in grains.iter().enumerate() {
        for (i, a) in grains[..j].iter().enumerate() {
            let gap = surface_gap(a, b, enclosure);
            if gap < 0.15 {
                expected.push((i, j, gap));
            }
        }
    }
    expected.sort_by_key(|pair| (pair.0, pair.1));
    let found: Vec<(usize, usize, f64)> =
        found.iter().map(|gap| (gap.first, gap.second, gap.distance)).collect();
    assert!(found.len() > 30 && found.iter().any(|pair| pair.2 > 0.0), "{}", found.len());
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!((found.0, found.1), (expected.0, expected.1));
        assert!((found.2 - expected.2).abs() < 1e-12, "{found:?} v {expected:?}");
    }
}

#[test]
fn a_shift_along_its_direction_widens_a_gap() {
    let (grains, enclosure) = turned_ellipsoids([0.5, 0.3, 0.2], 400);
    let shift = 1e-3;
    let mut tested = 0;
    for gap in gaps(&grains, &enclosure, 0.15).iter().filter(|gap| gap.distance > -0.05) {
        let moved = grains[gap.second].pose.position + shift * gap.direction;
        let second = grains[gap.second].clone().with_position(moved);
        let wider = surface_gap(&grains[gap.first], &second, &enclosure) - gap.distance;
        assert!((0.9 * shift..1.1 * shift).contains(&wider), "{gap:?}: wider by {wider}");
        tested += 1;
    }
    assert!(tested > 20, "{tested}");
}

#[test]
fn wall_gap_names_the_nearest_solid_face() {
    let enclosure = Enclosure {
        lower: DVec3::ZERO,
        upper: DVec3::new(1.0, 1.0, 3.0),
        periodic: [false; 3],
        sides: [[Side::WALL, Side::WALL], [Side::Open, Side::Open], [Side::WALL, Side::Open]],
    };
    let grain = sphere(0.2, 1.0, 60, DVec3::new(0.75, 0.2, 2.75));
    let (gap, wall) = wall_gap(&grain, &enclosure).unwrap();
    assert!((gap - 0.05).abs() < 1e-9);
    assert_eq!(wall, Partner::Wall { axis: 0, side: 1 });
    assert!(wall_gap(&grain, &open_box(1.0)).is_none());
}

#[test]
fn initial_overlaps_are_found_with_their_depth() {
    let grains = [
        sphere(0.5, 1.0, 100, DVec3::new(0.0, 0.0, 0.49)),
        sphere(0.5, 1.0, 100, DVec3::new(0.6, 0.0, 1.27)),
        sphere(0.5, 1.0, 100, DVec3::new(5.0, 0.0, 2.0)),
    ];
    let found = initial_overlaps(&grains, &floor());
    let [pair, wall] = found[..] else { panic!("{found:?}") };
    assert_eq!((pair.grain, pair.partner), (0, Partner::Grain(1)));
    let apart = DVec3::new(0.6, 0.0, 0.78).length();
    assert!((pair.depth - (1.0 - apart)).abs() < 1e-6, "{}", pair.depth);
    assert_eq!((wall.grain, wall.partner), (0, Partner::Wall { axis: 2, side: 0 }));
    assert!((wall.depth - 0.01).abs() < 1e-9);
    // The own periodic image counts as a partner.
    let narrow = Enclosure {
        lower: DVec3::ZERO,
        upper: DVec3::splat(0.95),
        periodic: [true; 3],
        sides: Default::default(),
    };
    let own = initial_overlaps(&grains[2..], &narrow);
    assert_eq!(own.len(), 1);
    assert_eq!(own[0].partner, Partner::Grain(0));
    assert!((own[0].depth - 0.05).abs() < 1e-6, "{}", own[0].depth);
}

#[test]
fn grains_outside_the_box_are_named_with_the_face() {
    let enclosure = Enclosure { periodic: [false, true, false], ..open_box(1.0) };
    let grains = [
        sphere(0.2, 1.0, 60, DVec3::new(0.9, 5.0, 0.0)),
        sphere(0.2, 1.0, 60, DVec3::new(0.0, 0.0, -1.5)),
        sphere(0.2, 1.0, 60, DVec3::ZERO),
        sphere(0.2, 1.0, 60, DVec3::new(f64::NAN, 0.0, 0.0)),
    ];
    let found = outside(&grains, &enclosure);
    assert_eq!((found[0].grain, found[0].axis, found[0].side, found[0].centroid), (0, 0, 1, false));
    assert!((found[0].by - 0.1).abs() < 1e-9);
    assert_eq!((found[1].grain, found[1].axis, found[1].side, found[1].centroid), (1, 2, 0, true));
    assert!((found[1].by - 0.7).abs() < 1e-9);
    assert!(found.iter().all(|o| o.grain != 2));
    assert!(found.iter().any(|o| o.grain == 3));
}
