//! Contact forces (Eqs 9-18): force laws, friction history and lubrication.
//!
//! A further force law is one file beside `linear.rs` that implements `ContactLaw`, one variant of
//! [`ContactLawKind`] and of `selected::SelectedLaw`, and its keys in the case file. A cohesive law
//! overrides `ContactLaw::normal_force`, which is never negative by default; a force across a gap
//! belongs beside `lubrication.rs`.

mod friction;
mod hertz_mindlin;
mod kinematics;
mod law;
mod linear;
mod lubrication;
mod model;
mod params;
mod record;
mod selected;

use glam::DVec3;

use super::search::Partner;
use crate::math::Load;

pub(super) use kinematics::{PairKinematics, PointMotion};
pub(super) use law::{BodyProperties, ContactMaterial, PairProperties};
pub(super) use model::ContactModel;
pub use params::{ContactLawKind, ContactParams};
pub(super) use record::{ContactRecord, TangentialHistory, update_records};

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
