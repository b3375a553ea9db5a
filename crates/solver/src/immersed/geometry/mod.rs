//! Geometry of grains on the grid: neighbours that share faces, boxes of cells, distances and lists
//! of faces.
//!
//! [`Locator`] fills the lists (`lists.rs`) by `distances.rs`, with the distances of
//! `narrow_band.rs` and `samples.rs`. `sampling.rs` is their set-up; `aperture.rs` gives the
//! aperture of a face or link.

pub mod aperture;
mod distances;
mod lists;
mod narrow_band;
mod samples;
mod sampling;

pub use distances::LocateScratch;
pub use lists::{BandFaces, FaceRow, FaceRun, LocatedBody, PAD, SharedFace};
pub use narrow_band::{NarrowBandShapes, NeighbourGrain, load_all};
pub use sampling::narrow_band_bytes;

use crate::dem::{BoundingSphere, BroadPhase, Enclosure, Grain, Partner};
use crate::grid::Mesh;
use distances::FillLists;
use glam::DVec3;
use grainwake_simd::dispatch;

/// Fraction of the size of two grains below which their distances from a face count as equal, since
/// distances are in single precision. Exactly one of two grains, or of two periodic images, at
/// equal distance from a face must be the nearest.
const TIE: f64 = 1e-6;

/// Geometry of all grains on one grid.
pub struct Locator {
    mesh: Mesh,
    periodic: [bool; 3],
    /// Half-width of the band around the surface [m].
    pub eps: f64,
    /// Distance from the surface up to which a grain affects faces [m].
    pub reach: f64,
    /// Narrow-band shapes of the grains.
    pub shapes: NarrowBandShapes,
    search: BroadPhase,
    spheres: Vec<BoundingSphere>,
    /// Both directions of all pairs: grain, other grain, and periods between the image of the
    /// other grain and its own position, along z first. Sorted in this order.
    pairs: Vec<(usize, usize, [i32; 3])>,
    /// Neighbours of grain 0, then of grain 1, ...
    neighbours: Vec<NeighbourGrain>,
    /// Entry of the first neighbour of each grain; one entry more at the end.
    first_neighbour: Vec<usize>,
}

impl Locator {
    /// Finds the neighbours of all grains, those whose spheres overlap, before [`Locator::locate`].
    /// A sphere contains all faces within reach of the surface of grain i, and `displacement(i)`
    /// [m] extends it to the last pose of the grain, whose faces count as well; 0 if they do not.
    pub fn find_neighbours(&mut self, grains: &[Grain], displacement: impl Fn(usize) -> f64) {
        let mesh = &self.mesh;
        let enclosure = Enclosure {
            lower: mesh.origin,
            upper: mesh.upper(),
            periodic: [0, 1, 2].map(|axis| self.periodic[axis] && mesh.is_resolved(axis)),
            sides: Default::default(),
        };
        let size = |grain: &Grain| grain.shape.bounding_radius() + self.reach;
        self.spheres.clear();
        let spheres = grains.iter().enumerate().map(|(index, grain)| BoundingSphere {
            centre: grain.pose.position,
            radius: size(grain) + displacement(index),
        });
        self.spheres.extend(spheres);
        self.search.search(&self.spheres, &enclosure);
        self.pairs.clear();
        for pair in &self.search.pairs {
            let Partner::Grain(other) = pair.partner else {
                continue;
            };
            let (grain, [x, y, z]) = (pair.grain as usize, pair.image);
            for (grain, other, sign) in [(grain, other, 1), (other, grain, -1)] {
                self.pairs.push((grain, other, [z, y, x].map(|periods| sign * periods)));
            }
        }
        self.pairs.sort_unstable();
        self.neighbours.clear();
        self.first_neighbour.clear();
        for &(index, other, [z, y, x]) in &self.pairs {
            let (entry, grain) = (self.neighbours.len(), &grains[other]);
            self.first_neighbour.resize(self.first_neighbour.len().max(index + 1), entry);
            let tie = TIE * (size(&grains[index]) + size(grain));
            self.neighbours.push(NeighbourGrain {
                grain: other,
                pose: grain.pose,
                bounding_radius: grain.shape.bounding_radius(),
                shift: DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * mesh.extent(),
                tie_breaker: match other == index {
                    true if [x, y, z] > [0; 3] => -tie,
                    false if other < index => -tie,
                    _ => tie,
                },
            });
        }
        self.first_neighbour.resize(grains.len() + 1, self.neighbours.len());
    }

