//! The box of the grid that is refined around the grains.

use glam::DVec3;

use crate::dem::Grain;
use crate::flow::{Boundaries, RefinedBox};
use crate::grid::Mesh;
use crate::math::largest_prime_factor;

/// Default distance from the grains to the sides of the refined box, in equivalent diameters of the
/// grain.
const MARGIN: f64 = 0.4;
/// Least distance from the grains to the sides of the refined box [cells of the whole grid].
pub const LEAST_REFINEMENT_MARGIN: f64 = 3.0;
/// Cells that a new box has beyond the margins, so that it moves less often.
const SLACK: usize = 2;
/// Largest number of cells that a box may have beyond those of a new one.
const EXCESS: usize = 8;
/// Largest distance of a refined box from the origin along a periodic axis [cells].
const FAR: usize = 1 << 40;

/// Returns whether a refined box fits into the grid; that of a damaged checkpoint may not.
pub fn is_possible(mesh: &Mesh, boundaries: &Boundaries, place: RefinedBox) -> bool {
    (0..3).all(|axis| {
        let (corner, cells, n) = (place.corner[axis], place.cells[axis], mesh.cells[axis]);
        let fits = if boundaries.is_periodic(axis) {
            corner.unsigned_abs() < FAR
        } else {
            corner >= 0 && cells <= n && corner <= (n - cells) as isize
        };
        fits && (1..=n).contains(&cells)
    })
}

/// Lower and upper end of what must be refined [cells from the lower corner of the box]; none if
/// all grains have left.
fn needed_range(mesh: &Mesh, grains: &[Grain], margin: Option<DVec3>) -> Option<[DVec3; 2]> {
    let ranges = grains.iter().filter(|grain| !grain.has_left()).map(|grain| {
        let default = DVec3::splat(MARGIN * grain.shape.equivalent_diameter());
        let margin =
            (margin.unwrap_or(default) / mesh.spacing).max(DVec3::splat(LEAST_REFINEMENT_MARGIN));
        let centre = (grain.pose.position - mesh.origin) / mesh.spacing;
        let extents = grain.shape.extents(grain.pose.orientation);
        let [below, above] = extents.map(|extent| extent / mesh.spacing + margin);
        [centre - below, centre + above]
    });
    ranges.reduce(|[low, high], [lower, upper]| [low.min(lower), high.max(upper)])
}

/// Refined box around grains at their present poses, with a `margin` [m] or the default one; none
/// if all have left. It is the `present` box along each axis where that holds the grains and is not
/// far too large, else a new one with the grains in its middle.
pub fn box_around(
    mesh: &Mesh,
    boundaries: &Boundaries,
    grains: &[Grain],
    margin: Option<DVec3>,
    present: Option<RefinedBox>,
) -> Option<RefinedBox> {
    let [low, high] = needed_range(mesh, grains, margin)?;
    let mut result = RefinedBox { corner: [0; 3], cells: mesh.cells };
    for axis in 0..3 {
        let (n, periodic) = (mesh.cells[axis], boundaries.is_periodic(axis));
        let (low, high) = if periodic {
            (low[axis], high[axis])
        } else {
            (low[axis].max(0.0), high[axis].min(n as f64))
        };
        let wanted = fast_count((high - low).ceil() as usize + SLACK);
        if wanted >= n {
            continue;
        }
        if let Some(present) = present {
            let (corner, cells) = (present.corner[axis], present.cells[axis]);
            let inside = corner as f64 <= low && (corner + cells as isize) as f64 >= high;
            let holds = inside || (periodic && cells == n);
            if holds && cells <= wanted + EXCESS {
                (result.corner[axis], result.cells[axis]) = (corner, cells);
                continue;
            }
        }
        // A box that is large enough keeps its size.
        let kept = present.map(|present| present.cells[axis]).filter(|kept| *kept < n);
        let cells = kept.filter(|kept| (wanted..=wanted + EXCESS).contains(kept)).unwrap_or(wanted);
        let corner = (0.5 * (low + high - cells as f64)).round() as isize;
        let last = (n - cells) as isize;
        result.cells[axis] = cells;
        result.corner[axis] = if periodic { corner } else { corner.clamp(0, last) };
    }
    Some(result)
}

