//! Hierarchy of the surface patches of a shape, built in the first step with it.

use grainwake_shape::Shape;

use super::patch_layout::surface_patches;
use super::patches::{PatchCluster, PatchTree};

/// Most patches of a leaf.
const LEAF: usize = 8;

impl PatchTree {
    /// Builds the hierarchy of a shape by halving along the longest extent.
    pub fn new(shape: &Shape) -> PatchTree {
        let area: f64 = shape.nodes().iter().map(|n| n.area).sum();
        let spacing = (area / shape.nodes().len().max(1) as f64).sqrt();
        let patches = surface_patches(shape, spacing);
        let extent = patches.iter().map(|p| p.extent).fold(0.0, f64::max);
        let mut tree = PatchTree { patches, clusters: Vec::new(), spacing, extent };
        if !tree.patches.is_empty() {
            tree.split(0, tree.patches.len());
        }
        tree
    }

    fn split(&mut self, from: usize, to: usize) {
        let patches = &mut self.patches[from..to];
        let start = patches[0].position;
        let (lower, upper) = patches.iter().fold((start, start), |(lower, upper), p| {
            (lower.min(p.position), upper.max(p.position))
        });
        let centre = 0.5 * (lower + upper);
        let radius = patches.iter().map(|p| p.position.distance(centre)).fold(0.0, f64::max);
        let index = self.clusters.len();
        self.clusters.push(PatchCluster {
            centre,
            radius,
            patches: (from as u32, to as u32),
            skip: 0,
        });
        if to - from > LEAF {
            let extent = upper - lower;
            let axis =
                (0..3).fold(0, |best, axis| if extent[axis] > extent[best] { axis } else { best });
            patches.sort_by(|a, b| a.position[axis].total_cmp(&b.position[axis]));
            let middle = from + (to - from) / 2;
            self.split(from, middle);
            self.split(middle, to);
        }
        self.clusters[index].skip = self.clusters.len() as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_bound_their_patches_and_leaves_cover_each_once() {
        let shape = Shape::sphere(1.0, 1000);
        let tree = PatchTree::new(&shape);
        let mut seen = 0;
        for (index, cluster) in tree.clusters.iter().enumerate() {
            let run = &tree.patches[cluster.patches.0 as usize..cluster.patches.1 as usize];
            assert!(
                run.iter()
                    .all(|p| p.position.distance(cluster.centre) <= cluster.radius * (1.0 + 1e-12))
            );
            if cluster.is_leaf(index) {
                assert_eq!(cluster.patches.0, seen);
                seen = cluster.patches.1;
            }
        }
        assert_eq!(seen as usize, shape.nodes().len());
    }
}
