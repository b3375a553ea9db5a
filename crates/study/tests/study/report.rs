//! Report of a study from synthetic run folders: all figures, missing runs, damaged files.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::pair;
use grainwake_run::provenance::Provenance;
use grainwake_study::{
    Condition, Kissing, Plan, RUNS, Range, Run, Study, StudyReportFiles, render,
};

/// Plan of the 65 models of the repository, with the hashes of the synthetic run folders.
fn synthetic_plan() -> Plan {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/dkt-morphology/study.toml");
    let mut plan = Plan::resolve(&Study::read(&path).unwrap(), &[]).unwrap();
    (plan.version, plan.commit) = ("0.1.0".into(), Some("0123abc".into()));
    let program =
        Provenance { version: "0.1.0".into(), commit: plan.commit.clone(), ..Provenance::new("") };
    for run in &mut plan.runs {
        (run.case_sha256, run.ending) = ("00ff".into(), "end 1.0, stop -".into());
        run.id = run.id_by(&program);
    }
    plan
}

/// Time scale of a run relative to the synthetic pair, with the trends of the paper.
fn pace(run: &Run) -> f64 {
    let (s, r) = (run.factors["sphericity"], run.factors["roundness"]);
    match run.levels.get("orientation").map(String::as_str) {
        Some("o1") => 1.0 + 0.5 * (1.0 - s) + 0.2 * (1.0 - r),
        Some("o2" | "o4") => 0.9 + 0.2 * (1.0 - s),
        _ => 0.7 + 0.05 * (1.0 - s) + 0.03 * (1.0 - r),
    }
}

/// Copies the synthetic pair in `from` to `to` with stretched times.
fn stretch(from: &Path, to: &Path, factor: f64) {
    std::fs::create_dir_all(to).unwrap();
    let read = |name: &str| std::fs::read_to_string(from.join(name)).unwrap();
    let mut table = String::new();
    for (i, line) in read("grains.csv").lines().enumerate() {
        if i == 0 {
            table += line;
            table.push('\n');
            continue;
        }
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        let scale = |cell: &str, by: f64| (cell.parse::<f64>().unwrap() * by).to_string();
        cells[0] = scale(&cells[0], factor);
        for cell in &mut cells[5..8] {
            *cell = scale(cell, 1.0 / factor);
        }
        writeln!(table, "{}", cells.join(",")).unwrap();
    }
    std::fs::write(to.join("grains.csv"), table).unwrap();
    let mut log = String::new();
    for line in read("events.jsonl").lines() {
        let mut event: serde_json::Value = serde_json::from_str(line).unwrap();
        event["time"] = (event["time"].as_f64().unwrap() * factor).into();
        writeln!(log, "{event}").unwrap();
    }
    std::fs::write(to.join("events.jsonl"), log).unwrap();
    std::fs::copy(from.join("provenance.json"), to.join("provenance.json")).unwrap();
    let resolved = read("case.resolved.toml") + "\n[time]\nend = 1.0\n";
    std::fs::write(to.join("case.resolved.toml"), resolved).unwrap();
    let mut summary: serde_json::Value = serde_json::from_str(&read("summary.json")).unwrap();
    summary["end_time_s"] = (summary["end_time_s"].as_f64().unwrap() * factor).into();
    summary["max_cfl"] = 0.3.into();
    summary["ended_by"] = "landing".into();
    summary["phase"] = "separated".into();
    for grain in summary["grains"].as_array_mut().unwrap() {
        grain["peak_settling_speed_m_per_s"] = 0.1.into();
        grain["position_m"] = serde_json::json!([0.0, 0.0, 0.0]);
    }
    std::fs::write(to.join("summary.json"), summary.to_string()).unwrap();
}

/// Creates a study folder in which the wanted runs are finished; runs of the stories have slices.
fn study(root: &Path, wanted: impl Fn(&Run) -> bool) -> PathBuf {
    let folder = root.join("study");
    let plan = synthetic_plan();
    let original = root.join("pair");
    std::fs::create_dir_all(&original).unwrap();
    pair::pair(&original, 0.9, 0.5e-3);
    for run in plan.runs.iter().filter(|r| wanted(r)) {
        let to = run.folder(&folder);
        let story = plan.analysis.figures.stories.contains(&run.name);
        stretch(&original, &to, if story { 1.0 } else { pace(run) });
        if story {
            for part in ["slices", "grains"] {
                std::fs::create_dir_all(to.join(part)).unwrap();
                for file in std::fs::read_dir(original.join(part)).unwrap().flatten() {
                    std::fs::copy(file.path(), to.join(part).join(file.file_name())).unwrap();
                }
            }
            for file in ["run.pvd", "diagnostics.csv"] {
                std::fs::copy(original.join(file), to.join(file)).unwrap();
            }
        }
    }
    std::fs::create_dir_all(folder.join(RUNS)).unwrap();
    std::fs::write(folder.join("study.json"), serde_json::to_string(&plan).unwrap()).unwrap();
    folder
}

