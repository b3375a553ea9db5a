//! Statistics over runs: right-censored observations, rank tests and verdicts on claims.

pub mod correlation;
pub mod observation;
pub mod statistics;
pub mod verdict;
