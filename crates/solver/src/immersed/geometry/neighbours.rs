//! Neighbouring grains, which may force the same faces: other grains and periodic images.

use glam::DVec3;

use super::index_map::UnknownFaces;
use super::narrow_band::NarrowBandShapes;
use crate::dem::{BoundingSphere, BroadPhase, Enclosure, Grain, Partner};
use crate::grid::Mesh;
use crate::math::Pose;

/// Fraction of the size of two grains below which their distances from a face count as equal, since
/// distances are in single precision. Exactly one of two grains, or of two periodic images, at
/// equal distance from a face must be the nearest.
const TIE: f64 = 1e-6;

/// A neighbouring grain, or a periodic image of the grain itself.
#[derive(Clone, Copy, Debug)]
pub struct NeighbourGrain {
    /// Index of the neighbour.
    pub grain: usize,
    /// Pose of the grain itself, without the shift.
    pub pose: Pose,
    bounding_radius: f64,
    /// Vector from the grain to its image [m].
    pub shift: DVec3,
    /// Added to the distance [m], so that both grains of a pair decide a tie alike.
    pub tie_breaker: f64,
}

impl NeighbourGrain {
    /// Signed distance from `x` to the surface of the neighbour [m], and its gradient in the frame
    /// of the neighbour. A distance above `limit` [m] may be returned as infinity.
    #[inline(always)]
    pub fn distance_and_gradient(
        &self,
        shapes: &NarrowBandShapes,
        x: DVec3,
        limit: f64,
    ) -> (f64, DVec3) {
        let x = x - self.shift;
        let far = self.bounding_radius + limit;
        if x.distance_squared(self.pose.position) > far * far {
            return (f64::INFINITY, DVec3::ZERO);
        }
        let shape = shapes.of(self.grain);
        shape.distance_and_gradient(self.pose.to_body(x))
    }
}

/// Smallest distance from `x` to a neighbour, tie breaker included [m]; infinite beyond `limit`
/// [m].
pub fn nearest_distance(
    neighbours: &[NeighbourGrain],
    shapes: &NarrowBandShapes,
    x: DVec3,
    limit: f64,
) -> f64 {
    let distances = neighbours
        .iter()
        .map(|other| other.distance_and_gradient(shapes, x, limit).0 + other.tie_breaker);
    distances.fold(f64::INFINITY, f64::min)
}

/// Lists of the neighbours of all grains, found with the broad phase of the contact search.
#[derive(Default)]
pub struct NeighbourSearch {
    search: BroadPhase,
    spheres: Vec<BoundingSphere>,
    pairs: Vec<NeighbourPair>,
    /// Neighbours of grain 0, then of grain 1, ...
    neighbours: Vec<NeighbourGrain>,
    /// Entry of the first neighbour of each grain; one entry more at the end.
    first: Vec<usize>,
}

/// One direction of a pair, in the order of the lists.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct NeighbourPair {
    grain: usize,
    other: usize,
    /// Periods between the image of the other grain and its own position, along z first.
    image: [i32; 3],
}

