//! Narrow phase: contact patch of a pair, from the surface nodes of each grain in the distance
//! field of its partner and the deepest point of the surface (Eqs 7-8).

use glam::DVec3;
use grainwake_shape::Shape;

use super::node_scan::{
    PenetratingPoint, SurfaceMemory, follow_contact, scan_candidates, scan_nodes,
};
use super::surface::{PartnerField, PosedShape, SurfacePoint, project_to_surface};

/// Penetrating point of a pair, space frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct ContactPoint {
    /// Identifier of the node or point; ascending within a pair.
    pub id: u32,
    /// Overlap d_i [m], positive (Eq. 7).
    pub overlap: f64,
    /// Area that the point represents [m^2].
    pub area: f64,
    /// Lever arm from the centroid of the first grain [m].
    pub lever_arm: DVec3,
    /// Unit normal out of the first grain, into its partner (Eq. 8).
    pub normal: DVec3,
}

/// Closest point of a pair without contact, space frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct ClosestPoint {
    /// Distance between the surfaces [m], negative if they overlap.
    pub gap: f64,
    /// Lever arm from the centroid of the first grain [m].
    pub lever_arm: DVec3,
    /// Unit normal out of the first grain.
    pub normal: DVec3,
}

/// Penetrating points of a pair, with the buffers of the narrow phase.
#[derive(Debug, Default)]
pub(in crate::dem) struct ContactPatch {
    /// Penetrating points, in ascending identifier.
    pub points: Vec<ContactPoint>,
    /// Lower bound of the distance between the surfaces [m]; not positive if unknown.
    pub separation: f64,
    /// Results of the last search of each surface.
    memory: [SurfaceMemory; 2],
    found: Vec<PenetratingPoint>,
}

impl ContactPatch {
    /// Discards what earlier searches found.
    pub fn reset(&mut self) {
        self.separation = 0.0;
        self.memory.iter_mut().for_each(SurfaceMemory::reset);
    }

    /// Records that the surfaces may have approached each other by `displacement` [m].
    pub fn approach(&mut self, displacement: f64) {
        self.separation -= displacement;
        self.memory.iter_mut().for_each(|memory| memory.approach(displacement));
    }

    /// Finds the penetrating points of two grains (Eqs 7-8); returns the closest point if the
    /// surfaces are nearer than `reach` [m].
    pub fn find_grain_contact(
        &mut self,
        a: &PosedShape,
        b: &PosedShape,
        reach: f64,
    ) -> Option<ClosestPoint> {
        self.points.clear();
        let branch = a.position - b.position;
        self.separation =
            branch.length() - a.shape.bounding_radius() - b.shape.bounding_radius() - reach;
        if self.separation > 0.0 {
            return None;
        }
        let to_b = b.rotation.transpose();
        let rotation = to_b * a.rotation;
        let field_of_b = PartnerField::grain(b.shape, rotation, to_b * branch);
        let (bound_a, closest_a) = self.search_surface(0, a, &field_of_b, reach, |p| {
            (a.rotation * p.position, -(a.rotation * p.normal))
        });
        let translation = -(a.rotation.transpose() * branch);
        let field_of_a = PartnerField::grain(a.shape, rotation.transpose(), translation);
        let (bound_b, closest_b) = self.search_surface(1, b, &field_of_a, reach, |p| {
            (b.rotation * p.position - branch, b.rotation * p.normal)
        });
        let closest = closest_a.into_iter().chain(closest_b);
        let closest = closest.min_by(|a, b| a.gap.total_cmp(&b.gap));
        self.finish(closest, bound_a.max(bound_b), reach)
    }

    /// Finds the penetrating points of a grain in a wall with the unit normal `inward`, at the
    /// distance `offset` [m] from the centroid; returns the closest point if nearer than `reach`
    /// [m].
    pub fn find_wall_contact(
        &mut self,
        a: &PosedShape,
        inward: DVec3,
        offset: f64,
        reach: f64,
    ) -> Option<ClosestPoint> {
        self.points.clear();
        self.separation = offset - a.shape.bounding_radius() - reach;
        if self.separation > 0.0 {
            return None;
        }
        let wall = PartnerField::HalfSpace { normal: a.rotation.transpose() * inward, offset };
        let (bound, closest) =
            self.search_surface(0, a, &wall, reach, |p| (a.rotation * p.position, -inward));
        self.finish(closest, bound, reach)
    }

    /// Searches the surface of `owner`, grain 0 or 1 of the pair, and appends its penetrating
    /// points.
    ///
    /// `to_space` gives the lever arm from the centroid of the first grain and the normal out of
    /// it. Returns a lower bound of the distance between surface and partner [m], and the closest
    /// point if it may be nearer than `reach` [m].
    fn search_surface(
        &mut self,
        grain: usize,
        owner: &PosedShape,
        partner: &PartnerField,
        reach: f64,
        to_space: impl Fn(&SurfacePoint) -> (DVec3, DVec3),
    ) -> (f64, Option<ClosestPoint>) {
        let (bound, closest) =
            scan_surface(owner, partner, reach, &mut self.memory[grain], &mut self.found);
        self.points.extend(self.found.iter().map(|found| {
            let (lever_arm, normal) = to_space(&found.point);
            let id = if grain == 0 { found.id } else { found.id | SECOND_GRAIN };
            ContactPoint { id, overlap: -found.point.distance, area: found.area, lever_arm, normal }
        }));
        let closest = closest.map(|point| {
            let (lever_arm, normal) = to_space(&point);
            ClosestPoint { gap: point.distance, lever_arm, normal }
        });
        (bound, closest)
    }

