//! Forcing of the faces in and near a grain (Eqs 4b, 4c, 5): weights of the faces (`faces`),
//! impulse that the forcing takes from the fluid (`impulse`), rigid velocity imposed on the faces
//! (`rigidity`).

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