    /// Neighbours of grain `index`, sorted by index and image.
    pub fn neighbours(&self, index: usize) -> &[NeighbourGrain] {
        &self.neighbours[self.first_neighbour[index]..self.first_neighbour[index + 1]]
    }

    /// Locates grain `index`: lists the faces within reach in `body`, and those in the forcing band
    /// in `runs`, with their distances and normals in `scratch.band`.
    pub fn locate(
        &self,
        index: usize,
        grain: &Grain,
        body: &mut LocatedBody,
        runs: &mut [Vec<FaceRun>; 3],
        scratch: &mut LocateScratch,
    ) {
        body.position = grain.pose.position;
        self.set_box(grain, body);
        dispatch(FillLists { locator: self, index, grain, body, runs, scratch });
    }

    /// Sets the box of cells around a grain.
    fn set_box(&self, grain: &Grain, body: &mut LocatedBody) {
        let mesh = &self.mesh;
        let [middle, span] = grain.shape.turned_box(grain.pose.orientation);
        let middle = grain.pose.position + middle;
        for axis in 0..3 {
            let (h, n) = (mesh.spacing[axis], mesh.cells[axis] as i32);
            if n == 1 {
                (body.lowest[axis], body.size[axis]) = (1, 1);
                continue;
            }
            // Limited so that positions do not overflow in an unstable run before it is stopped.
            let cell = |x: f64| ((x - mesh.origin[axis]) / h).floor().clamp(-1e9, 1e9) as i32;
            let from = cell(middle[axis] - span[axis] - self.reach);
            let to = cell(middle[axis] + span[axis] + self.reach);
            body.lowest[axis] = from + 1;
            body.size[axis] = to + 2 - body.lowest[axis];
        }
        body.index_map.fill(mesh, self.periodic, body.lowest, body.size);
        body.planes = body.index_map.plane_range();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::{Boundaries, Boundary};
    use grainwake_shape::Shape;
    use std::sync::Arc;

    #[test]
    fn neighbours_are_found_across_periodic_edges() {
        let mesh = Mesh {
            cells: [32, 16, 16],
            spacing: DVec3::splat(0.25),
            origin: DVec3::new(-1.0, 0.0, 0.0),
        };
        let shape = Arc::new(Shape::sphere(0.5, 100));
        // The first and the last are 1.1 apart across x; the second has no neighbours.
        let at = |x: f64| Grain::new(shape.clone(), 2.0).with_position(DVec3::new(x, 2.0, 2.0));
        let grains = [at(-0.5), at(3.0), at(6.4)];
        let periodic = Boundaries([[Boundary::Periodic; 2]; 3]);
        let mut locator = Locator { reach: 0.6, ..Locator::new(&mesh, &periodic, &grains) };
        let found = |locator: &Locator, index| -> Vec<(DVec3, f64)> {
            let neighbours = locator.neighbours(index).iter();
            neighbours.map(|n| (n.shift, n.tie_breaker)).collect()
        };
        locator.find_neighbours(&grains, |_| 0.0);
        let tie = 2.2 * TIE;
        let along_x = DVec3::new(8.0, 0.0, 0.0);
        assert_eq!(found(&locator, 0), [(-along_x, tie)]);
        assert_eq!(found(&locator, 1), []);
        assert_eq!(found(&locator, 2), [(along_x, -tie)]);
        assert_eq!(
            [0, 1, 2].map(|index| locator.neighbours(index).is_empty()),
            [false, true, false]
        );
        // The second is 3.4 from the third, both with a reach of 1.1, and moved by 1.25.
        locator.find_neighbours(&grains, |index| [0.0, 1.25, 0.0][index]);
        assert!(!locator.neighbours(1).is_empty());
        let others = found(&locator, 1).into_iter();
        let others = others.filter(|(shift, _)| *shift == DVec3::ZERO);
        assert_eq!(others.count(), 1, "the others are its own images");
        assert_eq!(found(&locator, 0), [(-along_x, tie)]);
        // With a reach of more than half a period a grain neighbours its own images.
        locator.reach = 1.6;
        locator.find_neighbours(&grains[1..2], |_| 0.0);
        let tie = 4.2 * TIE;
        let along_y = DVec3::new(0.0, 4.0, 0.0);
        let along_z = DVec3::new(0.0, 0.0, 4.0);
        let images = [(-along_z, tie), (-along_y, tie), (along_y, -tie), (along_z, -tie)];
        assert_eq!(found(&locator, 0), images);
    }
}
