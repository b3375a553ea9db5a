//! Evenly distributed surface nodes with their areas.
//!
//! The surface is split into small samples. A Poisson-disc selection of samples initialises the
//! nodes; a few iterations of Lloyd's relaxation (each node moves to the centroid of its nearest
//! samples, then back onto the surface) even them out. The area of a node is that of its samples.

use crate::field::SampledField;
use crate::triangles::TriangleMesh;
use glam::DVec3;
use rayon::prelude::*;

/// A surface point with the area that it represents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceNode {
    /// Position in the principal frame [m].
    pub position: DVec3,
    /// Area represented by the node [m^2]; the areas add up to the surface area.
    pub area: f64,
}

/// Returns the unit vector of height `z` and number `n` on a spiral of golden angles: evenly spread
/// directions if `z` is.
pub(crate) fn golden_spiral(n: usize, z: f64) -> DVec3 {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let (sine, cosine) = (golden * n as f64).sin_cos();
    let ring = (1.0 - z * z).sqrt();
    DVec3::new(ring * cosine, ring * sine, z)
}

/// Approximate number of samples per node.
const SAMPLES_PER_NODE: f64 = 16.0;
/// Number of relaxation iterations.
const ROUNDS: usize = 8;

/// A small piece of the surface.
struct Sample {
    position: DVec3,
    normal: DVec3,
    area: f64,
}

/// Distributes about `count` nodes on the zero set of `field`, the triangulation of which is
/// `mesh`.
pub(crate) fn spread(field: &SampledField, mesh: &TriangleMesh, count: usize) -> Vec<SurfaceNode> {
    let samples = samples(mesh, mesh.area() / (SAMPLES_PER_NODE * count as f64));
    let area: f64 = samples.iter().map(|s| s.area).sum();
    let spacing = (area / count as f64).sqrt();
    let (lower, upper) = mesh.bounds();
    // The surface of the field bulges slightly beyond the mesh.
    let slack = DVec3::splat(field.spacing());
    let bounds = (lower - slack, upper + slack);
    let chosen = choose(&samples, bounds, spacing, count);
    let mut positions: Vec<DVec3> =
        chosen.iter().map(|s| project(field, samples[*s as usize].position)).collect();
    for _ in 0..ROUNDS {
        let owner = assign(field, &samples, &positions, bounds, spacing);
        let mut sums = vec![(DVec3::ZERO, 0.0); positions.len()];
        for (sample, owner) in samples.iter().zip(&owner) {
            let sum = &mut sums[*owner as usize];
            sum.0 += sample.area * sample.position;
            sum.1 += sample.area;
        }
        for (position, (sum, area)) in positions.iter_mut().zip(&sums) {
            if *area > 0.0 {
                *position = project(field, *sum / *area);
            }
        }
    }
    let owner = assign(field, &samples, &positions, bounds, spacing);
    let mut areas = vec![0.0; positions.len()];
    for (sample, owner) in samples.iter().zip(&owner) {
        areas[*owner as usize] += sample.area;
    }
    let nodes = positions.into_iter().zip(areas);
    nodes.map(|(position, area)| SurfaceNode { position, area }).filter(|n| n.area > 0.0).collect()
}

/// Projects the point onto the zero set along the gradient.
pub(crate) fn project(field: &SampledField, mut x: DVec3) -> DVec3 {
    for _ in 0..30 {
        let (value, gradient) = field.distance_and_gradient(x);
        let slope = gradient.length();
        if value.abs() <= 1e-9 * field.spacing() || slope == 0.0 {
            break;
        }
        // The step is limited to one cell, the range in which the gradient is accurate.
        let step = (value / slope).clamp(-field.spacing(), field.spacing());
        x -= step / slope * gradient;
    }
    x
}

/// Subdivides the triangles into four until none is larger than `largest`.
fn samples(mesh: &TriangleMesh, largest: f64) -> Vec<Sample> {
    let mut samples = Vec::new();
    for face in 0..mesh.triangles.len() {
        let corners = mesh.corners(face);
        let cross = mesh.twice_area(face);
        let normal = cross.normalize_or_zero();
        let area = 0.5 * cross.length();
        let levels = if area > largest { (area / largest).log(4.0).ceil() as u32 } else { 0 };
        let n = 1usize << levels.min(12);
        let share = area / (n * n) as f64;
        let at = |i: usize, j: usize, third: f64| {
            let (u, v) = ((i as f64 + third) / n as f64, (j as f64 + third) / n as f64);
            corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])
        };
        for i in 0..n {
            for j in 0..n - i {
                let inner = (i + j + 1 < n).then_some(2.0 / 3.0);
                for third in [1.0 / 3.0].into_iter().chain(inner) {
                    samples.push(Sample { position: at(i, j, third), normal, area: share });
                }
            }
        }
    }
    samples
}

