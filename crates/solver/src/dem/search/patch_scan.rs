//! Patches of one grain that penetrate its partner, and the nearest patch: by the hierarchy of the
//! patches, or within a step by the candidates of the last search.

use super::patches::PatchTree;
use super::surface::{GRADIENT_MARGIN, PartnerField, SurfacePoint};

/// Distance from the partner up to which patches are candidates of the next searches [node
/// spacings].
const CANDIDATE_RANGE: f64 = 0.5;

/// Penetrating point in the principal frame of the grain on whose surface it lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct PenetratingPoint {
    /// Index of the patch.
    pub id: u32,
    /// Area of the patch [m^2].
    pub area: f64,
    /// Position and distance.
    pub point: SurfacePoint,
}

/// Result of the last search of the surface of one grain, from which the next one in the same step
/// starts.
#[derive(Debug, Default)]
pub(super) struct SurfaceMemory {
    /// Patches within the candidate range at the last traversal, in ascending order: distance [m]
    /// in the last test of all of them, and index.
    pub candidates: Vec<(f64, u32)>,
    /// Distance by which the surfaces may have approached since then [m].
    approach: f64,
    /// Distance by which the surfaces may approach until other patches than the candidates may
    /// penetrate [m].
    slack: f64,
    /// Nearest patch.
    pub nearest: Option<u32>,
}

impl SurfaceMemory {
    /// Forgets all but the buffer.
    pub fn reset(&mut self) {
        self.candidates.clear();
        (self.slack, self.nearest) = (0.0, None);
    }

    /// Records that the surfaces may have approached each other by `displacement` [m].
    pub fn approach(&mut self, displacement: f64) {
        self.slack -= GRADIENT_MARGIN * displacement;
        self.approach += GRADIENT_MARGIN * displacement;
    }
}

/// Nearest patch found so far; the lowest index among equally near patches.
pub(super) struct NearestPatch {
    /// Distance from the partner [m].
    pub distance: f64,
    /// Index of the patch; `None` if no patch is nearer than that.
    pub index: Option<u32>,
}

impl NearestPatch {
    fn update(&mut self, distance: f64, index: u32) {
        let tied = distance == self.distance && self.index.is_some_and(|known| index < known);
        if distance < self.distance || tied {
            *self = NearestPatch { distance, index: Some(index) };
        }
    }
}

/// Collects the penetrating patches among the candidates of the last traversal and returns the
/// nearest patch; `None` if other patches may be nearer or penetrate.
pub(super) fn scan_candidates(
    tree: &PatchTree,
    partner: &PartnerField,
    memory: &mut SurfaceMemory,
    found: &mut Vec<PenetratingPoint>,
) -> Option<NearestPatch> {
    if memory.slack <= 0.0 {
        return None;
    }
    found.clear();
    let mut nearest = NearestPatch { distance: memory.slack, index: None };
    // In a contact only the patches matter that may penetrate.
    for &(distance, index) in &memory.candidates {
        if distance < memory.approach {
            nearest.update(test_patch(tree, partner, index, f64::INFINITY, found), index);
        }
    }
    if nearest.distance < 0.0 {
        return Some(nearest);
    }
    found.clear();
    for (distance, index) in &mut memory.candidates {
        *distance = test_patch(tree, partner, *index, f64::INFINITY, found);
        nearest.update(*distance, *index);
    }
    memory.approach = 0.0;
    nearest.index.is_some().then_some(nearest)
}

/// Collects a patch if it penetrates; returns a lower bound of its distance, or infinity beyond
/// `reach` [m].
fn test_patch(
    tree: &PatchTree,
    partner: &PartnerField,
    index: u32,
    reach: f64,
    found: &mut Vec<PenetratingPoint>,
) -> f64 {
    let patch = &tree.patches[index as usize];
    let distance = patch.distance_within(partner, reach);
    if distance < 0.0
        && let Some(point) = patch.deepest_point(partner)
        && point.distance < 0.0
    {
        found.push(PenetratingPoint { id: index, area: patch.area, point });
    }
    distance
}

/// Collects the penetrating patches and returns the nearest patch within `range` [m]; lists the
/// candidates of the next searches.
pub(super) fn scan_patches(
    tree: &PatchTree,
    partner: &PartnerField,
    range: f64,
    memory: &mut SurfaceMemory,
    found: &mut Vec<PenetratingPoint>,
) -> NearestPatch {
    found.clear();
    let SurfaceMemory { candidates, approach, slack, nearest: seed, .. } = memory;
    candidates.clear();
    *approach = 0.0;
    *slack = CANDIDATE_RANGE * tree.spacing;
    let mut nearest = NearestPatch { distance: range, index: None };
    if let Some((index, patch)) = seed.and_then(|n| Some((n, tree.patches.get(n as usize)?))) {
        nearest.update(patch.distance_within(partner, range), index);
    }
    let extent = if partner.is_wall() { tree.extent } else { 0.0 };
    let mut cluster_index = 0;
    while let Some(cluster) = tree.clusters.get(cluster_index) {
        // Only candidates and patches nearer than the nearest one so far are of interest.
        if partner.is_beyond(cluster.centre, cluster.radius, nearest.distance.max(*slack) + extent)
        {
            cluster_index = cluster.skip as usize;
            continue;
        }
        if cluster.is_leaf(cluster_index) {
            for index in cluster.patches.0..cluster.patches.1 {
                let reach = nearest.distance.max(*slack);
                let distance = test_patch(tree, partner, index, reach, found);
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
