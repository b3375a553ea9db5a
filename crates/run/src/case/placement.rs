//! Orientation of grains and their extent along an axis.

use glam::{DMat3, DQuat, DVec3};

use super::raw::{Orientation, Turns};
use grainwake_solver::dem::{Enclosure, Grain, Side, wall_gap};

/// Returns the orientation of a grain after its turns. In the principal frame of a shape the moment
/// of inertia about x is the smallest and the one about z the largest.
///
/// A quaternion of unit length is kept exactly, so that a resolved case gives the same grain.
pub(super) fn orientation(orientation: &Orientation, turns: &Turns) -> Result<DQuat, String> {
    let start = match orientation {
        Orientation::Quaternion(q) => *q,
        Orientation::Axes(axes) => from_axes(axes)?,
    };
    let turned = turns.0.iter().fold(start, |q, turn| turn.quaternion() * q);
    Ok(if (turned.length_squared() - 1.0).abs() < 1e-14 { turned } else { turned.normalize() })
}

/// Returns the rotation of the principal axes (long, middle, short) to the given directions. The
/// second direction is made perpendicular to the first; its default is the next axis of space
/// (x -> y -> z -> x).
fn from_axes(axes: &[Option<DVec3>; 3]) -> Result<DQuat, String> {
    let first = axes.iter().position(Option::is_some).ok_or("no direction is given")?;
    let a = axes[first].and_then(DVec3::try_normalize).ok_or("a direction cannot be zero")?;
    let second = (0..3).find(|i| *i != first && axes[*i].is_some());
    let (other, toward) = match second {
        Some(i) => (i, axes[i].unwrap_or(DVec3::ZERO)),
        None => {
            let largest = (0..3).max_by(|i, j| a[*i].abs().total_cmp(&a[*j].abs())).unwrap_or(0);
            ((first + 1) % 3, DVec3::AXES[(largest + 1) % 3])
        }
    };
    let b = (toward - a * a.dot(toward))
        .try_normalize()
        .filter(|_| a.cross(toward).length() > 1e-6 * toward.length());
    let b = b.ok_or("the two directions are parallel; principal axes are perpendicular")?;
    let third = 3 - first - other;
    // Right-handed: axis i x axis i+1 = axis i+2.
    let c = if other == (first + 1) % 3 { a.cross(b) } else { b.cross(a) };
    let mut columns = [DVec3::ZERO; 3];
    (columns[first], columns[other], columns[third]) = (a, b, c);
    Ok(DQuat::from_mat3(&DMat3::from_cols(columns[0], columns[1], columns[2])).normalize())
}

/// Returns the lowest and highest coordinate of a grain's surface along `axis` [m].
pub(super) fn extent_along(grain: &Grain, axis: usize) -> (f64, f64) {
    // The wall gap of the contact model measures the surface that contact uses.
    let margin = 2.0 * grain.shape.bounding_radius();
    let centre = grain.pose.position;
    let side = |side: usize| {
        let mut sides: [[Side; 2]; 3] = Default::default();
        sides[axis][side] = Side::WALL;
        let box_around = Enclosure {
            lower: centre - margin,
            upper: centre + margin,
            periodic: [false; 3],
            sides,
        };
        wall_gap(grain, &box_around).map_or(margin, |(gap, _)| gap)
    };
    (centre[axis] - margin + side(0), centre[axis] + margin - side(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(axes: [Option<DVec3>; 3], body: DVec3) -> DVec3 {
        from_axes(&axes).unwrap() * body
    }

    #[test]
    fn named_axes_point_where_they_are_told() {
        assert!(turned([Some(DVec3::Z), None, None], DVec3::X).distance(DVec3::Z) < 1e-12);
        assert!(turned([None, None, Some(DVec3::Z)], DVec3::Z).distance(DVec3::Z) < 1e-12);
        let both = [Some(DVec3::Z), None, Some(DVec3::X)];
        assert!(turned(both, DVec3::X).distance(DVec3::Z) < 1e-12);
        assert!(turned(both, DVec3::Z).distance(DVec3::X) < 1e-12);
        let tilted = [None, Some(DVec3::new(1.0, 0.0, 1.0)), Some(DVec3::Y)];
        assert!(
            (turned(tilted, DVec3::Y) - DVec3::new(1.0, 0.0, 1.0).normalize()).length() < 1e-12
        );
        for axes in [both, tilted, [Some(DVec3::NEG_Y), None, None]] {
            let q = from_axes(&axes).unwrap();
            assert!((q * DVec3::X).cross(q * DVec3::Y).distance(q * DVec3::Z) < 1e-12);
        }
        assert!(from_axes(&[Some(DVec3::Z), Some(DVec3::NEG_Z), None]).is_err());
    }
}
