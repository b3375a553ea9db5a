//! Measured values of one run folder, and the table of all runs.

pub mod cost;
pub mod pair;
pub mod record;
pub mod settling;
pub mod table;
pub mod trajectory;
