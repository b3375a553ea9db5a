//! Case files: what is read, what is refused, and where the message points.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use grainwake_run::case::{Case, CaseError, Problem};
use grainwake_run::{Plane, PlanePosition};
use grainwake_solver::dem::{ContactLawKind, Material, MotionConstraint, surface_gap};
use grainwake_solver::flow::Boundary;
use grainwake_solver::immersed::Start;
use grainwake_solver::sim::StepRule;

/// The paper's pair (section 3.2.2) with spheres.
const PAIR: &str = r#"
title = "pair"

[fluid]
density = 1000
viscosity = "1 mPa s"

[domain]
size = ["25 mm", "25 mm", "97.5 mm"]
cell_size = "0.25 mm"

[time]
end = "1 s"

[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
density = "1500 kg/m3"
position = ["12.5 mm", "12.5 mm", "80 mm"]

[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
density = "1.5 g/cm3"
gap_above = { grain = 0, gap = "3 mm" }
"#;

fn parse(text: &str) -> Result<Case, CaseError> {
    Case::parse(text, "case.toml", Path::new("."), &[])
}

fn good(text: &str) -> Case {
    parse(text).unwrap_or_else(|e| panic!("{e}"))
}

/// The problems of a case that must be refused.
fn problems(text: &str) -> Vec<Problem> {
    match parse(text) {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(error) => error.problems().to_vec(),
    }
}

/// One change to the pair must be refused on the line that was changed, and say these words.
fn refused(from: &str, to: &str, key: &str, words: &[&str]) {
    assert!(PAIR.contains(from), "{from}");
    let text = PAIR.replacen(from, to, 1);
    let found = problems(&text);
    let line = PAIR[..PAIR.find(from).unwrap()].matches('\n').count() + 1;
    let all: String =
        found.iter().map(|p| format!("{p} | {}\n", p.help.clone().unwrap_or_default())).collect();
    let hit = found.iter().find(|p| p.key.as_deref().is_some_and(|k| k.starts_with(key)));
    let hit = hit.unwrap_or_else(|| panic!("no problem of {key}:\n{all}"));
    let (file, at, _) = hit.place().unwrap_or_else(|| panic!("no place:\n{all}"));
    assert_eq!(file, "case.toml");
    // What is missing is told of its table.
    let line = if to.trim().is_empty() {
        PAIR[..PAIR.find(from).unwrap()]
            .rfind("[[")
            .map(|i| PAIR[..i].matches('\n').count() + 1)
            .unwrap()
    } else {
        line
    };
    assert!(
        (line..=line + to.matches('\n').count()).contains(&at),
        "line {at}, not {line}:\n{all}"
    );
    for word in words {
        assert!(all.contains(word), "`{word}` is missing in:\n{all}");
    }
}

#[test]
fn the_papers_pair_is_understood() {
    let case = good(PAIR);
    assert_eq!(case.setup.mesh.cells, [100, 100, 390]);
    assert_eq!(case.setup.mesh.spacing, DVec3::splat(0.25e-3));
    let fluid = case.setup.fluid.unwrap();
    assert_eq!((fluid.density, fluid.kinematic_viscosity), (1000.0, 1e-6));
    let [a, b] = &case.setup.grains[..] else { panic!() };
    assert_eq!(a.pose.position, DVec3::new(0.0125, 0.0125, 0.08));
    assert_eq!((b.pose.position.x, b.density), (0.0125, 1500.0));
    assert!((b.pose.position.z - 0.085).abs() < 1e-9, "{}", b.pose.position.z);
    let gap = surface_gap(a, b, &case.setup.enclosure());
    assert!((gap - 3e-3).abs() < 1e-8, "{gap}");
    assert_eq!((a.translation, a.rotation), (MotionConstraint::Free, MotionConstraint::Free));
    assert_eq!(case.setup.boundaries.0, [[Boundary::WALL; 2]; 3]);
    assert!(matches!(case.setup.step, StepRule::Limits { .. }));
    assert_eq!(
        case.plan.planes,
        [
            Plane { axis: 1, position: PlanePosition::Grain(0) },
            Plane { axis: 1, position: PlanePosition::Grain(1) }
        ]
    );
    let estimate = case.estimate(2);
    assert!((estimate.galileo.unwrap() - 198.1).abs() < 0.1);
    assert!((estimate.cells_per_diameter.unwrap() - 8.0).abs() < 1e-9);
    assert_eq!(estimate.cells, 3_900_000);
}

#[test]
fn a_resolved_case_resolves_to_itself() {
    let with_more = PAIR.replace("[time]", "[contact]\nmaximum_overlap = 0.02\n\n[time]").replace(
        "density = \"1500 kg/m3\"",
        "density = \"1500 kg/m3\"\nmotion = { velocity = [0, 0, \"-1 mm/s\"] }\norientation = { axis = [1, 2, 3], angle = \"33 deg\" }",
    );
    for text in [PAIR, &with_more] {
        let first = good(text);
        let second = good(&first.resolved);
        assert_eq!(first.resolved, second.resolved);
        assert_eq!(first.digest, second.digest);
        for (a, b) in first.setup.grains.iter().zip(&second.setup.grains) {
            assert_eq!((a.pose, a.velocity, a.translation), (b.pose, b.velocity, b.translation));
        }
        assert_eq!(
            (first.setup.contact, first.setup.step, first.plan),
            (second.setup.contact, second.setup.step, second.plan)
        );
    }
}

#[test]
fn an_override_replaces_what_its_key_names() {
    let text = "[fluid]\ndensity = 1000\nviscosity = 1e-3\n[domain]\nsize = [0.01, 0.01, 0.01]\ncell_size = 5e-4\n\
        [[grain]]\nshape = { kind = \"sphere\", diameter = 2e-3 }\ndensity = 1500\nposition = [5e-3, 5e-3, 5e-3]\n[time]\nend = 1\n";
    let load = |set: &str| Case::parse(text, "ball.toml", Path::new(""), &[set.to_owned()]);
    let case = load("grain.0.shape={ kind = \"ellipsoid\", size = [3e-3, 2e-3, 2e-3] }").unwrap();
    let extent = case.setup.grains[0].shape.upper() - case.setup.grains[0].shape.lower();
    assert!((extent.max_element() - 3e-3).abs() < 1e-5, "{extent}");
    // A longer key changes only what it names.
    let larger = load("grain.0.shape.diameter=3e-3").unwrap();
    let diameter = larger.setup.grains[0].shape.equivalent_diameter();
    assert!((diameter - 3e-3).abs() < 1e-12);
    let lost = load("grain.0.shape={ diameter = 3e-3 }").unwrap_err();
    assert!(lost.to_string().contains("kind"), "{lost}");
}

#[test]
fn the_digest_follows_what_decides_the_results() {
    let digest = |from: &str, to: &str| good(&PAIR.replacen(from, to, 1)).digest;
    let original = good(PAIR).digest;
    assert_eq!(digest("\"pair\"", "\"another title\""), original);
    assert_eq!(digest("[time]", "[run]\nthreads = 3\n[time]"), original);
    assert_eq!(digest("[time]", "[output]\ncheckpoint_steps = 3\n[time]"), original);
    assert_ne!(digest("[time]", "[run]\nprecision = \"f32\"\n[time]"), original);
    assert_ne!(digest("1500 kg/m3", "1501 kg/m3"), original);
    assert_ne!(digest("1 mPa s", "1.1 mPa s"), original);
    assert_ne!(digest("[time]", "[output]\nslices = \"1 ms\"\n[time]"), original);
}

#[test]
fn mistyped_keys_and_words_are_corrected() {
    refused("viscosity =", "visocsity =", "fluid", &["unknown key", "did you mean `viscosity`"]);
    refused("position =", "positon =", "grain.0", &["did you mean `position`"]);
    refused("[time]\n", "[tme]\n", "tme", &["did you mean `time`"]);
    refused(
        "cell_size = \"0.25 mm\"",
        "cell_size = \"0.25 mm\"\nboundaries = { x = \"periodc\" }",
        "domain.boundaries",
        &["did you mean \"periodic\"", "free-surface"],
    );
    refused("kind = \"sphere\"", "kind = \"spere\"", "grain.0.shape", &["sphere"]);
    refused("gap = \"3 mm\"", "gpa = \"3 mm\"", "grain.1.gap_above", &["did you mean `gap`"]);
}

#[test]
fn a_lubrication_gap_must_exceed_the_roughness() {
    let contact = |line: &str| format!("end = \"1 s\"\n[contact]\n{line}");
    let words = ["is not above the roughness, 2 um", "lubrication_gap = 0"];
    let gap = contact("lubrication_gap = \"1.5 um\"");
    refused("end = \"1 s\"", &gap, "contact.lubrication_gap", &words);
    good(&PAIR.replace("end = \"1 s\"", &gap.replace("1.5 um", "3 um")));
    let smooth = contact("lubrication_gap = \"1.5 um\"\nroughness = \"1 um\"");
    good(&PAIR.replace("end = \"1 s\"", &smooth));
    // Without grains the default roughness is not known, and the resolved case does without.
    let flow = PAIR.split("[[grain]]").next().unwrap();
    let flow = flow.replace("end = \"1 s\"", &contact("lubrication_gap = \"0.1 mm\""));
    good(&good(&flow).resolved);
}

#[test]
fn lengths_and_angles_without_their_unit_are_refused() {
    let contact = |line: &str| format!("end = \"1 s\"\n[contact]\n{line}");
    let end = "end = \"1 s\"";
    let words = ["is larger than a grain (2 mm)", "with its unit"];
    refused(end, &contact("lubrication_gap = 0.25"), "contact.lubrication_gap", &words);
    refused(end, &contact("roughness = 1"), "contact.roughness", &words);
    let position = "position = [\"12.5 mm\", \"12.5 mm\", \"80 mm\"]";
    for angle in ["45", "\"45\"", "\" 45.0 \""] {
        let turned = format!("{position}\nrotate = {{ axis = \"y\", angle = {angle} }}");
        refused(position, &turned, "grain.0.rotate", &["45 deg", "radians"]);
    }
}

#[test]
fn text_that_is_not_toml_is_named() {
    let message = |text: &str| problems(text)[0].to_string();
    assert!(message("{\"fluid\": 1}").contains("case.toml is JSON"), "{}", message("{}"));
    assert!(message("solid\0\u{1}").contains("is not a file of text"), "{}", message("\0"));
    good(&format!("# grain\u{92}s\n{PAIR}"));
    let twice = problems("[grain]\ndensity = 1\n[grain]\ndensity = 2\n");
    assert!(twice[0].help.as_ref().unwrap().contains("[[grain]]"), "{:?}", twice[0].help);
}

#[test]
fn wrong_units_name_the_right_one() {
    refused("\"1 mPa s\"", "\"1 mm\"", "fluid.viscosity", &["is a length", "1 mPa s"]);
    refused(
        "\"2 mm\"",
        "\"2 mmm\"",
        "grain.0.shape.diameter",
        &["unknown unit", "did you mean `mm`"],
    );
    refused("\"1500 kg/m3\"", "\"1500 kg\"", "grain.0.density", &["is a mass", "kg/m3"]);
    refused("\"1 s\"", "\"1 m\"", "time.end", &["is a length", "a time"]);
    refused("\"1 mPa s\"", "\"1 mPas\"", "fluid.viscosity", &["did you mean `mPa s`"]);
    refused(
        "[\"12.5 mm\", \"12.5 mm\", \"80 mm\"]",
        "[\"12.5 mm\", \"12.5 kg\", \"80 mm\"]",
        "grain.0.position",
        &["is a mass"],
    );
    refused("density = 1000", "density = true", "fluid.density", &["density"]);
    refused("density = 1000", "density = nan", "fluid.density", &["NaN"]);
}

#[test]
fn values_out_of_range_are_refused() {
    refused("density = 1000", "density = 0", "fluid.density", &["greater than zero"]);
    refused("\"1500 kg/m3\"", "-1500", "grain.0.density", &["greater than zero"]);
    refused("\"1 s\"", "0", "time.end", &["greater than zero"]);
    refused("\"2 mm\"", "\"-2 mm\"", "grain.0.shape", &["`diameter` is -0.002", "positive"]);
    let cell = "cell_size = \"0.25 mm\"";
    let one = "cells = [1, 1, 1]\nboundaries = { x = \"periodic\", y = \"periodic\" }";
    refused(cell, one, "domain", &["a fluid needs more than one cell"]);
    refused("[time]", "[contact]\nrestitution = 1.5\n[time]", "contact.restitution", &["between"]);
    refused(
        "[time]",
        "[run]\nprecision = \"f16\"\n[time]",
        "run.precision",
        &["f16", "f32", "f64"],
    );
    refused("[time]", "[output]\ntables = \"1 ns\"\n[time]", "output.tables", &["unit forgotten"]);
}

#[test]
fn boxes_that_do_not_fit_say_what_would() {
    refused(
        "\"0.25 mm\"",
        "\"0.3 mm\"",
        "domain.cell_size",
        &["whole number of cells", "84 cells"],
    );
    refused("\"0.25 mm\"", "\"0.25 nm\"", "domain.cell_size", &["unit forgotten"]);
    refused("cell_size = \"0.25 mm\"", "cells = [0, 10, 10]", "domain.cells", &["1 to"]);
    refused(
        "cell_size = \"0.25 mm\"",
        "cell_size = \"0.25 mm\"\ncells = [100, 100, 100]",
        "domain.cells",
        &["two of"],
    );
    assert!(
        problems(&PAIR.replace("cell_size = \"0.25 mm\"\n", ""))[0]
            .help
            .as_ref()
            .unwrap()
            .contains("two of size")
    );
}

#[test]
fn boundaries_must_belong_together() {
    let with = |faces: &str, key: &str, words: &[&str]| {
        let to = format!("cell_size = \"0.25 mm\"\nboundaries = {{ {faces} }}");
        refused("cell_size = \"0.25 mm\"", &to, key, words);
    };
    with("x = [\"periodic\", \"wall\"]", "domain.boundaries.x", &["one side only"]);
    with("x = { lower = \"periodic\" }", "domain.boundaries.x", &["one side only"]);
    with(
        "x = [{ kind = \"inflow\", velocity = [0.1, 0, 0] }, \"wall\"]",
        "domain.boundaries.x",
        &["outflow"],
    );
    with("x = [\"inflow\", \"outflow\"]", "domain.boundaries.x", &["velocity"]);
    with(
        "x = [{ kind = \"inflow\", velocity = [-0.1, 0, 0] }, \"outflow\"]",
        "domain.boundaries.x",
        &["leaves the box"],
    );
    with(
        "x = [{ kind = \"wall\", velocity = [0.1, 0, 0] }, \"wall\"]",
        "domain.boundaries.x",
        &["own plane"],
    );
    with(
        "x = { kind = \"slip\", velocity = [0, 0.1, 0] }",
        "domain.boundaries.x",
        &["kind \"slip\" has no velocity"],
    );
    let two = "z = [\"wall\", \"free-surface\"], x = [\"free-surface\", \"wall\"]";
    with(two, "domain.boundaries.z.1", &["a second free surface; the box can have one"]);
    with("z = \"free-surface\"", "domain.boundaries.z", &["second free surface", "slip"]);
    let count = |faces: &str| {
        let boundaries = format!("cell_size = \"0.25 mm\"\nboundaries = {{ {faces} }}");
        problems(&PAIR.replace("cell_size = \"0.25 mm\"", &boundaries)).len()
    };
    let all = |word: &str| {
        let boundaries = format!("cell_size = \"0.25 mm\"\nboundaries = \"{word}\"");
        PAIR.replace("cell_size = \"0.25 mm\"", &boundaries)
    };
    assert_eq!(good(&all("slip")).setup.boundaries.0, [[Boundary::Slip; 2]; 3]);
    let (cell, key) = ("cell_size = \"0.25 mm\"", "domain.boundaries");
    let with = |word: &str| format!("boundaries = \"{word}\"\n{cell}");
    refused(cell, &with("free-surface"), key, &["second free surface"]);
    refused(cell, &with("slippery"), key, &["slippery", "free-surface"]);
    let slip = "{ kind = \"slip\", velocity = [0, 0.1, 0] }";
    assert_eq!(count(&format!("x = {slip}")), 1, "one value for both sides");
    assert_eq!(count(&format!("x = [{slip}, {slip}]")), 2, "a value for each side");
    let lid = PAIR.replace("cell_size = \"0.25 mm\"", "cell_size = \"0.25 mm\"\nboundaries = { x = \"periodic\", z = [\"wall\", { kind = \"wall\", velocity = [\"1 cm/s\", 0, 0] }] }");
    let case = good(&lid);
    assert_eq!(case.setup.boundaries.0[0], [Boundary::Periodic; 2]);
    assert_eq!(
        case.setup.boundaries.0[2][1],
        Boundary::Wall { velocity: DVec3::new(0.01, 0.0, 0.0) }
    );
}

#[test]
fn grains_must_stand_clear_and_inside() {
    refused(
        "gap_above = { grain = 0, gap = \"3 mm\" }",
        "gap_above = { grain = 0, gap = \"-1 mm\" }",
        "grain.1",
        &["overlap at the start by 1 mm", "move them apart"],
    );
    refused("\"80 mm\"]", "\"97 mm\"]", "grain.0.position", &["crosses a side", "0.5 mm"]);
    refused(
        "[\"12.5 mm\", \"12.5 mm\", \"80 mm\"]",
        "[\"12.5 mm\", \"40 mm\", \"80 mm\"]",
        "grain.0.position",
        &["outside the box"],
    );
    refused(
        "gap_above = { grain = 0",
        "gap_above = { grain = 1",
        "grain.1.gap_above",
        &["does not stand before"],
    );
    refused(
        "position = [\"12.5 mm\", \"12.5 mm\", \"80 mm\"]",
        "position = [\"12.5 mm\", \"12.5 mm\"]",
        "grain.0.position",
        &["gap_above"],
    );
    refused(
        "position = [\"12.5 mm\", \"12.5 mm\", \"80 mm\"]\n",
        "\n",
        "grain.0",
        &["no position"],
    );
}

#[test]
fn grains_beyond_the_box_say_what_helps() {
    let position = "[\"12.5 mm\", \"12.5 mm\", \"80 mm\"]";
    refused(
        position,
        "[\"12.5 mm\", \"12.5 mm\", 80]",
        "grain.0.position",
        &["beyond the upper z side (at 97.5 mm)", "unit forgotten? bare numbers are metres"],
    );
    let far = problems(&PAIR.replace("\"80 mm\"]", "\"80 m\"]"));
    assert!(!far[0].help.as_ref().unwrap().contains("metres"), "{far:?}");
    for (from, to, key, words) in [
        (
            "diameter = \"2 mm\" }",
            "diameter = \"30 mm\" }",
            "grain.0.shape",
            ["larger than the box: 30 mm along x, the box has 25 mm", "equivalent_diameter"],
        ),
        (
            "density = \"1500 kg/m3\"",
            "equivalent_diameter = 2\ndensity = \"1500 kg/m3\"",
            "grain.0.equivalent_diameter",
            ["larger than the box: 2 m", "bare numbers are metres"],
        ),
    ] {
        refused(from, to, key, &words);
        let found = problems(&PAIR.replacen(from, to, 1));
        let helps = found.iter().filter_map(|p| p.help.as_ref());
        let moves = helps.filter(|help| help.contains("move it by")).count();
        // The grain above it may still be told to move.
        assert!(moves <= 1, "{found:?}");
    }
}

#[test]
fn grains_within_each_other_overlap_by_all_there_is() {
    for (height, depth) in [("80 mm", "2 mm"), ("80.5 mm", "1.5 mm")] {
        refused(
            "gap_above = { grain = 0, gap = \"3 mm\" }",
            &format!("position = [\"12.5 mm\", \"12.5 mm\", \"{height}\"]"),
            "grain.1.position",
            &[&format!("overlap at the start by {depth}")],
        );
    }
}

#[test]
fn free_grains_lighter_than_the_coupling_bears_are_refused() {
    let density = "density = \"1500 kg/m3\"";
    refused(
        density,
        "density = \"0.005 g/cm3\"",
        "grain.0.density",
        &["0.005 times the density", "at least 0.01", "10 kg/m3"],
    );
    refused(
        density,
        "density = 2.5",
        "grain.0.density",
        &["without a unit it is in kg/m3: was \"g/cm3\" forgotten?"],
    );
    let with_unit = problems(&PAIR.replace(density, "density = \"2.5 kg/m3\""));
    let help = with_unit[0].help.as_ref().unwrap();
    assert!(!help.contains("forgotten"), "{help}");
    let packed = PAIR.replace(
        "[time]",
        "[[packing]]\ncount = 3\nshapes = [{ kind = \"sphere\", diameter = \"2 mm\" }]\ndensity = 2\nregion = { lower = [0, 0, 0], upper = [\"25 mm\", \"25 mm\", \"20 mm\"] }\n[time]",
    );
    let found = problems(&packed);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].key.as_deref(), Some("packing.0.density"));
    // Held grains may be as light as they like, and so may grains without a fluid.
    good(&PAIR.replacen(density, "density = 2\nmotion = \"fixed\"", 1));
    let fluid = "[fluid]\ndensity = 1000\nviscosity = \"1 mPa s\"\n";
    assert!(PAIR.contains(fluid));
    good(&PAIR.replace(fluid, "").replacen(density, "density = 2", 1));
}

