//! Coupling of flow and grains: rigidity is imposed on the grid, the grains get their loads (Eq. 5).
//!
//! # Layers
//!
//! Each layer imports only from the layers above it in this table.
//!
//! | layer | task | data it makes |
//! |---|---|---|
//! | `geometry` | distances to faces, index lists, neighbours, aperture | [`geometry::LocatedBody`], [`geometry::BandFaces`] |
//! | `forcing` | weights of forced faces, impulse on the fluid, rigid velocity on faces | [`forcing::ForcedFaces`], [`forcing::Impulse`] |
//! | `advection` | correction of the advection at links near a grain | [`advection::AdvectionCorrection`] |
//! | `rigid_body` | 6 x 6 equations of motion with the impulse | [`rigid_body::RigidBodySystem`] |
//! | `update`, `schedule` | work on one grain; order of the grains and threads | [`CoupledGrains`] |
//!
//! # Order in a step
//!
//! [`ImmersedGrains::couple`] and [`ImmersedGrains::impose_rigidity`] (`schedule.rs`) do, per grain:
//!
//! 1. `advection/correction.rs` corrects the predicted velocity u* at the faces where the grain was;
//! 2. `geometry/locator.rs` finds the faces near the new pose: `distances.rs` evaluates the signed
//!    distance d, `narrow_band.rs` interpolates it, `lists.rs` stores it;
//! 3. `forcing/faces.rs` weighs the forced faces. The solid fraction of a face is 1 - A(d), with the
//!    aperture A of `geometry/aperture.rs`;
//! 4. `forcing/impulse.rs` sums the impulse of the fluid on the grain, with opposite sign, as an
//!    affine function of the six new velocities;
//! 5. `rigid_body/system.rs` solves for these velocities, contact load included;
//! 6. `forcing/rigidity.rs` imposes them on the forced faces.
//!
//! An isolated grain passes through 1 to 6 at once. Where grains touch or are close, each of 1, 2 to 4
//! and 5 to 6 is completed for all of them before the next begins. Between 4 and 5 the caller repeats
//! the contact sub-steps with [`CoupledGrains::responses`] (`sim/stages.rs`).
//!
//! Every kernel has a plain scalar form in `reference/`, against which it is tested.

mod access;
mod advection;
mod forcing;
mod geometry;
mod grains;
mod initial;
mod kinematics;
#[cfg(test)]
mod reference;
mod rigid_body;
mod schedule;
mod scheme;
mod scratch;
#[cfg(test)]
mod tests;
mod update;

pub(crate) use grains::ImmersedGrains;
pub(crate) use kinematics::{GrainKinematics, PreviousStep, RigidVelocity};
pub(crate) use schedule::{CoupledGrains, RigidStep};
pub use scheme::Scheme;
pub(crate) use update::StepInput;
