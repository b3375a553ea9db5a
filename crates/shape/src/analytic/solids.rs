//! Box, cylinder, capsule and superquadric.

use super::sorted;
use crate::assemble::{Body, assemble};
use crate::error::{Result, check_length, within};
use crate::mesh;
use crate::provenance::Provenance;
use crate::roundness::Surface;
use crate::triangles::cube_sphere;
use crate::{Shape, ShapeOptions};
use glam::{DVec2, DVec3, Vec3Swizzles};
use std::f64::consts::PI;

/// Builds a box with the given full edge lengths [m], in any order. Edges and corners are rounded
/// to `radius` [m] (0 for a sharp box); rounding keeps the outer dimensions.
///
/// # Errors
/// A length that is no size of a grain, a radius above half of the shortest edge, or options out of
/// their range; the message names it.
pub fn rounded_box(
    length: f64,
    width: f64,
    height: f64,
    radius: f64,
    options: &ShapeOptions,
) -> Result<Shape> {
    let lengths = sorted(["length", "width", "height"], [length, width, height])?;
    let reason = "must lie between 0 and half the shortest edge";
    within("radius", radius, 0.0..=0.5 * lengths[2], reason)?;
    let half = 0.5 * DVec3::from_array(lengths);
    let core = half - DVec3::splat(radius);
    let edges = 2.0 * core;
    // Steiner's formula for the inner box dilated by a ball.
    let faces = 2.0 * (edges.x * edges.y + edges.y * edges.z + edges.z * edges.x);
    let volume = edges.element_product()
        + radius * faces
        + PI * radius * radius * edges.element_sum()
        + 4.0 / 3.0 * PI * radius.powi(3);
    let area = faces + 2.0 * PI * radius * edges.element_sum() + 4.0 * PI * radius * radius;
    let provenance = Provenance::new("analytic")
        .with("body", "rounded_box")
        .with("length_m", lengths[0])
        .with("width_m", lengths[1])
        .with("height_m", lengths[2])
        .with("radius_m", radius);
    let body = Body {
        distance: |x: DVec3, _: &mut u32| {
            let q = x.abs() - core;
            q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - radius
        },
        lower: -half,
        upper: half,
        volume: Some(volume),
        area: Some(area),
        corners: None,
        surface: Surface::Exact,
    };
    assemble(&body, provenance, options)
}

/// Builds a circular cylinder of `radius` and `height` [m]. Its axis is x for a rod and z for a
/// disc (height below sqrt(3) radii), following the order of the principal moments.
///
/// # Errors
/// A length that is no size of a grain, or options out of their range; the message names it.
pub fn cylinder(radius: f64, height: f64, options: &ShapeOptions) -> Result<Shape> {
    check_length("radius", radius)?;
    check_length("height", height)?;
    let long = height >= 3f64.sqrt() * radius;
    let half = 0.5 * height;
    let provenance = Provenance::new("analytic")
        .with("body", "cylinder")
        .with("radius_m", radius)
        .with("length_m", height);
    let extent =
        if long { DVec3::new(half, radius, radius) } else { DVec3::new(radius, radius, half) };
    let body = Body {
        distance: |x: DVec3, _: &mut u32| {
            let (along, across) = if long { (x.x, x.yz()) } else { (x.z, x.xy()) };
            let q = DVec2::new(across.length() - radius, along.abs() - half);
            q.max(DVec2::ZERO).length() + q.max_element().min(0.0)
        },
        lower: -extent,
        upper: extent,
        volume: Some(PI * radius * radius * height),
        area: Some(2.0 * PI * radius * (radius + height)),
        corners: None,
        surface: Surface::Exact,
    };
    assemble(&body, provenance, options)
}

