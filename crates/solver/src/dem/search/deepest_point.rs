//! Point of a surface with the smallest distance in the field of a partner: where a sphere touches,
//! and for gaps at the start of a run.

use glam::{DMat2, DVec2, DVec3};
use grainwake_shape::Shape;

use super::patches::PosedShape;
use super::surface::{PartnerField, SurfacePoint, is_sphere};

/// First and last radius of the compass search [node spacings].
const COMPASS_RADII: [f64; 2] = [0.25, 0.02];
/// Largest depth of a minimum below a node that the search assumes [node spacings].
const DEPTH_BELOW_NODES: f64 = 0.1;
/// Least distance between the nodes from which descents start [node spacings].
const START_DISTANCE: f64 = 1.0;
/// Most descents.
const MOST_STARTS: usize = 8;

/// Deepest point of a sphere in the field of a sampled shape, whose distance may have several
/// minima: from the nearest node, and from the nodes among `candidates` (distance [m] and index)
/// below which the deepest point may lie.
pub(super) fn deepest_point_of_sphere(
    sphere: &PosedShape,
    partner: &PartnerField,
    nearest: SurfacePoint,
    candidates: &[(f64, u32)],
) -> SurfacePoint {
    let spacing = sphere.tree.spacing;
    // The compass search that follows the descent is finer.
    let limits = DescentLimits { stride: spacing, tolerance: 0.02 * spacing, iterations: 10 };
    let descend = |start| minimise_distance(sphere.shape, partner, start, limits);
    let mut deepest = descend(nearest);
    let (mut starts, mut count) = ([nearest.position; MOST_STARTS], 1);
    let limit = nearest.distance + DEPTH_BELOW_NODES * spacing;
    for &(_, index) in candidates.iter().filter(|(distance, _)| *distance < limit) {
        let node = sphere.tree.patches[index as usize].position;
        let is_close = |start: &DVec3| start.distance(node) < START_DISTANCE * spacing;
        if count == MOST_STARTS || starts[..count].iter().any(is_close) {
            continue;
        }
        (starts[count], count) = (node, count + 1);
        if let Some(start) = SurfacePoint::at(partner, node) {
            let minimum = descend(start);
            if minimum.distance < deepest.distance {
                deepest = minimum;
            }
        }
    }
    // Of all directions in the kink between two samples, the radial one is that of the force.
    let normal = -deepest.position.normalize_or(-deepest.normal);
    SurfacePoint { normal, slope: deepest.slope * deepest.normal.dot(normal), ..deepest }
}

/// Limits of a descent.
#[derive(Clone, Copy, Debug)]
pub(super) struct DescentLimits {
    /// Longest step [m].
    pub stride: f64,
    /// The descent ends at a shorter step [m].
    pub tolerance: f64,
    /// Most steps.
    pub iterations: usize,
}

/// Local minimum, on `surface`, of the distance in the field of `partner`, at least as deep as
/// `start`.
pub(super) fn minimise_distance(
    surface: &Shape,
    partner: &PartnerField,
    start: SurfacePoint,
    limits: DescentLimits,
) -> SurfacePoint {
    let point = steepest_descent(surface, partner, start, limits);
    let radii = COMPASS_RADII.map(|radius| radius * limits.stride);
    compass_search(surface, partner, point, radii)
}

