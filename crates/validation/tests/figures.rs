//! Figures of a suite, drawn from synthetic run folders.

use std::path::{Path, PathBuf};

use grainwake_validation::{DrawnFigure, Suite, SuiteError};

#[path = "../../report/tests/report/synthetic/flows.rs"]
mod flows;
#[path = "../../report/tests/report/synthetic/fresh.rs"]
mod fresh;
#[path = "../../report/tests/report/synthetic/writing.rs"]
mod writing;

const SUITE: &str = r##"
title = "Made up"
constants = { c = 0.128 }

[[run]]
name = "sphere"
check = []

[[run]]
name = "cavity"
check = []

[[run]]
name = "coarse"
constants = { n = 8 }

[[run.check]]
quantity = "z"
take = "last"
of = "z"
reference = 2

[[run]]
name = "middle"
constants = { n = 16 }

[[run.check]]
quantity = "z"
take = "last"
of = "z"
reference = 2

[[run]]
name = "fine"
constants = { n = 32 }

[[run.check]]
quantity = "z"
take = "last"
of = "z"
reference = 2

[[figure]]
name = "speed"
title = "Speed of a sphere"
caption = "It settles."
x = { label = "*t*  [s]", from = 0, to = 1.3 }
y = { label = "−*v*_{z}  [m/s]" }

[[figure.reference]]
label = "published"
data = "speed.csv"
x = "t"
y = "c*part"
source = "someone"

[[figure.history]]
label = "here"
run = "sphere"
of = "-vz"

[[figure]]
name = "order"
title = "Order"
x = { label = "cells", scale = "log", ticks = [8, 16, 32] }
y = { label = "error", scale = "log" }

[[figure.results]]
label = "error of z"
runs = ["coarse", "middle", "fine"]
quantity = "z"
x = "n"
error = true
slope = -2
line = "full"

[[figure]]
name = "lid"
title = "Lid"
field = { quantity = "vorticity", label = "*ω*", length = "L", limit = 5 }

[[figure.picture]]
run = "cavity"
plane = "y-plane0"
title = "half of it"
from = [0, 0.5]
to = [1, 1]
"##;

/// Returns a suite with this text, and an empty folder for its runs.
fn suite(text: &str) -> (PathBuf, Result<Suite, SuiteError>) {
    let folder = fresh::folder("suite");
    std::fs::write(folder.join("case.toml"), "").unwrap();
    std::fs::write(folder.join("speed.csv"), "t,part\n0.1,0.4\n0.5,0.75\n1.2,0.78\n").unwrap();
    std::fs::write(folder.join("validation.toml"), text).unwrap();
    let runs = folder.join("runs");
    std::fs::create_dir_all(&runs).unwrap();
    (runs, Suite::read(&folder))
}

/// Writes a finished run of a grain that ends at the height `z`.
fn ends_at(folder: &Path, z: f64) {
    std::fs::create_dir_all(folder).unwrap();
    let table = format!("time,grain,z\n0,0,3\n1,0,{z}\n");
    std::fs::write(folder.join("grains.csv"), table).unwrap();
    std::fs::write(folder.join("summary.json"), "{}").unwrap();
}

fn fill(runs: &Path) {
    for name in ["sphere", "cavity"] {
        std::fs::create_dir_all(runs.join(name)).unwrap();
    }
    flows::single(&runs.join("sphere"));
    flows::cavity(&runs.join("cavity"));
    // Second order between the two finest runs, not from the coarsest.
    ends_at(&runs.join("coarse"), 2.5);
    ends_at(&runs.join("middle"), 1.92);
    ends_at(&runs.join("fine"), 2.02);
}

fn svg(drawn: &DrawnFigure) -> String {
    let drawing = drawn.drawing.as_ref().unwrap();
    assert!(drawing.to_png().unwrap().starts_with(b"\x89PNG"));
    drawing.to_svg("figure", "title", "text")
}

