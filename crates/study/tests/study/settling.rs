//! Studies of one and of three grains: results, figures and text.

use std::path::{Path, PathBuf};

use crate::common::plan;
use crate::files::DRY;
use grainwake_study::{
    Options, Outcome, Plan, RunRecord, StudyError, StudyObserver, execute, note_on_unmeasured,
    records, render,
};

struct Quiet;
impl StudyObserver for Quiet {}

const STUDY: &str = r#"
title = "falls"
base = "case.toml"
[[axis]]
name = "gravity"
key = "gravity"
values = [
  { name = "half", value = [0, 0, -5], factors = { g = 5 } },
  { name = "full", value = [0, 0, -10], factors = { g = 10 } },
]
"#;

/// Case of 2 mm spheres side by side without fluid, centres at 21 mm, 22 mm ... above the floor.
fn case(grains: usize) -> String {
    let (head, _) = DRY.split_once("[[grain]]").unwrap();
    let mut out = head.replace("60 ms", "100 ms");
    for i in 0..grains {
        out += &format!(
            "[[grain]]\nshape = {{ kind = \"sphere\", diameter = \"2 mm\" }}\nnodes = 200\ndensity = 2500\nposition = [\"{} mm\", \"5 mm\", \"{} mm\"]\n",
            2 + 3 * i,
            21 + i
        );
    }
    out
}

fn carried_out(grains: usize) -> (tempfile::TempDir, PathBuf, Plan) {
    carry_out(grains, STUDY)
}

/// Runs a study of two models.
fn carry_out(grains: usize, study: &str) -> (tempfile::TempDir, PathBuf, Plan) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("case.toml"), case(grains)).unwrap();
    let path = folder.path().join("study.toml");
    std::fs::write(&path, study).unwrap();
    let plan = plan(&path).unwrap();
    let out = folder.path().join("out");
    plan.create_folder(&out).unwrap();
    let options = Options {
        jobs: 1,
        threads: 1,
        retry: false,
        keep_checkpoints: false,
        command: vec!["test".into()],
    };
    let ended = execute(&plan.runs, &[0, 1], &out, &options, &Quiet).unwrap();
    assert!(ended.iter().all(|(_, o)| matches!(o, Outcome::Finished(_))));
    (folder, out, plan)
}

fn rows(plan: &Plan, out: &Path) -> Vec<RunRecord> {
    records(plan, out).unwrap()
}

fn page(out: &Path) -> String {
    let whole = std::fs::read_to_string(out.join("report.html")).unwrap();
    let mut text = String::new();
    for part in whole.split('<').filter(|part| !part.starts_with("style")) {
        text += part.split_once('>').map_or("", |(_, text)| text);
        text.push(' ');
    }
    text
}

#[test]
fn without_gravity_the_page_says_why_nothing_is_measured() {
    let weightless = STUDY.replace("-5]", "0]").replace("-10]", "0]");
    let (_folder, out, plan) = carry_out(1, &weightless);
    let note = note_on_unmeasured(&rows(&plan, &out)).unwrap();
    assert!(note.starts_with("2 runs have no measured values, because gravity is zero"), "{note}");
    render(&out).unwrap();
    let page = page(&out);
    assert!(page.contains(&note) && page.contains("2 of 2 runs are finished."), "{page}");
    assert!(!page.contains("kiss") && !page.contains("pair"), "{page}");
}

#[test]
fn single_grains_have_results_figures_and_text() {
    let (_folder, out, plan) = carried_out(1);
    let rows = rows(&plan, &out);
    for (row, g) in rows.iter().zip([5.0_f64, 10.0]) {
        // 20 mm of free fall; the final speed is the mean over 2 mm that end 2 mm above the floor.
        let value = |name: &str| row.measured(name).unwrap_or_else(|| panic!("no {name}"));
        let within = |bound: f64, name: &str, expected: f64| {
            let found = value(name);
            assert!((found / expected - 1.0).abs() < bound, "{name}: {found}, not {expected}");
        };
        let close = |name: &str, expected: f64| within(0.01, name, expected);
        let speed = |fallen: f64| (2.0 * g * fallen).sqrt();
        close("landing_time_s", (2.0 * 0.02 / g).sqrt());
        close("peak_speed_m_per_s", speed(0.02));
        close("final_speed_m_per_s", 0.5 * (speed(0.016) + speed(0.018)));
        close("final_speed", value("final_speed_m_per_s") / (2e-3 * g).sqrt());
        close("mean_speed", 0.5 * speed(0.02) / (2e-3 * g).sqrt());
        // Difference of speeds from rows at intervals of 1 ms.
        within(
            0.03,
            "speed_change",
            2.0 * (speed(0.018) - speed(0.016)) / (speed(0.018) + speed(0.016)),
        );
        assert!(value("drift") < 1e-9 && value("turned") < 1e-6);
        assert_eq!((value("grains"), value("landed")), (1.0, 1.0));
        assert!(row.measured("kiss_time").is_none());
    }
    let done = render(&out).unwrap();
    let names: Vec<_> = done.png.iter().map(|p| p.file_stem().unwrap().to_owned()).collect();
    assert_eq!(names, ["fig01-velocity", "fig02-settling-speed"]);
    let text = page(&out);
    assert!(text.contains("Figure 1. Settling speed") && text.contains("2 of 2 grains landed"));
    for word in ["kiss", "pair", "Which part"] {
        assert!(!text.contains(word), "{word}: {text}");
    }
    let table = std::fs::read_to_string(out.join("table.csv")).unwrap();
    let header = table.lines().next().unwrap();
    assert!(header.contains("final_speed_m_per_s") && !header.contains("kiss"), "{header}");
    let width = |line: &str| line.split(',').count();
    assert!(table.lines().all(|line| width(line) == width(header)));
    assert_eq!(std::fs::read_to_string(out.join("settling.csv")).unwrap().lines().count(), 3);
    // Without the run folders the figures are the same.
    let before = std::fs::read(&done.png[0]).unwrap();
    std::fs::remove_dir_all(out.join("runs")).unwrap();
    let again = render(&out).unwrap();
    assert_eq!(again.png.len(), 2);
    assert_eq!(rows_of(&out), 2);
    assert!(!before.is_empty());
}

