//! Surface of a grain in the distance field of its partner: the field in the frame of the grain,
//! and the point of the surface with the smallest distance.

use glam::{DMat3, DVec3};
use grainwake_shape::{Field, Shape};

/// Safety factor on a distance from a sampled field, whose gradient may slightly exceed one.
pub(super) const GRADIENT_MARGIN: f64 = 1.1;

/// Signed distance field of a grain or a wall in the principal frame of another grain.
#[derive(Clone, Copy, Debug)]
pub(super) enum PartnerField<'a> {
    /// Grain; `rotation` x + `translation` are coordinates in its own principal frame.
    Shape {
        /// Shape of the partner.
        shape: &'a Shape,
        /// Rotation into the partner's principal frame.
        rotation: DMat3,
        /// Translation after the rotation [m].
        translation: DVec3,
        /// Corners of the box in which the field is a distance and not an estimate [m].
        exact: (DVec3, DVec3),
    },
    /// Wall with the distance `normal` . x + `offset`.
    HalfSpace {
        /// Unit normal out of the wall.
        normal: DVec3,
        /// Distance of the grain's centroid from the wall [m].
        offset: f64,
    },
}

impl<'a> PartnerField<'a> {
    /// Field of a grain whose principal frame has the coordinates `rotation` x + `translation`.
    pub fn grain(shape: &'a Shape, rotation: DMat3, translation: DVec3) -> PartnerField<'a> {
        let exact = match shape.field() {
            Field::Sphere(_) => (DVec3::NEG_INFINITY, DVec3::INFINITY),
            Field::Sampled(field) => (field.lower(), field.upper()),
            _ => (shape.lower(), shape.upper()),
        };
        PartnerField::Shape { shape, rotation, translation, exact }
    }
    /// Signed distance [m] and its gradient at `x`.
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        match self {
            PartnerField::Shape { shape, rotation, translation, .. } => {
                let (distance, gradient) =
                    shape.distance_and_gradient(*rotation * x + *translation);
                (distance, rotation.transpose() * gradient)
            }
            PartnerField::HalfSpace { normal, offset } => (normal.dot(x) + offset, *normal),
        }
    }
    /// Signed distance [m] at `x`, or infinity if a bound shows that it exceeds `reach` [m].
    pub fn distance_within(&self, x: DVec3, reach: f64) -> f64 {
        match self {
            PartnerField::Shape { shape, rotation, translation, .. } => {
                let y = *rotation * x + *translation;
                let outside = (shape.lower() - y).max(y - shape.upper()).max(DVec3::ZERO);
                if outside.length_squared() > reach * reach {
                    return f64::INFINITY;
                }
                shape.distance(y)
            }
            PartnerField::HalfSpace { normal, offset } => normal.dot(x) + offset,
        }
    }
    /// Returns true if the whole sphere is farther away than `reach` [m], false if that is
    /// uncertain.
    pub fn is_beyond(&self, centre: DVec3, radius: f64, reach: f64) -> bool {
        match self {
            PartnerField::Shape { shape, rotation, translation, exact } => {
                let y = *rotation * centre + *translation;
                let far = radius + reach;
                if y.length_squared() > (shape.bounding_radius() + far).powi(2) {
                    return true;
                }
                if y.cmpge(exact.0).all() && y.cmple(exact.1).all() {
                    return shape.distance(y) > GRADIENT_MARGIN * far;
                }
                let outside = (shape.lower() - y).max(y - shape.upper()).max(DVec3::ZERO);
                outside.length_squared() > far * far
            }
            PartnerField::HalfSpace { normal, offset } => {
                normal.dot(centre) + offset > radius + reach
            }
        }
    }
    /// Radius of curvature for the first step of a descent [m].
    pub fn curvature_radius(&self) -> f64 {
        match self {
            PartnerField::Shape { shape, .. } => shape.bounding_radius(),
            PartnerField::HalfSpace { .. } => f64::INFINITY,
        }
    }
}

/// Point of a grain's surface with the partner's distance there, principal frame of the grain.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    /// Position [m].
    pub position: DVec3,
    /// Distance in the partner's field [m], negative inside.
    pub distance: f64,
    /// Unit gradient of that distance.
    pub normal: DVec3,
}

impl SurfacePoint {
    /// Evaluates the partner's field; `None` where its gradient vanishes.
    pub fn at(partner: &PartnerField, position: DVec3) -> Option<SurfacePoint> {
        let (distance, gradient) = partner.distance_and_gradient(position);
        let normal = gradient.try_normalize()?;
        Some(SurfacePoint { position, distance, normal })
    }
}

/// Projection onto the surface by two Newton steps.
pub(super) fn project_to_surface(surface: &Shape, mut x: DVec3) -> DVec3 {
    for _ in 0..2 {
        let (distance, gradient) = surface.distance_and_gradient(x);
        let square = gradient.length_squared();
        if square < 0.25 {
            break;
        }
        x -= gradient * (distance / square);
    }
    x
}

