//! What a pair remembers: the tangential displacement of every touching node.

use glam::{DVec3, IVec3};

use super::Partner;
use super::narrow_phase::Patch;
use crate::math::Load;

/// A pair: ordered by grain, then partner (grains before walls), then image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PairKey {
    /// First grain.
    pub grain: u32,
    /// What it may touch.
    pub partner: Partner,
    /// The partner stands this many periods from its own position.
    pub image: IVec3,
}

impl PairKey {
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

/// Tangential displacement of a node that touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Memory {
    /// Node code of the narrow phase; ascending within a pair.
    pub code: u32,
    /// Normal at which `slip` is tangential.
    pub normal: DVec3,
    /// Tangential displacement of the first grain against the partner, cut by Coulomb's law [m].
    pub slip: DVec3,
}

/// What the law made of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Outcome {
    /// Deepest overlap [m]; zero or less: no contact.
    pub overlap: f64,
    /// Load on the first grain.
    pub first: Load,
    /// Load on the partner.
    pub second: Load,
    /// Mean contact point, arm from the first grain's centroid [m].
    pub arm: DVec3,
    /// Mean unit normal out of the first grain.
    pub normal: DVec3,
    /// Energy in the springs [J].
    pub elastic_energy: f64,
}

/// A candidate pair with its memory and buffers, kept from sub-step to sub-step.
#[derive(Clone, Debug)]
pub(super) struct Slot {
    /// Which pair.
    pub key: PairKey,
    /// Whether it touched when last looked at.
    pub touching: bool,
    /// Whether it touched at any sub-step of the present step: an impact may fit between two ends.
    pub touched: bool,
    /// Part of the dashpot at work: less than one just after the contact began.
    pub onset: f64,
    /// Share-weighted mean of the displacements then, and its normal: what a new node inherits.
    pub mean: Memory,
    /// Displacements by node.
    pub memory: Vec<Memory>,
    /// Displacements being written.
    pub next: Vec<Memory>,
    /// Penetrating nodes of the last look.
    pub patch: Patch,
    /// Result of the last look.
    pub outcome: Outcome,
}

const NOTHING: Memory = Memory {
    code: 0,
    normal: DVec3::ZERO,
    slip: DVec3::ZERO,
};

impl Slot {
    /// A pair that has not touched.
    pub fn new(key: PairKey) -> Slot {
        Slot {
            key,
            touching: false,
            touched: false,
            onset: 1.0,
            mean: NOTHING,
            memory: Vec::new(),
            next: Vec::new(),
            patch: Patch::default(),
            outcome: Outcome::default(),
        }
    }
    /// Ends the contact and its memory; where it was stays known.
    pub fn part(&mut self) {
        self.touching = false;
        self.onset = 1.0;
        self.mean = NOTHING;
        self.memory.clear();
        self.outcome = Outcome {
            arm: self.outcome.arm,
            normal: self.outcome.normal,
            ..Default::default()
        };
    }
    /// Makes ready for another step: nothing but what a checkpoint holds may steer it.
    pub fn begin_step(&mut self) {
        self.touched = false;
        self.patch.forget();
    }
    /// Makes ready for another pair; only the buffers stay.
    fn reuse(&mut self, key: PairKey) {
        self.part();
        self.begin_step();
        self.outcome = Outcome::default();
        self.key = key;
    }
}

/// Replaces `slots` by one slot for each of the ascending `keys`, keeping the slots whose key stays
/// and using the others' buffers again.
pub(super) fn renew(
    slots: &mut Vec<Slot>,
    old: &mut Vec<Slot>,
    spare: &mut Vec<Slot>,
    keys: &[PairKey],
) {
    std::mem::swap(slots, old);
    let mut left = old.drain(..).peekable();
    for &key in keys {
        while let Some(gone) = left.next_if(|slot| slot.key < key) {
            spare.push(gone);
        }
        let kept = left.next_if(|slot| slot.key == key);
        slots.push(kept.unwrap_or_else(|| match spare.pop() {
            Some(mut slot) => {
                slot.reuse(key);
                slot
            }
            None => Slot::new(key),
        }));
    }
    spare.extend(left);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(grain: u32, partner: usize) -> PairKey {
        PairKey {
            grain,
            partner: Partner::Grain(partner),
            image: IVec3::ZERO,
        }
    }

    #[test]
    fn renewing_keeps_the_memory_of_pairs_that_stay() {
        let (mut slots, mut old, mut spare) = (Vec::new(), Vec::new(), Vec::new());
        renew(
            &mut slots,
            &mut old,
            &mut spare,
            &[key(0, 1), key(0, 2), key(1, 2)],
        );
        slots[1].touching = true;
        slots[2].touching = true;
        renew(
            &mut slots,
            &mut old,
            &mut spare,
            &[key(0, 2), key(0, 3), key(1, 3)],
        );
        let touching: Vec<_> = slots.iter().map(|s| s.touching).collect();
        assert_eq!(touching, [true, false, false]);
        assert_eq!(
            slots.iter().map(|s| s.key).collect::<Vec<_>>(),
            [key(0, 2), key(0, 3), key(1, 3)]
        );
        assert_eq!(spare.len(), 0);
    }

    #[test]
    fn walls_come_after_grains() {
        let wall = PairKey {
            grain: 0,
            partner: Partner::Wall { axis: 0, side: 0 },
            image: IVec3::ZERO,
        };
        assert!(key(0, 999) < wall && wall < key(1, 0));
    }
}
