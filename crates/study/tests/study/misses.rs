//! Report of pairs that land without a kiss, from a table without run folders.

use std::path::{Path, PathBuf};

use grainwake_study::{PairMeasures, RunRecord, StateKind, render, write_tables};

use crate::common;

const STUDY: &str = r#"
title = "misses"
base = "case.toml"
[[axis]]
name = "grip"
key = "contact.friction"
values = [ { name = "rough", value = 0.5 }, { name = "fine", value = 0.3 } ]
[[axis]]
name = "weight"
key = "grain.1.density"
values = [
  { name = "light", value = 2000 }, { name = "mid", value = 3000 }, { name = "heavy", value = 4000 },
]
[ensemble]
members = 2
offset = "0.02 mm"
"#;

/// Writes a study whose runs have a kiss at a time, or land at 40 without one.
fn study(kiss: impl Fn(&str, usize) -> Option<f64>) -> (tempfile::TempDir, PathBuf) {
    let (root, path) = common::folder(STUDY);
    let plan = common::plan(&path).unwrap();
    let folder = root.path().join("out");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("study.json"), serde_json::to_string(&plan).unwrap()).unwrap();
    let record = |run: &grainwake_study::Run| RunRecord {
        name: run.name.clone(),
        model: run.model.clone(),
        member: run.member,
        levels: run.levels.clone(),
        state: StateKind::Finished,
        id: run.id.clone(),
        diameter_m: Some(2e-3),
        gravity_m_per_s2: Some([0.0, 0.0, -9.81]),
        pair: Some(PairMeasures {
            kiss_time: kiss(&run.model, run.member),
            landing_time: Some(40.0),
            ..PairMeasures::default()
        }),
        ..RunRecord::default()
    };
    let records: Vec<RunRecord> = plan.runs.iter().map(record).collect();
    write_tables(&records, &folder).unwrap();
    (root, folder)
}

fn svg(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join("figures").join(name)).unwrap()
}

#[test]
fn a_landing_is_no_kissing_time() {
    // Light pairs kiss; of the two runs of a pair of medium weight one does; of the heavy pairs,
    // only rough ones do.
    let (_root, folder) = study(|model, member| match model {
        _ if model.ends_with("light") => Some(10.0),
        _ if model.ends_with("mid") && member == 0 => Some(12.0),
        "rough-heavy" => Some(11.0),
        _ => None,
    });
    let rendered = render(&folder).unwrap();
    let drawn = svg(&folder, "fig01-kissing-time.svg");
    assert!(drawn.contains("no kiss"), "the strip above the axis");
    assert!(!drawn.contains(">40<") && !drawn.contains(">26<"), "no landing time on the axis");
    // Two panels, three models without a time each, two of them with a kiss; and the legend.
    let symbols = drawn.matches("stroke-width=\"0.9\"").count();
    assert_eq!(symbols, 2 * (3 + 2) + 1, "symbols and kisses");
    assert!(drawn.contains("no kiss in half of the runs or more"), "the legend");
    // A line joins the light models across the grip. None joins a kiss and a landing, or the rough
    // light and heavy models across that of medium weight.
    let joined = drawn.lines().filter(|l| l.contains("#b4b4b8") && l.contains('L'));
    assert_eq!(joined.count(), 1, "{drawn}");
    let page = std::fs::read_to_string(&rendered.page).unwrap();
    let missed =
        "3 models, in half or more of whose runs the pair landed or the run ended before, have no";
    assert!(page.contains(missed), "{page}");
    assert!(drawn.contains("Hollow symbols above the axis: 3 models, in half or more"), "{drawn}");
    let kissed = "runs in which the pair kissed before the first landing or the end: 8,";
    assert!(page.contains(kissed), "{page}");
    assert!(!page.contains("right-censored"));
}

#[test]
fn pairs_that_still_approach_have_not_passed() {
    let (_root, folder) = study(|_, _| None);
    let file = folder.join("table.json");
    // All pairs come close without contact; the light ones move apart again.
    let mut records: Vec<RunRecord> =
        serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    for record in &mut records {
        let last = if record.model.ends_with("light") { 2.0 } else { 1.1 };
        let pair = record.pair.as_mut().unwrap();
        (pair.closest, pair.closest_gap) = (Some(1.1), Some(0.1));
        (pair.final_distance, pair.landing_time) = (Some(last), None);
    }
    write_tables(&records, &folder).unwrap();
    let page = std::fs::read_to_string(render(&folder).unwrap().page).unwrap();
    let near = "within 0.125 d of each other without contact, and moved apart again: 4";
    assert!(page.contains(near), "{page}");
    for (words, known) in [
        ("No model has a first contact, in more than half of its runs, before a grain lands", true),
        ("or the run ends. ≥: lower bound, the pair was still in contact then.", true),
        ("landed in contact", false),
        ("before the grains landed", false),
    ] {
        assert_eq!(page.contains(words), known, "{words}: {page}");
    }
}

#[test]
fn levels_have_one_style_in_the_order_of_the_study_file() {
    let (_root, folder) = study(|_, member| Some(10.0 + member as f64));
    let path = folder.join("study.json");
    let mut plan: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    plan["study"] = "gone.toml".into();
    plan["analysis"]["kissing"] = serde_json::json!({ "by": "grip" });
    plan["analysis"]["correlations"] = serde_json::json!(
        { "by": "grip", "quantities": ["kiss_time"], "factors": ["krumbein_sphericity"] });
    std::fs::write(&path, plan.to_string()).unwrap();
    render(&folder).unwrap();
    // "rough" is declared first, "fine" is the first in the alphabet.
    let share = svg(&folder, "fig01-kissing-share.svg");
    let means = std::fs::read_dir(folder.join("figures")).unwrap().flatten();
    let means = means.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let means = means.into_iter().find(|name| name.ends_with("factor-means.svg")).unwrap();
    let means = svg(&folder, &means);
    let colours = |svg: &str, name: &str| {
        // The sample of a legend stands before its name.
        let lines: Vec<&str> = svg.lines().collect();
        let label = lines.iter().position(|l| l.contains(&format!(">{name}<"))).unwrap();
        let sample = lines[label - 1];
        let at = sample.find("=\"#").map(|at| &sample[at + 2..at + 9]);
        at.unwrap_or_default().to_owned()
    };
    for level in ["rough", "fine"] {
        assert_eq!(colours(&share, level), colours(&means, level), "{level}");
    }
    assert_ne!(colours(&share, "rough"), colours(&share, "fine"));
}

#[test]
fn a_study_without_a_finished_run_prints_dashes() {
    let (root, path) = common::folder(STUDY);
    let plan = common::plan(&path).unwrap();
    let folder = root.path().join("out");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("study.json"), serde_json::to_string(&plan).unwrap()).unwrap();
    let page = std::fs::read_to_string(render(&folder).unwrap().page).unwrap();
    for wrong in [">-0<", "-0.00 h", "0.0e0"] {
        assert!(!page.contains(wrong), "{wrong}");
    }
    assert!(page.contains("wall-clock time, all runs</th><td>–"), "{page}");
}
