//! A convex body with curved faces: the intersection of balls.
//!
//! The nearest point of the intersection is the foot on one ball, on the circle where two meet, or
//! the point where three meet; its distance is exact. Eroding the body by r subtracts r from every
//! radius; dilating it by a ball of radius r subtracts r from the distance.

use crate::inscribed::deepest;
use glam::DVec3;

/// Tolerance for containment in a ball, relative to the largest radius.
const TOLERANCE: f64 = 1e-10;

/// One face of the body: part of the surface of this ball.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub centre: DVec3,
    pub radius: f64,
}

/// The circle in which the surfaces of two balls meet.
#[derive(Clone, Copy, Debug)]
struct Circle {
    centre: DVec3,
    axis: DVec3,
    radius: f64,
    balls: [usize; 2],
}

/// Intersection of balls, with the edges and corners on its surface.
#[derive(Clone, Debug)]
pub(super) struct Core {
    balls: Vec<Ball>,
    edges: Vec<Circle>,
    corners: Vec<DVec3>,
    slack: f64,
}

impl Circle {
    fn of(balls: &[Ball], i: usize, j: usize) -> Option<Circle> {
        let (p, q) = (balls[i], balls[j]);
        let apart = p.centre.distance(q.centre);
        if apart == 0.0 {
            return None;
        }
        let axis = (q.centre - p.centre) / apart;
        let along = 0.5 * (apart + (p.radius - q.radius) * (p.radius + q.radius) / apart);
        let squared = (p.radius - along) * (p.radius + along);
        (squared > 0.0).then(|| Circle {
            centre: p.centre + along * axis,
            axis,
            radius: squared.sqrt(),
            balls: [i, j],
        })
    }

    /// Returns the point of the circle nearest to `x`.
    fn foot(&self, x: DVec3) -> DVec3 {
        let reach = x - self.centre;
        self.towards(reach)
    }

    /// Returns the point of the circle farthest along `u`.
    fn towards(&self, u: DVec3) -> DVec3 {
        let across = u - self.axis * self.axis.dot(u);
        let across = across.try_normalize();
        self.centre + self.radius * across.unwrap_or_else(|| self.axis.any_orthonormal_vector())
    }

    /// Returns the two points of the circle that also lie on a third ball.
    fn meet(&self, ball: Ball) -> Option<[DVec3; 2]> {
        let e = self.axis.any_orthonormal_vector();
        let f = self.axis.cross(e);
        let reach = self.centre - ball.centre;
        // On the circle, |reach + radius (e cos t + f sin t)| = ball.radius.
        let (p, q) = (reach.dot(e), reach.dot(f));
        let size = p.hypot(q);
        let needed =
            (ball.radius * ball.radius - reach.length_squared() - self.radius * self.radius)
                / (2.0 * self.radius);
        if size == 0.0 || needed.abs() > size {
            return None;
        }
        let (middle, half) = (q.atan2(p), (needed / size).acos());
        let at = |t: f64| self.centre + self.radius * (t.cos() * e + t.sin() * f);
        Some([at(middle + half), at(middle - half)])
    }
}

impl Core {
    pub(super) fn new(balls: Vec<Ball>) -> Core {
        let largest = balls.iter().fold(0.0f64, |m, b| m.max(b.radius));
        let mut core =
            Core { balls, edges: Vec::new(), corners: Vec::new(), slack: TOLERANCE * largest };
        let n = core.balls.len();
        for i in 0..n {
            for j in i + 1..n {
                let Some(circle) = Circle::of(&core.balls, i, j) else {
                    continue;
                };
                let mut on_surface = false;
                for k in (0..n).filter(|k| *k != i && *k != j) {
                    for point in circle.meet(core.balls[k]).into_iter().flatten() {
                        if core.contains(point, &[i, j, k]) {
                            on_surface = true;
                            if k > j {
                                core.corners.push(point);
                            }
                        }
                    }
                }
                // A complete circle has no corner: any of its points is representative.
                if on_surface || core.contains(circle.towards(DVec3::X), &[i, j]) {
                    core.edges.push(circle);
                }
            }
        }
        core
    }

    /// Returns whether all balls except `but` contain the point.
    fn contains(&self, x: DVec3, but: &[usize]) -> bool {
        self.balls.iter().enumerate().all(|(n, ball)| {
            let reach = ball.radius + self.slack;
            x.distance_squared(ball.centre) <= reach * reach || but.contains(&n)
        })
    }

