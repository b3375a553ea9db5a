//! Tests of studies: plan, runs, analysis and report.

mod common;
mod expand;
mod files;
mod findings;
mod kissing;
mod measure;
mod misses;
mod report;
mod runs;
mod settling;
mod stats;

// Run folders of the report's tests.
#[path = "../../../report/tests/report/synthetic/pair.rs"]
mod pair;
#[path = "../../../report/tests/report/synthetic/surfaces.rs"]
mod surfaces;
#[path = "../../../report/tests/report/synthetic/writing.rs"]
mod writing;
