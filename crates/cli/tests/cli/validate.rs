//! `grainwake validate` on small suites.

use std::path::{Path, PathBuf};

use crate::common::grainwake;
use predicates::str::contains;

/// A ball that falls freely for 0.1 s.
const CASE: &str = r#"
[domain]
size = [1, 1, 2]
[contact]
stiffness = 1e4
[[grain]]
shape = { kind = "sphere", diameter = 0.1 }
nodes = 200
density = 1000
position = [0.5, 0.5, 1.5]
[time]
end = 0.1
step = 1e-3
[output]
tables = 1e-3
"#;

const SUITE: &str = r#"
title = "Free fall"
constants = { g = 9.81 }

[[run]]
name = "fall"

[[run.check]]
quantity = "speed at the end"
take = "last"
of = "-vz/(g*0.1)"
reference = 1
tolerance = "0.1 %"

[[run.check]]
quantity = "acceleration"
take = "slope"
of = "vz"
reference = -9.81
tolerance = 1e-6

[[run.check]]
quantity = "height"
take = "curve-max"
of = "z"
data = "height.csv"
x = "t"
y = "z"
at_most = 1e-6

[[run.check]]
quantity = "time of half the speed"
take = "first-zero"
of = "-vz-g*0.05"
reference = 0.05
tolerance = "0.1 %"

[[run]]
name = "slow"
level = "full"
set = ["gravity=[0,0,-1.62]"]

[[run.check]]
quantity = "acceleration"
take = "slope"
of = "vz"
reference = { run = "fall" }
tolerance = "50 %"
"#;

fn suites(text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let suite = folder.path().join("validation/fall");
    std::fs::create_dir_all(&suite).unwrap();
    std::fs::write(suite.join("case.toml"), CASE).unwrap();
    std::fs::write(suite.join("validation.toml"), text).unwrap();
    let data = "# z = 1.5 - g t^2 / 2\nt,z\n0,1.5\n0.05,1.4877375\n0.1,1.45095\n";
    std::fs::write(suite.join("height.csv"), data).unwrap();
    (folder, suite)
}

fn validate(folder: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    grainwake().current_dir(folder).args(["validate", "--quiet"]).args(more).assert()
}

#[test]
fn what_holds_is_said_and_json_has_the_stable_names() {
    let (folder, _) = suites(SUITE);
    let done = validate(folder.path(), &["--json"]).success();
    let list: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    let list = list.as_array().unwrap();
    assert_eq!(list.len(), 4, "{list:?}");
    for verdict in list {
        for key in ["name", "quantity", "value", "reference", "error", "bound", "pass"] {
            assert!(verdict.get(key).is_some(), "{key} in {verdict}");
        }
        assert_eq!(verdict["pass"], true, "{verdict}");
    }
    validate(folder.path(), &[]).success().stdout(contains("| fall "));
}

#[test]
fn concurrent_runs_are_evaluated_in_the_order_of_the_suite() {
    // The first run, to which the second one refers, ends last.
    let text = SUITE.replacen("name = \"fall\"", "name = \"fall\"\nset = [\"time.step=1e-5\"]", 1);
    let (folder, _) = suites(&text);
    let results = |jobs| {
        let options = ["--level", "full", "--json", "--threads", "1", "--jobs", jobs];
        // On the moon the ball falls slower than the bound of the second run allows.
        let done = validate(folder.path(), &options).code(1);
        String::from_utf8(done.get_output().stdout.clone()).unwrap()
    };
    let both = results("2");
    assert!(both.find("\"fall\"") < both.find("\"slow\""), "{both}");
    assert_eq!(both, results("1"));
    let wrong = ["--level", "full", "--jobs", "2", "--set", "gravitas=1"];
    validate(folder.path(), &wrong).code(2).stderr(contains("gravitas"));
}

#[test]
fn a_value_can_be_changed_in_every_case() {
    let (folder, _) = suites(SUITE);
    let moon = ["--set", "gravity=[0,0,-1.62]"];
    validate(folder.path(), &moon).code(1).stderr(contains("acceleration: -1.62"));
    validate(folder.path(), &["--set", "gravitas=1"]).code(2).stderr(contains("gravity"));
}

