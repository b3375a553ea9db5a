//! Messages about cases and runs: locations, warnings and hints.

use crate::common::{DRY, WET, folder_with, grainwake};
use predicates::prelude::*;
use predicates::str::contains;

fn check(text: &str) -> assert_cmd::assert::Assert {
    let (_folder, case) = folder_with(text);
    grainwake().arg("check").arg(&case).assert()
}

#[test]
fn wrong_nodes_are_shown_where_they_are_written() {
    for nodes in ["5", "2000000"] {
        let wrong = WET.replacen("nodes = 200", &format!("nodes = {nodes}"), 1);
        let line = 1 + wrong[..wrong.find("nodes").unwrap()].matches('\n').count();
        let wrong = wrong.replace("kind = \"sphere\"", "kind = \"cylinder\", height = \"2 mm\"");
        check(&wrong)
            .code(2)
            .stderr(contains(format!("case.toml:{line}:")).and(contains("grain.0.nodes")))
            .stderr(contains("must be 16 to 1000000").and(contains("surface nodes")))
            .stderr(contains("sizes of this shape").not());
    }
}

#[test]
fn expectations_that_contradict_themselves_say_how() {
    let with = |expected: &str| check(&format!("{WET}\n[expect]\nend_time = {expected}\n"));
    with("{ value = 0.06, tolerance = \"-30 %\" }")
        .code(2)
        .stderr(contains("a tolerance of -30 %").and(contains("without its sign")));
    with("{ at_least = 2, at_most = 1 }")
        .code(2)
        .stderr(contains("at_least, 2, is above at_most, 1"));
    with("{ value = 0.06, tolerance = \"30 %\" }").success();
}

#[test]
fn absurd_viscosities_are_warned_of() {
    let thick = WET.replace("5 mPa s", "10.8 MPa s");
    check(&thick)
        .success()
        .stdout(contains("warning").and(contains("more than can be run")))
        .stdout(contains("they will hardly move").and(contains("units of viscosity")));
    check(WET).success().stdout(contains("more than can be run").not());
}

#[test]
fn a_dry_case_that_asks_for_the_flow_is_warned() {
    let asks = DRY.replace(
        "surfaces = \"20 ms\"",
        "fields = \"20 ms\"\nplanes = [{ normal = \"y\", at = \"4 mm\" }]",
    ) + "[expect]\nmax_divergence = { at_most = 1e-9 }\n";
    check(&asks).success().stdout(contains(
        "there is no [fluid], so the run is dry and output.planes, output.fields, expect.max_divergence have no effect",
    ));
    check(DRY).success().stdout(contains("no warnings"));
}

#[test]
fn check_names_the_grain_of_its_galileo_number() {
    let (head, tail) = WET.rsplit_once("diameter = \"2 mm\"").unwrap();
    let uneven = format!("{head}diameter = \"2.4 mm\"{tail}");
    check(&uneven).success().stdout(contains("(grain 1, the largest)"));
    check(WET).success().stdout(contains("the largest").not());
}

#[test]
fn another_case_is_told_by_its_keys() {
    let (folder, case) = folder_with(WET);
    let out = folder.path().join("out");
    let run = |more: &[&str]| {
        let mut command = grainwake();
        command.arg("run").arg(&case).arg("-o").arg(&out);
        command.args(["--threads", "1", "--set", "time.end=4 ms"]).args(more).assert()
    };
    run(&[]).success().stderr(contains("2 grains").and(contains("1 thread ->")));
    run(&["--resume", "--set", "fluid.viscosity=6 mPa s", "--set", "grain.1.density=2600"])
        .code(2)
        .stderr(contains("fluid.kinematic_viscosity: 0.000005 there, 0.000006 here"))
        .stderr(contains("grain.1.density: 2500.0 there, 2600.0 here"));
}

#[test]
fn a_file_is_no_run_folder() {
    let (folder, case) = folder_with(DRY);
    let file = folder.path().join("pellet.grain");
    std::fs::write(&file, "something").unwrap();
    let mut command = grainwake();
    command.arg("run").arg(&case).arg("-o").arg(&file);
    command
        .assert()
        .code(2)
        .stderr(contains("is a file, not a folder").and(contains("--resume").not()));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "something");
}

