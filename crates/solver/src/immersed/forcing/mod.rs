//! Forcing of the faces in and near a grain: their weights, the impulse it takes from the fluid, and
//! the rigid velocity imposed on them (Eqs 4b, 4c, 5).

mod drag;
mod face_forcing;
mod faces;
mod impulse;
mod rigid_run;
mod rigidity;

pub use face_forcing::ForcingParams;
pub use faces::ForcedFaces;
pub use impulse::{Impulse, sum_impulse};
pub use rigidity::impose_rigidity;
