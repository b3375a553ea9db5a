//! Study files of a small case, and analysis files behind a line `---`.

#![no_main]

mod folder;

use grainwake_study::{Analysis, Plan, Study};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let (study, analysis) = text.split_once("\n---\n").unwrap_or((text, ""));
    let path = folder::folder().join("study.toml");
    if !path.exists() {
        folder::file("case.toml", include_bytes!("../seeds/case/dry.toml"));
        folder::file("study.toml", b"");
    }
    let Ok(study) = Study::parse(study, &path) else { return };
    if let Err(problems) = Analysis::parse("analysis.toml", analysis, &study.models) {
        assert!(!problems.is_empty());
    }
    match Plan::resolve(&study, &[]) {
        // A run folder lies in the folder of the study.
        Ok(plan) => assert!(plan.runs.iter().all(|run| !run.name.contains('/'))),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
