//! Overlap of a pair: the nodes of each in the field of the other (Eqs 7-8), and the deepest point.

use glam::{DMat3, DVec3};
use grainwake_shape::Shape;

use super::deepest::{Probe, project, slide};
use super::node_tree::NodeTree;
use super::target::Target;

/// Nodes of the second grain carry this bit in their code.
const SECOND: u32 = 1 << 31;
/// Code of the deepest point, which is no node, before `SECOND` is added. A node has twice its
/// index, its mirror point one more.
const DEEPEST: u32 = SECOND - 1;

/// The deepest point weighs as much as this many nodes of the same depth: it carries the contact
/// where no node has entered yet, and counts for little where many have.
const DEEPEST_NODES: f64 = 1.0;
/// Iterations in the search of the deepest point.
const ITERATIONS: usize = 10;
/// A mirror point counts if the surface is within this part of its distance from the deepest point.
const MIRROR_MISS: f64 = 0.3;
/// A patch with more nodes than this is resolved and goes without mirror points.
const RESOLVED: usize = 128;
/// Nodes are looked for up to this many spacings, to know how long a pair stays apart.
const LOOK_AHEAD: f64 = 3.0;
/// No point of a surface is further than this many spacings from a node.
const BETWEEN_NODES: f64 = 1.2;

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

/// A penetrating point in the frame of the grain whose surface it lies on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    code: u32,
    area: f64,
    probe: Probe,
}

/// What the nodes of one grain see of a target.
struct Scan {
    /// No point of the surface is nearer than this [m].
    bound: f64,
    /// The closest point, if it is nearer than asked.
    closest: Option<Probe>,
}

/// The nearest node so far; of equally near ones the first.
struct Nearest {
    distance: f64,
    node: Option<u32>,
}

impl Nearest {
    fn offer(&mut self, distance: f64, number: u32) {
        let tied = distance == self.distance && self.node.is_some_and(|node| number < node);
        if distance < self.distance || tied {
            *self = Nearest {
                distance,
                node: Some(number),
            };
        }
    }
}

/// Tests the nodes of `owner` against `target`: penetrating ones go to `found`, in ascending code;
/// looks for the closest point of the surface where it may be nearer than `reach` [m].
///
/// `seed` is the nearest node of the last look, if any: it only saves work.
fn scan(
    owner: &Body,
    target: &Target,
    reach: f64,
    seed: &mut Option<u32>,
    found: &mut Vec<Found>,
) -> Scan {
    found.clear();
    let tree = owner.tree;
    let near = tree.spacing.max(reach);
    let mut best = Nearest {
        distance: LOOK_AHEAD * near,
        node: None,
    };
    if let Some((number, node)) = seed.and_then(|n| Some((n, tree.nodes.get(n as usize)?))) {
        best.offer(target.distance(node.position), number);
    }
    let mut index = 0;
    while let Some(blob) = tree.blobs.get(index) {
        // Only penetrating nodes and those nearer than the nearest so far matter.
        if target.is_beyond(blob.center, blob.radius, best.distance.max(0.0)) {
            index = blob.skip as usize;
            continue;
        }
        if blob.is_leaf(index) {
            for number in blob.nodes.0..blob.nodes.1 {
                let node = &tree.nodes[number as usize];
                let limit = best.distance.max(0.0);
                let Some(distance) = target.distance_within(node.position, limit) else {
                    continue;
                };
                best.offer(distance, number);
                if distance < 0.0
                    && let Some(probe) = Probe::at(target, node.position)
                {
                    found.push(Found {
                        code: 2 * number,
                        area: node.area,
                        probe,
                    });
                }
            }
        }
        index += 1;
    }
    *seed = best.node;
    let bound = best.distance - BETWEEN_NODES * tree.spacing;
    let start = best
        .node
        .filter(|_| best.distance < near)
        .and_then(|number| Probe::at(target, tree.nodes[number as usize].position));
    let Some(start) = start else {
        return Scan {
            bound,
            closest: None,
        };
    };
    let tolerance = 1e-5 * tree.spacing;
    let closest = slide(
        owner.shape,
        target,
        start,
        tree.spacing,
        tolerance,
        ITERATIONS,
    );
    if closest.distance < 0.0 {
        if found.len() <= RESOLVED {
            mirror(owner.shape, target, closest.x, found);
        }
        let area = DEEPEST_NODES * tree.spacing * tree.spacing;
        found.push(Found {
            code: DEEPEST,
            area,
            probe: closest,
        });
    }
    Scan {
        bound,
        closest: (closest.distance < reach).then_some(closest),
    }
}