#[test]
fn saved_results_are_replaced_run_by_run() {
    let (folder, _) = suites(SUITE);
    let save = ["--save", "kept"];
    validate(folder.path(), &save).success();
    validate(folder.path(), &save).success();
    let text = std::fs::read_to_string(folder.path().join("kept/ci.json")).unwrap();
    let saved: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(saved["results"].as_array().unwrap().len(), 4);
    assert_eq!(saved["runs"].as_array().unwrap().len(), 1);
    let steps = saved["runs"][0]["steps"].as_u64().unwrap();
    let cells = saved["runs"][0]["cells"].as_u64().unwrap();
    let page = std::fs::read_to_string(folder.path().join("kept/ci.md")).unwrap();
    assert!(page.contains(&format!("| fall/fall | {cells} | {steps} |")), "{page}");
}

#[test]
fn figures_are_drawn_with_the_saved_results() {
    let figure = r#"
[[figure]]
name = "height"
title = "Height of the ball"
x = { label = "*t*  [s]" }
y = { label = "*z*  [m]" }

[[figure.reference]]
label = "closed form"
data = "height.csv"
x = "t"
y = "z"
source = "Galilei"

[[figure.history]]
label = "on the earth"
run = "fall"
of = "z"

[[figure.history]]
label = "on the moon"
run = "slow"
of = "z"
"#;
    let (folder, _) = suites(&format!("{SUITE}{figure}"));
    validate(folder.path(), &["--save", "kept"])
        .success()
        .stderr(contains("left out: no finished run slow"));
    let figures = folder.path().join("kept/figures");
    let png = std::fs::read(figures.join("fall-height.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
    let svg = std::fs::read_to_string(figures.join("fall-height.svg")).unwrap();
    assert!(svg.contains(">on the earth<") && svg.contains("Galilei"), "{svg}");
    assert!(!svg.contains("moon"), "a run that is not there is left out");
    let page = std::fs::read_to_string(figures.join("README.md")).unwrap();
    assert!(page.contains("![Height of the ball](fall-height.png)"), "{page}");
    // A figure that is there is not replaced by one that lacks a run.
    std::fs::write(figures.join("fall-height.png"), "of more runs").unwrap();
    validate(folder.path(), &["--save", "kept"])
        .success()
        .stderr(contains("figure fall-height: not replaced"));
    let kept = std::fs::read_to_string(figures.join("fall-height.png"));
    assert_eq!(kept.unwrap(), "of more runs");
    // Without --save nothing is drawn.
    std::fs::remove_dir_all(folder.path().join("kept")).unwrap();
    validate(folder.path(), &["--resume"]).success();
    assert!(!folder.path().join("kept").exists());
}

#[test]
fn what_falls_short_is_exit_code_1_and_another_run_can_be_the_reference() {
    let (folder, _) = suites(SUITE);
    validate(folder.path(), &["--level", "full"])
        .code(1)
        .stdout(contains("missed"))
        .stderr(contains("fall/slow acceleration"));
}

#[test]
fn a_run_asked_for_brings_those_it_is_compared_with_and_theirs() {
    let (_, slow) = SUITE.split_once("[[run]]\nname = \"slow\"").unwrap();
    let slow = slow.replace("-1.62", "-1.5").replace("\"fall\"", "\"slow\"");
    let slower = format!("\n[[run]]\nname = \"slower\"{slow}");
    let (folder, _) = suites(&format!("{SUITE}{slower}"));
    let done = validate(folder.path(), &["fall/slower", "--level", "full", "--json"]).code(1);
    let list: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    let of = |run: &str| {
        let mut all = list.as_array().unwrap().iter();
        all.find(|v| v["run"] == run && v["quantity"] == "acceleration")
            .unwrap_or_else(|| panic!("{run} in {list}"))
    };
    assert_eq!(of("slower")["reference"], of("slow")["value"]);
    assert_eq!(of("slow")["reference"], of("fall")["value"]);
}

#[test]
fn finished_runs_are_kept_only_if_asked() {
    let (folder, suite) = suites(SUITE);
    validate(folder.path(), &[]).success();
    let mark = folder.path().join("runs/validation/fall/fall/grains.csv");
    let before = std::fs::metadata(&mark).unwrap().modified().unwrap();
    validate(folder.path(), &["--resume"]).success();
    assert_eq!(std::fs::metadata(&mark).unwrap().modified().unwrap(), before);
    // Of another case nothing is kept.
    let heavier = CASE.replace("density = 1000", "density = 1100");
    std::fs::write(suite.join("case.toml"), heavier).unwrap();
    validate(folder.path(), &["--resume"]).success();
    assert_ne!(std::fs::metadata(&mark).unwrap().modified().unwrap(), before);
    validate(folder.path(), &[]).success();
}

#[test]
fn runs_of_another_program_can_be_judged_but_not_those_of_another_case() {
    let (folder, suite) = suites(SUITE);
    let kept = folder.path().join("kept");
    let judge = ["--judge", "--save", kept.to_str().unwrap()];
    validate(folder.path(), &judge).code(2).stderr(contains("no finished run"));
    validate(folder.path(), &[]).success();
    let file = folder.path().join("runs/validation/fall/fall/provenance.json");
    let mut provenance: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    provenance["commit"] = "elsewhere".into();
    std::fs::write(&file, provenance.to_string()).unwrap();
    validate(folder.path(), &judge).success();
    assert_eq!(std::fs::read_to_string(&file).unwrap(), provenance.to_string());
    let page = std::fs::read_to_string(kept.join("ci.md")).unwrap();
    assert!(page.contains("| elsewhere |"), "{page}");
    let heavier = CASE.replace("density = 1000", "density = 1100");
    std::fs::write(suite.join("case.toml"), heavier).unwrap();
    validate(folder.path(), &judge).code(2).stderr(contains("its case has changed"));
}

#[test]
fn wrong_names_and_keys_are_exit_code_2() {
    let (folder, suite) = suites(SUITE);
    validate(folder.path(), &["fal"]).code(2).stderr(contains("did you mean \"fall\""));
    validate(folder.path(), &["fall/slow"]).code(2).stderr(contains("of the level full"));
    validate(folder.path(), &["--suites", "nowhere"]).code(2).stderr(contains("--suites"));
    for (from, to, word) in [
        ("take = \"last\"", "take = \"latest\"", "last"),
        ("quantity = \"height\"", "quantty = \"height\"", "quantity"),
        ("tolerance = \"0.1 %\"", "tolerance = \"0.1\"", "percentage"),
        ("data = \"height.csv\"", "data = \"depth.csv\"", "depth.csv"),
        ("run = \"fall\"", "run = \"fell\"", "fall"),
        ("of = \"vz\"", "of = \"vz*\"", "vz*"),
        ("name = \"slow\"", "name = \"fall\"", "two runs"),
    ] {
        std::fs::write(suite.join("validation.toml"), SUITE.replace(from, to)).unwrap();
        validate(folder.path(), &[]).code(2).stderr(contains(word));
    }
}

#[test]
fn a_column_that_is_not_there_is_a_missed_check() {
    let (folder, _) = suites(&SUITE.replace("of = \"-vz/(g*0.1)\"", "of = \"speed\""));
    validate(folder.path(), &[]).code(1).stderr(contains("there is no column or constant"));
}

#[test]
fn the_list_is_available_as_json() {
    let (folder, _) = suites(SUITE);
    let done = validate(folder.path(), &["--list", "--json"]).success();
    let listed: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    let run = &listed[0]["runs"][0];
    assert_eq!(listed[0]["title"], "Free fall");
    assert_eq!((&run["name"], &run["level"]), (&"fall".into(), &"ci".into()));
    assert_eq!(run["quantities"][1], "acceleration");
}

#[test]
fn the_validations_of_the_product_can_be_read() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let done = validate(&root, &["--list"]).success();
    let text = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    for name in ["fixed-sphere", "ten-cate", "sphere-pair", "contact"] {
        assert!(text.contains(&format!("{name}: ")), "{name} in\n{text}");
    }
}
