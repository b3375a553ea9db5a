//! Distance between the surfaces of two shapes.

use crate::Shape;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use serde::Serialize;

/// Surface distances of two shapes with coinciding centroids and principal axes, in the one of the
/// 24 axis permutations that minimises them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Rotation from the frame of the first shape to that of the second, as columns.
    pub turn: DMat3,
    /// Mean distance between the surfaces [m]; positive where the first lies outside the second.
    pub mean_distance_m: f64,
    /// Root-mean-square distance between the surfaces [m].
    pub rms_distance_m: f64,
    /// Largest distance between the surfaces [m] (Hausdorff distance of the surface nodes).
    pub largest_distance_m: f64,
}

impl Comparison {
    /// Compares two shapes by the distances of the surface nodes of each from the other.
    pub fn of(first: &Shape, second: &Shape) -> Comparison {
        turns()
            .into_par_iter()
            .map(|turn| Comparison::at(first, second, turn))
            .min_by(|p, q| p.rms_distance_m.total_cmp(&q.rms_distance_m))
            .expect("there are 24 turns")
    }

    fn at(first: &Shape, second: &Shape, turn: DMat3) -> Comparison {
        let back = turn.transpose();
        let there = first.nodes().iter().map(|n| second.distance(turn * n.position));
        let here = second.nodes().iter().map(|n| -first.distance(back * n.position));
        // Both shapes have half the weight, regardless of their node counts.
        let [mut mean, mut square, mut largest] = [0.0; 3];
        for (distances, count) in [
            (there.collect::<Vec<_>>(), first.nodes().len()),
            (here.collect(), second.nodes().len()),
        ] {
            for d in distances {
                mean += 0.5 * d / count as f64;
                square += 0.5 * d * d / count as f64;
                largest = f64::max(largest, d.abs());
            }
        }
        Comparison {
            turn,
            mean_distance_m: mean,
            rms_distance_m: square.sqrt(),
            largest_distance_m: largest,
        }
    }
}

/// Returns the 24 rotations of a cube onto itself.
fn turns() -> Vec<DMat3> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    let pairs = axes.iter().flat_map(|x| axes.iter().map(move |y| (*x, *y)));
    pairs
        .filter(|(x, y)| x.dot(*y) == 0.0)
        .map(|(x, y)| DMat3::from_cols(x, y, x.cross(y)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ShapeOptions;
    use crate::analytic::{ellipsoid, sphere};

    #[test]
    fn there_are_24_proper_turns() {
        let turns = turns();
        assert_eq!(turns.len(), 24);
        assert!(turns.iter().all(|t| t.determinant() == 1.0));
    }

    #[test]
    fn spheres_differ_by_their_radii() {
        let ball = |radius| sphere(radius, &ShapeOptions::default()).unwrap();
        let (large, small) = (ball(1.1e-3), ball(1e-3));
        let found = Comparison::of(&large, &small);
        for value in [found.mean_distance_m, found.rms_distance_m, found.largest_distance_m] {
            assert!((value - 1e-4).abs() < 1e-12, "{found:?}");
        }
        assert!((Comparison::of(&small, &large).mean_distance_m + 1e-4).abs() < 1e-12);
    }

    #[test]
    fn the_same_body_is_found_whatever_the_order_of_its_axes() {
        let body = ellipsoid(1.5e-3, 1e-3, 5e-4, &ShapeOptions::default()).unwrap();
        let found = Comparison::of(&body, &body);
        assert!(found.rms_distance_m < 2e-3 * body.equivalent_diameter(), "{found:?}");
        let rounder = ellipsoid(1e-3, 1e-3, 1e-3, &ShapeOptions::default()).unwrap();
        let found = Comparison::of(&body, &rounder);
        // The poles protrude by 0.5 mm; the short axis recedes by 0.5 mm.
        assert!((found.largest_distance_m - 5e-4).abs() < 2e-5, "{found:?}");
    }
}