fn names(rendered: &StudyReportFiles) -> Vec<String> {
    let stem = |file: &PathBuf| file.file_stem().unwrap().to_string_lossy().into_owned();
    rendered.png.iter().map(stem).collect()
}

/// Reads the smallest gap of every run from the table.
fn closest_gaps(folder: &Path) -> BTreeMap<String, Option<f64>> {
    let text = std::fs::read_to_string(folder.join("table.json")).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let rows = value.as_array().unwrap().iter();
    rows.map(|row| {
        let name = row["name"].as_str().unwrap().to_owned();
        (name, row["pair"]["closest_gap"].as_f64())
    })
    .collect()
}

fn findings(folder: &Path) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(folder.join("analysis.json")).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let text = |v: &serde_json::Value| v.as_str().unwrap().to_owned();
    value["claims"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| (text(&c["claim"]), text(&c["verdict"])))
        .collect()
}

#[test]
fn a_complete_study_has_all_figures() {
    let root = tempfile::tempdir().unwrap();
    let root = std::env::var("GRAINWAKE_GALLERY").map_or(root.path().to_owned(), PathBuf::from);
    let folder = study(&root, |_| true);
    let rendered = render(&folder).unwrap();
    let expected = [
        "fig04-grains",
        "fig05-orientations",
        "fig07-setup",
        "fig08-g04-o1",
        "fig09-g04-o3",
        "fig10-sphere",
        "fig11-vorticity-g04-o1",
        "fig12-vorticity-g04-o3",
        "fig13-vorticity-sphere",
        "fig14a-kissing-time",
        "fig14b-kissing-time-spread",
        "fig15-gap-by-row",
        "fig16-gap-by-column",
        "fig17-velocity-by-row",
        "fig18-velocity-by-column",
        "correlations",
        "factor-means",
        "claims",
    ];
    assert_eq!(names(&rendered), expected);
    assert_eq!(rendered.runs, (65, 65));
    assert!(rendered.notes.is_empty(), "{:?}", rendered.notes);
    for png in &rendered.png {
        assert!(std::fs::metadata(png).unwrap().len() > 5000, "{}", png.display());
        let svg = std::fs::read_to_string(png.with_extension("svg")).unwrap();
        let drawn: Vec<&str> = svg.lines().filter(|l| !l.contains("base64")).collect();
        for wrong in ["NaN", "Minf", "Linf", "\"inf"] {
            assert!(!drawn.iter().any(|l| l.contains(wrong)), "{}: {wrong}", png.display());
        }
    }
    let page = std::fs::read_to_string(&rendered.page).unwrap();
    assert!(page.contains("65 of 65 runs are finished") && !page.contains("Missing or left out"));
    assert_eq!(page.matches("<figure").count(), 18);
    assert!(
        page.contains("<b>Shortest first contact, by model</b>: g16-o3"),
        "the roundest, most spherical, broad side down"
    );
    let gaps = closest_gaps(&folder);
    let kissed = gaps["sphere"].expect("its diagnostics are there");
    assert!(kissed.abs() < 0.02, "{kissed}: the surfaces meet");
    assert_eq!(gaps["g01-o1"], None, "without diagnostics");
    let found = findings(&folder);
    let verdict = |claim: &str| {
        found.iter().find(|(c, _)| c.contains(claim)).map(|(_, v)| v.as_str()).unwrap()
    };
    assert_eq!(verdict("longer in orientation 1 than in orientation 2"), "holds");
    assert_eq!(verdict("same in orientations 2 and 4"), "holds");
    assert_eq!(verdict("Lower sphericity prolongs the drafting in orientation 1"), "holds");
    assert_eq!(verdict("orientation 3 sphericity does not change the drafting"), "open");
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("not converged at 8 cells per diameter"));
    // The thinned histories are small, and sufficient to draw the curves without the run folders.
    let size: u64 = std::fs::read_dir(folder.join("histories"))
        .unwrap()
        .flatten()
        .map(|f| f.metadata().unwrap().len())
        .sum();
    assert!(size < 30_000_000, "{size}");
    let kept = |name: &str| std::fs::read(folder.join(name)).unwrap();
    let (table, analysis) = (kept("table.csv"), kept("analysis.json"));
    std::fs::rename(folder.join(RUNS), root.join("elsewhere")).unwrap();
    let history = |name: &str| folder.join("histories").join(format!("{name}.csv"));
    std::fs::remove_file(history("g05-o3")).unwrap();
    let again = render(&folder).unwrap();
    std::fs::rename(root.join("elsewhere"), folder.join(RUNS)).unwrap();
    assert_eq!((table, analysis), (kept("table.csv"), kept("analysis.json")));
    let note = "the figures of distance and velocity lack runs without history: g05-o3";
    assert!(again.notes.contains(&note.to_owned()), "{:?}", again.notes);
    let drawn = names(&again);
    assert!(drawn.contains(&"fig15-gap-by-row".into()) && !drawn.contains(&"fig08-g04-o1".into()));
}

