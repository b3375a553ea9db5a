//! Bounding-volume hierarchy of triangles for nearest-point queries.

use glam::DVec3;

/// Maximum number of triangles in a leaf.
const LEAF: usize = 4;

struct Node {
    lower: DVec3,
    upper: DVec3,
    /// Leaf: first triangle; branch: index of the right child (the left child follows the node).
    first: u32,
    /// Number of triangles in a leaf, 0 for a branch.
    count: u32,
}

/// Part of a triangle that contains the nearest point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Feature {
    /// The interior.
    Face,
    /// The edge between corners i and i + 1.
    Edge(u8),
    /// Corner i.
    Corner(u8),
}

/// The nearest point of the mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub point: DVec3,
    pub face: u32,
    pub feature: Feature,
}

/// Hierarchy with a copy of the triangles in leaf order.
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    corners: Vec<[DVec3; 3]>,
    faces: Vec<u32>,
}

impl Bvh {
    /// Builds the hierarchy of the triangles with these corners.
    pub(crate) fn new(triangles: &[[DVec3; 3]]) -> Bvh {
        let mut faces: Vec<u32> = (0..triangles.len() as u32).collect();
        let middle = |corners: &[DVec3; 3]| corners.iter().sum::<DVec3>() / 3.0;
        let centres: Vec<DVec3> = triangles.iter().map(middle).collect();
        let mut nodes = Vec::new();
        split(triangles, &centres, &mut faces, 0, &mut nodes);
        Bvh { nodes, corners: faces.iter().map(|f| triangles[*f as usize]).collect(), faces }
    }

    /// Returns the nearest point to `x` on triangle `n` in leaf order.
    fn on_leaf(&self, x: DVec3, n: u32) -> Nearest {
        let (point, feature) = nearest_on_triangle(x, &self.corners[n as usize]);
        Nearest { point, face: self.faces[n as usize], feature }
    }

    /// Calls `visit` with the index of every face with a bounding box that overlaps that of a
    /// triangle.
    pub(crate) fn overlapping(&self, triangle: &[DVec3; 3], mut visit: impl FnMut(u32)) {
        let lower = triangle[0].min(triangle[1]).min(triangle[2]);
        let upper = triangle[0].max(triangle[1]).max(triangle[2]);
        let mut stack = vec![0u32];
        while let Some(number) = stack.pop() {
            let node = &self.nodes[number as usize];
            if node.lower.cmpgt(upper).any() || node.upper.cmplt(lower).any() {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.first, number + 1]);
                continue;
            }
            let leaf = node.first as usize..(node.first + node.count) as usize;
            self.faces[leaf].iter().for_each(|face| visit(*face));
        }
    }

    /// Returns the nearest point of the mesh to `x`. The search starts from triangle `hint` (in
    /// leaf order) and sets it to the nearest triangle, a good start for a query nearby.
    pub(crate) fn nearest(&self, x: DVec3, hint: &mut u32) -> Nearest {
        let mut best = self.on_leaf(x, *hint);
        let mut bound = best.point.distance_squared(x);
        // The depth is about log2 of the triangle count: every split halves the list.
        let mut stack = [(0u32, 0.0f64); 64];
        stack[0] = (0, self.nodes[0].squared_distance(x));
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (number, distance) = stack[top];
            if distance >= bound {
                continue;
            }
            let node = &self.nodes[number as usize];
            if node.count > 0 {
                for n in node.first..node.first + node.count {
                    let candidate = self.on_leaf(x, n);
                    let distance = candidate.point.distance_squared(x);
                    if distance < bound {
                        (bound, *hint, best) = (distance, n, candidate);
                    }
                }
            } else {
                let (left, right) = (number + 1, node.first);
                let near = self.nodes[left as usize].squared_distance(x);
                let far = self.nodes[right as usize].squared_distance(x);
                let (first, second) = if near <= far {
                    ((left, near), (right, far))
                } else {
                    ((right, far), (left, near))
                };
                for entry in [second, first] {
                    if entry.1 < bound {
                        stack[top] = entry;
                        top += 1;
                    }
                }
            }
        }
        best
    }
}