/// Water through a box 2.5 mm deep, along z, past a fixed cylinder or sphere of 2 mm.
fn past_a_grain(domain: &str, shape: &str) -> Case {
    good(&format!(
        "[fluid]\ndensity = 1000\nviscosity = \"1 mPa s\"\n\
         [domain]\n{domain}\n\
         [time]\nend = \"10 ms\"\n\
         [[grain]]\nshape = {{ kind = \"{shape}\", diameter = \"2 mm\" }}\ndensity = 2000\n\
         motion = \"fixed\"\nposition = [\"5 mm\", \"1.25 mm\", \"10 mm\"]\n"
    ))
}

#[test]
fn the_resolution_of_a_flat_box_is_that_in_its_plane() {
    let flat = "cells = [40, 1, 80]\ncell_size = [\"0.25 mm\", \"2.5 mm\", \"0.25 mm\"]\n\
                boundaries = { x = \"slip\", y = \"periodic\", z = \"slip\" }";
    let across = past_a_grain(flat, "sphere").estimate(1).cells_per_diameter.unwrap();
    assert!((across - 8.0).abs() < 1e-9, "{across}");
}

#[test]
fn the_speed_of_an_inflow_counts_for_the_resolution() {
    let through = "size = [\"10 mm\", \"2.5 mm\", \"20 mm\"]\ncell_size = \"0.25 mm\"\n\
                   boundaries = { x = \"slip\", y = \"slip\", z = [{ kind = \"inflow\", \
                   velocity = [0, 0, 0.5] }, \"outflow\"] }";
    let estimate = past_a_grain(through, "sphere").estimate(1);
    assert!((estimate.start_reynolds.unwrap() - 1000.0).abs() < 1e-6);
    let warnings = estimate.warnings.join("\n");
    assert!(warnings.contains("the boundary layer is not resolved"), "{warnings}");
    // The surface of a sphere of 2 mm that spins at 1000 rad/s moves at 1 m/s.
    let spun = "density = \"1500 kg/m3\"\nangular_velocity = [0, 0, 1000]";
    let spinning = good(&PAIR.replace("density = \"1500 kg/m3\"", spun)).estimate(1);
    assert!((spinning.start_reynolds.unwrap() - 2000.0).abs() < 1e-6);
}

