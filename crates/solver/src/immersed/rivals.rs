//! Grains that may hold the same faces: others nearby, and periodic images.

use glam::DVec3;

use super::near::{NearShape, NearShapes};
use super::places::Unknowns;
use crate::dem::{Ball, BroadPhase, Enclosure, Grain, Partner};
use crate::grid::Mesh;

/// Distances that differ by less than this part of the size of both grains are equal, being found in single
/// precision: of two copies of a link across a periodic edge, and of a link as far from both, just one must count.
const TIE: f64 = 1e-6;

/// Another grain nearby, or an image of the grain itself.
pub struct Rival<'a> {
    pub grain: &'a Grain,
    pub shape: &'a NearShape,
    /// From the grain to the image in question [m].
    pub shift: DVec3,
    /// Added to its distance [m], so that it has the faces as far from both or has not.
    pub handicap: f64,
}

impl Rival<'_> {
    /// Distance of `x` from its surface [m] where that is at most `limit`, else that or infinity.
    #[inline(always)]
    pub fn distance(&self, x: DVec3, limit: f64) -> f64 {
        self.distance_and_gradient(x, limit).0
    }

    /// The same with the gradient in its own frame.
    #[inline(always)]
    pub fn distance_and_gradient(&self, x: DVec3, limit: f64) -> (f64, DVec3) {
        let (pose, x) = (&self.grain.pose, x - self.shift);
        let far = self.grain.shape.bounding_radius() + limit;
        if x.distance_squared(pose.position) > far * far {
            return (f64::INFINITY, DVec3::ZERO);
        }
        self.shape.distance_and_gradient(pose.to_body(x))
    }
}

/// Which grains, and periodic images of them and of the grain itself, each grain may have to share faces with.
#[derive(Default)]
pub struct Neighbours {
    search: BroadPhase,
    balls: Vec<Ball>,
    reach: f64,
    /// In the order of the grains.
    found: Vec<Neighbour>,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Neighbour {
    grain: usize,
    other: usize,
    /// How many periods the other one stands from its own position, along z first.
    image: [i32; 3],
}

impl Neighbours {
    /// Finds those whose bands may meet; faces matter up to `reach` [m] from a surface. Grain i came `travel(i)`
    /// [m], and what it may have met on the way counts.
    pub fn find(
        &mut self,
        mesh: &Mesh,
        unknowns: &Unknowns,
        reach: f64,
        grains: &[Grain],
        travel: impl Fn(usize) -> f64,
    ) {
        let enclosure = Enclosure {
            lower: mesh.origin,
            upper: mesh.upper(),
            periodic: [0, 1, 2].map(|axis| unknowns.is_periodic(axis) && mesh.cells[axis] > 1),
            solid: [[false; 2]; 3],
        };
        self.reach = reach;
        self.balls.clear();
        let balls = grains.iter().enumerate().map(|(index, grain)| Ball {
            center: grain.pose.position,
            radius: grain.shape.bounding_radius() + reach + travel(index),
        });
        self.balls.extend(balls);
        self.search.search(&self.balls, &enclosure);
        self.found.clear();
        for pair in &self.search.pairs {
            let Partner::Grain(other) = pair.partner else {
                continue;
            };
            let (grain, [x, y, z]) = (pair.grain as usize, pair.image.to_array());
            for (grain, other, sign) in [(grain, other, 1), (other, grain, -1)] {
                let image = [z, y, x].map(|periods| sign * periods);
                self.found.push(Neighbour {
                    grain,
                    other,
                    image,
                });
            }
        }
        self.found.sort_unstable();
    }

    /// Whether grain `index` has none.
    pub fn has_none(&self, index: usize) -> bool {
        let first = self.found.partition_point(|one| one.grain < index);
        self.found.get(first).is_none_or(|one| one.grain != index)
    }

    /// Those of grain `index`.
    pub fn of<'a>(
        &self,
        index: usize,
        mesh: &Mesh,
        shapes: &'a NearShapes,
        grains: &'a [Grain],
    ) -> Vec<Rival<'a>> {
        let first = self.found.partition_point(|one| one.grain < index);
        let own = self.found[first..].iter();
        let size = |index: usize| grains[index].shape.bounding_radius() + self.reach;
        let rivals = own.take_while(|one| one.grain == index).map(|one| {
            let [z, y, x] = one.image;
            let tie = TIE * (size(index) + size(one.other));
            Rival {
                grain: &grains[one.other],
                shape: shapes.of(one.other),
                shift: DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * mesh.extent(),
                handicap: match one.other == index {
                    true if [x, y, z] > [0; 3] => -tie,
                    false if one.other < index => -tie,
                    _ => tie,
                },
            }
        });
        rivals.collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DQuat;
    use grainwake_shape::{Shape, ShapeOptions, analytic};

    use super::*;
    use crate::dem::Dof;
    use crate::flow::{Boundaries, Boundary};
    use crate::grid::FACE_OFFSET;
    use crate::immersed::Scheme;
    use crate::immersed::forced::Forced;
    use crate::immersed::locate::{Body, Found, Locator};
    use crate::immersed::measure::Scratch;
    use crate::math::Pose;