#[test]
fn all_kinds_of_series_are_drawn() {
    let (runs, suite) = suite(SUITE);
    let suite = suite.unwrap();
    fill(&runs);
    let drawn: Vec<DrawnFigure> =
        suite.figures.iter().map(|f| f.draw(&runs, |_, _| None)).collect();
    for one in &drawn {
        assert!(one.notes.is_empty(), "{:?}", one.notes);
    }
    let speed = svg(&drawn[0]);
    assert!(speed.contains(">published<") && speed.contains(">here<"));
    let hollow = speed.matches("fill=\"none\" stroke=\"#0072b2\"").count();
    assert_eq!(hollow, 4, "three points and one in the legend");
    let order = svg(&drawn[1]);
    assert!(order.contains("error of z (order 2.00)"), "{order}");
    assert!(order.contains("slope −2") && order.contains(">32<"));
    let lid = svg(&drawn[2]);
    assert!(lid.contains("data:image/png") && lid.contains(">half of it<"));
    let text = suite.figures[0].description();
    assert_eq!(text, "It settles. Reference data: someone.");
}

#[test]
fn missing_data_are_left_out_and_listed() {
    let (runs, suite) = suite(&SUITE.replace("speed.csv", "lost.csv"));
    let suite = suite.unwrap();
    for figure in &suite.figures {
        let drawn = figure.draw(&runs, |_, _| None);
        assert!(drawn.drawing.is_none(), "{} without runs", figure.name);
        assert!(drawn.notes.iter().any(|n| n.contains("no finished run")));
    }
    fill(&runs);
    std::fs::remove_file(runs.join("coarse/summary.json")).unwrap();
    let drawn = suite.figures[0].draw(&runs, |_, _| None);
    assert!(drawn.drawing.is_some());
    assert!(drawn.notes[0].contains("\"published\"") && drawn.notes[0].contains("lost.csv"));
    let drawn = suite.figures[1].draw(&runs, |_, _| None);
    assert_eq!(drawn.notes, ["no finished run coarse"]);
    assert!(svg(&drawn).contains("order 2.00"));
    // A stored value replaces a missing run.
    let kept = |run: &str, quantity: &str| (run == "coarse" && quantity == "z").then_some(2.5);
    let with = suite.figures[1].draw(&runs, kept);
    assert!(with.notes.is_empty(), "{:?}", with.notes);
    std::fs::write(runs.join("coarse/summary.json"), "{}").unwrap();
    let all = suite.figures[1].draw(&runs, |_, _| None);
    assert_eq!(svg(&with), svg(&all));
    assert_ne!(svg(&with), svg(&drawn));
}

#[test]
fn problems_are_located() {
    let line = |text: &str, key: &str| 1 + text[..text.find(key).unwrap()].matches('\n').count();
    for (from, to, at, word) in [
        ("run = \"sphere\"", "run = \"spher\"", "\"spher\"", "did you mean \"sphere\""),
        ("of = \"-vz\"", "off = \"-vz\"", "off =", "`of`"),
        ("of = \"-vz\"", "of = \"-vz*\"", "\"-vz*\"", "expression"),
        ("y = \"c*part\"", "y = \"c*whole\"", "\"c*whole\"", "expression"),
        ("scale = \"log\", ticks", "scale = \"logs\", ticks", "\"logs\"", "log"),
        ("quantity = \"z\"\nx", "quantity = \"y\"\nx", "\"y\"\nx", "it measures: z"),
        ("x = \"n\"", "x = \"m\"", "\"m\"", "constants of this run: c, n"),
        ("x = \"n\"", "x = [8, 16]", "[8, 16]\n", "one number for each run"),
        ("\"vorticity\"", "\"vortex\"", "\"vortex\"", "vorticity"),
        ("name = \"order\"", "name = \"speed\"", "\"speed\"\ntitle = \"Order\"", "name of its own"),
        ("name = \"order\"", "name = \"a/b\"", "\"a/b\"", "letters, digits"),
        ("to = [1, 1]", "to = [1, 0]", "[1, 0]", "lower left"),
        ("field = {", "y = { label = \"\" }\nfield = {", "\"lid\"", "pictures have"),
    ] {
        let text = SUITE.replace(from, to);
        assert_ne!(text, SUITE, "{from}");
        let (_, read) = suite(&text);
        let Err(SuiteError::Invalid(problem)) = read else {
            panic!("{to} was accepted");
        };
        let (file, found, _) = problem.place().unwrap();
        assert!(file.ends_with("validation.toml"));
        assert_eq!(found, line(&text, at), "{to}: {problem}");
        let help = problem.help.clone().unwrap_or_default();
        assert!(help.contains(word), "{to}: {help}");
    }
    let (_, read) = suite(&SUITE.replace("reference = 2", ""));
    assert!(read.unwrap_err().to_string().contains("no nonzero reference"));
}
