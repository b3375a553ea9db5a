//! Coupling of flow and grains: the grid takes the rigid velocities, the grains take their loads.
//!
//! The loads follow Eq. 5.
//!
//! # Layers
//!
//! Each layer imports only from the layers above it in this table.
//!
//! | layer | task | data it makes |
//! |---|---|---|
//! | `geometry` | distances to faces, index lists, neighbours | `LocatedBody`, `BandFaces` |
//! | `forcing` | weights of faces, impulse, rigid velocity on faces | `ForcedFaces`, `Impulse` |
//! | `advection` | correction at the links near a grain | `AdvectionCorrection` |
//! | `rigid_body` | 6 x 6 equations of motion with the impulse | `RigidBodySystem` |
//! | `update`, `schedule` | work on one grain; order of the grains | `CoupledGrains` |
//!
//! # Order in a step
//!
//! `ImmersedGrains::couple` and `ImmersedGrains::impose_rigidity` in `schedule.rs` do for each
//! grain:
//!
//! 1. `advection/correction.rs` corrects the prediction u* next to the last pose of the grain.
//! 2. `geometry/locator.rs` lists the faces near the new pose. `distances.rs` evaluates their
//!    signed distances d, `narrow_band.rs` interpolates d, `lists.rs` defines the lists.
//! 3. `forcing/faces.rs` computes the weights of the forced faces: the drag, and the weight P of
//!    the pressure gradient, both of `forcing/drag.rs`.
//! 4. `forcing/impulse.rs` sums the impulse J on the fluid as an affine function of the six new
//!    velocities of the grain. The impulse on the grain is -J.
//! 5. `rigid_body/system.rs` solves for these velocities, contact load included.
//! 6. `forcing/rigidity.rs` imposes the velocities on the forced faces.
//!
//! An isolated grain passes from 1 to 6 at once. Grains that touch or are close to others are
//! processed in passes: 1 for all of them, then 2 to 4, then 5 and 6. If grains touch, the caller
//! (`sim/stages.rs`) repeats the contact sub-steps between 4 and 5, with
//! `CoupledGrains::responses`.
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
