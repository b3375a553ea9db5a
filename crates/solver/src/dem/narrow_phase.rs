//! Overlap of a pair: the nodes of each in the field of the other (Eqs 7-8), and the deepest point.

use glam::{DMat3, DVec3};
use grainwake_shape::Shape;

use super::deepest::{Probe, slide};
use super::node_tree::NodeTree;
use super::target::Target;

/// Nodes of the second grain carry this bit in their code.
const SECOND: u32 = 1 << 31;
/// Code of the deepest point, which is no node, before `SECOND` is added.
const DEEPEST: u32 = SECOND - 1;

/// The deepest point weighs as much as this many nodes of the same depth: it carries the contact
/// where the nodes do not resolve it, and counts for nothing where they do.
const DEEPEST_NODES: f64 = 4.0;
/// Iterations in the search of the deepest point.
const ITERATIONS: usize = 10;

/// A grain (or an image of it) as the contact law sees it.
#[derive(Clone, Copy)]
pub(super) struct Body<'a> {
    /// Shape.
    pub shape: &'a Shape,
    /// Its nodes in blobs.
    pub tree: &'a NodeTree,
    /// Body -> space.
    pub rotation: DMat3,
    /// Centroid [m].
    pub position: DVec3,
}

/// One penetrating point of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Which node; ascending within a pair.
    pub code: u32,
    /// Depth [m], positive.
    pub depth: f64,
    /// Area it stands for [m^2].
    pub area: f64,
    /// Arm from the centroid of the first grain, space frame [m].
    pub arm: DVec3,
    /// Unit normal out of the first grain, into its partner, space frame (Eq. 8).
    pub normal: DVec3,
}

/// The closest point found: the touch it would be, with the signed gap in place of the depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Closest {
    /// Surface distance [m], negative where overlapping.
    pub gap: f64,
    /// Arm from the centroid of the first grain, space frame [m].
    pub arm: DVec3,
    /// Unit normal out of the first grain.
    pub normal: DVec3,
}

/// Tests the nodes of `owner` against `target`: penetrating ones go to `emit`; returns the closest
/// point of the surface if it is nearer than `reach` [m].
fn scan(
    owner: &Body,
    target: &Target,
    reach: f64,
    mut emit: impl FnMut(u32, f64, Probe),
) -> Option<Probe> {
    let tree = owner.tree;
    let near = tree.spacing.max(reach);
    let mut best = (near, None);
    let mut index = 0;
    while let Some(blob) = tree.blobs.get(index) {
        if target.is_beyond(blob.center, blob.radius, near) {
            index = blob.skip as usize;
            continue;
        }
        if blob.is_leaf(index) {
            for code in blob.nodes.0..blob.nodes.1 {
                let node = &tree.nodes[code as usize];
                let distance = target.distance(node.position);
                if distance < best.0 {
                    best = (distance, Some(node.position));
                }
                if distance < 0.0
                    && let Some(probe) = Probe::at(target, node.position)
                {
                    emit(code, node.area, probe);
                }
            }
        }
        index += 1;
    }
    let start = Probe::at(target, best.1?)?;
    let closest = slide(
        owner.shape,
        target,
        start,
        tree.spacing,
        1e-5 * tree.spacing,
        ITERATIONS,
    );
    if closest.distance < 0.0 {
        emit(
            DEEPEST,
            DEEPEST_NODES * tree.spacing * tree.spacing,
            closest,
        );
    }
    (closest.distance < reach).then_some(closest)
}

fn nearer(a: Option<Closest>, b: Option<Closest>) -> Option<Closest> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.gap < a.gap { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// Fills `touches` with the penetrating points of two grains, in ascending code; returns the
/// closest point if the surfaces are nearer than `reach` [m].
pub(super) fn grain_grain(
    a: &Body,
    b: &Body,
    reach: f64,
    touches: &mut Vec<Touch>,
) -> Option<Closest> {
    touches.clear();
    let apart = a.position - b.position;
    let limit = a.shape.bounding_radius() + b.shape.bounding_radius() + reach;
    if apart.length_squared() > limit * limit {
        return None;
    }
    let to_b = b.rotation.transpose();
    let turn = to_b * a.rotation;
    let in_b = Target::Shape {
        shape: b.shape,
        turn,
        shift: to_b * apart,
    };
    let first = scan(a, &in_b, reach, |code, area, probe| {
        let (arm, normal) = (a.rotation * probe.x, -(a.rotation * probe.normal));
        touches.push(Touch {
            code,
            depth: -probe.distance,
            area,
            arm,
            normal,
        });
    });
    let first = first.map(|p| Closest {
        gap: p.distance,
        arm: a.rotation * p.x,
        normal: -(a.rotation * p.normal),
    });
    let in_a = Target::Shape {
        shape: a.shape,
        turn: turn.transpose(),
        shift: -(a.rotation.transpose() * apart),
    };
    let second = scan(b, &in_a, reach, |code, area, probe| {
        let (arm, normal) = (b.rotation * probe.x - apart, b.rotation * probe.normal);
        touches.push(Touch {
            code: code | SECOND,
            depth: -probe.distance,
            area,
            arm,
            normal,
        });
    });
    let second = second.map(|p| Closest {
        gap: p.distance,
        arm: b.rotation * p.x - apart,
        normal: b.rotation * p.normal,
    });
    nearer(first, second)
}

/// As [`grain_grain`] for a wall with normal `inward` at the distance `offset` [m] from the centroid.
pub(super) fn grain_wall(
    a: &Body,
    inward: DVec3,
    offset: f64,
    reach: f64,
    touches: &mut Vec<Touch>,
) -> Option<Closest> {
    touches.clear();
    if offset > a.shape.bounding_radius() + reach {
        return None;
    }
    let target = Target::HalfSpace {
        normal: a.rotation.transpose() * inward,
        offset,
    };
    let closest = scan(a, &target, reach, |code, area, probe| {
        let arm = a.rotation * probe.x;
        touches.push(Touch {
            code,
            depth: -probe.distance,
            area,
            arm,
            normal: -inward,
        });
    });
    closest.map(|p| Closest {
        gap: p.distance,
        arm: a.rotation * p.x,
        normal: -inward,
    })
}
