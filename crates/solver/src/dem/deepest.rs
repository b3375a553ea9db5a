//! The point of a surface that lies deepest in a field (or nearest to it).

use glam::DVec3;
use grainwake_shape::Shape;

use super::target::Target;

/// A point of one surface in the field of another, principal frame of the surface's grain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe {
    /// The point [m].
    pub x: DVec3,
    /// Distance in the target's field [m], negative inside.
    pub distance: f64,
    /// Unit gradient of that distance.
    pub normal: DVec3,
}

impl Probe {
    /// Looks the point up; none where the field has no direction.
    pub fn at(target: &Target, x: DVec3) -> Option<Probe> {
        let (distance, gradient) = target.distance_and_gradient(x);
        let normal = gradient.try_normalize()?;
        Some(Probe {
            x,
            distance,
            normal,
        })
    }
}

/// Newton's projection onto the zero level of the shape.
pub(super) fn project(surface: &Shape, mut x: DVec3) -> DVec3 {
    for _ in 0..2 {
        let (distance, gradient) = surface.distance_and_gradient(x);
        let square = gradient.length_squared();
        if square < 0.25 {
            break;
        }
        x -= gradient * (distance / square);
    }
    x
}

/// Slides `start` along `surface` to a local minimum of the distance in `target`.
///
/// Steepest descent in the tangent plane; the first step assumes the curvature of the bounding
/// spheres (Newton's step where both are spheres), the next ones the curvature seen on the last step
/// (Barzilai and Borwein). A step that does not come closer is shortened, never taken, so the
/// answer is at least as deep as `start`. Edges and the facets of a sampled field can stop it short;
/// then points around are tried until none is better. `stride` [m] limits a step, `tolerance` [m]
/// ends the search.
pub(super) fn slide(
    surface: &Shape,
    target: &Target,
    start: Probe,
    stride: f64,
    tolerance: f64,
    iterations: usize,
) -> Probe {
    let tangential = |probe: &Probe| {
        let (_, gradient) = surface.distance_and_gradient(probe.x);
        let out = gradient.normalize_or_zero();
        probe.normal.dot(out) * out - probe.normal
    };
    let mut here = start;
    let mut climb = tangential(&here);
    let mut length = 1.0 / (1.0 / surface.bounding_radius() + 1.0 / target.radius());
    let mut stopped = false;
    for _ in 0..iterations {
        let slope = climb.length();
        if slope.is_nan() || length * slope <= tolerance {
            break;
        }
        let step = length.min(stride / slope);
        let Some(next) = Probe::at(target, project(surface, here.x + step * climb)) else {
            break;
        };
        if next.distance >= here.distance {
            length = 0.25 * step;
            stopped = true;
            continue;
        }
        let next_climb = tangential(&next);
        let (moved, turned) = (next.x - here.x, climb - next_climb);
        let bend = moved.dot(turned);
        length = if bend > 0.0 {
            moved.length_squared() / bend
        } else {
            2.0 * step
        };
        here = next;
        climb = next_climb;
    }
    if stopped {
        look_around(surface, target, here, stride)
    } else {
        here
    }
}

/// Compass search from `here`: six points around it in the tangent plane, at a distance that is
/// halved when none of them is closer.
fn look_around(surface: &Shape, target: &Target, mut here: Probe, stride: f64) -> Probe {
    const DIRECTIONS: usize = 6;
    const MOST_MOVES: usize = 40;
    const FINEST: f64 = 0.2;
    let (_, gradient) = surface.distance_and_gradient(here.x);
    let (u, v) = gradient.normalize_or(DVec3::Z).any_orthonormal_pair();
    let around: [DVec3; DIRECTIONS] = std::array::from_fn(|k| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / DIRECTIONS as f64).sin_cos();
        c * u + s * v
    });
    let (mut radius, mut moves) = (stride, 0);
    while radius > FINEST * stride && moves < MOST_MOVES {
        let better = around.iter().find_map(|direction| {
            let next = Probe::at(target, project(surface, here.x + radius * *direction))?;
            (next.distance < here.distance).then_some(next)
        });
        match better {
            Some(next) => {
                here = next;
                moves += 1;
            }
            None => radius *= 0.5,
        }
    }
    here
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    #[test]
    fn a_sphere_finds_its_deepest_point_in_a_wall_and_in_a_sphere() {
        let ball = Shape::sphere(2.0, 100);
        let away = DVec3::new(0.3, -0.5, 1.0).normalize();
        let start = 2.0 * DVec3::new(0.5, -0.5, -0.8).normalize();
        let wall = Target::HalfSpace {
            normal: DVec3::Z,
            offset: 1.99,
        };
        let found = slide(
            &ball,
            &wall,
            Probe::at(&wall, start).unwrap(),
            0.5,
            1e-9,
            12,
        );
        assert!((found.distance + 0.01).abs() < 1e-12, "{}", found.distance);
        let other = Shape::sphere(1.0, 100);
        let target = Target::grain(&other, DMat3::IDENTITY, 2.98 * away);
        let start = -2.0 * (away + DVec3::new(0.2, 0.1, -0.1)).normalize();
        let found = slide(
            &ball,
            &target,
            Probe::at(&target, start).unwrap(),
            0.5,
            1e-9,
            12,
        );
        assert!((found.distance + 0.02).abs() < 1e-12, "{}", found.distance);
        assert!((found.x + 2.0 * away).length() < 1e-6);
    }
}