    /// Sets the separation after a search that found the closest point, if near; returns that point
    /// if it is nearer than `reach` [m]. `node_bound` is the lower bound that the nodes give [m].
    fn finish(
        &mut self,
        closest: Option<ClosestPoint>,
        node_bound: f64,
        reach: f64,
    ) -> Option<ClosestPoint> {
        // Half of the gap may close before the pair is searched again.
        let bound = closest.map_or(node_bound, |point| node_bound.max(0.5 * point.gap));
        self.separation = if self.points.is_empty() { bound - reach } else { 0.0 };
        closest.filter(|point| point.gap < reach)
    }
}

/// Bit that marks the points of the second grain in a point identifier.
const SECOND_GRAIN: u32 = 1 << 31;
/// Identifier of the deepest point, which is not a node. Node n has the identifier 2 n and its
/// mirror point 2 n + 1.
const DEEPEST_POINT: u32 = SECOND_GRAIN - 1;

/// Area of the deepest point [node areas]. The deepest point carries the contact before the first
/// node penetrates, and counts little in a patch of many nodes.
const DEEPEST_POINT_AREA: f64 = 1.0;
/// A mirror point is used if the surface lies within this fraction of its distance from the deepest
/// point.
const MIRROR_TOLERANCE: f64 = 0.3;
/// A patch with more nodes is resolved and needs no mirror points.
const RESOLVED: usize = 128;
/// Range of the search for the nearest node [node spacings]; bounds the separation of the pair.
const SEARCH_RANGE: f64 = 3.0;
/// Largest distance of a surface point from the nearest node [node spacings].
const NODE_COVERAGE: f64 = 1.2;

/// Tests the nodes of `owner` in the field of its partner (Eq. 7). Penetrating points go to `found`
/// in ascending identifier.
///
/// Returns a lower bound of the distance between surface and partner [m], and the closest point of
/// the surface if it may be nearer than `reach` [m]. `memory` is that of the last search in the
/// same step.
fn scan_surface(
    owner: &PosedShape,
    partner: &PartnerField,
    reach: f64,
    memory: &mut SurfaceMemory,
    found: &mut Vec<PenetratingPoint>,
) -> (f64, Option<SurfacePoint>) {
    let tree = owner.tree;
    if let Some(deepest) = follow_contact(owner, partner, memory, found) {
        add_deepest_point(owner, partner, deepest, found);
        return (f64::NEG_INFINITY, Some(deepest));
    }
    let range = NODE_COVERAGE * tree.spacing + reach;
    let nearest = scan_candidates(tree, partner, memory, found)
        .unwrap_or_else(|| scan_nodes(tree, partner, SEARCH_RANGE * range, memory, found));
    memory.nearest = nearest.index;
    let separation = nearest.distance - NODE_COVERAGE * tree.spacing;
    let start = nearest
        .index
        .filter(|_| nearest.distance < range)
        .and_then(|index| SurfacePoint::at(partner, tree.nodes[index as usize].position));
    let Some(start) = start else {
        return (separation, None);
    };
    let deepest = memory.minima.find(owner, partner, start, &memory.candidates);
    add_deepest_point(owner, partner, deepest, found);
    (separation, Some(deepest))
}

/// Adds the deepest point to the penetrating nodes, if it penetrates, and mirror points to a patch
/// of few nodes.
fn add_deepest_point(
    owner: &PosedShape,
    partner: &PartnerField,
    deepest: SurfacePoint,
    found: &mut Vec<PenetratingPoint>,
) {
    if deepest.distance >= 0.0 {
        return;
    }
    if found.len() <= RESOLVED {
        add_mirror_points(owner.shape, partner, deepest.position, found);
    }
    let area = DEEPEST_POINT_AREA * owner.tree.spacing * owner.tree.spacing;
    found.push(PenetratingPoint { id: DEEPEST_POINT, area, point: deepest });
}

/// Shares the area of each node with its mirror image about the deepest point, if the image lies on
/// the surface and penetrates.
///
/// The few nodes of a small patch have a centroid off that of the patch by a good part of their
/// spacing, which tilts the force and gives it a lever arm. Mirror points remove this error for a
/// symmetric patch and have no effect on average otherwise.
fn add_mirror_points(
    surface: &Shape,
    partner: &PartnerField,
    centre: DVec3,
    found: &mut Vec<PenetratingPoint>,
) {
    let (_, gradient) = surface.distance_and_gradient(centre);
    let axis = gradient.normalize_or_zero();
    for index in 0..found.len() {
        let node = found[index];
        let offset = node.point.position - centre;
        // Half a turn about the normal maps a surface of revolution onto itself.
        let image = centre + 2.0 * offset.dot(axis) * axis - offset;
        let position = project_to_surface(surface, image);
        let off_surface = position.distance_squared(image)
            > (MIRROR_TOLERANCE * MIRROR_TOLERANCE) * offset.length_squared();
        let mirror = SurfacePoint::at(partner, position);
        let Some(mirror) = mirror.filter(|p| !off_surface && p.distance < 0.0) else {
            continue;
        };
        // Half the area at equal depth, none at zero depth: the split is continuous.
        let share = 0.5 * (mirror.distance / node.point.distance).min(1.0);
        found[index].area = (1.0 - share) * node.area;
        found.push(PenetratingPoint { id: node.id + 1, area: share * node.area, point: mirror });
    }
    found.sort_unstable_by_key(|point| point.id);
}
