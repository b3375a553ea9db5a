//! Nodes of one grain that penetrate its partner, and the nearest node: by the hierarchy of the
//! nodes, or within a step by the candidates of the last search.

use super::deepest_point::{DEPTH_BELOW_NODES, LocalMinima};
use super::node_tree::NodeTree;
use super::surface::{GRADIENT_MARGIN, PartnerField, PosedShape, SurfacePoint};

/// Distance from the partner up to which nodes are candidates of the next searches [node spacings].
const CANDIDATE_RANGE: f64 = 0.5;

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

/// Result of the last search of the surface of one grain, from which the next one in the same step
/// starts.
#[derive(Debug, Default)]
pub(super) struct SurfaceMemory {
    /// Nodes within the candidate range at the last traversal, in ascending order: distance [m] in
    /// the last test of all of them, and index.
    pub candidates: Vec<(f64, u32)>,
    /// Distance by which the surfaces may have approached since then [m].
    approach: f64,
    /// Distance by which the surfaces may approach until other nodes than the candidates may
    /// penetrate [m].
    slack: f64,
    /// Nearest node.
    pub nearest: Option<u32>,
    /// Local minima of the distance.
    pub minima: LocalMinima,
}

impl SurfaceMemory {
    /// Forgets all but the buffer.
    pub fn reset(&mut self) {
        self.candidates.clear();
        (self.slack, self.nearest) = (0.0, None);
        self.minima.reset();
    }

    /// Records that the surfaces may have approached each other by `displacement` [m].
    pub fn approach(&mut self, displacement: f64) {
        self.slack -= GRADIENT_MARGIN * displacement;
        self.approach += GRADIENT_MARGIN * displacement;
        self.minima.approach(displacement);
    }
}

/// Nearest node found so far; the lowest index among equally near nodes.
pub(super) struct NearestNode {
    /// Distance from the partner [m].
    pub distance: f64,
    /// Index of the node; `None` if no node is nearer than that.
    pub index: Option<u32>,
}

impl NearestNode {
    fn update(&mut self, distance: f64, index: u32) {
        let tied = distance == self.distance && self.index.is_some_and(|known| index < known);
        if distance < self.distance || tied {
            *self = NearestNode { distance, index: Some(index) };
        }
    }
}

/// Collects the penetrating nodes among the candidates of the last traversal and returns the
/// nearest node; `None` if other nodes may be nearer or penetrate.
pub(super) fn scan_candidates(
    tree: &NodeTree,
    partner: &PartnerField,
    memory: &mut SurfaceMemory,
    found: &mut Vec<PenetratingPoint>,
) -> Option<NearestNode> {
    if memory.slack <= 0.0 {
        return None;
    }
    found.clear();
    let mut nearest = NearestNode { distance: memory.slack, index: None };
    for (distance, index) in &mut memory.candidates {
        *distance = test_node(tree, partner, *index, f64::INFINITY, found);
        nearest.update(*distance, *index);
    }
    memory.approach = 0.0;
    // The nodes below which the deepest point may lie must be candidates.
    let depth = DEPTH_BELOW_NODES * tree.spacing;
    let is_complete = nearest.distance >= depth || nearest.distance + depth <= memory.slack;
    (nearest.index.is_some() && is_complete).then_some(nearest)
}

/// Collects the penetrating nodes and returns the deepest point, from the last search in the same
/// step; `None` if another node may penetrate or another point may be the deepest.
pub(super) fn follow_contact(
    owner: &PosedShape,
    partner: &PartnerField,
    memory: &mut SurfaceMemory,
    found: &mut Vec<PenetratingPoint>,
) -> Option<SurfacePoint> {
    if memory.slack <= 0.0 {
        return None;
    }
    let deepest = memory.minima.deepest_known(owner, partner)?;
    found.clear();
    for &(distance, index) in &memory.candidates {
        if distance < memory.approach {
            test_node(owner.tree, partner, index, f64::INFINITY, found);
        }
    }
    Some(deepest)
}

/// Collects a node if it penetrates; returns its distance, or infinity beyond `reach` [m].
fn test_node(
    tree: &NodeTree,
    partner: &PartnerField,
    index: u32,
    reach: f64,
    found: &mut Vec<PenetratingPoint>,
) -> f64 {
    let node = &tree.nodes[index as usize];
    let distance = partner.distance_within(node.position, reach);
    if distance < 0.0
        && let Some(point) = SurfacePoint::at(partner, node.position)
    {
        found.push(PenetratingPoint { id: 2 * index, area: node.area, point });
    }
    distance
}

/// Collects the penetrating nodes and returns the nearest node within `range` [m]; lists the
/// candidates of the next searches.
pub(super) fn scan_nodes(
    tree: &NodeTree,
    partner: &PartnerField,
    range: f64,
    memory: &mut SurfaceMemory,
    found: &mut Vec<PenetratingPoint>,
) -> NearestNode {
    found.clear();
    let SurfaceMemory { candidates, approach, slack, nearest: seed, .. } = memory;
    candidates.clear();
    *approach = 0.0;
    *slack = CANDIDATE_RANGE * tree.spacing;
    let mut nearest = NearestNode { distance: range, index: None };
    if let Some((index, node)) = seed.and_then(|n| Some((n, tree.nodes.get(n as usize)?))) {
        nearest.update(partner.distance_within(node.position, range), index);
    }
    let mut cluster_index = 0;
    while let Some(cluster) = tree.clusters.get(cluster_index) {
        // Only candidates and nodes nearer than the nearest one so far are of interest.
        if partner.is_beyond(cluster.centre, cluster.radius, nearest.distance.max(*slack)) {
            cluster_index = cluster.skip as usize;
            continue;
        }
        if cluster.is_leaf(cluster_index) {
            for index in cluster.nodes.0..cluster.nodes.1 {
                let reach = nearest.distance.max(*slack);
                let distance = test_node(tree, partner, index, reach, found);
                nearest.update(distance, index);
                if distance <= *slack {
                    candidates.push((distance, index));
                }
            }
        }
        cluster_index += 1;
    }
    nearest
}
