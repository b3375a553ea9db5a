//! Statistics over runs: right-censored observations, rank tests and verdicts on claims.

pub mod claim_test;
pub mod correlation;
pub mod factor_mean;
pub mod kissing;
pub mod observation;
pub mod statistics;
pub mod survival;
pub mod verdict;
