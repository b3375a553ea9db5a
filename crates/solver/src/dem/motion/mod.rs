//! Motion of the grains (Eqs 19-37): contact sub-steps, integrator, rotation and the response of
//! the fluid to contact.

mod checkpoint;
mod contact_body;
mod dynamics;
mod integrator;
mod response;
pub mod rotation;
mod substeps;
mod trial_step;

pub use dynamics::Dynamics;
pub use response::Response;
pub use trial_step::{RigidState, TrialStep};