impl NeighbourSearch {
    /// Finds the pairs whose spheres overlap. A sphere contains all faces within `reach` [m] of the
    /// surface of grain i, and `displacement(i)` [m] extends it to the last pose of the grain.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        unknown_faces: &UnknownFaces,
        reach: f64,
        grains: &[Grain],
        displacement: impl Fn(usize) -> f64,
    ) {
        let enclosure = Enclosure {
            lower: mesh.origin,
            upper: mesh.upper(),
            periodic: [0, 1, 2]
                .map(|axis| unknown_faces.is_periodic(axis) && mesh.is_resolved(axis)),
            solid: [[false; 2]; 3],
        };
        self.spheres.clear();
        let spheres = grains.iter().enumerate().map(|(index, grain)| BoundingSphere {
            centre: grain.pose.position,
            radius: grain.shape.bounding_radius() + reach + displacement(index),
        });
        self.spheres.extend(spheres);
        self.search.search(&self.spheres, &enclosure);
        self.pairs.clear();
        for pair in &self.search.pairs {
            let Partner::Grain(other) = pair.partner else {
                continue;
            };
            let (grain, [x, y, z]) = (pair.grain as usize, pair.image.to_array());
            for (grain, other, sign) in [(grain, other, 1), (other, grain, -1)] {
                let image = [z, y, x].map(|periods| sign * periods);
                self.pairs.push(NeighbourPair { grain, other, image });
            }
        }
        self.pairs.sort_unstable();
        self.list(mesh, reach, grains);
    }

    /// Fills the list of neighbours from the sorted pairs.
    fn list(&mut self, mesh: &Mesh, reach: f64, grains: &[Grain]) {
        self.neighbours.clear();
        self.first.clear();
        let size = |index: usize| grains[index].shape.bounding_radius() + reach;
        for &NeighbourPair { grain: index, other, image: [z, y, x] } in &self.pairs {
            let entry = self.neighbours.len();
            self.first.resize(self.first.len().max(index + 1), entry);
            let tie = TIE * (size(index) + size(other));
            self.neighbours.push(NeighbourGrain {
                grain: other,
                pose: grains[other].pose,
                bounding_radius: grains[other].shape.bounding_radius(),
                shift: DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * mesh.extent(),
                tie_breaker: match other == index {
                    true if [x, y, z] > [0; 3] => -tie,
                    false if other < index => -tie,
                    _ => tie,
                },
            });
        }
        self.first.resize(grains.len() + 1, self.neighbours.len());
    }

    /// Neighbours of grain `index`, sorted by index and image.
    pub fn of(&self, index: usize) -> &[NeighbourGrain] {
        &self.neighbours[self.first[index]..self.first[index + 1]]
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use grainwake_shape::Shape;

    use super::*;
    use crate::flow::{Boundaries, Boundary};

    #[test]
    fn neighbours_are_found_across_periodic_edges() {
        let mesh = Mesh {
            cells: [32, 16, 16],
            spacing: DVec3::splat(0.25),
            origin: DVec3::new(-1.0, 0.0, 0.0),
        };
        let boundaries = Boundaries([[Boundary::Periodic; 2]; 3]);
        let unknown_faces = UnknownFaces::new(&mesh, &boundaries);
        let shape = Arc::new(Shape::sphere(0.5, 100));
        // The first and the last are 1.1 apart across x; the second has no neighbours.
        let at = |x: f64| Grain::new(shape.clone(), 2.0).with_position(DVec3::new(x, 2.0, 2.0));
        let grains = [at(-0.5), at(3.0), at(6.4)];
        let mut search = NeighbourSearch::default();
        let found = |search: &NeighbourSearch, index| -> Vec<(DVec3, f64)> {
            let neighbours = search.of(index).iter();
            neighbours.map(|n| (n.shift, n.tie_breaker)).collect()
        };
        search.update(&mesh, &unknown_faces, 0.6, &grains, |_| 0.0);
        let tie = 2.2 * TIE;
        let along_x = DVec3::new(8.0, 0.0, 0.0);
        assert_eq!(found(&search, 0), [(-along_x, tie)]);
        assert_eq!(found(&search, 1), []);
        assert_eq!(found(&search, 2), [(along_x, -tie)]);
        assert_eq!([0, 1, 2].map(|index| search.of(index).is_empty()), [false, true, false]);
        // The second is 3.4 from the third, both with a reach of 1.1, and moved by 1.25.
        search.update(&mesh, &unknown_faces, 0.6, &grains, |index| [0.0, 1.25, 0.0][index]);
        assert!(!search.of(1).is_empty());
        let others = found(&search, 1).into_iter();
        let others = others.filter(|(shift, _)| *shift == DVec3::ZERO);
        assert_eq!(others.count(), 1, "the others are its own images");
        assert_eq!(found(&search, 0), [(-along_x, tie)]);
        // With a reach of more than half a period a grain neighbours its own images.
        search.update(&mesh, &unknown_faces, 1.6, &grains[1..2], |_| 0.0);
        let tie = 4.2 * TIE;
        let along_y = DVec3::new(0.0, 4.0, 0.0);
        let along_z = DVec3::new(0.0, 0.0, 4.0);
        let images = [(-along_z, tie), (-along_y, tie), (along_y, -tie), (along_z, -tie)];
        assert_eq!(found(&search, 0), images);
    }
}
