//! Surfaces of the grains for VTK files.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{DMat3, DVec3};
use grainwake_formats::vtp::Surface;
use grainwake_shape::Shape;
use grainwake_solver::dem::Grain;
use grainwake_solver::sim::Simulation;

/// Largest number of triangles in one file; finer surfaces are simplified.
pub(super) const MAX_TRIANGLES: usize = 400_000;
/// Cubes across the diameter whose points a simplified surface merges: with many grains, and with
/// few.
const MERGED_CELLS: [f64; 2] = [10.0, 24.0];
/// Points of a simplified surface over its area in faces of the cubes (rocks 1.35, spheres 1.2).
pub(super) const MERGED_PER_SQUARE: f64 = 1.3;
/// Weight of the mean of the merged points, next to the planes of their triangles.
const MEAN_WEIGHT: f64 = 1e-3;

/// Returns the edge of the cubes whose points a simplified surface of one of `grains` grains merges
/// [m]: as small as the largest number of triangles allows, within limits.
pub(super) fn merged_edge(shape: &Shape, grains: usize) -> f64 {
    let diameter = shape.equivalent_diameter();
    // A closed surface has twice as many triangles as points.
    let at_one = 2.0 * MERGED_PER_SQUARE * shape.surface_area() / diameter.powi(2);
    let allowed = (MAX_TRIANGLES as f64 / grains as f64 / at_one).sqrt();
    diameter / allowed.clamp(MERGED_CELLS[0], MERGED_CELLS[1])
}

/// Closed surface in the body frame.
#[derive(Clone, Debug)]
struct BodySurface {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

/// Surfaces of the grains of a run, built once for each shape.
pub(super) struct Surfaces {
    by_grain: Vec<Arc<BodySurface>>,
}

impl Surfaces {
    /// Builds the surfaces of these grains.
    pub fn new(grains: &[Grain]) -> Surfaces {
        let mut known: Vec<(*const Shape, Arc<BodySurface>)> = Vec::new();
        let mut by_grain = Vec::with_capacity(grains.len());
        for grain in grains {
            let key = Arc::as_ptr(&grain.shape);
            let surface = match known.iter().find(|(shape, _)| *shape == key) {
                Some((_, surface)) => surface.clone(),
                None => {
                    let (points, triangles) = grain.shape.surface_mesh();
                    let mut surface = BodySurface { points, triangles };
                    if surface.triangles.len() * grains.len() > MAX_TRIANGLES {
                        surface = surface.simplified(merged_edge(&grain.shape, grains.len()));
                    }
                    let surface = Arc::new(surface);
                    known.push((key, surface.clone()));
                    surface
                }
            };
            by_grain.push(surface);
        }
        Surfaces { by_grain }
    }

    /// Returns the surfaces at the poses of the grains, with their velocities [m/s].
    pub fn at(&self, sim: &Simulation) -> Surface {
        let mut surface = Surface { time: Some(sim.time()), ..Surface::default() };
        let (mut velocity, mut owners) = (Vec::new(), Vec::new());
        let all = sim.grains().iter().zip(&self.by_grain).enumerate();
        for (index, (grain, body)) in all.filter(|(_, (grain, _))| !grain.has_left()) {
            let (first, moves) = (surface.points.len(), sim.grain_velocity(index));
            for point in &body.points {
                let point = grain.pose.to_space(*point);
                surface.points.push(point);
                velocity.push(moves.at(point - grain.pose.position));
            }
            let shifted = |triangle: &[u32; 3]| triangle.map(|corner| first + corner as usize);
            surface.triangles.extend(body.triangles.iter().map(shifted));
            owners.resize(surface.triangles.len(), index);
        }
        surface.velocity = Some(velocity);
        surface.grains = Some(owners);
        surface
    }
}

impl BodySurface {
    /// Merges the points of each cube of edge `cell` [m] where the planes of their triangles meet,
    /// which keeps edges and corners; triangles that collapse disappear.
    fn simplified(&self, cell: f64) -> BodySurface {
        let mut indices = BTreeMap::new();
        let mut clusters: Vec<Cluster> = Vec::new();
        let mut cluster_of = |point: &DVec3| {
            let key = (*point / cell).floor().to_array().map(|c| c as i64);
            let index = *indices.entry(key).or_insert_with(|| {
                clusters.push(Cluster::default());
                clusters.len() - 1
            });
            clusters[index].sum += *point;
            clusters[index].count += 1.0;
            index as u32
        };
        let clusters_of_points: Vec<u32> = self.points.iter().map(&mut cluster_of).collect();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.points[i as usize]);
            let area = 0.5 * (b - a).cross(c - a);
            for corner in triangle {
                clusters[clusters_of_points[*corner as usize] as usize].add_plane(a, area);
            }
        }
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        let mut seen = BTreeSet::new();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| clusters_of_points[i as usize]);
            // Rotated so that the smallest index is first, which keeps the orientation.
            let key = if a <= b && a <= c {
                [a, b, c]
            } else if b <= c {
                [b, c, a]
            } else {
                [c, a, b]
            };
            if a != b && b != c && c != a && seen.insert(key) {
                triangles.push(key);
            }
        }
        BodySurface { points: clusters.iter().map(|c| c.point(cell)).collect(), triangles }
    }
}

