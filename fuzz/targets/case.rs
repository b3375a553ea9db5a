//! Case files: parsed, validated, estimated.

#![no_main]

mod folder;

use grainwake_run::case::Case;
use libfuzzer_sys::{Corpus, fuzz_target};

fuzz_target!(|text: &str| -> Corpus {
    match Case::parse(text, "case.toml", folder::folder(), &[]) {
        // The warnings evaluate everything that the case says.
        Ok(case) => drop(case.estimate(2)),
        Err(error) => assert!(!error.problems().is_empty() && !error.to_string().is_empty()),
    }
    Corpus::Keep
});
