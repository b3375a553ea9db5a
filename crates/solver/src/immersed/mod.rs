//! Coupling of flow and grains: rigidity imposed on the grid, loads on the grains (Eq. 5).
//!
//! | room | contents | imports |
//! |---|---|---|
//! | `geometry` | distances to faces, index lists, neighbouring grains, apertures | |
//! | `forcing` | weights of forced faces, sums over them, rigidity imposed | `geometry` |
//! | `advection` | correction of the advection at links cut by grains | `geometry` |
//! | `rigid_body` | equations for the new velocities of a grain | `forcing` |
//! | `update`, `schedule` | work on one grain, order of the grains | all of the above |

mod advection;
mod forcing;
mod geometry;
mod grains;
mod initial;
mod kinematics;
mod ownership;
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
