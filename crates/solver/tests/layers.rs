//! Imports point downwards only (ARCHITECTURE.md): this test reads the `use` lines.

use std::fs;
use std::path::{Path, PathBuf};

/// What each module of the solver may import besides itself.
const ALLOWED: [(&str, &[&str]); 9] = [
    ("math", &[]),
    ("grid", &["math"]),
    ("poisson", &["math", "grid"]),
    ("dem", &["math"]),
    ("flow", &["math", "grid", "poisson"]),
    ("immersed", &["math", "grid", "dem", "flow"]),
    (
        "sim",
        &["math", "grid", "poisson", "dem", "flow", "immersed"],
    ),
    (
        "case",
        &["math", "grid", "dem", "flow", "immersed", "sim", "output"],
    ),
    (
        "output",
        &["math", "grid", "dem", "flow", "immersed", "sim"],
    ),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder)
        .expect("a source folder")
        .map(|entry| entry.expect("an entry").path())
    {
        if entry.is_dir() {
            sources(&entry, found);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            found.push(entry);
        }
    }
}

/// Modules of the crate that a line of code names.
fn named(line: &str) -> Vec<String> {
    let code = line.split("//").next().unwrap_or("");
    code.match_indices("crate::")
        .filter(|(at, _)| !code[..*at].ends_with('_'))
        .map(|(at, word)| {
            code[at + word.len()..]
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect()
        })
        .collect()
}

#[test]
fn imports_point_downwards() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = 0;
    for (module, allowed) in ALLOWED {
        let mut files = Vec::new();
        sources(&root.join(module), &mut files);
        for file in files {
            let text = fs::read_to_string(&file).expect("a readable source");
            for (number, line) in text.lines().enumerate() {
                for name in named(line) {
                    let known = ALLOWED.iter().any(|(module, _)| *module == name);
                    seen += usize::from(known);
                    assert!(
                        !known || name == module || allowed.contains(&name.as_str()),
                        "{}:{}: `{module}` may not import `{name}`",
                        file.display(),
                        number + 1
                    );
                }
            }
        }
    }
    assert!(
        seen > 50,
        "the test found only {seen} imports: has the layout changed?"
    );
}

#[test]
fn libraries_depend_downwards() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the folder of crates");
    for (name, barred) in [
        (
            "shape",
            &["grainwake-solver", "grainwake-report", "grainwake ="][..],
        ),
        ("solver", &["grainwake-report", "grainwake ="][..]),
        ("report", &["grainwake ="][..]),
    ] {
        let text = fs::read_to_string(crates.join(name).join("Cargo.toml")).expect("a manifest");
        let dependencies = text.split("dependencies]").nth(1).unwrap_or("");
        for word in barred {
            assert!(
                !dependencies.contains(word),
                "crates/{name} must not depend on {word}"
            );
        }
    }
}
