//! Tests of contact mechanics.

mod chung_ooi;
mod clouds;
mod conservation;
mod friction;
mod gap;
mod irregular;
mod normal;
mod rotation;
mod state;
mod support;
