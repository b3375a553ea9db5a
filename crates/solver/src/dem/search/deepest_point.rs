//! Deepest point of a contact: the point of a surface with the smallest distance in the field of
//! the partner.
//!
//! On a rough surface the distance has several local minima, and a contact is often shallower than
//! the differences between them. A search that ends in any one of them makes the overlap jump, and
//! every jump changes the energy of the spring. The search therefore starts from every node below
//! which the deepest point may lie (`docs/decisions/0024-deepest-point.md`). Within a step its
//! minima are used again until the surfaces have moved by a fraction of the overlap; then descents
//! start from them, until another minimum may have become the deepest.

use glam::{DMat2, DVec2, DVec3};
use grainwake_shape::{Field, Shape};

use super::surface::{GRADIENT_MARGIN, PartnerField, PosedShape, SurfacePoint, project_to_surface};

/// Largest depth of the surface below its nodes that the search assumes [node spacings]. A larger
/// value finds more of the minima and costs more descents.
pub(super) const DEPTH_BELOW_NODES: f64 = 0.1;
/// Least distance between the nodes from which descents start [node spacings].
const START_DISTANCE: f64 = 1.0;
/// Largest difference in depth between the deepest minimum and one that is kept [node spacings].
const KEPT_DEPTH: f64 = 0.05;
/// Distance below which two minima count as one [node spacings].
const SAME_MINIMUM: f64 = 0.1;
/// Least distance by which the surfaces move before the next search [node spacings].
const LEAST_SLACK: f64 = 0.002;
/// Distance by which the surfaces move before the next search, over the overlap or the gap.
const RELATIVE_SLACK: f64 = 0.05;
/// First and last radius of the compass search [node spacings].
const COMPASS_RADII: [f64; 2] = [0.25, 0.02];
/// Limits of a descent, with lengths in node spacings. The compass search that follows is finer.
const DESCENT: DescentLimits = DescentLimits { stride: 1.0, tolerance: 0.02, iterations: 10 };
/// Tolerance of a descent between spheres and walls, which ends at the minimum [node spacings].
const TOLERANCE_OF_SPHERES: f64 = 1e-5;

/// Local minima of the distance that the last search of a surface has found.
#[derive(Debug, Default)]
pub(super) struct LocalMinima {
    /// Positions in the principal frame [m].
    positions: Vec<DVec3>,
    /// Distance by which the surfaces may move until descents start from these positions [m].
    slack: f64,
    /// Distance by which the surfaces may move until another minimum may be the deepest [m].
    range: f64,
    /// Distances [m] and indices of the nodes below which the deepest point may lie.
    near: Vec<(f64, u32)>,
    /// Results of the descents of a search.
    found: Vec<SurfacePoint>,
    /// Nodes from which they started.
    starts: Vec<DVec3>,
}

impl LocalMinima {
    /// Discards the minima.
    pub fn reset(&mut self) {
        (self.slack, self.range) = (0.0, 0.0);
    }

    /// Records that the surfaces may have approached each other by `displacement` [m].
    pub fn approach(&mut self, displacement: f64) {
        self.slack -= GRADIENT_MARGIN * displacement;
        self.range -= GRADIENT_MARGIN * displacement;
    }

    /// Finds the point of the surface of `owner` with the smallest distance. `nearest` is the
    /// nearest node; `near` has the distances [m] and indices of at least all nodes that are
    /// farther away by less than [`DEPTH_BELOW_NODES`].
    pub fn find(
        &mut self,
        owner: &PosedShape,
        partner: &PartnerField,
        nearest: SurfacePoint,
        near: &[(f64, u32)],
    ) -> SurfacePoint {
        if has_one_minimum(owner.shape, partner) {
            let limits = DescentLimits { tolerance: TOLERANCE_OF_SPHERES, ..DESCENT };
            let limits = limits.scaled(owner.tree.spacing);
            return steepest_descent(owner.shape, partner, nearest, limits);
        }
        self.descend_from_nodes(owner, partner, nearest, near);
        let (deepest, kept) = self.keep_deepest(owner, partner);
        self.range = 0.5 * kept;
        deepest
    }

    /// Deepest of the known minima; `None` if another point may be deeper.
    pub fn deepest_known(
        &mut self,
        owner: &PosedShape,
        partner: &PartnerField,
    ) -> Option<SurfacePoint> {
        if self.range <= 0.0 {
            return None;
        }
        let points = self.positions.iter().filter_map(|x| SurfacePoint::at(partner, *x));
        if self.slack > 0.0 {
            return points.min_by(|a, b| a.distance.total_cmp(&b.distance));
        }
        let limits = DESCENT.scaled(owner.tree.spacing);
        let descents = points.map(|point| steepest_descent(owner.shape, partner, point, limits));
        self.found.clear();
        self.found.extend(descents);
        (!self.found.is_empty()).then(|| self.keep_deepest(owner, partner).0)
    }

    /// Keeps the deepest minima of `self.found`, which must not be empty. Returns the deepest, and
    /// the least difference in depth between it and a minimum that is not kept [m].
    fn keep_deepest(&mut self, owner: &PosedShape, partner: &PartnerField) -> (SurfacePoint, f64) {
        let spacing = owner.tree.spacing;
        self.found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        let mut deepest = self.found[0];
        let slack = |deepest: &SurfacePoint| {
            (LEAST_SLACK * spacing).max(RELATIVE_SLACK * deepest.distance.abs())
        };
        // While the deepest recedes by the slack, another one may approach by as much.
        let kept = (KEPT_DEPTH * spacing).max(2.0 * slack(&deepest));
        let radii = COMPASS_RADII.map(|radius| radius * spacing);
        self.positions.clear();
        for &minimum in &self.found {
            let is_same = |x: &DVec3| x.distance(minimum.position) < SAME_MINIMUM * spacing;
            let is_deep = minimum.distance < deepest.distance + kept;
            if !is_deep || self.positions.iter().any(is_same) {
                continue;
            }
            let minimum = compass_search(owner.shape, partner, minimum, radii);
            if minimum.distance < deepest.distance {
                deepest = minimum;
            }
            self.positions.push(minimum.position);
        }
        self.slack = slack(&deepest);
        (deepest, kept)
    }

