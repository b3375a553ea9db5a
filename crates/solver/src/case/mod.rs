//! Case files: TOML in, a validated set-up and a run plan out.

mod error;
mod loc;
mod quantity;
mod raw;
mod source;
mod suggest;
mod units;

pub use error::{CaseError, Problem};
