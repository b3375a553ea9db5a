//! Surfaces of the grains for VTK files.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::DVec3;
use grainwake_formats::vtp::Surface;
use grainwake_shape::Shape;
use grainwake_solver::dem::Grain;
use grainwake_solver::sim::Simulation;

/// Largest number of triangles in one file; finer surfaces are simplified.
pub(super) const MAX_TRIANGLES: usize = 400_000;
/// Cubes across the diameter whose points a simplified surface merges.
pub(super) const MERGED_CELLS: f64 = 10.0;

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
                        surface =
                            surface.simplified(grain.shape.equivalent_diameter() / MERGED_CELLS);
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
    /// Merges the points of each cube of edge `cell` [m]; triangles that collapse disappear.
    fn simplified(&self, cell: f64) -> BodySurface {
        let mut clusters = BTreeMap::new();
        let mut sums: Vec<(DVec3, f64)> = Vec::new();
        let mut cluster_of = |point: &DVec3| {
            let key = (*point / cell).floor().to_array().map(|c| c as i64);
            let index = *clusters.entry(key).or_insert_with(|| {
                sums.push((DVec3::ZERO, 0.0));
                sums.len() - 1
            });
            sums[index].0 += *point;
            sums[index].1 += 1.0;
            index as u32
        };
        let clusters_of_points: Vec<u32> = self.points.iter().map(&mut cluster_of).collect();
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
        BodySurface { points: sums.iter().map(|(sum, n)| *sum / *n).collect(), triangles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