/// Steepest descent in the tangent plane. It may stall at an edge or a facet of a sampled field.
///
/// The first step length is the harmonic sum of the bounding radii (Newton's step for two spheres),
/// later ones follow Barzilai and Borwein. A step that does not reduce the distance is rejected and
/// shortened.
fn steepest_descent(
    surface: &Shape,
    partner: &PartnerField,
    start: SurfacePoint,
    limits: DescentLimits,
) -> SurfacePoint {
    let descent_direction = |point: &SurfacePoint| {
        let (_, gradient) = surface.distance_and_gradient(point.position);
        let outward = gradient.normalize_or_zero();
        point.normal.dot(outward) * outward - point.normal
    };
    let mut point = start;
    let mut direction = descent_direction(&point);
    let mut length = 1.0 / (1.0 / surface.bounding_radius() + 1.0 / partner.curvature_radius());
    for _ in 0..limits.iterations {
        let slope = direction.length();
        if slope.is_nan() || length * slope <= limits.tolerance {
            break;
        }
        let step = length.min(limits.stride / slope);
        let position = project_to_surface(surface, point.position + step * direction);
        let Some(next) = SurfacePoint::at(partner, position) else {
            break;
        };
        if next.distance >= point.distance {
            length = 0.25 * step;
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
    point
}

/// Number of points of a ring in the compass search.
const DIRECTIONS: usize = 6;

/// Compass search from `point`: six points around it in the tangent plane, at a radius that is
/// halved from `first` to `last` [m] if none of them is closer. If one of the two bodies is a
/// sphere, the last ring gives the vertex of a paraboloid: the point of a sphere that rolls would
/// otherwise lag behind the deepest one, by up to half the last radius of the search, and the
/// sphere would gain energy. Between two sampled surfaces the vertex would be that of their
/// roughness.
fn compass_search(
    surface: &Shape,
    partner: &PartnerField,
    mut point: SurfacePoint,
    [first, last]: [f64; 2],
) -> SurfacePoint {
    const MAX_MOVES: usize = 40;
    let (_, gradient) = surface.distance_and_gradient(point.position);
    let (u, v) = gradient.normalize_or(DVec3::Z).any_orthonormal_pair();
    let around: [DVec2; DIRECTIONS] = std::array::from_fn(|k| {
        DVec2::from_angle(std::f64::consts::TAU * k as f64 / DIRECTIONS as f64)
    });
    let moved = |from: DVec3, by: DVec2| project_to_surface(surface, from + by.x * u + by.y * v);
    let (mut radius, mut moves) = (first, 0);
    while radius > last && moves < MAX_MOVES {
        let mut ring = [0.0; DIRECTIONS];
        let better = around.iter().zip(&mut ring).find_map(|(direction, distance)| {
            let position = moved(point.position, radius * *direction);
            *distance = partner.distance(position);
            (*distance < point.distance).then_some(())?;
            SurfacePoint::at(partner, position)
        });
        if let Some(next) = better {
            point = next;
            moves += 1;
            continue;
        }
        if 0.5 * radius <= last && (is_sphere(surface) || partner.is_sphere()) {
            let by = vertex(point.distance, &ring, &around, radius);
            let next = by.and_then(|by| SurfacePoint::at(partner, moved(point.position, by)));
            return next.filter(|next| next.distance < point.distance).unwrap_or(point);
        }
        radius *= 0.5;
    }
    point
}

/// Vertex of the paraboloid through the distance `centre` and the distances on a `ring` of `radius`
/// around it [m], if it lies within the ring.
fn vertex(
    centre: f64,
    ring: &[f64; DIRECTIONS],
    around: &[DVec2; DIRECTIONS],
    radius: f64,
) -> Option<DVec2> {
    // f = f_0 + r g . e + r^2 / 4 (tr H + (H_xx - H_yy) cos 2t + 2 H_xy sin 2t) on the ring.
    let (mut slope, mut trace, mut double) = (DVec2::ZERO, 0.0, DVec2::ZERO);
    for (distance, direction) in ring.iter().zip(around) {
        let rise = distance - centre;
        slope += rise * *direction;
        trace += rise;
        double += rise * direction.rotate(*direction);
    }
    let count = DIRECTIONS as f64;
    let slope = 2.0 / (count * radius) * slope;
    let trace = 4.0 / (count * radius * radius) * trace;
    let double = 8.0 / (count * radius * radius) * double;
    let hessian = DMat2::from_cols(
        DVec2::new(0.5 * (trace + double.x), 0.5 * double.y),
        DVec2::new(0.5 * double.y, 0.5 * (trace - double.x)),
    );
    // Not finite if the distance does not curve.
    let by = -(hessian.inverse() * slope);
    (by.length() <= radius).then_some(by)
}

impl PartnerField<'_> {
    /// Returns whether the partner is an exact sphere.
    pub fn is_sphere(&self) -> bool {
        matches!(self, PartnerField::Shape { shape, .. } if is_sphere(shape))
    }
    /// Point with the smallest distance on a sphere of `radius` [m] around the origin; `None` if
    /// the partner is neither a sphere nor a wall, or a concentric sphere.
    pub fn deepest_point_of_sphere(&self, radius: f64) -> Option<SurfacePoint> {
        if !self.is_sphere() && !self.is_wall() {
            return None;
        }
        let (_, gradient) = self.distance_and_gradient(DVec3::ZERO);
        SurfacePoint::at(self, -radius * gradient.try_normalize()?)
    }
    /// Radius of curvature for the first step of a descent [m].
    pub fn curvature_radius(&self) -> f64 {
        match self {
            PartnerField::Shape { shape, .. } => shape.bounding_radius(),
            PartnerField::HalfSpace { .. } => f64::INFINITY,
        }
    }
}

/// Projection onto the surface by two Newton steps.
fn project_to_surface(surface: &Shape, mut x: DVec3) -> DVec3 {
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