/// Selects about `count` Poisson-disc samples; the disc radius is adjusted until the number fits.
fn choose(samples: &[Sample], bounds: (DVec3, DVec3), spacing: f64, count: usize) -> Vec<u32> {
    let order = shuffled(samples.len());
    let (mut low, mut high) = (0.55 * spacing, 0.95 * spacing);
    let mut best: Option<Vec<u32>> = None;
    for _ in 0..7 {
        let radius = 0.5 * (low + high);
        let chosen = discs(samples, &order, bounds, radius);
        if chosen.len() > count {
            low = radius;
        } else {
            high = radius;
        }
        let off = |c: &Vec<u32>| c.len().abs_diff(count);
        if best.as_ref().is_none_or(|b| off(&chosen) < off(b)) {
            best = Some(chosen);
        }
    }
    best.unwrap_or_default()
}

/// Selects samples in shuffled order, each at least `radius` from all selected before.
fn discs(samples: &[Sample], order: &[u32], bounds: (DVec3, DVec3), radius: f64) -> Vec<u32> {
    let mut grid = Buckets::new(bounds, radius);
    let mut kept = Vec::new();
    for &s in order {
        let sample = &samples[s as usize];
        let crowded = grid.any_around(sample.position, |k| {
            let other = &samples[k as usize];
            other.position.distance_squared(sample.position) < radius * radius
                && other.normal.dot(sample.normal) > -0.2
        });
        if !crowded {
            grid.insert(sample.position, s);
            kept.push(s);
        }
    }
    kept
}

/// Returns 0..n in an arbitrary but fixed order.
fn shuffled(n: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    // The linear congruential generator of Knuth's MMIX instead of `random`: the nodes of committed
    // grains depend on this order.
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    for i in (1..n).rev() {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let other = ((u128::from(state) * (i as u128 + 1)) >> 64) as usize;
        order.swap(i, other);
    }
    order
}

/// Assigns each sample to the nearest node on its side of the body.
fn assign(
    field: &SampledField,
    samples: &[Sample],
    positions: &[DVec3],
    bounds: (DVec3, DVec3),
    spacing: f64,
) -> Vec<u32> {
    let mut grid = Buckets::new(bounds, 1.2 * spacing);
    let normals: Vec<DVec3> = positions.iter().map(|x| field.distance_and_gradient(*x).1).collect();
    for (n, x) in positions.iter().enumerate() {
        grid.insert(*x, n as u32);
    }
    samples
        .par_iter()
        .map(|sample| {
            // Minimum of (behind, squared distance, index): a node behind the sample, on the far
            // side of a thin plate, ranks last.
            let least = |best: (bool, f64, u32), n: u32| {
                let squared = positions[n as usize].distance_squared(sample.position);
                if !best.0 && squared > best.1 {
                    return best;
                }
                let behind = normals[n as usize].dot(sample.normal) < -0.2;
                let score = (behind, squared, n);
                if score < best { score } else { best }
            };
            let mut best = (true, f64::INFINITY, NONE);
            grid.any_around(sample.position, |n| {
                best = least(best, n);
                false
            });
            if best.2 == NONE {
                best = (0..positions.len() as u32).fold(best, least);
            }
            best.2
        })
        .collect()
}

/// Points in cubic buckets over a box that contains the body.
struct Buckets {
    lower: DVec3,
    size: f64,
    dims: [usize; 3],
    /// Last point of each bucket as an index into `chain`, or [`NONE`].
    heads: Vec<u32>,
    /// All points, each with the preceding point of its bucket.
    chain: Vec<(u32, u32)>,
}

/// Index of no point.
const NONE: u32 = u32::MAX;

impl Buckets {
    fn new(bounds: (DVec3, DVec3), size: f64) -> Buckets {
        let lower = bounds.0 - DVec3::splat(size);
        let cells = (bounds.1 - lower) / size;
        let dims = cells.to_array().map(|n| n as usize + 2);
        Buckets { lower, size, dims, heads: vec![NONE; dims.iter().product()], chain: Vec::new() }
    }

    fn key(&self, x: DVec3) -> [usize; 3] {
        let s = ((x - self.lower) / self.size).to_array();
        // The outermost layer stays empty, so that every occupied bucket has all its neighbours.
        std::array::from_fn(|axis| (s[axis] as usize).clamp(1, self.dims[axis] - 2))
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.dims[0] * (j + self.dims[1] * k)
    }

    fn insert(&mut self, x: DVec3, item: u32) {
        let index = self.index(self.key(x));
        let head = &mut self.heads[index];
        self.chain.push((item, *head));
        *head = (self.chain.len() - 1) as u32;
    }

    /// Returns whether `matches` is true for any item in the bucket of `x` and its 26 neighbours,
    /// tested in a fixed order.
    fn any_around(&self, x: DVec3, mut matches: impl FnMut(u32) -> bool) -> bool {
        let [i, j, k] = self.key(x);
        for k in k - 1..=k + 1 {
            for j in j - 1..=j + 1 {
                let first = self.index([i - 1, j, k]);
                for head in &self.heads[first..first + 3] {
                    let mut at = *head;
                    while at != NONE {
                        let (item, next) = self.chain[at as usize];
                        if matches(item) {
                            return true;
                        }
                        at = next;
                    }
                }
            }
        }
        false
    }
}
