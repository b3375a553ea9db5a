//! Overlaps of a run: measured, limited, and the stiffness that the message names.

use std::path::Path;

use crate::common::{DRY, folder_with, grainwake};
use predicates::prelude::*;
use predicates::str::contains;

/// A sphere that falls 8 mm onto a floor without fluid.
const SOFT: &str = r#"
[domain]
size = ["6 mm", "6 mm", "10 mm"]
[contact]
stiffness = 5
[time]
end = "60 ms"
step = "0.1 ms"
[output]
tables = "1 ms"
surfaces = 0
checkpoint_steps = 100
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 400
density = 2650
position = ["3 mm", "3 mm", "9 mm"]
"#;

/// The two columns of overlaps in the diagnostics.
fn overlaps(run: &Path) -> [Vec<f64>; 2] {
    let text = std::fs::read_to_string(run.join("diagnostics.csv")).unwrap();
    let mut lines = text.lines();
    assert!(lines.next().unwrap().ends_with("contacts,gap,max_overlap,mean_overlap"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let column = |from_end: usize| {
        rows.iter().map(|row| row[row.len() - from_end].parse().unwrap()).collect()
    };
    [column(2), column(1)]
}

#[test]
fn a_soft_contact_stops_and_names_the_stiffness_to_choose() {
    let (folder, case) = folder_with(SOFT);
    grainwake().arg("check").arg(&case).assert().success().stdout(
        contains("a grain that falls through the box would overlap by 33 % of its diameter")
            .and(contains("(the run stops at 10 %): raise [contact] stiffness to")),
    );
    let softest = ["--set", "contact.stiffness=1e-9"];
    let deeper = grainwake().arg("check").arg(&case).args(softest).assert().success();
    deeper.stdout(contains("would overlap by more than its diameter at impact"));
    let out = folder.path().join("soft");
    let run = |out: &Path, more: &[&str]| {
        let mut command = grainwake();
        command.arg("run").arg(&case).args(["--threads", "1", "--no-report", "-o"]).arg(out);
        command.args(more).assert()
    };
    let stopped = run(&out, &[]).code(3).stderr(
        contains("grain 0 overlaps the lower z wall by")
            .and(contains("% of the equivalent diameter; the limit is 10 %"))
            .and(contains("try a [contact] stiffness of")),
    );
    let message = String::from_utf8(stopped.get_output().stderr.clone()).unwrap();
    let failure = std::fs::read_to_string(out.join("failure.json")).unwrap();
    assert!(failure.contains("a [contact] stiffness of"), "{failure}");

    // The suggested stiffness gives the overlap that the message names.
    let (_, rest) = message.split_once("a [contact] stiffness of ").unwrap();
    let stiffness = rest.split_whitespace().next().unwrap();
    let good = folder.path().join("good");
    run(&good, &["--set", &format!("contact.stiffness={stiffness}")]).success();
    let summary = std::fs::read_to_string(good.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let largest = summary["max_overlap"].as_f64().unwrap();
    assert!((0.009..0.0105).contains(&largest), "{largest}");
    let [max, mean] = overlaps(&good);
    assert_eq!(max.iter().copied().fold(0.0, f64::max), largest);
    assert!(mean.iter().zip(&max).all(|(mean, max)| mean <= max));
    let mean = summary["mean_overlap"].as_f64().unwrap();
    assert!(0.0 < mean && mean < largest, "{mean}");

    // A larger limit continues the stopped run: the limit changes no result before.
    run(&out, &["--resume", "--set", "contact.overlap_limit=0.5"]).success();
}

#[test]
fn overlaps_of_grains_are_measured_too() {
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("out");
    let mut command = grainwake();
    command.arg("run").arg(&case).args(["--no-report", "-o"]).arg(&out);
    command.assert().success();
    let [max, _] = overlaps(&out);
    let largest = max.iter().copied().fold(0.0, f64::max);
    assert!((0.005..0.1).contains(&largest), "{largest}");
    grainwake()
        .arg("check")
        .arg(&case)
        .args(["--set", "contact.overlap_limit=0.9"])
        .assert()
        .code(2)
        .stderr(contains("contact.overlap_limit").and(contains("0.001 and 0.5")));
}