#[test]
fn a_dry_run_has_no_divergence() {
    let (folder, case) = folder_with(DRY);
    let mut command = grainwake();
    command.arg("run").arg(&case).arg("-o").arg(folder.path().join("out"));
    let done = command.args(["--set", "time.end=2 ms", "--no-report"]);
    done.assert().success().stdout(contains("done at").and(contains("div").not()));
}

#[test]
fn an_analysis_without_a_key_points_to_its_own_page() {
    let (folder, _case) = folder_with(WET);
    let path = folder.path().join("study.toml");
    let study = "title = \"s\"\nbase = \"case.toml\"\nanalysis = \"a.toml\"\n[[axis]]\nname = \"w\"\nkey = \"grain.0.density\"\nvalues = [{ name = \"a\", value = 2000 }]\n";
    std::fs::write(&path, study).unwrap();
    let analysis = "[correlations]\nquantities = [\"kiss_time\"]\nfactors = []\n";
    std::fs::write(folder.path().join("a.toml"), analysis).unwrap();
    grainwake()
        .arg("study")
        .arg(&path)
        .arg("--list")
        .assert()
        .code(2)
        .stderr(contains("a.toml:1:").and(contains("`by` is missing")))
        .stderr(contains("docs/reference/study-file.md").and(contains("grainwake schema").not()));
}

#[test]
fn unset_removes_a_key_so_that_its_default_applies() {
    let (_folder, case) = folder_with(DRY);
    let check = |more: &[&str]| grainwake().arg("check").arg(&case).args(more).assert();
    check(&["--set", "time.max_step=1 ms"]).code(2).stderr(contains("a fixed step has no limits"));
    check(&["--unset", "time.step", "--set", "time.max_step=1 ms"])
        .success()
        .stdout(contains("time step").and(contains("1 ms")));
    check(&["--unset", "grain.1.angular_velocity"]).success();
    check(&["--unset", "time.speed"])
        .code(2)
        .stderr(contains("--unset time.speed: the case has no such key"))
        .stderr(contains("present are end, step"));
    check(&["--unset", "time.step=1"]).code(2).stderr(contains("a value follows the key"));
    check(&["--unset", "grain.0"]).code(2).stderr(contains("a row of a list, not a key"));
    check(&["--unset", "grain.7.density"]).code(2).stderr(contains("grain.0, grain.1, grain.2"));
    let bench = |more: &[&str]| {
        let mut command = grainwake();
        command.args(["bench", "--steps", "1", "--warm-up", "0"]).args(more).assert()
    };
    let path = case.to_str().unwrap();
    bench(&[path, "--set", "time.max_step=1 ms"]).code(2);
    bench(&[path, "--unset", "time.step", "--set", "time.max_step=1 ms"]).success();
    bench(&["--unset", "time.step"]).code(2).stderr(contains("none is given"));
    let validate = ["validate", "contact/bounce", "--quiet", "--unset", "time.speed"];
    grainwake().args(validate).assert().code(2).stderr(contains("the case has no such key"));
}

#[test]
fn a_length_without_a_unit_is_in_metres() {
    let wrong = WET.replacen("cell_size = \"0.5 mm\"", "cell_size = 0.5", 1);
    assert_ne!(wrong, WET);
    check(&wrong)
        .code(2)
        .stderr(contains("domain.cell_size").and(contains("a cell of 500 mm is larger than")))
        .stderr(contains("without a unit is in metres").and(contains("\"0.5 mm\"")));
}

#[test]
fn a_case_is_a_file_in_utf_8() {
    let folder = tempfile::tempdir().unwrap();
    let latin = folder.path().join("latin.toml");
    std::fs::write(&latin, b"title = \"a\"\n[fluid]\nviscosity = \"1 \xb5Pa s\"\n").unwrap();
    let checked = |path: &std::path::Path| grainwake().arg("check").arg(path).assert().code(2);
    checked(folder.path()).stderr(contains("give the path of a case file"));
    checked(&latin).stderr(contains("line 3 is not a text in UTF-8 (byte 0xb5)"));
}

#[test]
fn a_report_of_no_run_says_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("notes.txt");
    std::fs::write(&file, "no run").unwrap();
    for (path, why) in [
        (folder.path().join("nowhere"), "there is no folder"),
        (file, "is a file, not a run folder"),
        (folder.path().to_owned(), "holds no run"),
    ] {
        for more in [&[][..], &["--film"]] {
            let done = grainwake().arg("report").arg(&path).args(more).assert().code(2);
            done.stderr(contains(why).and(contains("`grainwake study` has written")));
        }
    }
}
