//! Contact forces (Eqs 9-18): contacts and their records, kept between sub-steps. `law.rs` and
//! `hertz_mindlin.rs` have the force laws, `model.rs` the loads of a pair, `film.rs` lubrication.
//! At set-up, `parameters.rs` selects the law.
//!
//! A further force law implements `ContactLaw` in a file beside `hertz_mindlin.rs`. It needs a
//! variant of [`ContactLawKind`], of which the compiler then names every `match` (in `crates/run`
//! some code compares with `Linear` alone). It also needs its keys in the case file, and its name
//! in `law_schema` (`crates/run/src/case/raw/physics.rs`).
//!
//! A cohesive law overrides `ContactLaw::normal_force`, which returns the pull as a negative force;
//! the elastic force that it gets is at least zero. A force across a gap belongs beside the
//! lubrication in `film.rs`: `ContactModel::range` makes pairs of this gap contacts, and
//! `substeps.rs` chooses the sub-steps.

mod film;
mod hertz_mindlin;
mod law;
mod model;
mod parameters;

pub(super) use law::{BodyProperties, PairProperties};
pub(super) use model::{BodyState, ContactModel, Film, PairKinematics, SubstepVelocity};
pub use parameters::{ContactLawKind, ContactParams};

use glam::DVec3;

use super::enclosure::{PairKey, Partner};
use super::search::{ContactPatch, ContactPoint};
use crate::math::Load;

/// Contact of a step; `grain` < partner if the partner is a grain, and equal if a grain touches its
/// own periodic image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// First grain.
    pub grain: usize,
    /// Second body.
    pub partner: Partner,
    /// Deepest overlap at the end of the step [m]; zero if the contact has ended within the step.
    pub overlap: f64,
    /// Load on `grain`; the partner receives the opposite force.
    pub load: Load,
    /// Mean contact point, next to `grain` at its present position [m].
    pub point: DVec3,
    /// Mean unit normal, out of `grain`.
    pub normal: DVec3,
}

/// Tangential displacement of a contact point, accumulated since the contact began (Eqs 13-15).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::dem) struct TangentialHistory {
    /// Identifier of the contact point; ascending within a pair.
    pub id: u32,
    /// Normal to which `displacement` is tangential.
    pub normal: DVec3,
    /// Displacement of the first grain relative to the partner, limited by Coulomb's bound [m].
    pub displacement: DVec3,
}

/// Overlap and loads of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::dem) struct PairLoads {
    /// Deepest overlap [m]; zero or negative without contact.
    pub overlap: f64,
    /// Load on the first grain.
    pub on_grain: Load,
    /// Load on the partner.
    pub on_partner: Load,
    /// Lever arm of the mean contact point from the first grain's centroid [m].
    pub lever_arm: DVec3,
    /// Mean unit normal out of the first grain.
    pub normal: DVec3,
    /// Energy of the springs [J].
    pub elastic_energy: f64,
}

/// Pair that may touch, with its friction history and buffers, kept between sub-steps.
#[derive(Debug)]
pub(in crate::dem) struct ContactRecord {
    /// Identity of the pair.
    pub key: PairKey,
    /// Whether the pair was in contact at the last evaluation.
    pub in_contact: bool,
    /// Deepest overlap at any sub-step of the present step [m]; zero without contact.
    pub deepest_overlap: f64,
    /// Fraction of the dashpot that acts; differs from one just after the contact began.
    pub dashpot_fraction: f64,
    /// Tangential stiffness at the last evaluation [N/m]; zero before the first.
    pub tangential_stiffness: f64,
    /// Mean displacement of the patch, inherited by new contact points.
    pub mean_history: TangentialHistory,
    /// Displacements by contact point.
    pub history: Vec<TangentialHistory>,
    /// Displacements under evaluation.
    pub next_history: Vec<TangentialHistory>,
    /// Penetrating points of the last search.
    pub patch: ContactPatch,
    /// Whether the pair was near enough at the last search to have loads.
    pub may_interact: bool,
    /// Closest points of a pair without penetrating points, if a force acts across the gap.
    pub closest: Option<ContactPoint>,
    /// Loads of the last evaluation.
    pub loads: PairLoads,
}

impl Clone for ContactRecord {
    fn clone(&self) -> ContactRecord {
        let mut copy = ContactRecord::new(self.key);
        copy.clone_from(self);
        copy
    }
    /// Copies a record into the buffers of this one: the trial step copies all records in every
    /// step. What the search has found is not copied, since each step begins without it.
    fn clone_from(&mut self, source: &ContactRecord) {
        let mut history = std::mem::take(&mut self.history);
        history.clone_from(&source.history);
        let next_history = std::mem::take(&mut self.next_history);
        let patch = std::mem::take(&mut self.patch);
        *self = ContactRecord { history, next_history, patch, ..*source };
    }
}

impl ContactRecord {
    /// Record of a pair that has not touched.
    pub fn new(key: PairKey) -> ContactRecord {
        ContactRecord {
            key,
            in_contact: false,
            deepest_overlap: 0.0,
            dashpot_fraction: 1.0,
            tangential_stiffness: 0.0,
            mean_history: TangentialHistory::default(),
            history: Vec::new(),
            next_history: Vec::new(),
            patch: ContactPatch::default(),
            may_interact: false,
            closest: None,
            loads: PairLoads::default(),
        }
    }
    /// Ends the contact and clears its history; the last contact point and normal are kept.
    pub fn end_contact(&mut self) {
        self.in_contact = false;
        self.dashpot_fraction = 1.0;
        self.tangential_stiffness = 0.0;
        self.mean_history = TangentialHistory::default();
        self.history.clear();
        self.loads = PairLoads {
            lever_arm: self.loads.lever_arm,
            normal: self.loads.normal,
            ..Default::default()
        };
    }
    /// Prepares another step: only quantities of the checkpoint may affect it.
    pub fn begin_step(&mut self) {
        self.deepest_overlap = 0.0;
        self.patch.reset();
    }
}

/// Updates the records to one for each of the ascending `keys`. The history of a pair that is
/// still listed is kept.
pub(in crate::dem) fn update_records(records: &mut Vec<ContactRecord>, keys: &[PairKey]) {
    records.retain(|record| keys.binary_search(&record.key).is_ok());
    let kept = records.len();
    for &key in keys {
        if records[..kept].binary_search_by_key(&key, |record| record.key).is_err() {
            records.push(ContactRecord::new(key));
        }
    }
    records.sort_unstable_by_key(|record| record.key);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dem::enclosure::Partner;

    fn key((grain, partner): (u32, usize)) -> PairKey {
        PairKey { grain, partner: Partner::Grain(partner), image: [0; 3] }
    }

    #[test]
    fn updating_keeps_the_records_of_pairs_that_remain() {
        let mut records = Vec::new();
        update_records(&mut records, &[(0, 1), (0, 2), (1, 2)].map(key));
        records[1].in_contact = true;
        records[2].in_contact = true;
        update_records(&mut records, &[(0, 2), (0, 3), (1, 3)].map(key));
        let in_contact: Vec<_> = records.iter().map(|r| r.in_contact).collect();
        assert_eq!(in_contact, [true, false, false]);
        let keys: Vec<_> = records.iter().map(|r| r.key).collect();
        assert_eq!(keys, [(0, 2), (0, 3), (1, 3)].map(key));
    }
}
