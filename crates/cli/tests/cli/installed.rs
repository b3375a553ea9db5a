//! Program as a user installs it: version, manual pages, validations away from the source tree.

use std::path::Path;
use std::process::Command;

use crate::common::{DRY, folder_with, grainwake};

fn stdout(arguments: &[&str]) -> String {
    let done = grainwake().args(arguments).assert().success();
    String::from_utf8_lossy(&done.get_output().stdout).into_owned()
}

/// Commit of the working tree; none in a copy without a repository.
fn commit() -> Option<String> {
    let done = Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).output().ok()?;
    done.status.success().then(|| String::from_utf8_lossy(&done.stdout).trim().to_owned())
}

#[test]
fn the_version_and_the_provenance_name_the_commit() {
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(stdout(&["-V"]), format!("grainwake {version}\n"));
    let long = stdout(&["--version"]);
    assert!(long.starts_with(&format!("grainwake {version} (commit ")), "{long}");
    let (folder, case) = folder_with(DRY);
    let out = folder.path().join("run");
    let mut run = grainwake();
    run.arg("run").arg(&case).arg("-o").arg(&out).args(["--quiet", "--no-report"]);
    run.args(["--set", "time.end=1 ms"]).assert().success();
    let text = std::fs::read_to_string(out.join("provenance.json")).unwrap();
    let provenance: serde_json::Value = serde_json::from_str(&text).unwrap();
    match commit() {
        Some(commit) => {
            assert!(long.contains(&commit), "{commit} in {long}");
            let written = provenance["commit"].as_str().unwrap_or_default();
            assert!(written.starts_with(&commit), "{text}");
            assert!(long.contains(written), "{long}");
        }
        None => assert!(long.contains("unknown"), "{long}"),
    }
}

/// Commands of the program, as lists of words, without those that print help.
fn commands(above: &[String], found: &mut Vec<Vec<String>>) {
    let mut arguments: Vec<&str> = above.iter().map(String::as_str).collect();
    arguments.push("--help");
    let help = stdout(&arguments);
    found.push(above.to_vec());
    let Some((_, list)) = help.split_once("Commands:\n") else {
        return;
    };
    for line in list.lines().take_while(|line| !line.is_empty()) {
        // Descriptions continue on lines that are indented further.
        let Some(name) = line.strip_prefix("  ").filter(|rest| !rest.starts_with(' ')) else {
            continue;
        };
        let name = name.split_whitespace().next().unwrap();
        if name != "help" {
            commands(&[above, &[name.to_owned()]].concat(), found);
        }
    }
}

#[test]
fn every_command_has_a_manual_page_and_every_option_a_line_in_the_reference() {
    let mut all = Vec::new();
    commands(&[], &mut all);
    assert!(all.len() > 20, "{all:?}");
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man1");
    stdout(&["man", "-o", pages.to_str().unwrap()]);
    assert_eq!(std::fs::read_dir(&pages).unwrap().count(), all.len());
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference");
    let reference = std::fs::read_to_string(reference.join("command-line.md")).unwrap();
    let mut missing = Vec::new();
    for words in &all {
        let name = [&["grainwake".to_owned()], words.as_slice()].concat();
        let page = pages.join(format!("{}.1", name.join("-")));
        let page = std::fs::read_to_string(&page).unwrap_or_else(|e| panic!("{page:?}: {e}"));
        // Roff escapes hyphens.
        let page = page.replace("\\-", "-");
        if let Some(last) = words.last() {
            assert!(reference.contains(&format!("`{last}")), "{last} in command-line.md");
        }
        let mut arguments: Vec<&str> = words.iter().map(String::as_str).collect();
        arguments.push("--help");
        let help = stdout(&arguments);
        let (_, options) = help.split_once("Options:\n").unwrap();
        for line in options.lines().filter(|line| line.trim_start().starts_with('-')) {
            let mut words = line.split(|c: char| c.is_whitespace() || c == ',');
            let option = words.find(|word| word.starts_with("--")).unwrap();
            assert!(page.contains(option), "{option} in the page of {name:?}");
            let named = |end: &str| reference.contains(&format!("{option}{end}"));
            if option != "--help" && !["`", " ", ","].into_iter().any(named) {
                missing.push(format!("{} {option}", name.join(" ")));
            }
        }
    }
    assert!(missing.is_empty(), "command-line.md lacks {missing:#?}");
    assert!(stdout(&["man"]).starts_with(".ie"), "roff on standard output");
}

#[test]
fn validations_run_in_an_empty_folder() {
    let folder = tempfile::tempdir().unwrap();
    let validate = |more: &[&str]| {
        let mut command = grainwake();
        command.current_dir(folder.path()).args(["validate", "contact/bounce", "--quiet"]);
        command.args(more).assert().success()
    };
    let list = validate(&["--list"]);
    let list = String::from_utf8_lossy(&list.get_output().stdout).into_owned();
    assert!(list.contains("contact: "), "{list}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "a list writes nothing");
    let table = validate(&[]);
    let table = String::from_utf8_lossy(&table.get_output().stdout).into_owned();
    assert!(table.contains("| contact "), "{table}");
    let run = folder.path().join("runs/validation/contact/bounce/grains.csv");
    let written = || std::fs::metadata(&run).unwrap().modified().unwrap();
    let first = written();
    // The temporary copy of the case has another path, but it is the same case.
    validate(&["--resume"]);
    assert_eq!(written(), first);
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().flatten().collect();
    assert_eq!(names.len(), 1, "{names:?}");
    // A folder of this name that is something else does not hide the suites of the program.
    std::fs::create_dir(folder.path().join("validation")).unwrap();
    validate(&["--resume"]);
    assert_eq!(written(), first);
}
