//! Saved pages, also of incomplete and damaged runs.

mod common;

use std::path::Path;

use grainwake_view::{Source, ViewError, Viewer, save};
use serde_json::Value;

fn saved(folders: &[&Path]) -> (String, Vec<String>) {
    let source = |(i, folder): (usize, &&Path)| {
        let name = format!("run {i}");
        Source { name, folder: (*folder).to_owned() }
    };
    let sources = folders.iter().enumerate().map(source).collect();
    let mut viewer = Viewer::new(sources, None).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    let notes = save(&mut viewer, &file).unwrap();
    (std::fs::read_to_string(&file).unwrap(), notes)
}

/// Returns the JSON of a data block of a saved page.
fn block(page: &str, id: &str) -> Value {
    let start = page.split(&format!("id=\"{id}\">")).nth(1).expect("the block");
    serde_json::from_str(start.split("</script>").next().unwrap()).unwrap()
}

#[test]
fn a_page_contains_its_runs_and_loads_nothing() {
    let run = common::run_folder();
    let (page, notes) = saved(&[run.path(), run.path()]);
    assert!(page.contains("connect-src 'none'") && page.contains("default-src 'none'"));
    assert_eq!(block(&page, "index")["runs"], serde_json::json!(["run 0", "run 1"]));
    let run = block(&page, "run-1");
    assert_eq!(run["state"], "unfinished");
    assert_eq!(run["grains"][1]["scale"], 1.5e-3);
    assert_eq!(run["grains"][0]["mesh"], run["grains"][1]["mesh"], "one mesh for both spheres");
    assert_eq!(run["slices"][0]["axis"], 1);
    assert_eq!(run["events"][0]["event"], "kiss");
    assert_eq!(notes.len(), 2, "diagnostics.csv is missing in both: {notes:?}");
}

#[test]
fn a_folder_without_a_run_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let source = Source { name: "x".into(), folder: folder.path().into() };
    let error = Viewer::new(vec![source], None).err().unwrap();
    assert!(matches!(error, ViewError::Run(_)) && !error.is_input_output());
    assert!(error.to_string().contains("holds no run"), "{error}");
}

#[test]
fn damaged_files_are_noted_and_the_rest_is_shown() {
    let run = common::run_folder();
    let path = run.path();
    std::fs::write(path.join("slices/y-grain0_000001.vti"), "nonsense").unwrap();
    std::fs::write(path.join("summary.json"), "{").unwrap();
    std::fs::write(path.join("diagnostics.csv"), "time,gap\n0,1e-3\n0.1,x\n0.2,1\n").unwrap();
    let rows = std::fs::read_to_string(path.join("grains.csv")).unwrap();
    std::fs::write(path.join("grains.csv"), rows + "0.2,0,bad\n0.3,0,bad\n").unwrap();
    let (page, notes) = saved(&[path]);
    let run = block(&page, "run-0");
    assert_eq!(run["poses"]["grains"], 2);
    assert_eq!(run["slices"][0]["frames"].as_array().unwrap().len(), 1);
    assert_eq!(run["diagnostics"][1]["name"], "gap");
    let noted = |text: &str| assert!(notes.iter().any(|n| n.contains(text)), "{text}: {notes:?}");
    noted("y-grain0_000001.vti was left out");
    noted("summary.json, line 1");
    noted("diagnostics.csv, line 3");
    noted("grains.csv, line 6");
}

#[test]
fn a_run_without_motion_or_case_is_shown() {
    let run = common::run_folder();
    std::fs::remove_file(run.path().join("grains.csv")).unwrap();
    let (page, notes) = saved(&[run.path()]);
    assert_eq!(block(&page, "run-0")["poses"], Value::Null);
    assert!(notes.iter().any(|n| n.contains("grains.csv is missing")), "{notes:?}");

    let run = common::run_folder();
    std::fs::remove_file(run.path().join("case.resolved.toml")).unwrap();
    let (page, notes) = saved(&[run.path()]);
    let document = block(&page, "run-0");
    assert_eq!(document["size"], Value::Null);
    assert_eq!(document["meshes"][0]["kind"], "sphere");
    assert!(notes.iter().any(|n| n.contains("shown as spheres")), "{notes:?}");
}

#[test]
fn texts_of_a_run_cannot_leave_their_block() {
    let run = common::run_folder();
    let case = run.path().join("case.resolved.toml");
    let title = "</script><img src=x onerror=alert(1)>";
    let text = std::fs::read_to_string(&case).unwrap().replace("Two spheres", title);
    std::fs::write(&case, text).unwrap();
    let (page, _) = saved(&[run.path()]);
    assert!(!page.contains("<img"));
    assert_eq!(block(&page, "run-0")["title"], title);
}