#[test]
fn blockage_is_that_of_the_flow_past_the_grain_with_and_without_gravity() {
    let case = |boundaries: &str, motion: &str, more: &str| {
        good(&format!(
            "{more}\n[fluid]\ndensity = 1000\nviscosity = \"10 mPa s\"\n\
             [domain]\nsize = [\"3 mm\", \"3 mm\", \"12 mm\"]\ncell_size = \"0.25 mm\"\n\
             boundaries = {{ {boundaries} }}\n[time]\nend = \"0.02 s\"\n\
             [[grain]]\nshape = {{ kind = \"sphere\", diameter = \"2 mm\" }}\ndensity = 1000\n\
             position = [\"1.5 mm\", \"1.5 mm\", \"6 mm\"]\n{motion}"
        ))
        .estimate(1)
    };
    let none = "gravity = [0, 0, 0]";
    let through = "z = [\"outflow\", { kind = \"inflow\", velocity = [0, 0, -0.1] }]";
    let towed = "motion = { velocity = [0, 0, \"-0.1 m/s\"], angular_velocity = \"fixed\" }";
    let swung = "motion = { velocity = { formula = [0, 0, \"0.1*sin(600*t)\"] } }";
    let sideways = "gravity = [9.81, 0, 0]";
    let along_z = std::f64::consts::PI / 9.0;
    for (boundaries, motion, gravity) in [
        ("", towed, none),
        ("", swung, none),
        (through, "motion = \"fixed\"", none),
        (through, "", none),
        (through, "motion = \"fixed\"", sideways),
        ("", "", ""),
    ] {
        let estimate = case(boundaries, motion, gravity);
        let blockage = estimate.blockage.expect("a blockage");
        assert!((blockage - along_z).abs() < 1e-9, "{motion} {gravity}: {blockage}");
        let warnings = estimate.warnings.join("\n");
        assert!(warnings.contains("blocks 35 % of the cross-section"), "{warnings}");
    }
    let across = case("", "", sideways).blockage.unwrap();
    assert!((across - along_z / 4.0).abs() < 1e-9, "{across}");
    assert_eq!(case("", "motion = \"fixed\"", none).blockage, None);
}

#[test]
fn refinement_is_not_advised_for_grains_that_float_in_a_free_surface() {
    let floating = PAIR
        .replace("\"1500 kg/m3\"", "600")
        .replace("\"0.25 mm\"", "\"0.5 mm\"\nboundaries = { z = [\"wall\", \"free-surface\"] }");
    let warnings = |text: &str| good(text).estimate(1).warnings.join("\n");
    let coarse = warnings(&floating);
    assert!(
        coarse.contains("make cell_size smaller") && !coarse.contains("refinement"),
        "{coarse}"
    );
    let refined = warnings(&floating.replace("[domain]", "[domain]\nrefinement = 2"));
    assert!(refined.contains("floats up to the free surface"), "{refined}");
    // At the surface from the start: the run would stop after its first step.
    let there = floating.replace("\"80 mm\"", "\"97 mm\"");
    good(&there);
    let refused = problems(&there.replace("[domain]", "[domain]\nrefinement = 2"));
    let all = format!("{refused:?}");
    assert!(all.contains("grain 0 reaches 0.5 mm beyond the free surface"), "{all}");
    assert_eq!(refused[0].key.as_deref(), Some("grain.0.position"), "{all}");
}

#[test]
fn light_grains_are_warned_of() {
    let warnings = |densities: [&str; 2], stop: &str| {
        let text = PAIR
            .replace("\"1500 kg/m3\"", densities[0])
            .replace("\"1.5 g/cm3\"", densities[1])
            .replace("end = \"1 s\"", &format!("end = \"1 s\"\n{stop}"));
        good(&text).estimate(1).warnings.join("\n")
    };
    let landing = "stop = \"landing\"";
    let light = warnings(["400", "2000"], "");
    assert!(light.contains("1 of 2 free grains"), "{light}");
    let rising = warnings(["600", "700"], landing);
    assert!(rising.contains("they rise"), "{rising}");
    assert!(rising.contains("upwards") && !rising.contains("never"), "{rising}");
    assert!(warnings(["600", "2000"], landing).contains("may never be met"));
    let heavy = warnings(["1500", "2000"], landing);
    assert!(!heavy.contains("rise") && !heavy.contains("landing"), "{heavy}");
}

/// Warnings of a case.
fn warnings(text: &str) -> String {
    good(text).estimate(1).warnings.join("\n")
}

#[test]
fn eight_cells_are_enough_and_fewer_are_warned_of() {
    let cells = |size: &str| PAIR.replace("cell_size = \"0.25 mm\"", size);
    assert!(!warnings(PAIR).contains("cells across"), "{}", warnings(PAIR));
    // 0.8 mm over 0.1 mm is 7.999999999999999.
    let tenths = PAIR
        .replace("[\"25 mm\", \"25 mm\", \"97.5 mm\"]", "[0.025, 0.025, 0.095]")
        .replace("\"2 mm\"", "\"0.8 mm\"");
    let tenths = tenths.replace("cell_size = \"0.25 mm\"", "cell_size = \"0.1 mm\"");
    assert!(!warnings(&tenths).contains("cells across"), "{}", warnings(&tenths));
    let coarse = warnings(&cells("cell_size = \"0.5 mm\""));
    assert!(coarse.contains("only 4.0 cells across the smallest grain: below 8"), "{coarse}");
    assert!(!coarse.contains("may become unstable"), "{coarse}");
    let coarser = warnings(&cells("cells = [40, 40, 156]"));
    assert!(coarser.contains("below 4 the run may become unstable"), "{coarser}");
}

#[test]
fn boundary_layers_are_warned_of_from_five_percent() {
    // Settling at Re 184 (4.8 %) and Re 197 (5.1 %), by Schiller and Naumann.
    let density = |value: &str| PAIR.replace("1500 kg/m3", value).replace("1.5 g/cm3", value);
    assert!(!warnings(&density("1270 kg/m3")).contains("boundary layer"));
    let thin = warnings(&density("1301 kg/m3"));
    assert!(thin.contains("boundary layer is not resolved"), "{thin}");
    assert!(thin.contains("the drag may be up to 5 % too low; 12 cells"), "{thin}");
}

#[test]
fn unbalanced_weights_without_walls_are_warned_of() {
    let case = |density: f64, acceleration: &str| {
        let text = format!(
            r#"
            gravity = [0, 0, -10]
            [fluid]
            density = 1000
            viscosity = "5 mPa s"
            body_acceleration = {acceleration}
            [domain]
            size = ["10 mm", "10 mm", "20 mm"]
            cell_size = "0.5 mm"
            boundaries = {{ x = "periodic", y = "periodic", z = "periodic" }}
            [[packing]]
            count = 8
            shapes = [{{ kind = "sphere", diameter = "4 mm" }}]
            density = {density}
            [time]
            end = 0.1
            "#
        );
        good(&text).estimate(1).warnings.join("\n")
    };
    // 8 spheres of 33.51 mm3 in 2000 mm3: the excess of 500 kg/m3 takes 0.6702 m/s2.
    let none = case(1500.0, "[0, 0, 0]");
    assert!(none.contains("fixed grain carries the weight: grains and fluid fall"), "{none}");
    assert!(none.contains("body_acceleration = [0, 0, 0.670206] (m/s2) balances it"), "{none}");
    let little = case(1500.0, "[0.1, 0, 0.3]");
    assert!(little.contains("does not balance the weight: grains and fluid fall"), "{little}");
    assert!(little.contains("body_acceleration = [0.1, 0, 0.670206]"), "{little}");
    let much = case(1500.0, "[0, 0, 0.7]");
    assert!(much.contains("is more than the weight: grains and fluid rise"), "{much}");
    let light = case(500.0, "[0, 0, 0]");
    assert!(light.contains("holds the grains down: grains and fluid rise"), "{light}");
    assert!(light.contains("body_acceleration = [0, 0, -0.670206]"), "{light}");
    let quiet =
        [case(1500.0, "[0, 0, 0.67]"), case(500.0, "[0, 0, -0.67]"), case(1000.0, "[0, 0, 0]")];
    assert!(quiet.iter().all(|text| !text.contains("faster and faster")), "{quiet:?}");
}

