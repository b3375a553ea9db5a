//! Tests of the sampled field.

use super::*;

fn ball() -> SampledField {
    SampledField::sample(
        &|x: DVec3, _: &mut u32| x.length() - 1.0,
        DVec3::splat(-1.0),
        DVec3::splat(1.0),
        2.0 / 48.0,
        0.25,
    )
    .unwrap()
}

/// Points of a low-discrepancy sequence in the cube of half-width `half`.
fn points(half: f64, count: usize) -> impl Iterator<Item = DVec3> {
    (1..=count).map(move |i| {
        let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * i as f64;
        half * (2.0 * u.fract() - DVec3::ONE)
    })
}

#[test]
fn trilinear_value_is_second_order_close() {
    let field = ball();
    for x in points(1.2, 2000).filter(|x| x.length() > 0.3) {
        assert!((field.distance(x) - (x.length() - 1.0)).abs() < 2e-3, "at {x}");
    }
}

#[test]
fn gradient_is_that_of_the_interpolated_value() {
    let field = ball();
    let step = 1e-7;
    for x in points(1.2, 500) {
        let cell = ((x - field.lower()) / field.spacing()).fract();
        if cell.min_element() < 1e-4 || cell.max_element() > 1.0 - 1e-4 {
            continue;
        }
        let (value, gradient) = field.distance_and_gradient(x);
        assert_eq!(value, field.distance(x));
        for axis in DVec3::AXES {
            let slope =
                (field.distance(x + step * axis) - field.distance(x - step * axis)) / (2.0 * step);
            assert!((slope - gradient.dot(axis)).abs() < 1e-6, "at {x}");
        }
    }
}

#[test]
fn off_the_grid_the_distance_stays_close_and_the_direction_points_away() {
    // A ball, and a rod of aspect ratio eight.
    for half in [0.0, 0.875] {
        let radius = 1.0 - half;
        let exact = |x: DVec3| {
            let reach = x - DVec3::X * x.x.clamp(-half, half);
            (reach.length() - radius, reach.normalize_or_zero())
        };
        let corner = DVec3::new(1.0, radius, radius);
        let distance = |x, _: &mut u32| exact(x).0;
        let field = SampledField::sample(&distance, -corner, corner, 1.0 / 24.0, 0.25).unwrap();
        let off_grid = |x: &DVec3| x.cmplt(field.lower()).any() || x.cmpgt(field.upper()).any();
        for x in points(1.6, 4000).chain(points(8.0, 4000)).filter(off_grid) {
            let (d, n) = exact(x);
            let (value, gradient) = field.distance_and_gradient(x);
            assert!((value / d - 1.0).abs() < 0.01, "at {x}: {value} for {d}");
            assert!((gradient.length() - 1.0).abs() < 1e-12);
            assert!(gradient.dot(n) > 0.99, "at {x}: {gradient} for {n}");
        }
    }
}

#[test]
fn a_limited_distance_is_the_distance_up_to_the_limit() {
    let corner = DVec3::new(1.0, 0.125, 0.125);
    let rod = |x: DVec3, _: &mut u32| (x - DVec3::X * x.x.clamp(-0.875, 0.875)).length() - 0.125;
    let field = SampledField::sample(&rod, -corner, corner, 1.0 / 24.0, 0.25).unwrap();
    let (mut spared, mut far) = (0, 0);
    for x in points(1.6, 8000) {
        let (full, limited) = (field.distance(x), field.distance_within(x, 0.4));
        if full <= 0.4 {
            assert_eq!(limited, full, "at {x}");
        } else {
            assert!(limited > 0.4, "at {x}");
            far += 1;
            spared += i32::from(limited.is_infinite());
        }
    }
    assert!(spared > 9 * far / 10, "{spared} of {far}");
}

#[test]
fn the_border_of_the_grid_is_no_jump() {
    let field = ball();
    let edge = field.upper().x;
    for y in points(1.2, 200) {
        let inside = field.distance(DVec3::new(edge, y.y, y.z));
        let outside = field.distance(DVec3::new(edge + 1e-9, y.y, y.z));
        assert!((inside - outside).abs() < 1e-6, "{inside} {outside}");
    }
}

#[test]
fn an_extended_field_has_its_samples_and_more_about_them() {
    let field = ball();
    let far = |x: DVec3| field.distance(x);
    let wide = field.extended(far, DVec3::splat(-1.0), DVec3::splat(1.0), 1.5).unwrap();
    assert!(wide.lower().max_element() <= -2.5 && wide.upper().min_element() >= 2.5);
    for x in points(2.4, 2000) {
        let (d, _) = wide.distance_and_gradient_on_grid(x).unwrap();
        match field.distance_and_gradient_on_grid(x) {
            Some((own, _)) => assert!((d - own).abs() < 1e-12, "at {x}"),
            None => assert!((d - far(x)).abs() < 0.1 * field.spacing(), "at {x}"),
        }
    }
    let absurd = field.extended(far, DVec3::splat(-1.0), DVec3::splat(1.0), 1e6);
    assert!(matches!(absurd, Err(ShapeError::BadParameter { .. })));
}

#[test]
fn nan_in_nan_out() {
    assert!(ball().distance(DVec3::NAN).is_nan());
}

#[test]
fn an_absurd_resolution_is_refused() {
    let refused = SampledField::sample(
        &|x: DVec3, _: &mut u32| x.x,
        DVec3::splat(-1.0),
        DVec3::splat(1.0),
        1e-6,
        0.0,
    );
    assert!(matches!(refused, Err(ShapeError::BadParameter { .. })));
}
