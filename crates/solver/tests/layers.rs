//! Imports point downwards only (ARCHITECTURE.md): this test reads the `use` lines.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules of the solver that each module may import.
const ALLOWED: [(&str, &[&str]); 7] = [
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
];

/// Crates of the workspace that each crate may depend on.
const CRATES: [(&str, &[&str]); 10] = [
    ("simd", &[]),
    ("formats", &["simd"]),
    ("shape", &["formats"]),
    ("solver", &["simd", "formats", "shape"]),
    ("run", &["formats", "shape", "solver"]),
    ("plot", &[]),
    ("report", &["formats", "plot"]),
    (
        "study",
        &["formats", "plot", "report", "run", "shape", "solver"],
    ),
    (
        "validation",
        &["formats", "plot", "report", "run", "shape", "solver"],
    ),
    (
        "cli",
        &[
            "formats",
            "plot",
            "report",
            "run",
            "shape",
            "solver",
            "study",
            "validation",
        ],
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
    for (name, allowed) in CRATES {
        let text = fs::read_to_string(crates.join(name).join("Cargo.toml")).expect("a manifest");
        let sections = text
            .split("\n[")
            .filter(|part| part.starts_with("dependencies]"));
        for line in sections.flat_map(str::lines) {
            let Some(dependency) = line.strip_prefix("grainwake-") else {
                continue;
            };
            let dependency = dependency.split(['.', ' ']).next().unwrap_or("");
            assert!(
                allowed.contains(&dependency),
                "crates/{name} must not depend on crates/{dependency}"
            );
        }
    }
    let present = fs::read_dir(crates).expect("the crates").flatten();
    for entry in present.filter(|entry| entry.path().join("Cargo.toml").is_file()) {
        let name = entry.file_name().to_string_lossy().into_owned();
        assert!(
            CRATES.iter().any(|(known, _)| *known == name),
            "crates/{name} has no entry in CRATES"
        );
    }
}

/// Paths of a use tree: `a::{b, c::d}` gives `a::b` and `a::c::d`.
fn paths(tree: &str, prefix: &str, found: &mut Vec<String>) {
    let tree = tree.trim();
    let Some((head, rest)) = tree.split_once('{') else {
        found.push(format!("{prefix}{tree}"));
        return;
    };
    let inner = rest.trim_end().strip_suffix('}').unwrap_or(rest);
    let (mut depth, mut start) = (0, 0);
    for (at, c) in inner.char_indices().chain([(inner.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !inner[start..at].trim().is_empty() {
                    paths(&inner[start..at], &format!("{prefix}{head}"), found);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// Code of a source file: no comments, no unit tests at its end.
fn code(file: &Path) -> String {
    let text = fs::read_to_string(file).expect("a readable source");
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or(""));
    lines.collect::<Vec<_>>().join("\n")
}

/// End of the path or use tree at the start of `code`.
fn path_end(code: &str) -> usize {
    let mut depth = 0;
    for (at, c) in code.char_indices() {
        match c {
            '{' if at == 0 || code[..at].ends_with("::") || depth > 0 => depth += 1,
            '}' if depth == 1 => return at + 1,
            '}' if depth > 0 => depth -= 1,
            ':' | '_' => {}
            c if depth > 0 || c.is_alphanumeric() => {}
            _ => return at,
        }
    }
    code.len()
}

/// First segments of the paths below `crate::` in `code`.
fn roots(code: &str) -> BTreeSet<String> {
    let mut found = Vec::new();
    for (at, word) in code.match_indices("crate::") {
        if !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            let tree = &code[at + word.len()..];
            paths(&tree[..path_end(tree)], "", &mut found);
        }
    }
    let first = |path: &String| path.split("::").next().unwrap_or("").trim().to_owned();
    found.iter().map(first).collect()
}

/// Top-level module that the crate root re-exports each name from.
fn exports(root: &str) -> BTreeMap<String, String> {
    let mut found = Vec::new();
    for statement in root.split(';') {
        if let Some((_, tree)) = statement.split_once("use ") {
            paths(tree.trim().trim_start_matches("crate::"), "", &mut found);
        }
    }
    let pair = |path: &String| {
        let name = path.rsplit("::").next()?.rsplit(" as ").next()?.trim();
        Some((name.to_owned(), path.split("::").next()?.trim().to_owned()))
    };
    found.iter().filter_map(pair).collect()
}

/// Top-level modules of a crate, each with the modules it imports.
fn imports(src: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let module = |path: &Path| -> String {
        let first = path.strip_prefix(src).ok().and_then(|p| p.iter().next());
        let first = first.unwrap_or_default().to_string_lossy();
        first.trim_end_matches(".rs").to_owned()
    };
    let mut files = Vec::new();
    sources(src, &mut files);
    let roots_of = |file: &PathBuf| (module(file), roots(&code(file)));
    let of_root = |name: &str| name == "lib" || name == "main" || name == "bin";
    let root: String = files
        .iter()
        .filter(|f| of_root(&module(f)))
        .map(|f| code(f))
        .collect();
    let exports = exports(&root);
    let named: Vec<_> = files
        .iter()
        .map(roots_of)
        .filter(|(m, _)| !of_root(m))
        .collect();
    let modules: BTreeSet<String> = named.iter().map(|(module, _)| module.clone()).collect();
    let mut out: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, names) in named {
        let own = out.entry(module.clone()).or_default();
        for name in names {
            let target = exports
                .get(&name)
                .filter(|_| !modules.contains(&name))
                .unwrap_or(&name);
            if modules.contains(target) && *target != module {
                own.insert(target.clone());
            }
        }
    }
    out
}

/// Groups of modules that reach each other, each in order of name.
fn circles(imports: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<Vec<String>> {
    let reached = |start: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(module) = open.pop() {
            open.extend(
                imports[module]
                    .iter()
                    .filter(|next| seen.insert((*next).clone())),
            );
        }
        seen
    };
    let reach: BTreeMap<&String, BTreeSet<String>> = imports
        .keys()
        .map(|module| (module, reached(module)))
        .collect();
    let group = |module: &String| -> Vec<String> {
        let both =
            |other: &&String| reach[module].contains(*other) && reach[other].contains(module);
        imports.keys().filter(both).cloned().collect()
    };
    imports
        .keys()
        .map(group)
        .filter(|group| group.len() > 1)
        .collect()
}

#[test]
fn modules_form_no_circles() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the folder of crates");
    let mut seen = 0;
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(crates).expect("the crates").flatten() {
        let imports = imports(&entry.path().join("src"));
        seen += imports.values().map(BTreeSet::len).sum::<usize>();
        let name = entry.file_name().to_string_lossy().into_owned();
        found.extend(
            circles(&imports)
                .into_iter()
                .map(|group| (name.clone(), group)),
        );
    }
    assert!(
        seen > 100,
        "only {seen} imports found: has the layout changed?"
    );
    assert!(found.is_empty(), "modules import each other: {found:?}");
}

#[test]
fn use_trees_are_read_whole() {
    let code = "use crate::{a, b::{c, d}};\nfn f() { crate::e::g(); grainwake_crate::h(); }";
    assert_eq!(roots(code).into_iter().collect::<Vec<_>>(), ["a", "b", "e"]);
    let exports = exports("pub use x::{Y, z::W as V};\nmod x;");
    assert_eq!((exports["Y"].as_str(), exports["V"].as_str()), ("x", "x"));
}
