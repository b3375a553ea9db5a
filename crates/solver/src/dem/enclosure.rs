//! Box of the grains: its solid faces, its images along periodic axes, and the pairs of a grain
//! with a grain, an image or a wall.

use glam::{DVec3, IVec3};

/// Box of the grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure {
    /// Lower corner [m].
    pub lower: DVec3,
    /// Upper corner [m].
    pub upper: DVec3,
    /// Periodic axes: grains interact with images along them.
    pub periodic: [bool; 3],
    /// Faces `[axis][side]`, 0 lower and 1 upper; ignored along periodic axes.
    pub sides: [[Side; 2]; 3],
}

/// Kind of a face of the box, for grains.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Side {
    /// No wall.
    #[default]
    Open,
    /// Wall with friction.
    Wall {
        /// Velocity of the wall in its own plane [m/s].
        velocity: DVec3,
    },
    /// Wall without friction.
    Frictionless,
}

impl Side {
    /// A wall with friction, at rest.
    pub const WALL: Side = Side::Wall { velocity: DVec3::ZERO };
}

/// Face of the box as a half space: a grain inside the box is on the side of `inward`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WallFace {
    /// The face as the second body of a contact.
    pub partner: Partner,
    /// Axis of the normal.
    pub axis: usize,
    /// Unit normal into the box: the gradient of the wall's distance field.
    pub inward: DVec3,
    /// Coordinate of the face along its axis [m].
    pub coordinate: f64,
}

impl WallFace {
    /// Signed distance of a point of the space frame, negative inside the wall [m].
    pub fn distance(&self, x: DVec3) -> f64 {
        self.inward[self.axis] * (x[self.axis] - self.coordinate)
    }
}

impl Enclosure {
    /// Edge lengths [m].
    pub fn size(&self) -> DVec3 {
        self.upper - self.lower
    }
    /// Whether grains interact with images along `axis`.
    pub fn is_periodic(&self, axis: usize) -> bool {
        self.periodic[axis] && self.size()[axis] > 0.0
    }
    /// Periods along the three axes [m], zero along axes that are not periodic.
    pub(super) fn period(&self) -> DVec3 {
        DVec3::from_array(
            [0, 1, 2].map(|axis| if self.is_periodic(axis) { self.size()[axis] } else { 0.0 }),
        )
    }
    /// Face `side` of `axis` as a plane, solid or not.
    pub(super) fn plane(&self, axis: usize, side: usize) -> WallFace {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let corner = if side == 0 { self.lower } else { self.upper };
        let partner = Partner::Wall { axis: axis as u8, side: side as u8 };
        WallFace { partner, axis, inward: sign * DVec3::AXES[axis], coordinate: corner[axis] }
    }
    /// All faces that are walls for grains.
    pub(super) fn faces(&self) -> impl Iterator<Item = WallFace> + '_ {
        let faces = (0..6).map(|k| (k / 2, k % 2));
        let solid = faces.filter(|&(axis, side)| {
            self.sides[axis][side] != Side::Open && !self.is_periodic(axis)
        });
        solid.map(|(axis, side)| self.plane(axis, side))
    }
    /// Number of periods in each component of `distance` [m], rounded by `round`; zero along axes
    /// that are not periodic.
    ///
    /// The count is clamped to a million, so that a diverging grain cannot overflow it.
    pub(super) fn periods(&self, distance: DVec3, round: impl Fn(f64) -> f64) -> IVec3 {
        let period = self.period();
        IVec3::from_array([0, 1, 2].map(|axis| {
            if period[axis] > 0.0 {
                round(distance[axis] / period[axis]).clamp(-1e6, 1e6) as i32
            } else {
                0
            }
        }))
    }
    /// Number of periods by which `x` lies outside the box.
    pub(super) fn periods_outside(&self, x: DVec3) -> IVec3 {
        self.periods(x - self.lower, f64::floor)
    }
    /// Image of `x` inside the box along periodic axes [m].
    pub fn wrap(&self, x: DVec3) -> DVec3 {
        x - self.periods_outside(x).as_dvec3() * self.period()
    }
    /// Shortest periodic image of a separation vector [m].
    pub fn nearest_image(&self, separation: DVec3) -> DVec3 {
        separation - self.periods(separation, f64::round).as_dvec3() * self.period()
    }
}

/// Second body of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Partner {
    /// Another grain, by index.
    Grain(usize),
    /// Wall: a face of the box.
    Wall {
        /// Axis of its normal.
        axis: u8,
        /// 0 lower, 1 upper.
        side: u8,
    },
}

impl Partner {
    /// Index of the partner, if it is a grain.
    pub(crate) fn grain(self) -> Option<usize> {
        match self {
            Partner::Grain(index) => Some(index),
            Partner::Wall { .. } => None,
        }
    }
}

/// Key of a pair, ordered by grain, then partner (grains before walls), then image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct PairKey {
    /// First grain.
    pub grain: u32,
    /// Second body.
    pub partner: Partner,
    /// Periods from the partner's own position to the image in question.
    pub image: [i32; 3],
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel() -> Enclosure {
        Enclosure {
            lower: DVec3::new(-1.0, 0.0, 0.0),
            upper: DVec3::new(1.0, 2.0, 3.0),
            periodic: [true, false, false],
            sides: [[Side::WALL; 2], [Side::WALL, Side::Open], [Side::Open; 2]],
        }
    }

    #[test]
    fn wraps_only_periodic_axes() {
        let box_ = channel();
        assert_eq!(box_.wrap(DVec3::new(1.5, 5.0, -1.0)), DVec3::new(-0.5, 5.0, -1.0));
        assert_eq!(box_.nearest_image(DVec3::new(1.5, 1.5, 0.0)), DVec3::new(-0.5, 1.5, 0.0));
    }

    #[test]
    fn solid_faces_are_half_spaces_and_periodic_axes_have_none() {
        let box_ = channel();
        let faces: Vec<_> = box_.faces().collect();
        assert_eq!(faces.len(), 1);
        assert_eq!(faces[0].partner, Partner::Wall { axis: 1, side: 0 });
        assert_eq!(faces[0].distance(DVec3::new(9.0, -0.25, 9.0)), -0.25);
        assert_eq!(box_.plane(2, 1).distance(DVec3::new(0.0, 0.0, 2.0)), 1.0);
    }

    #[test]
    fn walls_come_after_grains() {
        let key = |grain: u32, partner| PairKey { grain, partner, image: [0; 3] };
        let wall = key(0, Partner::Wall { axis: 0, side: 0 });
        assert!(key(0, Partner::Grain(999)) < wall && wall < key(1, Partner::Grain(0)));
    }
}
