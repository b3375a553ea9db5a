//! Study and analysis files against damage: located refusals or a result, never a panic.
//! `PROPTEST_CASES` sets the number of cases.

#[path = "study/files.rs"]
mod files;

use files::{DRY, STUDY};
use grainwake_study::{Analysis, Plan, Study};
use proptest::prelude::*;
use proptest::sample::Index;

const ENSEMBLE: &str = "[ensemble]\nmembers = 3\noffset = \"0.05 mm\"\nturn = \"2 deg\"\n";

const ANALYSIS: &str = r#"
[[claim]]
part = "1"
says = "later"
quantity = "kiss_time"
test.order = { axis = "weight", more = "light", less = "heavy" }
[[claim]]
says = "faster"
quantity = "mean_speed_leading"
test.trend = { with = "density", sign = "rises" }
where = { grip = "smooth", density = { at_least = 0.5 } }
[correlations]
quantities = ["kiss_time"]
factors = ["density"]
by = "grip"
[kissing]
by = "weight"
grid = "grip"
[figures]
compare = "smooth"
reference = "alone"
[resolution]
unconverged = ["kiss_time"]
note = "coarse"
"#;

/// Texts that replace a part of a file.
const TEXTS: [&str; 16] = [
    "",
    "0",
    "-1",
    "nan",
    "1e300",
    "9223372036854775807",
    "true",
    "\"\"",
    "\"nan\"",
    "\"../x\"",
    "[]",
    "{}",
    "[[axis]]\n",
    "[ensemble]\n",
    "=",
    "\"light\"",
];

/// Replaces parts of a text: (start, length, replacement).
fn changed(text: &str, changes: &[(Index, usize, usize)]) -> String {
    let mut text = text.to_owned();
    for (at, length, to) in changes {
        if text.is_ascii() && !text.is_empty() {
            let at = at.index(text.len());
            text.replace_range(at..(at + length).min(text.len()), TEXTS[*to]);
        }
    }
    text
}

fn changes() -> impl Strategy<Value = Vec<(Index, usize, usize)>> {
    prop::collection::vec((any::<Index>(), 0..12_usize, 0..TEXTS.len()), 1..4)
}

fn config() -> ProptestConfig {
    let default = ProptestConfig::default();
    let asked = std::env::var_os("PROPTEST_CASES").is_some();
    let cases = if asked { default.cases } else { 100 };
    ProptestConfig { cases, failure_persistence: None, ..default }
}

#[test]
fn the_seeds_are_sound() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("study.toml");
    std::fs::write(folder.path().join("case.toml"), DRY).unwrap();
    let study = Study::parse(&format!("{STUDY}{ENSEMBLE}"), &path).unwrap();
    assert_eq!(Plan::resolve(&study, &[]).unwrap().runs.len(), 15);
    let analysis = Analysis::parse("analysis.toml", ANALYSIS, &study.models).unwrap();
    assert_eq!(analysis.claims.len(), 2);
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn damaged_studies_are_refused_or_resolved(changes in changes()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.toml");
        std::fs::write(folder.path().join("case.toml"), DRY).unwrap();
        let text = changed(&format!("{STUDY}{ENSEMBLE}"), &changes);
        let plan = Study::parse(&text, &path).and_then(|study| Plan::resolve(&study, &[]));
        match plan {
            // A run folder lies in the folder of the study.
            Ok(plan) => prop_assert!(plan.runs.iter().all(|run| !run.name.contains('/'))),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }

    #[test]
    fn damaged_analyses_are_refused_or_read(changes in changes()) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("case.toml"), DRY).unwrap();
        let study = Study::parse(STUDY, &folder.path().join("study.toml")).unwrap();
        if let Err(problems) =
            Analysis::parse("analysis.toml", &changed(ANALYSIS, &changes), &study.models)
        {
            prop_assert!(!problems.is_empty());
        }
    }
}
