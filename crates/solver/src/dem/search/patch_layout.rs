//! Positions and arcs of the patches of a sampled surface, found in the first step with a shape:
//! one patch around each node of the shape, and further ones where the surface is strongly curved
//! between the nodes.

use std::collections::HashMap;

use glam::{DVec3, IVec3};
use grainwake_shape::{Field, SampledField, Shape, SurfaceNode};

use super::patches::{Arc, SurfacePatch};

/// Height of the surface above the chord of two points at their least distance [diameters].
const SAGITTA: f64 = 8e-4;
/// Least distance between two points [sample spacings].
const LEAST_DISTANCE: f64 = 0.5;
/// Largest distance of the nodes over that of two points; bounds the number of points.
const MOST_REFINEMENT: f64 = 16.0;
/// Half width of a patch over the distance between neighbouring points.
const HALF_WIDTH: f64 = 0.75;
/// Largest sine of the angle between the middle and the end of an arc.
const LARGEST_SINE: f64 = 0.2;
/// Least radius of an arc [sample spacings].
const LEAST_RADIUS: f64 = 12.0;
/// Largest radius of an arc [diameters].
const LARGEST_RADIUS: f64 = 3.0;
/// Largest relative difference between the curvature of a patch and that of either half.
const TOLERANCE: f64 = 0.1;

impl SurfacePatch {
    /// A point.
    fn point(node: &SurfaceNode) -> SurfacePatch {
        let arc = Arc { axis: DVec3::X, radius: 0.0, sine: 0.0 };
        let SurfaceNode { position, area } = *node;
        SurfacePatch { position, area, extent: 0.0, normal: DVec3::X, arcs: [arc; 2] }
    }

    /// Patch around a point of `field` with neighbours at `distance` [m]; arcs have at most the
    /// radius `largest` [m].
    fn new(node: &SurfaceNode, field: &SampledField, distance: f64, largest: f64) -> SurfacePatch {
        let step = (0.5 * distance).max(field.spacing());
        // Differences over a sample spacing or more are smoother than the interpolated gradient.
        let unit = |x: DVec3| {
            let along = |d: DVec3| field.distance(x + step * d) - field.distance(x - step * d);
            DVec3::from_array(DVec3::AXES.map(along)).normalize_or_zero()
        };
        let Some(normal) = unit(node.position).try_normalize() else {
            return SurfacePatch::point(node);
        };
        // Change of the normal per distance, over one side.
        let turn = |d: DVec3| (unit(node.position + step * d) - normal) / step;
        let (u, v) = normal.any_orthonormal_pair();
        let (along_u, along_v) = (0.5 * (turn(u) - turn(-u)), 0.5 * (turn(v) - turn(-v)));
        // The eigenvectors of the curvature tensor (a b; b c) are the principal directions.
        let (a, c) = (along_u.dot(u), along_v.dot(v));
        let b = 0.5 * (along_u.dot(v) + along_v.dot(u));
        let (sine, cosine) = (0.5 * (2.0 * b).atan2(a - c)).sin_cos();
        let (mean, half) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
        let arc = |axis: DVec3, curvature: f64| {
            let alike = |turned: f64| (turned - curvature).abs() < TOLERANCE * curvature;
            // An arc fits where the surface bends alike on both sides.
            let fits = alike(turn(axis).dot(axis)) && alike(-turn(-axis).dot(axis));
            let radius = 1.0 / curvature;
            let is_resolved = (LEAST_RADIUS * field.spacing()..largest).contains(&radius);
            let radius = if fits && is_resolved { radius } else { 0.0 };
            Arc { axis, radius, sine: (HALF_WIDTH * distance * curvature).min(LARGEST_SINE) }
        };
        let arcs =
            [arc(cosine * u + sine * v, mean + half), arc(cosine * v - sine * u, mean - half)];
        // The chord of an arc is longer than its sine by at most 1 %.
        let [first, second] = arcs.map(|arc| 1.01 * arc.radius * arc.sine);
        SurfacePatch { extent: first.hypot(second), normal, arcs, ..SurfacePatch::point(node) }
    }
}