#[test]
fn ways_out_are_warned_of() {
    let warnings = |from: &str, to: &str| {
        assert!(PAIR.contains(from), "{from}");
        good(&PAIR.replacen(from, to, 1)).estimate(1).warnings.join("\n")
    };
    let walls = |z: &str| {
        let cell = "cell_size = \"0.25 mm\"";
        let walls =
            format!("{cell}\nboundaries = {{ x = \"periodic\", y = \"periodic\", z = {z} }}");
        warnings(cell, &walls)
    };
    let none = ["leave through", "faster and faster", "prescribed motion", "one cell thick"];
    let quiet = walls("\"wall\"");
    assert!(none.iter().all(|text| !quiet.contains(text)), "{quiet}");
    let open = walls("[\"outflow\", \"wall\"]");
    assert!(open.contains("lower side of z"), "{open}");
    let up = walls("[\"wall\", \"outflow\"]");
    assert!(!up.contains("leave through"), "{up}");
    let float = good(
        &PAIR
            .replacen(
                "cell_size = \"0.25 mm\"",
                "cell_size = \"0.25 mm\"\nboundaries = { z = [\"wall\", \"free-surface\"] }",
                1,
            )
            .replace("1500 kg/m3", "500 kg/m3")
            .replace("1.5 g/cm3", "500 kg/m3"),
    );
    let float = float.estimate(1).warnings.join("\n");
    assert!(float.contains("grains may float in the free surface"), "{float}");
    assert!(float.contains("make no waves and feel no splash and no surface tension"), "{float}");
    // 2 x 500 kg/m^3 x 4.19 mm^3 g over 1000 kg/m^3 x 60.9 cm^3.
    let fall = walls("\"periodic\"");
    assert!(fall.contains("body_acceleration = [0, 0, 0.000674331]"), "{fall}");
    let position = "position = [\"12.5 mm\", \"12.5 mm\", \"80 mm\"]";
    let given =
        warnings(position, &format!("{position}\nmotion = {{ velocity = [0, 0, \"-0.1 m/s\"] }}"));
    assert!(
        given.contains("grain 0") && given.contains("lower wall of z at t = 790 ms"),
        "{given}"
    );
}

#[test]
fn grains_next_to_an_open_side_or_off_the_middle_of_a_flat_box_are_warned_of() {
    let case = |cells: &str, position: &str| {
        format!(
            "title = \"box\"\n[fluid]\ndensity = 1000\nviscosity = \"1 mPa s\"\n[domain]\n\
             cells = {cells}\ncell_size = \"0.1 mm\"\nboundaries = {{ y = \"periodic\", z = \
             [{{ kind = \"inflow\", velocity = [0, 0, \"1 cm/s\"] }}, \"outflow\"] }}\n\
             [[grain]]\nshape = {{ kind = \"ellipsoid\", size = [\"0.35 mm\", \"0.07 mm\", \"0.35 mm\"] }}\norientation = {{ short_axis = \"y\" }}\ndensity = 2000\n\
             position = {position}\n[time]\nend = 0.1\n"
        )
    };
    let starts = warnings(&case("[30, 30, 60]", "[\"1.5 mm\", \"1.5 mm\", \"5.675 mm\"]"));
    assert!(starts.contains("grain 0 starts within two cells of the open upper side"), "{starts}");
    let flat = warnings(&case("[30, 1, 60]", "[\"1.5 mm\", \"0.06 mm\", \"3 mm\"]"));
    assert!(flat.contains("grains move in its plane only"), "{flat}");
    assert!(flat.contains("its centre is at 60 um") || flat.contains("0.06 mm"), "{flat}");
    let leaving = format!(
        "{}[[grain]]\nshape = {{ kind = \"sphere\", diameter = \"0.1 mm\" }}\ndensity = 2000\nposition = \
         [\"2.5 mm\", \"0.05 mm\", \"5 mm\"]\nangular_velocity = [0, 0, 1]\n",
        case("[30, 1, 60]", "[\"1.5 mm\", \"0.05 mm\", \"3 mm\"]")
            .replace("[time]\nend = 0.1\n", "")
    ) + "[time]\nend = 0.1\n";
    let [problem] = &problems(&leaving)[..] else { panic!("{:?}", problems(&leaving)) };
    assert!(problem.to_string().contains("grain 1 starts out of the plane"), "{problem}");
    assert_eq!(problem.key.as_deref(), Some("grain.1.position"));
    for (cells, position) in [
        ("[30, 30, 60]", "[\"1.5 mm\", \"1.5 mm\", \"5.575 mm\"]"),
        ("[30, 1, 60]", "[\"1.5 mm\", \"0.05 mm\", \"3 mm\"]"),
    ] {
        let quiet = warnings(&case(cells, position));
        assert!(!quiet.contains("starts within") && !quiet.contains("its centre"), "{quiet}");
    }
}

#[test]
fn shapes_must_be_whole() {
    refused(
        "shape = { kind = \"sphere\", diameter = \"2 mm\" }",
        "file = \"nowhere.grain\"",
        "grain.0.file",
        &["there is no grain file", "from-scan"],
    );
    refused(
        "shape = { kind = \"sphere\", diameter = \"2 mm\" }",
        "shape = { kind = \"sphere\", size = [1, 1, 1] }",
        "grain.0.shape",
        &["`diameter` is missing"],
    );
    refused(
        "diameter = \"2 mm\" }",
        "diameter = \"2 mm\", height = \"1 mm\" }",
        "grain.0.shape",
        &["does not belong"],
    );
    refused("shape = { kind = \"sphere\", diameter = \"2 mm\" }\n", "\n", "grain.0", &["no shape"]);
}

#[test]
fn scales_follow_from_the_case_or_are_given() {
    let with = |scales: &str| format!("{PAIR}\n[output]\nscales = {scales}\n");
    let scales = |text: &str| good(text).plan.scales.expect("scales");
    let near = |value: f64, expected: f64| {
        assert!((value / expected - 1.0).abs() < 1e-3, "{value} instead of {expected}");
    };
    let velocities = [
        ("\"gravity\"", (9.80665f64 * 2e-3).sqrt()),
        ("\"buoyancy\"", (0.5f64 * 9.80665 * 2e-3).sqrt()),
        ("\"viscous\"", 1e-6 / 2e-3),
    ];
    for (preset, velocity) in velocities {
        let found = scales(&with(preset));
        near(found.length_m, 2e-3);
        near(found.velocity_m_per_s, velocity);
        near(found.time_s, 2e-3 / velocity);
        assert_eq!(found.density_kg_per_m3, 1000.0);
        // The resolved case has the numbers.
        let case = good(&with(preset));
        let resolved = good(&case.resolved);
        assert_eq!((resolved.plan.scales, resolved.digest), (case.plan.scales, case.digest));
    }
    let given = scales(&with("{ length = \"1 mm\", time = \"0.5 s\", density = 2500 }"));
    assert_eq!((given.velocity_m_per_s, given.density_kg_per_m3), (2e-3, 2500.0));
    assert_eq!(scales(&with("{ length = 1e-3, velocity = 2e-3 }")).time_s, 0.5);
    assert_ne!(good(&with("\"gravity\"")).digest, good(PAIR).digest);
    let dry = |text: &str| {
        let (fluid, domain) = (text.find("[fluid]").unwrap(), text.find("[domain]").unwrap());
        text[..fluid].to_owned() + &text[domain..]
    };
    let floating = PAIR.replace("\"1500 kg/m3\"", "1000").replace("\"1.5 g/cm3\"", "1000");
    let weightless = with("\"gravity\"").replace("title = \"pair\"", "gravity = [0, 0, 0]");
    for (text, words) in [
        (with("\"graviti\""), "gravity"),
        (with("{ length = \"2 mm\" }"), "add `time` or `velocity`"),
        (with("{ length = \"2 s\", time = 1 }"), "is a time"),
        (with("{ length = 0, time = 1 }"), "length scale"),
        (with("{ length = 1, time = 1, mass = 1 }"), "mass"),
        (dry(&with("\"buoyancy\"")), "use scales = \"gravity\""),
        (dry(&with("\"viscous\"")), "there is no fluid"),
        (weightless, "there is no gravity"),
        (floating + "[output]\nscales = \"buoyancy\"\n", "is that of the fluid"),
    ] {
        let found = problems(&text);
        let all = |p: &Problem| format!("{p} {}", p.help.clone().unwrap_or_default());
        let told = found.iter().find(|problem| all(problem).contains(words));
        let told = told.unwrap_or_else(|| panic!("{words} is not in {found:?}"));
        assert!(told.to_string().contains("output.scales"), "{told}");
    }
}

#[test]
fn several_problems_are_told_at_once() {
    let text = PAIR
        .replace("density = 1000", "density = -1")
        .replace("end = \"1 s\"", "end = -1")
        .replace("cell_size = \"0.25 mm\"", "cell_size = \"0.3 mm\"");
    assert!(problems(&text).len() >= 2);
}

#[test]
fn motion_and_orientation_have_several_forms() {
    let with = |more: &str| {
        good(&PAIR.replacen(
            "density = \"1500 kg/m3\"",
            &format!("density = \"1500 kg/m3\"\n{more}"),
            1,
        ))
        .setup
        .grains[0]
            .clone()
    };
    let fixed = with("motion = \"fixed\"");
    assert_eq!(
        (fixed.translation, fixed.rotation),
        (MotionConstraint::Prescribed(DVec3::ZERO), MotionConstraint::Prescribed(DVec3::ZERO))
    );
    let spun = with("motion = { velocity = \"fixed\", angular_velocity = [0, 0, \"60 rpm\"] }");
    assert_eq!(
        spun.rotation,
        MotionConstraint::Prescribed(DVec3::new(0.0, 0.0, std::f64::consts::TAU))
    );
    assert_eq!(spun.angular_velocity, DVec3::new(0.0, 0.0, std::f64::consts::TAU));
    let pulled = with("motion = { velocity = [0, 0, \"-1 cm/s\"] }");
    assert_eq!(
        (pulled.translation, pulled.rotation),
        (MotionConstraint::Prescribed(DVec3::new(0.0, 0.0, -0.01)), MotionConstraint::Free)
    );
    refused(
        "density = \"1500 kg/m3\"",
        "density = \"1500 kg/m3\"\nmotion = \"fixed\"\nvelocity = [0, 0, 1]",
        "grain.0.velocity",
        &["prescribe"],
    );
    let turned =
        with("orientation = { long_axis = \"z\" }\nrotate = { axis = \"y\", angle = \"90 deg\" }");
    assert!((turned.pose.orientation * DVec3::X - DVec3::X).length() < 1e-12);
}

