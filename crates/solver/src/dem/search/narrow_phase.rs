//! Narrow phase, one way: surface nodes of a grain in the distance field of its partner (Eqs 7-8),
//! and the deepest point of the surface.

use glam::{DMat3, DVec3};
use grainwake_shape::Shape;

use super::closest_point::{DescentLimits, SurfacePoint, minimise_distance, project_to_surface};
use super::node_tree::NodeTree;
use super::partner_field::PartnerField;

/// Bit that marks the points of the second grain in a point identifier.
pub(super) const SECOND_GRAIN: u32 = 1 << 31;
/// Identifier of the deepest point, which is not a node. Node n has the identifier 2 n and its
/// mirror point 2 n + 1.
const DEEPEST_POINT: u32 = SECOND_GRAIN - 1;

/// Area of the deepest point [node areas]. The deepest point carries the contact before the first
/// node penetrates, and counts little in a patch of many nodes.
const DEEPEST_POINT_AREA: f64 = 1.0;
/// Most steps in the search of the deepest point.
const ITERATIONS: usize = 10;
/// A mirror point is used if the surface lies within this fraction of its distance from the deepest
/// point.
const MIRROR_TOLERANCE: f64 = 0.3;
/// A patch with more nodes is resolved and needs no mirror points.
const RESOLVED: usize = 128;
/// Range of the search for the nearest node [node spacings]; bounds the separation of the pair.
const SEARCH_RANGE: f64 = 3.0;
/// Largest distance of a surface point from the nearest node [node spacings].
const NODE_COVERAGE: f64 = 1.2;

/// Shape of a grain, or of a periodic image, at its pose.
#[derive(Clone, Copy)]
pub(in crate::dem) struct PosedShape<'a> {
    /// Shape.
    pub shape: &'a Shape,
    /// Hierarchy of its surface nodes.
    pub tree: &'a NodeTree,
    /// Rotation from the principal frame to the space frame.
    pub rotation: DMat3,
    /// Centroid [m].
    pub position: DVec3,
}

/// Penetrating point in the principal frame of the grain on whose surface it lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct PenetratingPoint {
    /// Identifier of the node or point.
    pub id: u32,
    /// Area that the point represents [m^2].
    pub area: f64,
    /// Position and distance.
    pub point: SurfacePoint,
}

/// Result of testing the nodes of one grain in the field of its partner.
pub(super) struct SurfaceScan {
    /// Lower bound of the distance between surface and partner [m].
    pub separation: f64,
    /// Closest point of the surface, if nearer than the search range asked for.
    pub closest: Option<SurfacePoint>,
}

/// Nearest node found so far; the lowest index among equally near nodes.
struct NearestNode {
    distance: f64,
    index: Option<u32>,
}

impl NearestNode {
    fn update(&mut self, distance: f64, index: u32) {
        let tied = distance == self.distance && self.index.is_some_and(|known| index < known);
        if distance < self.distance || tied {
            *self = NearestNode { distance, index: Some(index) };
        }
    }
}

/// Tests the nodes of `owner` in the field of its partner (Eq. 7).
///
/// Penetrating points go to `found` in ascending identifier. The closest point of the surface is
/// determined if it may be nearer than `reach` [m]. `seed`, the nearest node of the last scan, only
/// saves work.
pub(super) fn scan_surface(
    owner: &PosedShape,
    partner: &PartnerField,
    reach: f64,
    seed: &mut Option<u32>,
    found: &mut Vec<PenetratingPoint>,
) -> SurfaceScan {
    found.clear();
    let tree = owner.tree;
    let range = tree.spacing.max(reach);
    let nearest = scan_nodes(tree, partner, SEARCH_RANGE * range, *seed, found);
    *seed = nearest.index;
    let separation = nearest.distance - NODE_COVERAGE * tree.spacing;
    let start = nearest
        .index
        .filter(|_| nearest.distance < range)
        .and_then(|index| SurfacePoint::at(partner, tree.nodes[index as usize].position));
    let Some(start) = start else {
        return SurfaceScan { separation, closest: None };
    };
    let limits = DescentLimits {
        stride: tree.spacing,
        tolerance: 1e-5 * tree.spacing,
        iterations: ITERATIONS,
    };
    let closest = minimise_distance(owner.shape, partner, start, limits);
    if closest.distance < 0.0 {
        if found.len() <= RESOLVED {
            add_mirror_points(owner.shape, partner, closest.position, found);
        }
        found.push(PenetratingPoint {
            id: DEEPEST_POINT,
            area: DEEPEST_POINT_AREA * tree.spacing * tree.spacing,
            point: closest,
        });
    }
    SurfaceScan { separation, closest: (closest.distance < reach).then_some(closest) }
}

/// Collects the penetrating nodes and returns the nearest node within `range` [m].
fn scan_nodes(
    tree: &NodeTree,
    partner: &PartnerField,
    range: f64,
    seed: Option<u32>,
    found: &mut Vec<PenetratingPoint>,
) -> NearestNode {
    let mut nearest = NearestNode { distance: range, index: None };
    if let Some((index, node)) = seed.and_then(|n| Some((n, tree.nodes.get(n as usize)?))) {
        nearest.update(partner.distance(node.position), index);
    }
    let mut cluster_index = 0;
    while let Some(cluster) = tree.clusters.get(cluster_index) {
        // Only penetrating nodes and nodes nearer than the nearest one so far are of interest.
        if partner.is_beyond(cluster.centre, cluster.radius, nearest.distance.max(0.0)) {
            cluster_index = cluster.skip as usize;
            continue;
        }
        if cluster.is_leaf(cluster_index) {
            for index in cluster.nodes.0..cluster.nodes.1 {
                let node = &tree.nodes[index as usize];
                let limit = nearest.distance.max(0.0);
                let Some(distance) = partner.distance_within(node.position, limit) else {
                    continue;
                };
                nearest.update(distance, index);
                if distance < 0.0
                    && let Some(point) = SurfacePoint::at(partner, node.position)
                {
                    found.push(PenetratingPoint { id: 2 * index, area: node.area, point });
                }
            }
        }
        cluster_index += 1;
    }
    nearest
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