impl Node {
    fn squared_distance(&self, x: DVec3) -> f64 {
        (self.lower - x).max(x - self.upper).max(DVec3::ZERO).length_squared()
    }
}

/// Builds the subtree of `faces` (starting at `first` in the complete list), halved along the
/// longest extent of the triangle centres.
fn split(
    triangles: &[[DVec3; 3]],
    centres: &[DVec3],
    faces: &mut [u32],
    first: usize,
    nodes: &mut Vec<Node>,
) {
    let (mut lower, mut upper) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for f in faces.iter() {
        for corner in triangles[*f as usize] {
            lower = lower.min(corner);
            upper = upper.max(corner);
        }
        low = low.min(centres[*f as usize]);
        high = high.max(centres[*f as usize]);
    }
    let number = nodes.len();
    nodes.push(Node { lower, upper, first: first as u32, count: faces.len() as u32 });
    if faces.len() <= LEAF {
        return;
    }
    let extent = high - low;
    let axis = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let half = faces.len() / 2;
    faces.select_nth_unstable_by(half, |a, b| {
        let (p, q) = (centres[*a as usize][axis], centres[*b as usize][axis]);
        p.total_cmp(&q).then(a.cmp(b))
    });
    let (left, right) = faces.split_at_mut(half);
    split(triangles, centres, left, first, nodes);
    nodes[number].first = nodes.len() as u32;
    nodes[number].count = 0;
    split(triangles, centres, right, first + half, nodes);
}

/// Returns the nearest point of a triangle (Ericson, Real-Time Collision Detection, section 5.1.5).
pub(crate) fn nearest_on_triangle(x: DVec3, [a, b, c]: &[DVec3; 3]) -> (DVec3, Feature) {
    let (ab, ac, ax) = (*b - *a, *c - *a, x - *a);
    let (d1, d2) = (ab.dot(ax), ac.dot(ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, Feature::Corner(0));
    }
    let bx = x - *b;
    let (d3, d4) = (ab.dot(bx), ac.dot(bx));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, Feature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (*a + ab * (d1 / (d1 - d3)), Feature::Edge(0));
    }
    let cx = x - *c;
    let (d5, d6) = (ab.dot(cx), ac.dot(cx));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, Feature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (*a + ac * (d2 / (d2 - d6)), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (*b + (*c - *b) * t, Feature::Edge(1));
    }
    let scale = 1.0 / (va + vb + vc);
    (*a + ab * (vb * scale) + ac * (vc * scale), Feature::Face)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hierarchy_agrees_with_brute_force() {
        let mesh = crate::triangles::cube_sphere(8, |u| u * (1.0 + 0.3 * (5.0 * u.x).sin() * u.y));
        let corners = mesh.faces();
        let bvh = Bvh::new(&corners);
        for i in 0..200 {
            let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
            let x = 4.0 * u.fract() - DVec3::splat(2.0);
            let brute = (0..corners.len())
                .map(|f| nearest_on_triangle(x, &corners[f]).0.distance(x))
                .fold(f64::INFINITY, f64::min);
            assert!((bvh.nearest(x, &mut 0).point.distance(x) - brute).abs() < 1e-14);
        }
    }

    #[test]
    fn every_region_of_a_triangle_is_found() {
        let t = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let at = |x, y| nearest_on_triangle(DVec3::new(x, y, 1.0), &t);
        assert_eq!(at(0.25, 0.25), (DVec3::new(0.25, 0.25, 0.0), Feature::Face));
        assert_eq!(at(-1.0, -1.0).1, Feature::Corner(0));
        assert_eq!(at(3.0, 0.0).1, Feature::Corner(1));
        assert_eq!(at(0.0, 3.0).1, Feature::Corner(2));
        assert_eq!(at(0.5, -1.0), (DVec3::new(0.5, 0.0, 0.0), Feature::Edge(0)));
        assert_eq!(at(1.0, 1.0), (DVec3::new(0.5, 0.5, 0.0), Feature::Edge(1)));
        assert_eq!(at(-1.0, 0.5), (DVec3::new(0.0, 0.5, 0.0), Feature::Edge(2)));
    }
}