#[test]
fn vectors_may_be_formulas() {
    let text = PAIR
        .replacen(
            "density = \"1500 kg/m3\"",
            "density = \"1500 kg/m3\"\nmotion = { velocity = { formula = [0, \"0.1*t\", \"cos(3*t)\"] }, angular_velocity = \"fixed\" }",
            1,
        )
        .replacen(
            "[fluid]",
            "[fluid]\ninitial_velocity = { formula = [\"z\", 0, \"2*x - y\"] }\nbody_acceleration = { formula = [\"exp(-t)\", 0, 0] }",
            1,
        );
    let case = good(&text);
    let setup = &case.setup;
    assert_eq!(
        setup.grains[0].translation,
        MotionConstraint::Prescribed(DVec3::new(0.0, 0.0, 1.0))
    );
    assert_eq!(setup.grains[0].velocity, DVec3::new(0.0, 0.0, 1.0));
    let start = setup.prescription.initial_velocity.as_ref().unwrap();
    assert_eq!(start.at(&[1.0, 2.0, 3.0]), DVec3::new(3.0, 0.0, 0.0));
    assert_eq!(setup.prescription.body_acceleration(0.0), Some(DVec3::new(1.0, 0.0, 0.0)));
    let again = good(&case.resolved);
    assert_eq!(case.resolved, again.resolved);
    let fluid = |to: &str, words: &[&str]| {
        refused("[fluid]", &format!("[fluid]\n{to}"), "fluid", words);
    };
    fluid("initial_velocity = { formula = [\"t\", 0, 0] }", &["unknown name \"t\"", "x, y, z"]);
    fluid("initial_velocity = { formula = [\"1/(x - 0.0125)\", 0, 0] }", &["finite number"]);
    fluid("body_acceleration = { formula = [\"t\", 0] }", &["three"]);
    for (formula, words) in [
        ("2*(t", "its brackets do not match; a formula may use t,"),
        ("2*t 3", "it cannot be read"),
        ("", "it is empty"),
    ] {
        fluid(
            &format!("body_acceleration = {{ formula = [\"{formula}\", 0, 0] }}"),
            &["the x component", words],
        );
    }
    fluid("body_acceleration = { formula = [\"sqrt(t - 1)\", 0, 0] }", &["finite number"]);
    refused(
        "density = \"1500 kg/m3\"",
        "density = \"1500 kg/m3\"\nmotion = { velocity = { formula = [0, 0, \"x\"] } }",
        "grain",
        &["unknown name \"x\""],
    );
}

#[test]
fn packings_become_grains() {
    let text = r#"
        [domain]
        size = [0.05, 0.05, 0.2]
        [time]
        end = 0.1
        stop = { when = "rest", hold = "10 ms" }
        [[packing]]
        count = 60
        shapes = [{ kind = "sphere", diameter = "2 mm" }, { kind = "sphere", diameter = "3 mm" }]
        equivalent_diameter = { from = "2 mm", to = "4 mm" }
        nodes = 200
        density = 2650
        region = { lower = ["10 mm", "10 mm", "10 mm"], upper = ["40 mm", "40 mm", "190 mm"] }
        seed = 3
    "#;
    let case = good(text);
    assert_eq!(case.setup.grains.len(), 60);
    assert!(case.setup.fluid.is_none());
    let resolved = good(&case.resolved);
    assert_eq!(resolved.resolved, case.resolved);
    for (a, b) in case.setup.grains.iter().zip(&resolved.setup.grains) {
        assert_eq!((a.pose, a.shape.volume()), (b.pose, b.shape.volume()));
    }
    let d: Vec<f64> = case.setup.grains.iter().map(|g| g.shape.equivalent_diameter()).collect();
    assert!(d.iter().all(|d| (2e-3..4e-3).contains(d)) && d[0] != d[1]);
    // A velocity beside a prescribed one is refused, as for a [[grain]].
    let stop = "stop = { when = \"rest\", hold = \"10 ms\" }";
    let fixed = text.replace(stop, "").replace("seed = 3", "seed = 3\nmotion = \"fixed\"");
    good(&fixed);
    let moving = problems(&fixed.replace("seed = 3", "seed = 3\nvelocity = [0, 0, 0.1]"));
    assert_eq!(moving.len(), 1, "{moving:?}");
    assert_eq!(moving[0].key.as_deref(), Some("packing.0.velocity"));
    assert!(moving[0].message.contains("the motion prescribes [0 m/s"), "{}", moving[0]);
    let crowded = problems(&text.replace("count = 60", "count = 60000"));
    assert!(crowded[0].message.contains("sites for 60000 grains"), "{}", crowded[0]);
    assert_eq!(crowded.len(), 1, "{crowded:?}");
    let random = text.replace("seed = 3", "seed = 3\narrangement = \"random\"");
    assert_eq!(good(&random).setup.grains.len(), 60);
    // 36 % of the region: closer than separate spheres would find random places.
    let small = random.replace("\"190 mm\"", "\"20 mm\"");
    let close = good(&small.replace("count = 60", "count = 230"));
    assert_eq!(close.setup.grains.len(), 230);
    let crowded = problems(&random.replace("count = 60", "count = 60000"));
    assert!(
        crowded[0].message.contains("grains find no places without touching"),
        "{}",
        crowded[0]
    );
    assert_eq!(crowded[0].key.as_deref(), Some("packing.0.region"));
}

#[test]
fn copies_of_a_shape_are_prepared_once() {
    let head = "[domain]\nsize = [0.05, 0.05, 0.2]\n[time]\nend = 0.1\n";
    let packed = "[[packing]]\ncount = 100\ndensity = 2650\nseed = 3\n";
    let file = "../../cases/grains/tsquare_rock.grain";
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy.grain");
    std::fs::copy(file, &copy).unwrap();
    let mut entries = String::new();
    for n in 0..100 {
        // The same file under other names, and the same length in other units.
        let copy = copy.display().to_string();
        let name = [file, "../run/../../cases/grains/tsquare_rock.grain", &copy][n % 3];
        let diameter = ["\"2 mm\"", "0.002", "\"0.2 cm\""][n / 3 % 3];
        let (x, z) = (4e-3 * (n % 10 + 1) as f64, 4e-3 * (n / 10 + 1) as f64);
        entries += &format!(
            "[[grain]]\nfile = \"{name}\"\nequivalent_diameter = {diameter}\ndensity = 2650\n\
             position = [{x}, 0.02, {z}]\n"
        );
    }
    let shape = "shapes = [{ kind = \"rounded-box\", size = [2e-3, 2e-3, 2e-3], radius = 3e-4 }]\n";
    for text in [
        format!("{head}{packed}files = [\"{file}\"]\nequivalent_diameter = 2e-3\n"),
        format!("{head}{packed}files = [\"{file}\"]\narrangement = \"random\"\n"),
        format!("{head}{packed}{shape}arrangement = \"lattice\"\n"),
        format!("{head}{entries}"),
    ] {
        let case = good(&text);
        let first = &case.setup.grains[0].shape;
        assert_eq!(case.setup.grains.len(), 100);
        let shared = case.setup.grains.iter().filter(|grain| Arc::ptr_eq(&grain.shape, first));
        assert_eq!(shared.count(), 100, "{text}");
    }
}