/// Step limits of [`minimise_distance`].
#[derive(Clone, Copy, Debug)]
pub(super) struct DescentLimits {
    /// Longest step [m].
    pub stride: f64,
    /// The search ends at a shorter step [m].
    pub tolerance: f64,
    /// Most steps.
    pub iterations: usize,
}

/// Local minimum, on `surface`, of the distance in the field of `partner`.
///
/// Steepest descent in the tangent plane. The first step length is the harmonic sum of the bounding
/// radii (Newton's step for two spheres), later ones follow Barzilai and Borwein. A step that does
/// not reduce the distance is rejected and shortened, so the result is at least as deep as `start`.
/// Edges and facets of a sampled field can stall the descent; a compass search follows then.
pub(super) fn minimise_distance(
    surface: &Shape,
    partner: &PartnerField,
    start: SurfacePoint,
    limits: DescentLimits,
) -> SurfacePoint {
    let stride = limits.stride;
    let descent_direction = |point: &SurfacePoint| {
        let (_, gradient) = surface.distance_and_gradient(point.position);
        let outward = gradient.normalize_or_zero();
        point.normal.dot(outward) * outward - point.normal
    };
    let mut point = start;
    let mut direction = descent_direction(&point);
    let mut length = 1.0 / (1.0 / surface.bounding_radius() + 1.0 / partner.curvature_radius());
    let mut rejected = false;
    for _ in 0..limits.iterations {
        let slope = direction.length();
        if slope.is_nan() || length * slope <= limits.tolerance {
            break;
        }
        let step = length.min(stride / slope);
        let position = project_to_surface(surface, point.position + step * direction);
        let Some(next) = SurfacePoint::at(partner, position) else {
            break;
        };
        if next.distance >= point.distance {
            length = 0.25 * step;
            rejected = true;
            continue;
        }
        let next_direction = descent_direction(&next);
        let displacement = next.position - point.position;
        let curvature = displacement.dot(direction - next_direction);
        length =
            if curvature > 0.0 { displacement.length_squared() / curvature } else { 2.0 * step };
        point = next;
        direction = next_direction;
    }
    if rejected { compass_search(surface, partner, point, stride) } else { point }
}

/// Compass search from `point`: six points around it in the tangent plane, at a radius that is
/// halved if none of them is closer.
fn compass_search(
    surface: &Shape,
    partner: &PartnerField,
    mut point: SurfacePoint,
    stride: f64,
) -> SurfacePoint {
    const DIRECTIONS: usize = 6;
    const MAX_MOVES: usize = 40;
    const MIN_RADIUS: f64 = 0.2;
    let (_, gradient) = surface.distance_and_gradient(point.position);
    let (u, v) = gradient.normalize_or(DVec3::Z).any_orthonormal_pair();
    let around: [DVec3; DIRECTIONS] = std::array::from_fn(|k| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / DIRECTIONS as f64).sin_cos();
        c * u + s * v
    });
    let (mut radius, mut moves) = (stride, 0);
    while radius > MIN_RADIUS * stride && moves < MAX_MOVES {
        let better = around.iter().find_map(|direction| {
            let position = project_to_surface(surface, point.position + radius * *direction);
            let next = SurfacePoint::at(partner, position)?;
            (next.distance < point.distance).then_some(next)
        });
        match better {
            Some(next) => {
                point = next;
                moves += 1;
            }
            None => radius *= 0.5,
        }
    }
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    #[test]
    fn the_deepest_point_of_a_sphere_in_a_wall_and_in_a_sphere() {
        let sphere = Shape::sphere(2.0, 100);
        let direction = DVec3::new(0.3, -0.5, 1.0).normalize();
        let limits = DescentLimits { stride: 0.5, tolerance: 1e-9, iterations: 12 };
        let deepest = |field: &PartnerField, start: DVec3| {
            let start = SurfacePoint::at(field, start).unwrap();
            minimise_distance(&sphere, field, start, limits)
        };
        let wall = PartnerField::HalfSpace { normal: DVec3::Z, offset: 1.99 };
        let point = deepest(&wall, 2.0 * DVec3::new(0.5, -0.5, -0.8).normalize());
        assert!((point.distance + 0.01).abs() < 1e-12, "{}", point.distance);
        let other = Shape::sphere(1.0, 100);
        let field = PartnerField::grain(&other, DMat3::IDENTITY, 2.98 * direction);
        let start = -2.0 * (direction + DVec3::new(0.2, 0.1, -0.1)).normalize();
        let point = deepest(&field, start);
        assert!((point.distance + 0.02).abs() < 1e-12, "{}", point.distance);
        assert!((point.position + 2.0 * direction).length() < 1e-6);
    }
}