/// Shares the area of each node with its mirror image in the deepest point, where the surface goes
/// on there and touches as well.
///
/// A contact patch holds few nodes, and their centroid is off the patch's own by a good part of
/// their spacing, which turns the force and gives it a lever. Sampling a patch and its mirror image
/// alike removes that error where the patch is symmetric, and changes nothing on average elsewhere.
fn mirror(surface: &Shape, target: &Target, center: DVec3, found: &mut Vec<Found>) {
    let (_, gradient) = surface.distance_and_gradient(center);
    let axis = gradient.normalize_or_zero();
    for index in 0..found.len() {
        let node = found[index];
        let away = node.probe.x - center;
        // Half a turn about the normal: on a surface of revolution it stays on the surface.
        let image = center + 2.0 * away.dot(axis) * axis - away;
        let x = project(surface, image);
        let missed =
            x.distance_squared(image) > (MIRROR_MISS * MIRROR_MISS) * away.length_squared();
        let Some(probe) = Probe::at(target, x).filter(|p| !missed && p.distance < 0.0) else {
            continue;
        };
        // In full where it is as deep as the node; nothing when it just touches, to stay continuous.
        let part = 0.5 * (probe.distance / node.probe.distance).min(1.0);
        found[index].area = (1.0 - part) * node.area;
        found.push(Found {
            code: node.code + 1,
            area: part * node.area,
            probe,
        });
    }
    found.sort_unstable_by_key(|point| point.code);
}

fn nearer(a: Option<Closest>, b: Option<Closest>) -> Option<Closest> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.gap < a.gap { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// Buffers of the narrow phase and its result.
#[derive(Clone, Debug, Default)]
pub(super) struct Patch {
    /// Penetrating points of the pair, in ascending code.
    pub touches: Vec<Touch>,
    /// The surfaces are at least this far apart [m]; not positive where that is unknown.
    pub apart: f64,
    /// Nearest node of either grain at the last look.
    seeds: [Option<u32>; 2],
    found: Vec<Found>,
}

impl Patch {
    /// Forgets what earlier looks found out about where the pair is near.
    pub fn forget(&mut self) {
        self.apart = 0.0;
        self.seeds = [None; 2];
    }

    fn take(&mut self, second: u32, place: impl Fn(&Probe) -> (DVec3, DVec3)) {
        self.touches.extend(self.found.iter().map(|point| {
            let (arm, normal) = place(&point.probe);
            let (code, depth) = (point.code | second, -point.probe.distance);
            Touch {
                code,
                depth,
                area: point.area,
                arm,
                normal,
            }
        }));
    }

    /// Collects the penetrating points of two grains; returns the closest point if the surfaces are
    /// nearer than `reach` [m].
    pub fn of_grains(&mut self, a: &Body, b: &Body, reach: f64) -> Option<Closest> {
        self.touches.clear();
        let apart = a.position - b.position;
        self.apart = apart.length() - a.shape.bounding_radius() - b.shape.bounding_radius() - reach;
        if self.apart > 0.0 {
            return None;
        }
        let to_b = b.rotation.transpose();
        let turn = to_b * a.rotation;
        let in_b = Target::grain(b.shape, turn, to_b * apart);
        let first = scan(a, &in_b, reach, &mut self.seeds[0], &mut self.found);
        let place = |p: &Probe| (a.rotation * p.x, -(a.rotation * p.normal));
        let nearest = first.closest.map(|p| closest(&p, place(&p)));
        self.take(0, place);
        let shift = -(a.rotation.transpose() * apart);
        let in_a = Target::grain(a.shape, turn.transpose(), shift);
        let second = scan(b, &in_a, reach, &mut self.seeds[1], &mut self.found);
        let place = |p: &Probe| (b.rotation * p.x - apart, b.rotation * p.normal);
        let other = second.closest.map(|p| closest(&p, place(&p)));
        self.take(SECOND, place);
        self.apart = if self.touches.is_empty() {
            first.bound.max(second.bound) - reach
        } else {
            0.0
        };
        nearer(nearest, other)
    }

    /// The same for a wall with normal `inward` at the distance `offset` [m] from the centroid.
    pub fn of_wall(&mut self, a: &Body, inward: DVec3, offset: f64, reach: f64) -> Option<Closest> {
        self.touches.clear();
        self.apart = offset - a.shape.bounding_radius() - reach;
        if self.apart > 0.0 {
            return None;
        }
        let target = Target::HalfSpace {
            normal: a.rotation.transpose() * inward,
            offset,
        };
        let result = scan(a, &target, reach, &mut self.seeds[0], &mut self.found);
        let place = |p: &Probe| (a.rotation * p.x, -inward);
        self.take(0, place);
        self.apart = if self.touches.is_empty() {
            result.bound - reach
        } else {
            0.0
        };
        result.closest.map(|p| closest(&p, place(&p)))
    }
}

fn closest(probe: &Probe, (arm, normal): (DVec3, DVec3)) -> Closest {
    Closest {
        gap: probe.distance,
        arm,
        normal,
    }
}
