//! Surface nodes of a shape in blobs with bounding spheres, so that far nodes are never tested.

use glam::DVec3;
use grainwake_shape::{Shape, SurfaceNode};

/// Nodes of a blob that is not split further.
const LEAF: usize = 8;

/// A ball that holds a run of nodes, stored in depth-first order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blob {
    /// Centre, principal frame [m].
    pub center: DVec3,
    /// Radius [m].
    pub radius: f64,
    /// First node of the run and the node behind its last.
    pub nodes: (u32, u32),
    /// The blob to go on with when this one is skipped.
    pub skip: u32,
}

impl Blob {
    /// Whether the nodes are to be tested one by one here.
    pub fn is_leaf(&self, index: usize) -> bool {
        self.skip as usize == index + 1
    }
}

/// Nodes in blob order.
#[derive(Clone, Debug)]
pub(super) struct NodeTree {
    /// The nodes, near ones together.
    pub nodes: Vec<SurfaceNode>,
    /// Blobs in depth-first order.
    pub blobs: Vec<Blob>,
    /// Typical distance of neighbouring nodes: the root of the mean node area [m].
    pub spacing: f64,
}

impl NodeTree {
    /// Sorts the nodes of a shape.
    pub fn new(shape: &Shape) -> NodeTree {
        let nodes = shape.nodes().to_vec();
        let area: f64 = nodes.iter().map(|n| n.area).sum();
        let spacing = (area / nodes.len().max(1) as f64).sqrt();
        let mut tree = NodeTree {
            nodes,
            blobs: Vec::new(),
            spacing,
        };
        if !tree.nodes.is_empty() {
            tree.split(0, tree.nodes.len());
        }
        tree
    }

    fn split(&mut self, from: usize, to: usize) {
        let run = &mut self.nodes[from..to];
        let start = run[0].position;
        let (lower, upper) = run.iter().fold((start, start), |(lo, up), n| {
            (lo.min(n.position), up.max(n.position))
        });
        let center = 0.5 * (lower + upper);
        let radius = run
            .iter()
            .map(|n| n.position.distance(center))
            .fold(0.0, f64::max);
        let index = self.blobs.len();
        self.blobs.push(Blob {
            center,
            radius,
            nodes: (from as u32, to as u32),
            skip: 0,
        });
        if to - from > LEAF {
            let extent = upper - lower;
            let axis = (0..3).fold(0, |best, axis| {
                if extent[axis] > extent[best] {
                    axis
                } else {
                    best
                }
            });
            run.sort_by(|a, b| a.position[axis].total_cmp(&b.position[axis]));
            let middle = from + (to - from) / 2;
            self.split(from, middle);
            self.split(middle, to);
        }
        self.blobs[index].skip = self.blobs.len() as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blobs_hold_their_nodes_and_leaves_cover_all_of_them_once() {
        let shape = Shape::sphere(1.0, 1000);
        let tree = NodeTree::new(&shape);
        let mut seen = 0;
        for (index, blob) in tree.blobs.iter().enumerate() {
            let run = &tree.nodes[blob.nodes.0 as usize..blob.nodes.1 as usize];
            assert!(
                run.iter()
                    .all(|n| n.position.distance(blob.center) <= blob.radius * (1.0 + 1e-12))
            );
            if blob.is_leaf(index) {
                assert_eq!(blob.nodes.0, seen);
                seen = blob.nodes.1;
            }
        }
        assert_eq!(seen as usize, shape.nodes().len());
    }
}