/// Reduces the analysis to the given figures, in a folder without its study file.
fn ask_only(folder: &Path, figures: serde_json::Value) {
    let file = folder.join("study.json");
    let mut plan: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    plan["study"] = "/nowhere/study.toml".into();
    plan["analysis"] = serde_json::json!({ "figures": figures });
    std::fs::write(&file, plan.to_string()).unwrap();
}

#[test]
fn figures_of_other_studies_are_numbered_from_one() {
    let root = tempfile::tempdir().unwrap();
    let folder = study(root.path(), |run| run.name.starts_with("g04"));
    ask_only(&folder, serde_json::json!({ "stories": ["g04-o1", "g05-o1"] }));
    let rendered = render(&folder).unwrap();
    assert_eq!(names(&rendered), ["fig01-g04-o1", "fig02-vorticity-g04-o1"]);
    let page = std::fs::read_to_string(&rendered.page).unwrap();
    assert!(page.contains("<b>Figure 1. Drafting") && !page.contains("Figure 8"));
    assert!(page.contains("the pictures of g05-o1 are left out"));
    // Without a request: all pairs in one figure, and results against the varied parameters.
    ask_only(&folder, serde_json::json!({}));
    let rendered = render(&folder).unwrap();
    assert_eq!(names(&rendered), ["fig01-gap", "fig02-kissing-time"]);
    let svg = std::fs::read_to_string(rendered.png[1].with_extension("svg")).unwrap();
    assert!(svg.contains("kissing time") && svg.contains("orientation"));
    let page = std::fs::read_to_string(&rendered.page).unwrap();
    assert!(page.contains("<td class=\"number\">1</td>"), "kisses are counted");
}