/// Returns the patches around the shape's nodes, then the further ones. Each node shares its area
/// equally with the further points of which it is the nearest node. `node_spacing` is the mean
/// spacing of the nodes [m].
pub(super) fn surface_patches(shape: &Shape, node_spacing: f64) -> Vec<SurfacePatch> {
    let mut points = shape.nodes().to_vec();
    let Field::Sampled(field) = shape.field() else {
        return points.iter().map(SurfacePatch::point).collect();
    };
    let sagitta = SAGITTA * shape.equivalent_diameter();
    let least = (LEAST_DISTANCE * field.spacing()).max(node_spacing / MOST_REFINEMENT);
    let mut candidates: Vec<(f64, DVec3)> = zero_crossings(field)
        .map(|position| {
            let distance = (8.0 * sagitta / curvature(field, position)).sqrt();
            (distance.max(least), position)
        })
        .filter(|(distance, _)| *distance < node_spacing)
        .collect();
    // Edges and corners come first.
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let cell = |x: DVec3| (x / node_spacing).floor().as_ivec3();
    let mut cells: HashMap<IVec3, Vec<usize>> = HashMap::new();
    for (index, node) in points.iter().enumerate() {
        cells.entry(cell(node.position)).or_default().push(index);
    }
    let nodes = points.len();
    let mut nearest_nodes: Vec<usize> = (0..nodes).collect();
    let mut distances = vec![node_spacing; nodes];
    for (distance, position) in candidates {
        let (mut nearest, mut nearest_node) = (f64::INFINITY, (f64::INFINITY, None));
        for index in neighbours(cell(position)).filter_map(|cell| cells.get(&cell)).flatten() {
            let apart = points[*index].position.distance(position);
            nearest = nearest.min(apart);
            if *index < nodes && apart < nearest_node.0 {
                nearest_node = (apart, Some(*index));
            }
        }
        if let (_, Some(node)) = nearest_node
            && nearest >= distance
        {
            cells.entry(cell(position)).or_default().push(points.len());
            points.push(SurfaceNode { position, area: 0.0 });
            nearest_nodes.push(node);
            distances.push(distance);
        }
    }
    let mut shares = vec![0.0; nodes];
    nearest_nodes.iter().for_each(|node| shares[*node] += 1.0);
    for (point, node) in points.iter_mut().zip(&nearest_nodes) {
        point.area = shape.nodes()[*node].area / shares[*node];
    }
    let largest = LARGEST_RADIUS * shape.equivalent_diameter();
    let around =
        |(node, distance): (&SurfaceNode, &f64)| SurfacePatch::new(node, field, *distance, largest);
    points.iter().zip(&distances).map(around).collect()
}

/// A cell and the 26 around it.
fn neighbours(cell: IVec3) -> impl Iterator<Item = IVec3> {
    (0..27).map(move |n| cell + IVec3::new(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1))
}

/// Points at which the linear interpolant between two neighbouring samples is zero.
fn zero_crossings(field: &SampledField) -> impl Iterator<Item = DVec3> {
    let [nx, ny, nz] = field.dims();
    let levels = field.levels();
    let strides = [1, nx, nx * ny];
    let samples =
        (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
    samples.flat_map(move |sample| {
        let [i, j, k] = sample;
        let index = i + nx * (j + ny * k);
        let origin = DVec3::new(i as f64, j as f64, k as f64);
        (0..3).filter_map(move |axis| {
            if sample[axis] + 1 >= field.dims()[axis] {
                return None;
            }
            let here = f64::from(levels[index]);
            let there = f64::from(levels[index + strides[axis]]);
            let crosses = (here < 0.0) != (there < 0.0);
            crosses.then(|| {
                let along = DVec3::AXES[axis] * (here / (here - there));
                field.lower() + field.spacing() * (origin + along)
            })
        })
    })
}

/// Largest curvature of the level set through `x` [1/m], positive, over two sample spacings.
fn curvature(field: &SampledField, x: DVec3) -> f64 {
    let normal = |x: DVec3| field.distance_and_gradient(x).1.normalize_or_zero();
    let (u, v) = normal(x).try_normalize().unwrap_or(DVec3::Z).any_orthonormal_pair();
    let step = field.spacing();
    let directions = [u, v, (u + v).normalize(), (u - v).normalize()];
    let turns = directions.map(|d| (normal(x + step * d) - normal(x - step * d)).length());
    turns.into_iter().fold(0.0, f64::max) / (2.0 * step)
}

#[cfg(test)]
mod tests {
    use grainwake_shape::{ShapeOptions, analytic};

    use super::*;

    #[test]
    fn edges_and_corners_of_a_box_get_further_points_and_flat_faces_none() {
        let options = ShapeOptions::default();
        let shape = analytic::rounded_box(4.0, 3.0, 2.0, 0.2, &options).unwrap();
        let nodes = shape.nodes();
        let area: f64 = nodes.iter().map(|n| n.area).sum();
        let points = surface_patches(&shape, (area / nodes.len() as f64).sqrt());
        let shared: f64 = points.iter().map(|n| n.area).sum();
        assert!((shared / area - 1.0).abs() < 1e-12);
        assert_eq!(points[0].position, nodes[0].position);
        let half = DVec3::new(2.0, 1.5, 1.0);
        let further = &points[nodes.len()..];
        println!("{} nodes, {} further points", nodes.len(), further.len());
        let is_round = |p: &&SurfacePatch| {
            (p.position.abs() - (half - 0.2)).cmpgt(DVec3::splat(-0.15)).bitmask().count_ones() >= 2
        };
        assert!(further.len() > 100);
        assert!(points.iter().all(|p| p.extent == 0.0), "edges too sharp for arcs");
        assert_eq!(further.iter().filter(is_round).count(), further.len());
    }
}