    /// Returns the signed distance [m] of the intersection and its outward unit gradient.
    pub(super) fn distance(&self, x: DVec3) -> (f64, DVec3) {
        let mut depth = (f64::NEG_INFINITY, DVec3::ZERO);
        for ball in &self.balls {
            let reach = x - ball.centre;
            let length = reach.length();
            if length - ball.radius > depth.0 {
                depth = (length - ball.radius, reach / length);
            }
        }
        if depth.0 <= 0.0 {
            return depth;
        }
        let mut best = (f64::INFINITY, x);
        for (n, ball) in self.balls.iter().enumerate() {
            let reach = x - ball.centre;
            let length = reach.length();
            if length > ball.radius {
                let foot = ball.centre + reach * (ball.radius / length);
                // If the nearest point of a ball lies in the body, it is the body's nearest point.
                if self.contains(foot, &[n]) {
                    return (length - ball.radius, reach / length);
                }
            }
        }
        for edge in &self.edges {
            let foot = edge.foot(x);
            let squared = foot.distance_squared(x);
            if squared < best.0 && self.contains(foot, &edge.balls) {
                best = (squared, foot);
            }
        }
        for corner in &self.corners {
            let squared = corner.distance_squared(x);
            if squared < best.0 {
                best = (squared, *corner);
            }
        }
        let distance = best.0.sqrt();
        (distance, (x - best.1) / distance)
    }

    /// Returns the support function of the body along the unit vector `u` [m].
    pub(super) fn support(&self, u: DVec3) -> f64 {
        let mut reach = f64::NEG_INFINITY;
        let mut offer = |x: DVec3, balls: &[usize]| {
            if u.dot(x) > reach && self.contains(x, balls) {
                reach = u.dot(x);
            }
        };
        for (n, ball) in self.balls.iter().enumerate() {
            offer(ball.centre + ball.radius * u, &[n]);
        }
        for edge in &self.edges {
            offer(edge.towards(u), &edge.balls);
        }
        for corner in &self.corners {
            reach = reach.max(u.dot(*corner));
        }
        reach
    }
}

/// Returns centre and radius of the largest ball in an intersection of balls.
pub(super) fn inscribed(balls: &[Ball], start: DVec3, reach: f64) -> (DVec3, f64) {
    let depth = |x: DVec3| {
        balls
            .iter()
            .map(|ball| {
                let inward = ball.centre - x;
                let length = inward.length();
                (ball.radius - length, inward / length)
            })
            .min_by(|p, q| p.0.total_cmp(&q.0))
            .unwrap_or((f64::NEG_INFINITY, DVec3::X))
    };
    deepest(depth, start, reach, 700, f64::NEG_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Random, direction};
    use rand::{RngExt, SeedableRng};

    fn stone() -> Vec<Ball> {
        let mut random = Random::seed_from_u64(4);
        (0..14)
            .map(|_| {
                let radius = 2.0 + 3.0 * random.random::<f64>();
                let centre = (0.8 + 0.4 * random.random::<f64>() - radius) * direction(&mut random);
                Ball { centre, radius }
            })
            .collect()
    }

    /// Compares with a slow reference: alternating projections with Dykstra's correction.
    #[test]
    fn the_distance_is_that_of_the_nearest_point() {
        let balls = stone();
        let core = Core::new(balls.clone());
        assert!(core.corners.len() >= 12 && core.edges.len() >= 18);
        let mut random = Random::seed_from_u64(9);
        for _ in 0..60 {
            let x = (1.0 + 2.0 * random.random::<f64>()) * direction(&mut random);
            let (found, outward) = core.distance(x);
            if found <= 0.0 {
                continue;
            }
            let mut p = x;
            let mut memory = vec![DVec3::ZERO; balls.len()];
            for _ in 0..20_000 {
                for (ball, kept) in balls.iter().zip(&mut memory) {
                    let y = p + *kept;
                    let reach = y - ball.centre;
                    p = ball.centre + reach * (ball.radius / reach.length()).min(1.0);
                    *kept = y - p;
                }
            }
            assert!((found - p.distance(x)).abs() < 1e-4, "{found} {}", p.distance(x));
            assert!((outward - (x - p).normalize()).length() < 1e-2);
        }
    }

    #[test]
    fn inside_the_distance_is_the_depth_and_the_inscribed_ball_touches_four_faces() {
        let balls = stone();
        let core = Core::new(balls.clone());
        let (centre, radius) = inscribed(&balls, DVec3::ZERO, 2.0);
        assert!((core.distance(centre).0 + radius).abs() < 1e-9);
        let mut depths: Vec<f64> =
            balls.iter().map(|b| b.radius - centre.distance(b.centre)).collect();
        depths.sort_by(f64::total_cmp);
        assert!(depths[2] - radius < 1e-7, "{depths:?}");
        // No random point nearby is deeper.
        let mut random = Random::seed_from_u64(2);
        for _ in 0..300 {
            assert!(core.distance(centre + 0.05 * direction(&mut random)).0 >= -radius);
        }
    }

    #[test]
    fn the_support_is_the_limit_of_the_distance_from_afar() {
        let core = Core::new(stone());
        let mut random = Random::seed_from_u64(5);
        for _ in 0..100 {
            let u = direction(&mut random);
            let far = 1e5;
            let limit = far - core.distance(far * u).0;
            assert!((core.support(u) - limit).abs() < 2e-5, "{} {limit}", core.support(u));
        }
    }
}