    /// Descends from the nodes below which the deepest point may lie; `self.found` has the results.
    fn descend_from_nodes(
        &mut self,
        owner: &PosedShape,
        partner: &PartnerField,
        nearest: SurfacePoint,
        near: &[(f64, u32)],
    ) {
        let (spacing, nodes) = (owner.tree.spacing, &owner.tree.nodes);
        let limits = DESCENT.scaled(spacing);
        let first = steepest_descent(owner.shape, partner, nearest, limits);
        let mut deepest = first.distance;
        self.found.clear();
        self.found.push(first);
        self.starts.clear();
        self.starts.push(nearest.position);
        let depth = DEPTH_BELOW_NODES * spacing;
        let limit = if nearest.distance < depth { nearest.distance + depth } else { 0.0 };
        self.near.clear();
        self.near.extend(near.iter().filter(|(distance, _)| *distance < limit));
        self.near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(distance, index) in &self.near {
            if distance >= deepest + depth {
                break;
            }
            let node = nodes[index as usize].position;
            let is_close = |start: &DVec3| start.distance(node) < START_DISTANCE * spacing;
            if self.starts.iter().any(is_close) {
                continue;
            }
            self.starts.push(node);
            if let Some(start) = SurfacePoint::at(partner, node) {
                let minimum = steepest_descent(owner.shape, partner, start, limits);
                deepest = deepest.min(minimum.distance);
                self.found.push(minimum);
            }
        }
    }
}

/// Returns true for a sphere whose partner is a sphere or a wall: the distance then has a single
/// minimum on its surface.
fn has_one_minimum(surface: &Shape, partner: &PartnerField) -> bool {
    let is_wall = matches!(partner, PartnerField::HalfSpace { .. });
    is_sphere(surface) && (is_wall || partner_is_sphere(partner))
}

fn is_sphere(shape: &Shape) -> bool {
    matches!(shape.field(), Field::Sphere(_))
}

fn partner_is_sphere(partner: &PartnerField) -> bool {
    matches!(partner, PartnerField::Shape { shape, .. } if is_sphere(shape))
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

impl DescentLimits {
    /// Limits whose lengths are multiplied by `length`.
    fn scaled(self, length: f64) -> DescentLimits {
        DescentLimits { stride: self.stride * length, tolerance: self.tolerance * length, ..self }
    }
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
        if 0.5 * radius <= last && (is_sphere(surface) || partner_is_sphere(partner)) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dem::search::node_tree::NodeTree;
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

    #[test]
    fn the_deepest_point_of_a_rough_grain_is_the_deepest_of_a_dense_search() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/grains/tsquare_rock.grain");
        let shape = Shape::load(path.as_ref()).unwrap();
        let tree = NodeTree::new(&shape);
        let owner = PosedShape {
            shape: &shape,
            tree: &tree,
            rotation: DMat3::IDENTITY,
            position: DVec3::ZERO,
        };
        // Points of the surface, a quarter of a spacing apart.
        let dense: Vec<DVec3> = (tree.nodes.iter())
            .flat_map(|node| {
                let (_, gradient) = shape.distance_and_gradient(node.position);
                let (u, v) = gradient.normalize().any_orthonormal_pair();
                let offsets = (-3..=3).flat_map(move |i| (-3..=3).map(move |j| (i, j)));
                let step = 0.25 * tree.spacing;
                offsets
                    .map(move |(i, j)| node.position + step * (f64::from(i) * u + f64::from(j) * v))
            })
            .map(|x| project_to_surface(&shape, x))
            .collect();
        // Depth missed by the search, and by a search from the nearest node alone.
        let mut missed = [Vec::new(), Vec::new()];
        for n in 0..200 {
            let t = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(n);
            let normal = (2.0 * t.fract() - DVec3::ONE).normalize();
            let wall = PartnerField::HalfSpace { normal, offset: 0.0 };
            let mut distances: Vec<(f64, u32)> = (tree.nodes.iter().zip(0..))
                .map(|(node, index)| (wall.distance(node.position), index))
                .collect();
            distances.sort_by(|a, b| a.0.total_cmp(&b.0));
            let nearest = tree.nodes[distances[0].1 as usize].position;
            let start = SurfacePoint::at(&wall, nearest).unwrap();
            let limit = distances[0].0 + DEPTH_BELOW_NODES * tree.spacing;
            let near = &distances[..distances.partition_point(|(d, _)| *d < limit)];
            let exact = dense.iter().map(|x| wall.distance(*x)).fold(f64::INFINITY, f64::min);
            for (near, missed) in [near, &[]].into_iter().zip(&mut missed) {
                let deepest = LocalMinima::default().find(&owner, &wall, start, near);
                missed.push((deepest.distance - exact) / tree.spacing);
            }
        }
        let [[most, wrong], [most_alone, wrong_alone]] = missed.map(|missed| {
            let most = missed.iter().copied().fold(0.0, f64::max);
            [most, missed.iter().filter(|missed| **missed > 1e-3).count() as f64]
        });
        println!("missed: {most:.1e} spacings, {wrong} of 200; {most_alone:.1e}, {wrong_alone}");
        assert!(most < 0.03 && wrong <= 10.0, "{most} {wrong}");
        assert!(wrong_alone > 1.5 * wrong, "{most_alone} {wrong_alone}");
    }
}