/// Points that become one, with the planes of their triangles.
#[derive(Clone, Copy, Debug, Default)]
struct Cluster {
    /// Sum and number of the points.
    sum: DVec3,
    count: f64,
    /// Sum of a n n^T over the planes with area a [m^2] and unit normal n.
    normals: DMat3,
    /// Sum of a n (n . x) with a point x of the plane [m^3].
    offsets: DVec3,
}

impl Cluster {
    /// Adds the plane through `x` [m] with the area vector `area` [m^2].
    fn add_plane(&mut self, x: DVec3, area: DVec3) {
        let normal = area.normalize_or_zero();
        let weighted = DMat3::from_cols(area * normal.x, area * normal.y, area * normal.z);
        self.normals += weighted;
        self.offsets += area * normal.dot(x);
    }

    /// Returns the point nearest to the planes in the least squares [m], or the mean of the points
    /// if that is farther away than `cell` [m].
    fn point(&self, cell: f64) -> DVec3 {
        let mean = self.sum / self.count;
        let trace = (0..3).map(|axis| self.normals.col(axis)[axis]).sum::<f64>();
        let matrix = self.normals + DMat3::from_diagonal(DVec3::splat(MEAN_WEIGHT * trace));
        let shift = matrix.inverse() * (self.offsets - self.normals * mean);
        if shift.is_finite() && shift.length() < cell { mean + shift } else { mean }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cylinder of radius and half height 1 along x keeps its rims.
    #[test]
    fn simplification_keeps_sharp_edges() {
        use grainwake_shape::{ShapeOptions, analytic};
        let options = ShapeOptions { roundness: false, ..ShapeOptions::default() };
        let shape = analytic::cylinder(1.0, 2.0, &options).unwrap();
        let (points, triangles) = shape.surface_mesh();
        let simple = BodySurface { points, triangles }.simplified(merged_edge(&shape, 12));
        let count = simple.triangles.len();
        assert!(12 * count < MAX_TRIANGLES && count > 3000, "{count}");
        let (mut off, mut rims) = (0.0_f64, vec![f64::INFINITY; 48]);
        for point in &simple.points {
            let (across, along) = (point.y.hypot(point.z) - 1.0, point.x.abs() - 1.0);
            off = off.max(across.max(along).abs());
            let sector = ((point.z.atan2(point.y) / std::f64::consts::TAU + 0.5) * 23.999) as usize;
            let rim = &mut rims[sector + if point.x > 0.0 { 24 } else { 0 }];
            *rim = rim.min(across.hypot(along));
        }
        let farthest = rims.iter().copied().fold(0.0, f64::max);
        println!("{count} triangles, {off:.4} off the surface, {farthest:.4} from the rim");
        assert!(off < 0.02, "{off} off the surface");
        assert!(farthest < 0.02, "{farthest} from the rim");
    }

    #[test]
    fn simplification_keeps_the_volume() {
        let (points, triangles) = Shape::sphere(1.0, 100).surface_mesh();
        let simple = BodySurface { points, triangles }.simplified(0.2);
        let count = simple.triangles.len();
        assert!((200..2500).contains(&count), "{count}");
        let volume: f64 = (simple.triangles.iter())
            .map(|triangle| {
                let [a, b, c] = triangle.map(|i| simple.points[i as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((volume / exact - 1.0).abs() < 0.05, "{volume}");
    }
}
