//! Identity of a pair: a grain, its partner and the periodic image of the partner.

use glam::IVec3;

use crate::dem::enclosure::WallFace;

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

impl From<&WallFace> for Partner {
    fn from(face: &WallFace) -> Partner {
        Partner::Wall { axis: face.axis as u8, side: face.side as u8 }
    }
}

/// Key of a pair, ordered by grain, then partner (grains before walls), then image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PairKey {
    /// First grain.
    pub grain: u32,
    /// Second body.
    pub partner: Partner,
    /// Periods from the partner's own position to the image in question.
    pub image: IVec3,
}

impl PairKey {
    /// Pair of a grain with a wall.
    pub(super) fn wall(grain: u32, face: &WallFace) -> PairKey {
        PairKey { grain, partner: face.into(), image: IVec3::ZERO }
    }

    fn rank(&self) -> (u32, Partner, [i32; 3]) {
        (self.grain, self.partner, self.image.to_array())
    }
}

impl Ord for PairKey {
    fn cmp(&self, other: &PairKey) -> std::cmp::Ordering {
        self.rank().cmp(&other.rank())
    }
}
impl PartialOrd for PairKey {
    fn partial_cmp(&self, other: &PairKey) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_come_after_grains() {
        let key = |grain: u32, partner| PairKey { grain, partner, image: IVec3::ZERO };
        let wall = key(0, Partner::Wall { axis: 0, side: 0 });
        assert!(key(0, Partner::Grain(999)) < wall && wall < key(1, Partner::Grain(0)));
    }
}
