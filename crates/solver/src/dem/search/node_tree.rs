//! Hierarchy of the surface nodes of a shape, built once for each shape.

use glam::{DMat3, DVec3};
use grainwake_shape::Shape;

use super::patches::{SurfacePatch, surface_patches};

/// Most nodes of a leaf.
const LEAF: usize = 8;

/// Bounding sphere of a range of nodes.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct NodeCluster {
    /// Centre, principal frame [m].
    pub centre: DVec3,
    /// Radius [m].
    pub radius: f64,
    /// Range of nodes: first, and one past the last.
    pub nodes: (u32, u32),
    /// Index of the next cluster in depth-first order outside this subtree.
    pub skip: u32,
}

impl NodeCluster {
    /// Returns true if this cluster, at `index`, has no sub-clusters.
    pub fn is_leaf(&self, index: usize) -> bool {
        self.skip as usize == index + 1
    }
}

/// Nodes and clusters of one shape.
#[derive(Clone, Debug)]
pub(in crate::dem) struct NodeTree {
    /// Nodes and the further points of the surface, in the order of the leaves.
    pub nodes: Vec<SurfacePatch>,
    /// Clusters in depth-first order.
    pub clusters: Vec<NodeCluster>,
    /// Spacing of the shape's nodes: square root of their mean area [m].
    pub spacing: f64,
    /// Largest extent of a patch [m].
    pub extent: f64,
}

impl NodeTree {
    /// Builds the hierarchy of a shape by halving along the longest extent.
    pub fn new(shape: &Shape) -> NodeTree {
        let area: f64 = shape.nodes().iter().map(|n| n.area).sum();
        let spacing = (area / shape.nodes().len().max(1) as f64).sqrt();
        let nodes = surface_patches(shape, spacing);
        let extent = nodes.iter().map(|n| n.extent).fold(0.0, f64::max);
        let mut tree = NodeTree { nodes, clusters: Vec::new(), spacing, extent };
        if !tree.nodes.is_empty() {
            tree.split(0, tree.nodes.len());
        }
        tree
    }

    fn split(&mut self, from: usize, to: usize) {
        let nodes = &mut self.nodes[from..to];
        let start = nodes[0].position;
        let (lower, upper) = nodes.iter().fold((start, start), |(lower, upper), n| {
            (lower.min(n.position), upper.max(n.position))
        });
        let centre = 0.5 * (lower + upper);
        let radius = nodes.iter().map(|n| n.position.distance(centre)).fold(0.0, f64::max);
        let index = self.clusters.len();
        self.clusters.push(NodeCluster {
            centre,
            radius,
            nodes: (from as u32, to as u32),
            skip: 0,
        });
        if to - from > LEAF {
            let extent = upper - lower;
            let axis =
                (0..3).fold(0, |best, axis| if extent[axis] > extent[best] { axis } else { best });
            nodes.sort_by(|a, b| a.position[axis].total_cmp(&b.position[axis]));
            let middle = from + (to - from) / 2;
            self.split(from, middle);
            self.split(middle, to);
        }
        self.clusters[index].skip = self.clusters.len() as u32;
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_bound_their_nodes_and_leaves_cover_each_node_once() {
        let shape = Shape::sphere(1.0, 1000);
        let tree = NodeTree::new(&shape);
        let mut seen = 0;
        for (index, cluster) in tree.clusters.iter().enumerate() {
            let run = &tree.nodes[cluster.nodes.0 as usize..cluster.nodes.1 as usize];
            assert!(
                run.iter()
                    .all(|n| n.position.distance(cluster.centre) <= cluster.radius * (1.0 + 1e-12))
            );
            if cluster.is_leaf(index) {
                assert_eq!(cluster.nodes.0, seen);
                seen = cluster.nodes.1;
            }
        }
        assert_eq!(seen as usize, shape.nodes().len());
    }
}