#[test]
fn an_incomplete_study_is_drawn_and_missing_runs_are_listed() {
    let root = tempfile::tempdir().unwrap();
    let some =
        |run: &Run| ["g01", "g06"].iter().any(|g| run.levels.get("grain").is_some_and(|l| l == g));
    let folder = study(root.path(), some);
    // One run has failed, one is unfinished.
    let place = |name: &str| folder.join(RUNS).join(name);
    std::fs::remove_file(place("g06-o3").join("summary.json")).unwrap();
    std::fs::remove_file(place("g01-o1").join("summary.json")).unwrap();
    std::fs::write(place("g01-o1").join("failure.json"), "{\"what\":\"it blew up\"}").unwrap();
    let rendered = render(&folder).unwrap();
    assert_eq!(rendered.runs, (6, 65));
    let drawn = names(&rendered);
    assert!(
        drawn.contains(&"fig14a-kissing-time".into()) && drawn.contains(&"fig04-grains".into())
    );
    assert!(!drawn.iter().any(|n| n.contains("vorticity")));
    let page = std::fs::read_to_string(&rendered.page).unwrap();
    for part in [
        "6 of 65 runs are finished",
        "unfinished: g06-o3",
        "g01-o1: it blew up",
        "there is no run sphere",
        "the figures of distance and velocity lack unfinished runs: g02-o3, ",
        "too few for a test",
    ] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn an_empty_study_has_a_page_and_one_without_plan_and_runs_is_an_error() {
    let root = tempfile::tempdir().unwrap();
    let folder = study(root.path(), |_| false);
    let rendered = render(&folder).unwrap();
    assert_eq!(rendered.runs, (0, 65));
    assert!(std::fs::read_to_string(&rendered.page).unwrap().contains("0 of 65 runs are finished"));
    // The table still lists the runs.
    std::fs::write(folder.join("study.json"), "{").unwrap();
    let rebuilt = render(&folder).unwrap();
    assert_eq!(rebuilt.runs, (0, 65));
    assert!(rebuilt.notes[0].contains("study.json is damaged"), "{:?}", rebuilt.notes);
    std::fs::remove_file(folder.join("table.json")).unwrap();
    assert!(render(&folder).unwrap_err().to_string().contains("study.json is damaged"));
}

#[test]
fn the_page_tells_who_kisses_and_does_not_name_every_missing_run() {
    let root = tempfile::tempdir().unwrap();
    let orientation = |run: &Run| run.levels.get("orientation").cloned().unwrap_or_default();
    let folder = study(root.path(), |run| ["o1", "o3"].contains(&&*orientation(run)));
    let path = folder.join("study.json");
    let mut plan: Plan = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    // Without the study file, the analysis of the plan is used.
    plan.study = "gone.toml".into();
    plan.analysis.kissing = Some(Kissing { by: "orientation".into(), grid: None });
    std::fs::write(&path, serde_json::to_string(&plan).unwrap()).unwrap();
    let rendered = render(&folder).unwrap();
    assert!(names(&rendered).contains(&"kissing-share".to_owned()));
    let svg = std::fs::read_to_string(folder.join("figures/kissing-share.svg")).unwrap();
    assert!(svg.contains("share that has kissed") && !svg.contains("NaN"));
    let page = std::fs::read_to_string(&rendered.page).unwrap();
    assert!(page.contains("<h2>Who kisses</h2>"), "no section");
    assert!(page.contains("missing: 33 runs, the first are g01-o2, g01-o4, "));
    assert!(!page.contains("g15-o2"), "a missing run has no row");
    let analysis = std::fs::read_to_string(folder.join("analysis.json")).unwrap();
    let analysis: serde_json::Value = serde_json::from_str(&analysis).unwrap();
    let levels = analysis["kissing"]["levels"].as_array().unwrap();
    let of = |level: &serde_json::Value| {
        (
            level["level"].as_str().unwrap().to_owned(),
            level["runs"].as_u64(),
            level["share"].as_f64(),
        )
    };
    let expected = |name: &str| (name.to_owned(), Some(16), Some(1.0));
    assert_eq!(levels.iter().map(of).collect::<Vec<_>>(), [expected("o1"), expected("o3")]);
    let difference = &analysis["kissing"]["differences"][0];
    assert!(difference["time_shift"].as_f64().unwrap() > 0.0, "orientation 1 is later");
    assert!(difference["log_rank_p"].as_f64().unwrap() < 1e-3);
}

#[test]
fn claims_and_figures_can_be_restricted_to_some_runs() {
    let root = tempfile::tempdir().unwrap();
    let folder = study(root.path(), |_| true);
    let all = render(&folder).unwrap();
    assert!(names(&all).contains(&"claims".to_owned()));
    let path = folder.join("study.json");
    let mut plan: Plan = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    plan.study = "gone.toml".into();
    let spherical = Condition::Range(Range { at_least: Some(0.7), at_most: None });
    plan.analysis.when.insert("sphericity".into(), spherical);
    std::fs::write(&path, serde_json::to_string(&plan).unwrap()).unwrap();
    let some = render(&folder).unwrap();
    assert_eq!(some.runs, all.runs, "the table has all runs");
    let text = std::fs::read_to_string(folder.join("analysis.json")).unwrap();
    let analysis: serde_json::Value = serde_json::from_str(&text).unwrap();
    let counts = |key: &str| -> Vec<u64> {
        analysis[key].as_array().unwrap().iter().filter_map(|c| c["n"].as_u64()).collect()
    };
    assert!(counts("correlations").iter().all(|n| *n == 8), "{:?}", counts("correlations"));
    assert!(counts("claims").iter().all(|n| *n <= 9), "{:?}", counts("claims"));
    let svg = std::fs::read_to_string(folder.join("figures/claims.svg")).unwrap();
    assert!(svg.contains("rank correlation") && !svg.contains("NaN"));
}