/// Builds a cylinder of `radius` and `height` [m] along x with a hemisphere at either end (total
/// length `height` + 2 `radius`).
///
/// # Errors
/// A length that is no size of a grain, or options out of their range; the message names it.
pub fn capsule(radius: f64, height: f64, options: &ShapeOptions) -> Result<Shape> {
    check_length("radius", radius)?;
    check_length("height", height)?;
    let half = 0.5 * height;
    let extent = DVec3::new(half + radius, radius, radius);
    let provenance = Provenance::new("analytic")
        .with("body", "capsule")
        .with("radius_m", radius)
        .with("length_m", height);
    let body = Body {
        distance: |x: DVec3, _: &mut u32| {
            DVec3::new((x.x.abs() - half).max(0.0), x.y, x.z).length() - radius
        },
        lower: -extent,
        upper: extent,
        volume: Some(PI * radius * radius * (height + 4.0 / 3.0 * radius)),
        area: Some(2.0 * PI * radius * (height + 2.0 * radius)),
        corners: None,
        surface: Surface::Exact,
    };
    assemble(&body, provenance, options)
}

/// Quadrilaterals along each edge of the cube from which a superquadric is meshed.
const FACETS: usize = 72;

/// Builds the superquadric (Barr 1981) (|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) = 1
/// with semi-axes a, b, c [m]. Exponents e1 = e2 = 1 give the ellipsoid, small ones approach a box,
/// and 2 gives an octahedron. Distances refer to a fine mesh with its vertices on the exact
/// surface.
///
/// # Errors
/// A length or an exponent out of its range, or options out of theirs; the message names it.
pub fn superquadric(
    semi_axes: [f64; 3],
    e1: f64,
    e2: f64,
    options: &ShapeOptions,
) -> Result<Shape> {
    for (name, length) in ["a", "b", "c"].into_iter().zip(semi_axes) {
        check_length(name, length)?;
    }
    for (name, value) in [("e1", e1), ("e2", e2)] {
        let reason = "must lie between 0.1 and 2 (convex, and not too sharp to mesh)";
        within(name, value, 0.1..=2.0, reason)?;
    }
    let axes = DVec3::from_array(semi_axes);
    let mesh = cube_sphere(FACETS, |u| {
        let v = u.abs();
        let ring = (v.x.powf(2.0 / e2) + v.y.powf(2.0 / e2)).powf(e2 / e1);
        axes * u / (ring + v.z.powf(2.0 / e1)).powf(0.5 * e1)
    });
    let provenance = Provenance::new("analytic")
        .with("body", "superquadric")
        .with("a_m", semi_axes[0])
        .with("b_m", semi_axes[1])
        .with("c_m", semi_axes[2])
        .with("e1", e1)
        .with("e2", e2);
    mesh::from_closed(&mesh, Surface::Exact, provenance, options)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Field;

    fn options() -> ShapeOptions {
        ShapeOptions { cells: Some(40), nodes: Some(300), ..Default::default() }
    }

    #[track_caller]
    fn close(found: f64, exact: f64, relative: f64) {
        assert!((found / exact - 1.0).abs() < relative, "{found} for {exact}");
    }

    #[test]
    fn a_rounded_box_has_its_volume_moments_and_extents() {
        let shape = rounded_box(1e-3, 3e-3, 2e-3, 0.2e-3, &options()).unwrap();
        let extent = shape.upper() - shape.lower();
        close(extent.x, 3e-3, 4e-3);
        close(extent.y, 2e-3, 4e-3);
        close(extent.z, 1e-3, 4e-3);
        assert!(shape.quality().unwrap().volume_error.unwrap().abs() < 2e-3);
        assert!(shape.inertia().x < shape.inertia().y && shape.inertia().y < shape.inertia().z);
    }

    #[test]
    fn a_body_with_too_many_samples_is_refused_with_the_cause() {
        let refused = |size: [f64; 3], options: &ShapeOptions| {
            rounded_box(size[0], size[1], size[2], 0.0, options).unwrap_err().to_string()
        };
        let thin = refused([5e-3, 5e-3, 0.02e-3], &options());
        assert!(thin.contains("thinnest extent = 250") && thin.contains("make the body"), "{thin}");
        let fine = ShapeOptions { cells: Some(1000), ..options() };
        let many = refused([1e-3; 3], &fine);
        assert!(many.contains("ask for fewer cells"), "{many}");
    }

    #[test]
    fn cylinders_long_and_flat_are_ordered_by_their_moments() {
        let rod = cylinder(1.0, 6.0, &options()).unwrap();
        close(rod.volume(), 6.0 * PI, 3e-3);
        close(rod.inertia().x, 6.0 * PI / 2.0, 8e-3);
        close(rod.inertia().y, 6.0 * PI * (3.0 + 36.0) / 12.0, 6e-3);
        let disc = cylinder(1.0, 0.5, &options()).unwrap();
        close(disc.upper().z - disc.lower().z, 0.5, 6e-3);
        close(disc.inertia().z, 0.5 * PI / 2.0, 8e-3);
    }

    #[test]
    fn a_capsule_and_a_superquadric() {
        let pill = capsule(1.0, 2.0, &options()).unwrap();
        close(pill.volume(), PI * (2.0 + 4.0 / 3.0), 3e-3);
        assert!((pill.distance(DVec3::new(2.5, 0.0, 0.0)) - 0.5).abs() < 5e-3);
        let ball = superquadric([1.0, 1.0, 1.0], 1.0, 1.0, &options()).unwrap();
        close(ball.volume(), 4.0 / 3.0 * PI, 4e-3);
        // Exponents of 0.1 approximate a cube; b is the longest axis and becomes x.
        let brick = superquadric([1.0, 2.0, 0.9], 0.1, 0.1, &options()).unwrap();
        assert!(brick.volume() > 0.97 * 8.0 * 1.8 && brick.volume() < 8.0 * 1.8);
        close(brick.upper().x, 2.0, 3e-3);
        assert!(matches!(brick.field(), Field::Sampled(_)));
    }

    /// Edges aligned with the grids of the field (which truncates them) and of the roundness.
    #[test]
    fn sharp_bodies_have_their_area_and_no_roundness() {
        let bodies = [
            (rounded_box(2.0, 2.0, 2.0, 0.0, &options()), 24.0, 8.0),
            (rounded_box(3.0, 2.0, 2.0, 0.0, &options()), 32.0, 12.0),
            (cylinder(1.0, 2.0, &options()), 6.0 * PI, 2.0 * PI),
        ];
        for (shape, area, volume) in bodies {
            let shape = shape.unwrap();
            let m = shape.morphology();
            let nodes: f64 = shape.nodes().iter().map(|n| n.area).sum();
            close(nodes, area, 1e-9);
            let exact = (36.0 * PI * volume * volume).cbrt() / area;
            close(m.wadell_sphericity, exact, 0.01);
            let roundness = m.wadell_roundness.unwrap();
            println!("{:.4} for {exact:.4}, {roundness:.4}", m.wadell_sphericity);
            assert!(roundness < 0.05, "{roundness}");
        }
    }

    #[test]
    fn bad_parameters_are_refused() {
        let o = options();
        assert!(cylinder(0.0, 1.0, &o).is_err());
        assert!(cylinder(1.0, f64::NAN, &o).is_err());
        assert!(capsule(-1.0, 1.0, &o).is_err());
        assert!(rounded_box(1.0, 1.0, 1.0, 0.6, &o).is_err());
        assert!(rounded_box(1.0, 1.0, 1.0, f64::NAN, &o).is_err());
        assert!(superquadric([1.0; 3], 0.01, 1.0, &o).is_err());
        assert!(rounded_box(1.0, 1.0, 1e-9, 0.0, &o).is_err());
        let few = ShapeOptions { cells: Some(2), ..Default::default() };
        assert!(cylinder(1.0, 1.0, &few).is_err());
    }
}