    #[test]
    fn neighbours_see_each_other_across_an_edge_and_share_its_faces() {
        let mesh = Mesh {
            cells: [32, 16, 16],
            spacing: DVec3::splat(0.25),
            origin: DVec3::new(-1.0, 0.0, 0.0),
        };
        let boundaries = Boundaries([[Boundary::Periodic; 2]; 3]);
        let unknowns = Unknowns::new(&mesh, &boundaries);
        let shape = Arc::new(Shape::sphere(0.5, 100));
        // The first and the last 1.1 apart across x; the second has none near but its own images along y.
        let at = |x: f64| Grain {
            shape: shape.clone(),
            density: 2.0,
            pose: Pose {
                position: DVec3::new(x, 2.0, 2.0),
                orientation: DQuat::IDENTITY,
            },
            velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            translation: Dof::Free,
            rotation: Dof::Free,
        };
        let grains = [at(-0.5), at(3.0), at(6.4)];
        let shapes = NearShapes::new(&grains, 0.25, 0.6);
        let mut neighbours = Neighbours::default();
        let found = |neighbours: &Neighbours, index| -> Vec<(DVec3, f64)> {
            let rivals = neighbours.of(index, &mesh, &shapes, &grains);
            rivals
                .iter()
                .map(|rival| (rival.shift, rival.handicap))
                .collect()
        };
        neighbours.find(&mesh, &unknowns, 0.6, &grains, |_| 0.0);
        let tie = 2.2 * TIE;
        let along_x = DVec3::new(8.0, 0.0, 0.0);
        assert_eq!(found(&neighbours, 0), [(-along_x, tie)]);
        assert_eq!(found(&neighbours, 1), []);
        assert_eq!(found(&neighbours, 2), [(along_x, -tie)]);
        assert_eq!(
            [0, 1, 2].map(|index| neighbours.has_none(index)),
            [false, true, false]
        );
        // The second is 3.4 from the third, both with balls of 1.1, and came from 1.25 away.
        neighbours.find(&mesh, &unknowns, 0.6, &grains, |index| {
            [0.0, 1.25, 0.0][index]
        });
        assert!(!neighbours.has_none(1));
        let others = found(&neighbours, 1).into_iter();
        let others = others.filter(|(shift, _)| *shift == DVec3::ZERO);
        assert_eq!(others.count(), 1, "the others are images of its own");
        assert_eq!(found(&neighbours, 0), [(-along_x, tie)]);
        // With a reach of more than half a period every grain meets its own images too.
        neighbours.find(&mesh, &unknowns, 1.6, &grains[1..2], |_| 0.0);
        let tie = 4.2 * TIE;
        let along_y = DVec3::new(0.0, 4.0, 0.0);
        let along_z = DVec3::new(0.0, 0.0, 4.0);
        let own = [
            (-along_z, tie),
            (-along_y, tie),
            (along_y, -tie),
            (along_z, -tie),
        ];
        let rivals = neighbours.of(0, &mesh, &shapes, &grains[1..2]);
        let rivals: Vec<_> = rivals
            .iter()
            .map(|rival| (rival.shift, rival.handicap))
            .collect();
        assert_eq!(rivals, own);
    }

    #[test]
    fn every_face_near_two_grains_is_of_one_of_them() {
        let mesh = Mesh {
            cells: [40, 24, 24],
            spacing: DVec3::splat(0.1),
            origin: DVec3::ZERO,
        };
        let boundaries = Boundaries([[Boundary::WALL; 2]; 3]);
        let options = ShapeOptions::default();
        let shape = Arc::new(analytic::ellipsoid(0.4, 0.35, 0.3, &options).unwrap());
        // Faces in the middle between them are as far from both.
        let at = |x: f64| Grain {
            shape: shape.clone(),
            density: 2.0,
            pose: Pose {
                position: DVec3::new(x, 1.2, 1.2),
                orientation: DQuat::IDENTITY,
            },
            velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            translation: Dof::Free,
            rotation: Dof::Free,
        };
        let grains = [at(1.55), at(2.45)];
        let mut locator = Locator::new(&mesh, &boundaries, Scheme::Aperture, 0.01, &grains);
        locator.find_neighbours(&grains, |_| 0.0);
        let mut owners = [0, 1, 2].map(|_| vec![0; mesh.layout().len()]);
        let mut between = 0;
        for index in 0..2 {
            let (mut body, mut forced) = (Body::default(), Forced::default());
            let found = Found {
                body: &mut body,
                forced: &mut forced,
            };
            locator.locate(
                &grains,
                index,
                0.01,
                found,
                &mut Scratch::default(),
                |_, _| {},
            );
            for (component, rows) in body.rows.iter().enumerate() {
                for (row, n) in rows
                    .iter()
                    .flat_map(|row| (0..row.count).map(move |n| (row, n)))
                {
                    let owned = body.distance[component][row.first + n].is_finite();
                    owners[component][row.at + n] += i32::from(owned);
                }
            }
        }
        for (component, owners) in owners.iter().enumerate() {
            let [row, plane] = [mesh.layout().row(), mesh.layout().plane()];
            for (at, owners) in owners.iter().enumerate() {
                let cell = [at % row, at % plane / row, at / plane].map(|n| n as f64 - 1.0);
                let offset = DVec3::from_array(FACE_OFFSET[component]);
                let x = mesh.spacing * (DVec3::from_array(cell) + offset);
                let [one, other] = grains
                    .each_ref()
                    .map(|grain| grain.shape.distance(grain.pose.to_body(x)));
                if one.min(other) < 0.2 {
                    between += i32::from((one - other).abs() < 1e-9);
                    assert_eq!(*owners, 1, "component {component} at {x}");
                }
            }
        }
        assert!(between > 20, "{between}");
    }
}
