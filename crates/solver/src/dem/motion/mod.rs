//! Motion of the grains (Eqs 19-37): contact sub-steps, integrator, rotation and the response of
//! the fluid to contact.

mod checkpoint;
mod contact_body;
mod dynamics;
mod integrator;
mod response;
pub mod rotation;
mod state_before;
mod substeps;
mod trial_step;

pub use dynamics::ContactDynamics;
pub use response::GrainResponse;
pub use state_before::RigidState;
pub use trial_step::TrialStep;
