//! Tests of the program as its user runs it.

mod bad_grain;
mod bad_input;
mod branch;
mod closed_pipes;
mod commands;
mod common;
mod contacts;
#[cfg(target_os = "linux")]
mod encoding;
mod export;
mod film;
mod hollow;
mod installed;
mod leaving;
mod lock;
mod messages;
mod outputs;
mod overlap;
mod poses;
mod probes;
mod resume;
mod scan;
mod signals;
mod study;
mod validate;
mod view;
