//! Tests of the report of a run.

mod gallery;
mod page;
mod synthetic;
