//! Patches of a surface at which it touches others, and their hierarchy. `patch_layout.rs` and
//! `patch_tree.rs` build them in the first step with a shape.
//!
//! In another grain a patch counts with its middle. On a wall it has arcs of circles where the
//! surface is convex and smooth, so that a rounded grain rolls smoothly. Patches are fixed to the
//! grain: their overlaps are functions of the poses (`docs/decisions/0026-energy-of-a-contact.md`).

use glam::{DMat3, DVec3};
use grainwake_shape::Shape;

use super::surface::{PartnerField, SurfacePoint};

/// Patch of a surface, principal frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct SurfacePatch {
    /// Point of the surface in the middle [m].
    pub position: DVec3,
    /// Area that the patch represents [m^2].
    pub area: f64,
    /// Bound of the distance of a point of the patch from the middle [m]; zero for a point.
    pub extent: f64,
    /// Outward unit normal.
    pub(super) normal: DVec3,
    /// Arcs of the patch along the principal directions of curvature.
    pub(super) arcs: [Arc; 2],
}

/// Convex arc of a circle; a point if its radius is zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    /// Unit vector along the arc in its middle.
    pub axis: DVec3,
    /// Radius [m].
    pub radius: f64,
    /// Sine of the angle between the middle and the ends.
    pub sine: f64,
}

impl SurfacePatch {
    /// Lower bound of the distance from `partner` [m], or infinity beyond `reach` [m].
    pub(super) fn distance_within(&self, partner: &PartnerField, reach: f64) -> f64 {
        let extent = if partner.is_wall() { self.extent } else { 0.0 };
        partner.distance_within(self.position, reach + extent) - extent
    }

    /// Deepest point in a wall; in a grain, whose surface is curved too, the middle of the patch.
    pub(super) fn deepest_point(&self, partner: &PartnerField) -> Option<SurfacePoint> {
        let mut position = self.position;
        if let PartnerField::HalfSpace { normal, .. } = partner {
            let facing = -normal.dot(self.normal);
            for arc in self.arcs.iter().filter(|arc| arc.radius > 0.0 && facing > 0.0) {
                // The arc is parallel to the wall at this sine.
                let slope = -normal.dot(arc.axis) / facing;
                let sine = (slope / slope.hypot(1.0)).clamp(-arc.sine, arc.sine);
                let fall = 1.0 - (1.0 - sine * sine).sqrt();
                position += arc.radius * (sine * arc.axis - fall * self.normal);
            }
        }
        SurfacePoint::at(partner, position)
    }
}

/// Bounding sphere of the positions of a range of patches.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct PatchCluster {
    /// Centre, principal frame [m].
    pub centre: DVec3,
    /// Radius [m].
    pub radius: f64,
    /// Range of patches: first, and one past the last.
    pub patches: (u32, u32),
    /// Index of the next cluster in depth-first order outside this subtree.
    pub skip: u32,
}

impl PatchCluster {
    /// Returns true if this cluster, at `index`, has no sub-clusters.
    pub fn is_leaf(&self, index: usize) -> bool {
        self.skip as usize == index + 1
    }
}

/// Patches and clusters of one shape.
#[derive(Clone, Debug)]
pub(in crate::dem) struct PatchTree {
    /// Patches at the nodes and at further points of the surface, in the order of the leaves.
    pub patches: Vec<SurfacePatch>,
    /// Clusters in depth-first order.
    pub clusters: Vec<PatchCluster>,
    /// Spacing of the shape's nodes: square root of their mean area [m].
    pub spacing: f64,
    /// Largest extent of a patch [m].
    pub extent: f64,
}

/// Shape of a grain, or of a periodic image, at its pose.
#[derive(Clone, Copy)]
pub(in crate::dem) struct PosedShape<'a> {
    /// Shape.
    pub shape: &'a Shape,
    /// Hierarchy of its surface patches.
    pub tree: &'a PatchTree,
    /// Rotation from the principal frame to the space frame.
    pub rotation: DMat3,
    /// Centroid [m].
    pub position: DVec3,
}