#[test]
fn lattices_of_one_size_fit_every_box() {
    let mut refused = Vec::new();
    for diameter in (7..34).map(|tenths| 0.1 * f64::from(tenths)) {
        for edge in [10.0, 12.0, 13.7, 20.0] {
            let text = format!(
                "[domain]\nsize = [\"{edge} mm\", \"{edge} mm\", \"{edge} mm\"]\n\
                 [time]\nend = \"1 ms\"\n[[packing]]\ncount = 27\ndensity = 2650\n\
                 shapes = [{{ kind = \"sphere\", diameter = \"{diameter:.1} mm\" }}]\nnodes = 100\n"
            );
            if let Err(error) = parse(&text) {
                refused.push(format!("{diameter:.1} mm in {edge} mm: {error}"));
            }
        }
    }
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

#[test]
fn thin_grains_are_warned_of_by_their_shortest_axis() {
    let plate = |thickness: &str| {
        let shape = format!("kind = \"ellipsoid\", size = [\"4 mm\", \"4 mm\", \"{thickness}\"]");
        PAIR.replace("kind = \"sphere\", diameter = \"2 mm\"", &shape)
    };
    let thin = warnings(&plate("0.5 mm"));
    assert!(thin.contains("only 2.0 cells across the shortest axis"), "{thin}");
    assert!(!thin.contains("across the smallest grain"), "{thin}");
    assert!(!warnings(&plate("1 mm")).contains("shortest axis"));
}

#[test]
fn a_fixed_step_is_compared_with_the_velocities_at_the_start() {
    let start = |speed: &str, time: &str| {
        warnings(
            &PAIR
                .replacen("[[grain]]", &format!("[[grain]]\nvelocity = [\"{speed}\", 0, 0]"), 1)
                .replace("end = \"1 s\"", &format!("end = \"1 s\"\n{time}")),
        )
    };
    let fast = start("1 m/s", "step = \"0.5 ms\"");
    assert!(
        fast.contains("grain 0 at the start gives the first step a CFL number of 2.0"),
        "{fast}"
    );
    assert!(fast.contains("fixed step of 0.25 ms or less"), "{fast}");
    assert!(!start("0.1 m/s", "step = \"0.5 ms\"").contains("CFL number"));
    assert!(!start("1 m/s", "").contains("CFL number"));
}

#[test]
fn a_fixed_grain_does_not_stiffen_the_contact() {
    let stiffness = |more: &str| {
        let case = format!(
            "[domain]\nsize = [\"20 mm\", \"20 mm\", \"20 mm\"]\n[time]\nend = \"0.1 s\"\n\
             [[grain]]\nshape = {{ kind = \"sphere\", diameter = \"0.2 mm\" }}\ndensity = 2500\n\
             position = [\"10 mm\", \"10 mm\", \"15 mm\"]\n{more}"
        );
        good(&case).setup.contact.normal_stiffness
    };
    let fixed = "[[grain]]\nshape = { kind = \"sphere\", diameter = \"8 mm\" }\ndensity = 2500\n\
                 position = [\"10 mm\", \"10 mm\", \"5 mm\"]\nmotion = \"fixed\"\n";
    let free = fixed.replace("motion = \"fixed\"\n", "");
    assert_eq!(stiffness(fixed), stiffness(""));
    assert!(stiffness(&free) > 100.0 * stiffness(""));
}

#[test]
fn few_substeps_are_warned_of_for_grains_that_may_be_flat() {
    let dropped = |shape: &str, substeps: u32| {
        warnings(&format!(
            "[domain]\nsize = [\"50 mm\", \"50 mm\", \"50 mm\"]\n[contact]\n\
             substeps_per_contact = {substeps}\n[time]\nend = \"1 s\"\n[[grain]]\nshape = {shape}\n\
             density = 2500\nposition = [\"25 mm\", \"25 mm\", \"25 mm\"]\n"
        ))
    };
    let plate =
        "{ kind = \"rounded-box\", size = [\"8 mm\", \"5 mm\", \"1 mm\"], radius = \"0.3 mm\" }";
    let few = dropped(plate, 11);
    assert!(few.contains("11 sub-steps per contact are unstable for flat faces"), "{few}");
    assert!(few.contains("substeps_per_contact of 12 or more"), "{few}");
    assert!(!dropped(plate, 12).contains("sub-steps per contact"));
    let sphere = "{ kind = \"sphere\", diameter = \"2 mm\" }";
    assert!(!dropped(sphere, 5).contains("sub-steps per contact"));
}

#[test]
fn a_lubrication_gap_other_than_one_cell_of_the_finest_grid_is_warned_of() {
    let of = |gap: &str, refinement: &str| {
        warnings(&format!(
            "[fluid]\ndensity = 1000\nkinematic_viscosity = 1e-6\n[domain]\n\
             size = [\"12 mm\", \"12 mm\", \"24 mm\"]\ncell_size = \"0.25 mm\"\n{refinement}\n\
             [contact]\nlubrication_gap = \"{gap}\"\n[time]\nend = \"1 s\"\n[[grain]]\n\
             shape = {{ kind = \"sphere\", diameter = \"2 mm\" }}\ndensity = 1100\n\
             position = [\"6 mm\", \"6 mm\", \"12 mm\"]\n"
        ))
    };
    let refined = "refinement = 2";
    for (gap, refinement, amount) in
        [("0.4 mm", "", "large"), ("0.1 mm", "", "small"), ("0.25 mm", refined, "large")]
    {
        let found = of(gap, refinement);
        let cell = if refinement.is_empty() { "0.25 mm" } else { "0.125 mm" };
        let words = format!(
            "a lubrication_gap of {gap} makes the lubrication force too {amount}: set [contact] \
             lubrication_gap to one cell, {cell}"
        );
        assert!(found.contains(&words), "{found}");
    }
    for (gap, refinement) in [("0.25 mm", ""), ("0.125 mm", refined), ("0 mm", "")] {
        assert!(!of(gap, refinement).contains("lubrication"), "{gap}");
    }
    let with = |roughness: &str| of(&format!("0.25 mm\"\nroughness = \"{roughness}"), "");
    assert!(with("1e-9 mm").contains("roughness of 1e-12 m is less than the size of an atom"));
    assert!(!with("1 nm").contains("atom"));
}

#[test]
fn contact_that_dominates_names_its_levers() {
    let heap = "[domain]\nsize = [\"50 mm\", \"50 mm\", \"200 mm\"]\n[contact]\nstiffness = \"1 MN/m\"\n\
                [time]\nend = \"2 s\"\n[[packing]]\ncount = 500\ndensity = 2650\nnodes = 1000\n\
                shapes = [{ kind = \"sphere\", diameter = \"2 mm\" }]\n";
    let dear = warnings(heap);
    for lever in
        ["contact takes 100 % of the wall time", "stiffness", "nodes", "substeps_per_contact"]
    {
        assert!(dear.contains(lever), "{dear}");
    }
    let cheap = warnings(&heap.replace("count = 500", "count = 3").replace("1 MN/m", "1000 N/m"));
    assert!(!cheap.contains("of the wall time"), "{cheap}");
}

#[test]
fn expectations_need_a_meaning() {
    let with = |text: &str| PAIR.replace("[time]", &format!("[expect]\n{text}\n[time]"));
    assert_eq!(good(&with("kiss_time = { value = \"0.2 s\", tolerance = \"5 %\" }\npeak_settling_speed = [{ at_least = 0.1, grain = 0 }, { at_most = 0.2, grain = 1 }]")).expect.len(), 3);
    refused(
        "[time]",
        "[expect]\nkiss_time = { value = 0.2 }\n[time]",
        "expect.kiss_time",
        &["what is expected"],
    );
    // A result of a pair in the case of a single grain.
    let single = |line: &str| {
        let grain = PAIR.rfind("[[grain]]").unwrap();
        let text = format!("{}[expect]\n{line}\n", &PAIR[..grain]);
        let found = problems(&text);
        let [problem] = &found[..] else { panic!("{found:?}") };
        assert!(problem.message.ends_with("but the case has 1 grain"), "{problem}");
        let key = format!("expect.{}", line.split(' ').next().unwrap());
        assert!(problem.key.as_ref().unwrap().starts_with(&key), "{problem}");
        assert_eq!(problem.place().unwrap().1, text.lines().count(), "{problem}");
    };
    single("kiss_time = { at_least = 0.1 }");
    single("separation_time = [{ at_most = 0.1 }]");
    assert!(
        problems(&with("kiss_tme = { value = 0.2 }"))[0]
            .help
            .as_ref()
            .unwrap()
            .contains("kiss_time")
    );
    assert!(
        problems(&with("landing_time = { at_most = 1, grain = 7 }"))[0]
            .message
            .contains("no grain 7")
    );
}

#[test]
fn angles_in_degrees_and_densities_in_grams_are_noticed() {
    let turned = |angle: &str| {
        PAIR.replacen(
            "density = \"1500 kg/m3\"",
            &format!("density = \"1500 kg/m3\"\nrotate = {{ axis = \"y\", angle = {angle} }}"),
            1,
        )
    };
    assert!(problems(&turned("90"))[0].message.contains("\"90 deg\" for degrees"));
    for accepted in ["1.5708", "\"90 deg\"", "\"90 rad\""] {
        good(&turned(accepted));
    }
    let warns = |case: &Case| {
        case.estimate(1).warnings.iter().any(|warning| warning.contains("look at its unit"))
    };
    assert!(!warns(&good(PAIR)));
    let light = PAIR.replacen("density = \"1500 kg/m3\"", "density = 30\nmotion = \"fixed\"", 1);
    assert!(!warns(&good(&light)));
    let grams = PAIR.replacen("density = \"1500 kg/m3\"", "density = 2.5\nmotion = \"fixed\"", 1);
    assert!(warns(&good(&grams)));
}

#[test]
fn overrides_are_located_too() {
    let case = Case::parse(
        PAIR,
        "case.toml",
        Path::new("."),
        &["time.end=2".into(), "grain.1.density=2 g/cm3".into()],
    );
    let case = case.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((case.plan.end, case.setup.grains[1].density), (2.0, 2000.0));
    let set = |item: &str| Case::parse(PAIR, "case.toml", Path::new("."), &[item.into()]);
    let formula = set("domain.size={ formula = [0, 0, 0] }");
    assert!(formula.is_err_and(|e| e.to_string().contains("three components")));
    assert!(set("domain.size.0=30 mm").is_ok_and(|c| c.setup.mesh.cells[0] == 120));
    let Err(error) =
        Case::parse(PAIR, "case.toml", Path::new("."), &["grain.1.density=2 kg".into()])
    else {
        panic!()
    };
    assert_eq!(error.problems()[0].place().map(|(name, line, _)| (name, line)), Some(("--set", 1)));
    // What begins like TOML is not taken for a text.
    for broken in
        ["domain.size=[0, 0,", "fluid.initial_velocity={ formula = [0, 0, 0]", "title=\"a"]
    {
        assert!(set(broken).is_err_and(|e| e.to_string().contains("the value is not TOML")));
    }
}

#[test]
fn what_an_override_broke_is_told_of_the_override() {
    let inline = "gap_above = { grain = 0, gap = \"3 mm\" }";
    let table = "[grain.gap_above]\ngrain = 0\ngap = \"3 mm\"";
    let stop = "end = \"1 s\"\nstop = { when = \"rest\", hold = \"1 s\" }";
    for text in [PAIR.to_string(), PAIR.replace(inline, table)] {
        let text = text.replace("end = \"1 s\"", stop);
        for (set, key) in [
            ("time.stop.hold=-1", "time.stop.hold"),
            ("grain.1.gap_above.gap=15 mm", "grain.1.gap_above"),
            ("grain.1.gap_above.gap=-1 mm", "grain.1.gap_above"),
            ("grain.0.position.2=0.5 mm", "grain.0.position"),
            ("domain.size.0=-1", "domain.size"),
            ("grain.1.density=2", "grain.1.density"),
        ] {
            let case = Case::parse(&text, "case.toml", Path::new("."), &[set.into()]);
            let error = case.map(|_| ()).unwrap_err();
            let first = &error.problems()[0];
            assert_eq!(first.place().map(|(name, ..)| name), Some("--set"), "{set}");
            let found = first.key.as_deref().unwrap();
            assert!(found.starts_with(key), "{set}: {first}");
        }
    }
}

const HERTZ: &str = r#"
[domain]
size = ["40 mm", "20 mm", "40 mm"]

[contact]
law = "hertz-mindlin"
youngs_modulus = "48 GPa"
poisson_ratio = 0.2
wall_youngs_modulus = "70 GPa"

[[grain]]
shape = { kind = "sphere", diameter = "4 mm" }
density = 7850
position = ["10 mm", "10 mm", "22 mm"]
youngs_modulus = "208 GPa"
poisson_ratio = 0.3
restitution = 0.9

[[grain]]
shape = { kind = "sphere", diameter = "4 mm" }
density = 2800
position = ["30 mm", "10 mm", "22 mm"]

[time]
end = "0.2 s"
"#;

#[test]
fn a_grain_starts_impulsively_or_released() {
    let [default, impulsive, released] = ["", "start = \"impulsive\"", "start = \"released\""]
        .map(|line| good(&format!("{PAIR}\n[coupling]\n{line}\n")));
    assert_eq!(default.setup.start, Start::Impulsive);
    // Checkpoints of cases without the key go on matching.
    assert_eq!(default.digest, impulsive.digest);
    assert_eq!(released.setup.start, Start::Released);
    assert_ne!(released.digest, default.digest);
    assert!(released.resolved.contains("start = \"released\""));
    let no_effect = |keys: &str, named: &str| {
        let dry = good(&HERTZ.replace("[contact]", &format!("{keys}\n[contact]")));
        assert!(dry.estimate(1).warnings.iter().any(|w| w.contains(named)), "{named}");
    };
    no_effect("[coupling]\nstart = \"released\"", "coupling.start has no effect");
    no_effect("[coupling]\nscheme = \"paper\"", "coupling.scheme has no effect");
    no_effect("[run]\nprecision = \"f32\"", "run.precision has no effect");
}

#[test]
fn the_memory_of_a_heap_grows_with_its_grains() {
    let heap = |count: usize, surfaces: &str| {
        let text = format!(
            "[domain]\nsize = [0.02, 0.02, 0.04]\n[time]\nend = 0.1\n[output]\n{surfaces}\n\
             [[packing]]\ncount = {count}\nshapes = [{{ kind = \"sphere\", diameter = 0.5e-3 }}]\n\
             nodes = 100\ndensity = 2500\n"
        );
        good(&text).estimate(1).memory_bytes as f64
    };
    let per_grain = |surfaces: &str| (heap(1500, surfaces) - heap(500, surfaces)) / 1000.0;
    // Measured with 1000 and 4000 grains: 11 kB and, with files of surfaces, 72 kB.
    let (plain, drawn) = (per_grain("surfaces = 0"), per_grain(""));
    assert!((10e3..12e3).contains(&plain), "{plain}");
    assert!((60e3..90e3).contains(&drawn), "{drawn}");
}

#[test]
fn the_grid_is_refined_around_the_grains() {
    let refined = PAIR.replace("[time]", "refinement = 2\n[time]");
    let (plain, fine) = (good(PAIR), good(&refined));
    assert_eq!((plain.setup.refinement, fine.setup.refinement), (1, 2));
    assert!(fine.resolved.contains("refinement = 2") && !plain.resolved.contains("refinement"));
    let (plain, fine) = (plain.estimate(1), fine.estimate(1));
    // 8 cells across, 3.2 on each side and 2 of slack; 12 cells and a diameter higher for the pair.
    assert_eq!((plain.refined_cells, fine.refined_cells), (None, Some(36 * 36 * 80)));
    assert_eq!((plain.cells_per_diameter, fine.cells_per_diameter), (Some(8.0), Some(16.0)));
    let ratio = fine.steps as f64 / plain.steps as f64;
    assert!((1.8..2.2).contains(&ratio), "{ratio}");
    let more = (fine.memory_bytes - plain.memory_bytes) as f64 / (36.0 * 36.0 * 80.0 * 8.0);
    assert!((20.0..30.0).contains(&more), "{more} numbers a cell");
    assert!(fine.wall_s > 2.0 * plain.wall_s);
    let coarse = |text: &str| good(text).estimate(1).warnings.join("\n");
    assert!(coarse(PAIR).contains("set refinement = 2"));
    assert!(!coarse(&refined).contains("set refinement = 2"));
    let key = "domain.refinement";
    refused("[time]", "refinement = 3\n[time]", key, &["found 3", "2 halves"]);
    let margin = |text: &str| PAIR.replace("[time]", &format!("refinement = 2\n{text}\n[time]"));
    let wide = good(&margin("refinement_margin = [\"1 mm\", \"1 mm\", \"2 mm\"]"));
    assert_eq!(wide.setup.refinement_margin, Some(DVec3::new(1e-3, 1e-3, 2e-3)));
    // 8 cells across, 4 or 8 on each side and 2 of slack.
    assert_eq!(wide.estimate(1).refined_cells, Some(36 * 36 * 96));
    let key = "domain.refinement_margin";
    let narrow = "refinement = 2\nrefinement_margin = \"0.5 mm\"\n[time]";
    refused("[time]", narrow, key, &["found [0.5", "at least 3 cells", "0.75"]);
    let alone = "refinement_margin = \"1 mm\"\n[time]";
    refused("[time]", alone, key, &["without a refinement", "leave out"]);
    let key = "domain.refinement";
    let paper = "refinement = 2\n[coupling]\nscheme = \"paper\"\n[time]";
    refused("[time]", paper, key, &["paper's scheme", "leave out"]);
    let flat = "size = [\"25 mm\", \"0.25 mm\", \"97.5 mm\"]\nrefinement = 2\n\
        boundaries = { y = \"periodic\" }";
    refused("size = [\"25 mm\", \"25 mm\", \"97.5 mm\"]", flat, key, &["y is flat"]);
    let dry = refined.replace("[fluid]\ndensity = 1000\nviscosity = \"1 mPa s\"\n", "");
    assert!(problems(&dry)[0].to_string().contains("no grid to refine"));
    let empty = &refined[..refined.find("[[grain]]").unwrap()];
    assert!(problems(empty)[0].to_string().contains("no grain around which"));
}

#[test]
fn hertz_mindlin_takes_materials_from_the_grain_or_from_contact() {
    let case = good(HERTZ);
    let materials: Vec<_> = case.setup.grains.iter().map(|g| g.material).collect();
    let steel = (materials[0].youngs_modulus, materials[0].poisson_ratio);
    let glass = (materials[1].youngs_modulus, materials[1].poisson_ratio);
    assert_eq!((steel, glass), ((208e9, 0.3), (48e9, 0.2)));
    assert_eq!((materials[0].restitution, materials[1].restitution), (0.9, 1.0));
    let contact = case.setup.contact;
    assert_eq!(contact.law, ContactLawKind::HertzMindlin);
    let wall = contact.wall_material;
    assert_eq!((wall.youngs_modulus, wall.poisson_ratio), (70e9, 0.2));
    // The resolved case gives the same run.
    let again = good(&case.resolved);
    assert_eq!((again.digest, again.setup.contact), (case.digest.clone(), contact));
    let time = case.estimate(1).contact_time_s.unwrap();
    // Hertz duration of two steel spheres at sqrt(2 g 40 mm), which is shorter than that of glass.
    let mass = 7850.0 * std::f64::consts::PI / 6.0 * 0.004f64.powi(3) / 2.0;
    let (radius, modulus) = (0.001, 104e9 / 0.91);
    let speed = (2.0f64 * 9.81 * 0.04).sqrt();
    let expected = 2.868 * (mass * mass / (radius * modulus * modulus * speed)).powf(0.2);
    assert!((time / expected - 1.0).abs() < 1e-3, "{time} {expected}");
    let soft = good(&HERTZ.replace("wall_youngs_modulus = \"70 GPa\"\n", ""));
    assert_eq!(soft.setup.contact.wall_material, Material::RIGID);
}

#[test]
fn keys_of_the_other_contact_law_are_refused_where_they_stand() {
    let hertz = |from: &str, to: &str| problems(&HERTZ.replacen(from, to, 1));
    for (from, to, key, words) in [
        ("law =", "stiffness = 100\nlaw =", "contact.stiffness", "does not use stiffness"),
        ("\"hertz-mindlin\"", "\"linear\"", "contact.youngs_modulus", "does not use"),
        ("\"48 GPa\"", "\"-48 GPa\"", "contact.youngs_modulus", "greater than zero"),
        ("\"208 GPa\"", "\"208 kg\"", "grain.0.youngs_modulus", "an elastic modulus"),
        ("poisson_ratio = 0.3", "poisson_ratio = 0.6", "grain.0.poisson_ratio", "out of range"),
        ("youngs_modulus = \"48 GPa\"\n", "", "contact.law", "needs the youngs_modulus"),
        ("youngs_modulus = \"48", "youngs_modulos = \"48", "contact.youngs_modulos", "unknown"),
        ("\"hertz-mindlin\"", "\"hertz\"", "contact.law", "hertz-mindlin"),
    ] {
        let found = hertz(from, to);
        let problem = found.iter().find(|p| p.key.as_deref() == Some(key));
        let problem = problem.unwrap_or_else(|| panic!("{key}: {found:?}"));
        let help = problem.help.clone().unwrap_or_default();
        assert!(format!("{problem} {help}").contains(words), "{problem} {help}");
    }
}

#[test]
fn coordinates_on_a_side_of_the_box_are_inside_in_spite_of_rounding() {
    // 0.3 m + 30 mm is less than 330 mm by rounding.
    let case = good(
        r#"
[domain]
size = ["20 mm", "20 mm", "30 mm"]
origin = [0, 0, "0.3 m"]
cell_size = "5 mm"
[fluid]
density = 1000
viscosity = "1 mPa s"
[time]
end = "1 s"
[output]
planes = [{ normal = "z", at = "330 mm" }]
[[probe]]
name = "plane"
plane = { normal = "z", at = "330 mm" }
[[probe]]
name = "line"
line = { from = [0, 0, "0.3 m"], to = [0, 0, "330 mm"], points = 4 }
[[packing]]
shapes = [{ kind = "sphere", diameter = "4 mm" }]
count = 1
density = 2500
region = { lower = [0, 0, "0.3 m"], upper = ["20 mm", "20 mm", "330 mm"] }
"#,
    );
    assert_eq!(case.setup.grains.len(), 1);
}

#[test]
fn a_line_of_probes_needs_a_length() {
    let line = "[[probe]]\nline = { from = [0, 0, 0], to = [0, 0, 0], points = 4 }\n[time]";
    refused("[time]", line, "probe.0.line.to", &["both ends are at one point", "`point`"]);
}

#[test]
fn a_landing_needs_a_floor() {
    let end = "end = \"1 s\"";
    let landing = "end = \"1 s\"\nstop = \"landing\"";
    let open = |sides: &str| {
        let cell = "cell_size = \"0.25 mm\"";
        PAIR.replace(cell, &format!("{cell}\nboundaries = {{ z = {sides} }}"))
    };
    for sides in ["\"periodic\"", "[\"outflow\", \"wall\"]"] {
        let found = problems(&open(sides).replace(end, landing));
        assert!(found[0].to_string().contains("no wall"), "{sides}: {}", found[0]);
    }
    good(&open("[\"wall\", \"free-surface\"]").replace(end, landing));
}

#[test]
fn rest_and_landing_need_gravity() {
    for stop in ["rest", "landing"] {
        let text = PAIR.replace("end = \"1 s\"", &format!("end = \"1 s\"\nstop = \"{stop}\""));
        good(&text);
        let found = problems(&text.replace("title = \"pair\"", "gravity = [0, 0, 0]"));
        assert!(found[0].to_string().contains("gravity is zero"), "{}", found[0]);
    }
}

#[test]
fn a_density_that_no_matter_has_is_refused() {
    let found = problems(&PAIR.replacen("density = \"1500 kg/m3\"", "density = 1e20", 1));
    assert!(found[0].to_string().contains("the density of a grain is 1e20"), "{}", found[0]);
}

#[test]
fn whole_numbers_of_steps_lead_to_each_output() {
    let case = good(PAIR);
    let free = case.estimate(1);
    let interval = 1.25 * free.time_step_s;
    let text = format!("{PAIR}\n[output]\ntables = {interval:?}\nslices = 0\nsurfaces = 0\n");
    let estimate = good(&text).estimate(1);
    assert!((estimate.time_step_s - 0.5 * interval).abs() < 1e-12, "{}", estimate.time_step_s);
}

/// The flow beside a fixed grain is faster than the inflow: the runs take 468 and 161 steps.
#[test]
fn the_flow_beside_a_fixed_grain_counts_in_steps_and_default_outputs() {
    let case = |output: &str, end: &str| {
        good(&format!(
            "gravity = [0, 0, 0]\n\
             [fluid]\ndensity = 1000\nviscosity = \"1 mPa s\"\n\
             initial_velocity = [\"30 mm/s\", 0, 0]\n\
             [domain]\nsize = [\"16 mm\", \"8 mm\", \"8 mm\"]\ncell_size = \"0.25 mm\"\n\
             boundaries = {{ x = [{{ kind = \"inflow\", velocity = [\"30 mm/s\", 0, 0] }}, \
             \"outflow\"], y = \"slip\", z = \"slip\" }}\n\
             [time]\nend = \"{end}\"\n[output]\n{output}\n\
             [[grain]]\nshape = {{ kind = \"sphere\", diameter = \"2 mm\" }}\ndensity = 1000\n\
             position = [\"5 mm\", \"4 mm\", \"4 mm\"]\nmotion = \"fixed\""
        ))
    };
    let steps = |case: &Case| case.estimate(1).steps as f64;
    let plain = case("", "1 s");
    assert!((steps(&plain) / 468.0 - 1.0).abs() < 0.15, "{}", steps(&plain));
    let free = steps(&case("tables = 0\nslices = 0\nsurfaces = 0", "1 s"));
    assert!(steps(&plain) < 1.08 * free, "{} instead of {free}", steps(&plain));
    // An interval of several steps: one step more costs little.
    assert!(plain.job().plan.tables > 4.5 / free, "{}", plain.job().plan.tables);
    // Many rows: the default remains.
    assert_eq!(case("", "10 s").job().plan.tables, 0.025);
}

/// Short steps between the times of two outputs would be followed by others.
#[test]
fn default_tables_have_the_times_of_a_given_output() {
    let tables = |contacts: &str| {
        let output = format!("[output]\ncontacts = \"{contacts}\"");
        let dry = PAIR.replace("[fluid]\ndensity = 1000\nviscosity = \"1 mPa s\"", "");
        assert!(dry != PAIR);
        let text = format!("{}\n{output}", dry.replace("end = \"1 s\"", "end = \"0.2 s\""));
        good(&text).job().plan.tables
    };
    for (contacts, interval) in [("10 ms", 10e-3), ("11 ms", 11e-3), ("1 ms", 1e-3)] {
        let ratio = (interval / tables(contacts)).max(tables(contacts) / interval);
        assert!((ratio - ratio.round()).abs() < 1e-9, "{contacts}: {ratio}");
        assert!(tables(contacts) <= tables("1 s") * 1.2, "{contacts}");
    }
}

/// A default interval slightly longer than a step would halve the steps.
#[test]
fn default_outputs_hardly_shorten_the_steps() {
    let case = |end: &str, output: &str| {
        let text = format!("{}\n[output]\n{output}", PAIR.replacen("\"1 s\"", end, 1));
        good(&text)
    };
    let whole = |ratio: f64| (ratio - ratio.round()).abs() < 1e-9 && ratio > 0.5;
    for end in ["0.02", "0.1", "0.3", "0.5", "1", "3"] {
        let [plain, free] = ["", "tables = 0\nslices = 0\nsurfaces = 0"]
            .map(|output| case(end, output).estimate(1).time_step_s);
        assert!(plain > 0.74 * free, "{end}: {plain} instead of {free}");
        let plan = case(end, "").job().plan;
        assert!(whole(plan.slices / plan.tables) && plan.surfaces == plan.slices, "{end}");
        let plan = case(end, "tables = \"3 ms\"").job().plan;
        assert!(whole(plan.slices / 3e-3), "{end}: {}", plan.slices);
        let plan = case(end, "tables = 0").job().plan;
        assert!(plan.slices > 0.79 * free.min(plan.end), "{end}: {}", plan.slices);
    }
    let plan = case("10", "").job().plan;
    assert_eq!((plan.tables, plan.slices), (0.025, 0.25));
}

#[test]
fn a_single_free_grain_between_walls_has_contact_time() {
    let second = PAIR.rfind("[[grain]]").unwrap();
    let times =
        |change: &str| good(&PAIR[..second].replacen("density = \"1500", change, 1)).estimate(1);
    let free = times("density = \"1500");
    assert!(free.contact_time_s.is_some() && free.contact_substeps.is_some());
    let held = times("motion = \"fixed\"\ndensity = \"1500");
    assert!(held.contact_time_s.is_none());
}

#[test]
fn prescribed_motions_count_in_the_expected_step() {
    let moved_with = |motion: &str, time: &str| {
        let grain = "position = [\"12.5 mm\", \"12.5 mm\", \"80 mm\"]";
        let text = PAIR.replacen(grain, &format!("{grain}\nmotion = {motion}"), 1);
        assert!(text != PAIR);
        good(&text.replace("end = \"1 s\"", time))
    };
    let step = |motion: &str| moved_with(motion, "end = \"1 s\"").estimate(1).time_step_s;
    let (free, fast) = (good(PAIR).estimate(1).time_step_s, step("{ velocity = [0, 0, 1] }"));
    // The Courant number of 0.4 at the speed of the fluid beside a sphere.
    assert!((fast / (0.4 * 0.25e-3 / 1.4) - 1.0).abs() < 0.1 && fast < 0.6 * free, "{fast} {free}");
    // The CFL number is a sum over the axes.
    let diagonal = step("{ velocity = [0.3, -0.4, 0.3] }");
    assert!((diagonal / fast - 1.0).abs() < 0.1, "{diagonal}");
    // A sine has 2 / pi of its largest speed on average.
    let sine =
        |periods: i32| format!("{{ velocity = {{ formula = [0, 0, \"sin({periods}*TAU*t)\"] }} }}");
    for periods in [1, 100, 144, 200] {
        let sine = step(&sine(periods));
        assert!(sine > 1.2 * fast && sine < 1.9 * fast, "{periods}: {sine} {fast}");
    }
    // A fast one has 20 steps in a period; a longer step that is given is warned of.
    for periods in [987, 2584] {
        let part = step(&sine(periods)) * f64::from(periods);
        assert!((0.04..0.051).contains(&part), "{periods}: {part}");
    }
    let follows = |step: &str| {
        let fixed = moved_with(&sine(987), &format!("end = \"1 s\"\nstep = \"{step}\""));
        fixed.estimate(1).warnings.iter().all(|w| !w.contains("do not follow"))
    };
    assert!(follows("0.05 ms") && !follows("0.2 ms"));
    let spin = step("{ velocity = \"fixed\", angular_velocity = [0, 0, 1000] }");
    assert!((spin / fast - 1.0).abs() < 0.1, "{spin}");
    // The largest speed limits a fixed step; at the start it is zero.
    let limit = |step: &str| {
        let sine = "{ velocity = { formula = [0, 0, \"sin(10*TAU*t)\"] } }";
        let fixed = moved_with(sine, &format!("end = \"1 s\"\nstep = \"{step}\""));
        fixed.estimate(1).warnings.iter().filter(|w| w.contains("above the stability")).count()
    };
    assert_eq!((limit("0.2 ms"), limit("0.09 ms")), (1, 0));
}

#[test]
fn the_expected_landing_is_that_of_the_study() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let table = std::fs::read_to_string(root.join("results/dkt-morphology-members/table.csv"));
    let table = table.unwrap();
    let column = table.lines().next().unwrap().split(',').position(|name| name == "end_time_s");
    let path = root.join("studies/dkt-morphology/case.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut bias = 0.0;
    for grain in (1..=16).map(|grain| format!("{grain:02}")) {
        let runs = table.lines().filter(|row| row.starts_with(&format!("g{grain}-o")));
        let ends = runs.map(|row| row.split(',').nth(column.unwrap()).unwrap());
        let ends: Vec<f64> = ends.map(|end| end.parse().unwrap()).collect();
        let measured = ends.iter().sum::<f64>() / ends.len() as f64;
        let set = [
            "domain.size=[\"15 mm\", \"15 mm\", \"60 mm\"]".into(),
            "grain.0.position=[\"7.5 mm\", \"7.5 mm\", \"48 mm\"]".into(),
            format!("grain.0.file=\"grains/{grain}.grain\""),
            format!("grain.1.file=\"grains/{grain}.grain\""),
        ];
        let case = Case::parse(&text, "case.toml", path.parent().unwrap(), &set).unwrap();
        let error = case.estimate(1).expected_end_s / measured - 1.0;
        println!("grain {grain}: {:+.1} %", 100.0 * error);
        assert!(error.abs() < 0.15, "{grain}: {error}");
        bias += error / 16.0;
    }
    assert!(bias.abs() < 0.06, "{bias}");
    // Without a stop at the landing the run goes on to its end.
    let end = |text: &str| good(text).estimate(1).expected_end_s;
    assert_eq!(end(PAIR), 1.0);
    // The spheres fall 85 mm at 136 mm/s.
    let landing = PAIR.replace("end = \"1 s\"", "end = \"1 s\"\nstop = \"landing\"");
    assert!((0.6..0.7).contains(&end(&landing)), "{}", end(&landing));
    // Not in a stream.
    let stream =
        landing.replace("viscosity =", "initial_velocity = [0, 0, \"1 cm/s\"]\nviscosity =");
    assert_eq!(end(&stream), 1.0);
}