#[test]
fn factors_that_are_no_shapes_are_not_called_so() {
    let (folder, out, _) = carried_out(1);
    let analysis = "[[claim]]\nsays = \"Gravity pulls\"\nquantity = \"final_speed_m_per_s\"\n\
                    test.trend = { with = \"g\", sign = \"rises\" }\n[correlations]\n\
                    quantities = [\"final_speed_m_per_s\"]\nfactors = [\"g\"]\nby = \"gravity\"\n";
    std::fs::write(folder.path().join("analysis.toml"), analysis).unwrap();
    let with = STUDY.replace("[[axis]]", "analysis = \"analysis.toml\"\n[[axis]]");
    std::fs::write(folder.path().join("study.toml"), &with).unwrap();
    render(&out).unwrap();
    let text = page(&out);
    for words in ["Results against factors", "contradicted: 0, open: 1"] {
        assert!(text.contains(words), "`{words}` is missing in {text}");
    }
    for words in ["shape factors", "kissing", "A pair", "1 claims", "1 grains"] {
        assert!(!text.contains(words), "{words}: {text}");
    }
}

fn rows_of(out: &Path) -> usize {
    let text = std::fs::read_to_string(out.join("table.json")).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let all = value.as_array().unwrap().iter();
    all.filter(|row| row["settling"]["landed"] == 1).count()
}

#[test]
fn three_grains_have_means_and_individual_landings() {
    let (_folder, out, plan) = carried_out(3);
    let rows = rows(&plan, &out);
    let full = rows[1].settling.as_ref().unwrap();
    assert_eq!((full.grains, full.landed), (3, 3));
    for (i, grain) in full.each.iter().enumerate() {
        let expected = (2.0 * (0.02 + 1e-3 * i as f64) / 10.0).sqrt();
        let found = grain.landing_time_s.unwrap();
        assert!((found / expected - 1.0).abs() < 0.01, "grain {i}: {found}, not {expected}");
    }
    assert_eq!(full.landing_time_s, full.each[0].landing_time_s);
    render(&out).unwrap();
    assert!(page(&out).contains("6 of 6 grains landed"));
    assert_eq!(std::fs::read_to_string(out.join("settling.csv")).unwrap().lines().count(), 7);
}

#[test]
fn a_changed_analysis_is_used_and_a_wrong_one_is_an_error() {
    let (folder, out, _) = carried_out(1);
    render(&out).unwrap();
    let file = folder.path().join("analysis.toml");
    let claim = |quantity: &str| {
        format!(
            "[[claim]]\nsays = \"Gravity pulls\"\nquantity = \"{quantity}\"\ntest.trend = {{ with = \"g\", sign = \"rises\" }}\n"
        )
    };
    std::fs::write(&file, claim("final_speed_m_per_s")).unwrap();
    let with = STUDY.replace("[[axis]]", "analysis = \"analysis.toml\"\n[[axis]]");
    std::fs::write(folder.path().join("study.toml"), &with).unwrap();
    render(&out).unwrap();
    assert!(page(&out).contains("Gravity pulls"));
    let kept = std::fs::read_to_string(out.join("study.json")).unwrap();
    assert!(kept.contains("Gravity pulls"));
    std::fs::write(&file, claim("final_sped_m_per_s")).unwrap();
    let Err(StudyError::Invalid(problems)) = render(&out) else {
        panic!("accepted");
    };
    let text = problems[0].to_string();
    assert!(text.contains("final_sped_m_per_s"), "{text}");
    assert_eq!(problems[0].place().map(|(_, line, _)| line), Some(3));
    // If the case of the study file is missing, the stored analysis is used, with a note.
    std::fs::write(&file, claim("final_speed_m_per_s")).unwrap();
    let case = folder.path().join("case.toml");
    std::fs::rename(&case, folder.path().join("gone")).unwrap();
    let done = render(&out).unwrap();
    assert!(done.notes[0].contains("there is no case file"), "{:?}", done.notes);
    // Without the study file, the stored analysis is used.
    std::fs::remove_file(folder.path().join("study.toml")).unwrap();
    render(&out).unwrap();
    assert!(page(&out).contains("Gravity pulls"));
}