/// Smallest count from `count` on without prime factors beyond 5, for which transforms are fast.
fn fast_count(count: usize) -> usize {
    (count..).find(|n| largest_prime_factor(*n) <= 5).unwrap_or(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::Boundary;
    use glam::DQuat;
    use grainwake_shape::{Shape, ShapeOptions, analytic};
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    use std::sync::Arc;

    const MESH: Mesh =
        Mesh { cells: [40, 40, 80], spacing: DVec3::splat(0.125), origin: DVec3::ZERO };

    /// Box around spheres of diameter 1 at the given positions.
    fn placed(positions: &[[f64; 3]], side: Boundary, present: Option<RefinedBox>) -> RefinedBox {
        let shape = Arc::new(Shape::sphere(0.5, 0));
        let grains: Vec<Grain> = positions
            .iter()
            .map(|x| Grain::new(shape.clone(), 1.5).with_position(DVec3::from_array(*x)))
            .collect();
        box_around(&MESH, &Boundaries([[side; 2]; 3]), &grains, None, present).unwrap()
    }

    #[test]
    fn the_box_holds_the_grains_and_stays_while_it_does() {
        let first = placed(&[[2.5, 2.5, 8.0]], Boundary::WALL, None);
        // 8 cells across, 2 times 3.2 around and 2 of slack: 17, and 18 has small factors.
        assert_eq!((first.cells, first.corner), ([18; 3], [11, 11, 55]));
        let near = placed(&[[2.5, 2.5, 7.9]], Boundary::WALL, Some(first));
        assert_eq!(near, first);
        let far = placed(&[[2.5, 2.5, 7.5]], Boundary::WALL, Some(first));
        assert_eq!((far.cells, far.corner), ([18; 3], [11, 11, 51]));
    }

    #[test]
    fn the_box_of_a_long_grain_follows_its_extents() {
        let shape = analytic::ellipsoid(1.2, 0.4, 0.3, &ShapeOptions::default()).unwrap();
        let grain = Grain::new(Arc::new(shape), 1.5).with_position(DVec3::new(2.5, 2.5, 5.0));
        let cells = |turn: DQuat| {
            let turned = [grain.clone().with_orientation(turn)];
            let boundaries = Boundaries([[Boundary::WALL; 2]; 3]);
            box_around(&MESH, &boundaries, &turned, None, None).unwrap().cells
        };
        // Edges of 2.4, 0.8 and 0.6, twice the margin of 0.42 and 2 cells of slack.
        assert_eq!(cells(DQuat::IDENTITY), [30, 16, 15]);
        assert_eq!(cells(DQuat::from_rotation_y(FRAC_PI_2)), [15, 16, 30]);
        // Turned by 45 degrees the edges are sqrt(2 (1.2^2 + 0.4^2)) = 1.79.
        assert_eq!(cells(DQuat::from_rotation_z(FRAC_PI_4)), [24, 24, 15]);
        // No turn needs more than the bounding sphere.
        for n in 0..40 {
            let axis = DVec3::new(1.0, f64::from(n % 7) - 3.0, 0.3).normalize();
            let [x, y, z] = cells(DQuat::from_axis_angle(axis, 0.2 * f64::from(n)));
            assert!(x.max(y).max(z) <= 30);
        }
    }

    #[test]
    fn the_box_ends_at_walls_and_continues_across_periodic_sides() {
        let beside = [[0.6, 2.5, 0.6]];
        assert_eq!(placed(&beside, Boundary::WALL, None).corner, [0, 11, 0]);
        let periodic = placed(&beside, Boundary::Periodic, None);
        assert_eq!((periodic.corner, periodic.cells), ([-4, 11, -4], [18; 3]));
        let later = placed(&[[-9.4, 2.5, 0.6]], Boundary::Periodic, Some(periodic));
        assert_eq!(later.corner, [-84, 11, -4]);
    }

    #[test]
    fn grains_far_apart_share_one_box() {
        let two = placed(&[[2.5, 2.5, 2.0], [2.5, 2.5, 6.0]], Boundary::WALL, None);
        assert_eq!(two.cells, [18, 18, 50]);
        let all = placed(&[[0.6, 2.5, 1.0], [4.4, 2.5, 9.0]], Boundary::Periodic, None);
        assert_eq!((all.cells, all.corner), ([40, 18, 80], [0, 11, 0]));
        let kept = placed(&[[2.5, 2.5, 2.0], [2.5, 2.5, 9.9]], Boundary::Periodic, Some(all));
        assert_eq!((kept.cells[2], kept.corner[2]), (80, 0));
        // It shrinks when the grains have met.
        let met = placed(&[[2.5, 2.5, 2.0], [2.5, 2.5, 3.0]], Boundary::WALL, Some(two));
        assert_eq!(met.cells, [18, 18, 25]);
    }
}
