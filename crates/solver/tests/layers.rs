//! Imports point downwards only (ARCHITECTURE.md), and modules of a folder form no circles. The
//! tests read the paths in the sources.

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
    ("sim", &["math", "grid", "poisson", "dem", "flow", "immersed"]),
];

/// Crates of the workspace that each crate may depend on.
const CRATES: [(&str, &[&str]); 13] = [
    ("features", &[]),
    ("simd", &[]),
    ("formats", &["simd"]),
    ("shape", &["formats"]),
    ("solver", &["simd", "formats", "shape"]),
    ("run", &["formats", "shape", "solver"]),
    ("plot", &[]),
    ("report", &["formats", "plot", "shape"]),
    ("view", &["formats", "plot", "report", "shape"]),
    ("study", &["formats", "plot", "report", "run", "shape", "solver"]),
    ("validation", &["formats", "plot", "report", "run", "shape"]),
    (
        "cli",
        &[
            "features",
            "formats",
            "plot",
            "report",
            "run",
            "shape",
            "solver",
            "study",
            "validation",
            "view",
        ],
    ),
    ("python", &["features", "formats", "report", "run", "shape", "solver", "study", "validation"]),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in
        fs::read_dir(folder).expect("a source folder").map(|entry| entry.expect("an entry").path())
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
    assert!(seen > 50, "the test found only {seen} imports: has the layout changed?");
}

#[test]
fn libraries_depend_downwards() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the folder of crates");
    for (name, allowed) in CRATES {
        let text = fs::read_to_string(crates.join(name).join("Cargo.toml")).expect("a manifest");
        let sections = text.split("\n[").filter(|part| part.starts_with("dependencies]"));
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

/// Code without comments and without items that are compiled for unit tests only.
fn product_code(text: &str) -> String {
    let mut lines = text.lines().map(|line| line.split("//").next().unwrap_or("").trim_end());
    let mut kept = Vec::new();
    while let Some(line) = lines.next() {
        if line == "#[cfg(test)]" {
            // A formatted item at the top of a file ends at a semicolon or at a brace in column 0.
            let ends = |line: &&str| {
                line.starts_with('}') || !line.starts_with(' ') && line.ends_with(';')
            };
            lines.find(ends);
        } else {
            kept.push(line);
        }
    }
    kept.join("\n")
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

/// Module path, from the root of the crate.
type Module = Vec<String>;

/// Paths in `code` that begin with `crate::`, `super::` or `self::`, as text.
fn internal_paths(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for root in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(root) {
            if !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':') {
                let tree = &code[at..];
                paths(&tree[..path_end(tree)], "", &mut found);
            }
        }
    }
    found
}

/// Segments of a path in the code of `module`, counted from the root of the crate.
fn absolute(module: &[String], path: &str) -> Module {
    let path = path.split(" as ").next().unwrap_or("");
    let mut segments = module.to_vec();
    for (n, segment) in path.split("::").map(str::trim).enumerate() {
        match segment {
            "crate" if n == 0 => segments.clear(),
            "super" => drop(segments.pop()),
            "self" => {}
            name => segments.push(name.to_owned()),
        }
    }
    segments
}

/// Modules of a crate, without its tests.
struct Crate {
    /// Code of each module.
    code: BTreeMap<Module, String>,
    /// Paths that each module imports or re-exports by name.
    names: BTreeMap<Module, BTreeMap<String, Module>>,
}

impl Crate {
    fn read(src: &Path) -> Crate {
        let mut files = Vec::new();
        sources(src, &mut files);
        let module = |file: &PathBuf| -> Module {
            let inside = file.strip_prefix(src).expect("a file of the crate");
            let name = |part: &std::ffi::OsStr| part.to_string_lossy().into_owned();
            let mut module: Module = inside.with_extension("").iter().map(name).collect();
            let last = module.last().map(String::as_str);
            if matches!(last, Some("mod" | "lib" | "main")) {
                module.pop();
            }
            module
        };
        let mut code: BTreeMap<Module, String> = BTreeMap::new();
        let mut tests = Vec::new();
        for file in &files {
            let module = module(file);
            let text = fs::read_to_string(file).expect("a readable source");
            for after in text.split("#[cfg(test)]\nmod ").skip(1) {
                let name = after.split([';', ' ']).next().unwrap_or("");
                tests.push([&module[..], &[name.to_owned()]].concat());
            }
            (code.entry(module).or_default()).push_str(&product_code(&text));
        }
        code.retain(|module, _| !tests.iter().any(|test| module.starts_with(test)));
        let names =
            (code.iter()).map(|(module, code)| (module.clone(), names(module, code))).collect();
        Crate { code, names }
    }

    /// Replaces re-exported names in a path by the paths that they stand for.
    fn resolve(&self, mut path: Module) -> Module {
        let mut known = 0;
        // A path has few segments, and each of them few re-exports.
        for _ in 0..20 {
            if known == path.len() {
                break;
            }
            if self.code.contains_key(&path[..=known]) {
                known += 1;
                continue;
            }
            let names = self.names.get(&path[..known]);
            let Some(target) = names.and_then(|names| names.get(&path[known])) else {
                break;
            };
            path = [&target[..], &path[known + 1..]].concat();
            known = 0;
        }
        path
    }

    /// Modules directly below `parent`, each with its siblings that it imports. The `mod.rs` of a
    /// folder belongs to the parent.
    fn imports(&self, parent: &[String]) -> BTreeMap<String, BTreeSet<String>> {
        let depth = parent.len();
        let mut imports: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        let below = (self.code.iter())
            .filter(|(module, _)| module.len() > depth && module.starts_with(parent));
        for (module, code) in below {
            let own = imports.entry(module[depth].clone()).or_default();
            for path in internal_paths(code) {
                let path = self.resolve(absolute(module, &path));
                if path.len() > depth
                    && path.starts_with(parent)
                    && path[depth] != module[depth]
                    && self.code.contains_key(&path[..=depth])
                {
                    own.insert(path[depth].clone());
                }
            }
        }
        imports
    }

    /// Modules that have modules below them, the root included.
    fn parents(&self) -> BTreeSet<Module> {
        let parent = |module: &Module| Some(module.split_last()?.1.to_vec());
        self.code.keys().filter_map(parent).collect()
    }
}

/// Paths that `code` of `module` imports or re-exports, by name.
fn names(module: &[String], code: &str) -> BTreeMap<String, Module> {
    let mut found = Vec::new();
    for statement in code.split(';') {
        if let Some((_, tree)) = statement.split_once("use ") {
            paths(tree.trim(), "", &mut found);
        }
    }
    let pair = |path: &String| {
        let name = path.rsplit("::").next()?.rsplit(" as ").next()?.trim();
        Some((name.to_owned(), absolute(module, path)))
    };
    found.iter().filter_map(pair).collect()
}

/// Groups of modules that reach each other, each in order of name.
fn circles(imports: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<Vec<String>> {
    let reached = |start: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(module) = open.pop() {
            open.extend(imports[module].iter().filter(|next| seen.insert((*next).clone())));
        }
        seen
    };
    let reach: BTreeMap<&String, BTreeSet<String>> =
        imports.keys().map(|module| (module, reached(module))).collect();
    let group = |module: &String| -> Vec<String> {
        let both =
            |other: &&String| reach[module].contains(*other) && reach[other].contains(module);
        imports.keys().filter(both).cloned().collect()
    };
    imports.keys().map(group).filter(|group| group.len() > 1).collect()
}

#[test]
fn modules_form_no_circles() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the folder of crates");
    let (mut seen, mut found) = (0, Vec::new());
    for entry in fs::read_dir(crates).expect("the crates").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let read = Crate::read(&entry.path().join("src"));
        for parent in read.parents() {
            let imports = read.imports(&parent);
            seen += imports.values().map(BTreeSet::len).sum::<usize>();
            let folder = [std::slice::from_ref(&name), &parent[..]].concat().join("/");
            found.extend(circles(&imports).into_iter().map(|circle| (folder.clone(), circle)));
        }
    }
    assert!(seen > 400, "only {seen} imports found: has the layout changed?");
    assert!(found.is_empty(), "modules import each other: {found:#?}");
}

/// Modules that change the disk without `formats::disk`: crate, module, changes, and the reason.
const EXCEPTIONS: [(&str, &str, &[&str], &str); 5] = [
    (
        "formats",
        "disk",
        &[".open(", ".sync_all(", ".sync_data(", "fs::rename(", "fs::remove_", "fs::create_dir"],
        "makes the changes",
    ),
    ("formats", "disk/faults", &[".open("], "loses what a planned power failure loses"),
    (
        "cli",
        "grain",
        &["fs::remove_", "fs::create_dir"],
        "tries whether a folder can be written, with a folder of its own that must not exist",
    ),
    (
        "validation",
        "library",
        &["tempfile::", "fs::write(", "fs::create_dir"],
        "unpacks the suites of the program into a temporary folder for itself",
    ),
    ("python", "case", &["tempfile::"], "keeps the files of a case in a temporary folder"),
];

/// Functions that change the disk; `.open(` is the method of `OpenOptions`.
const CHANGES: [&str; 15] = [
    " File::create",
    "(File::create",
    ":File::create",
    "File::options",
    ".open(",
    "Writer::from_path",
    "tempfile::",
    "fs::hard_link(",
    ".sync_all(",
    ".sync_data(",
    "fs::write(",
    "fs::rename(",
    "fs::remove_",
    "fs::create_dir",
    "fs::copy(",
];

/// Changes on the disk in `code`, by name.
fn changes(code: &str) -> Vec<&'static str> {
    CHANGES.into_iter().filter(|change| code.contains(change)).collect()
}

#[test]
fn every_change_on_the_disk_can_be_made_to_fail() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the folder of crates");
    let mut seen = BTreeSet::new();
    for (name, _) in CRATES {
        for (module, code) in Crate::read(&crates.join(name).join("src")).code {
            let place = module.join("/");
            let exception = EXCEPTIONS.iter().find(|e| (e.0, e.1) == (name, &place));
            for change in changes(&code) {
                let allowed = exception.is_some_and(|(.., allowed, _)| allowed.contains(&change));
                assert!(allowed, "crates/{name}, {place}: `{change}` instead of `disk`");
                seen.insert((name, place.clone(), change));
            }
        }
    }
    for (name, place, allowed, reason) in EXCEPTIONS {
        for change in allowed {
            let seen = seen.contains(&(name, place.to_owned(), *change));
            assert!(seen, "crates/{name}, {place}, {reason}: no `{change}`; has it moved?");
        }
    }
}

#[test]
fn changes_on_the_disk_are_found() {
    for code in [
        "let file = std::fs::File::create(path)?;",
        "let file = BufWriter::new(File::create(path)?);",
        "csv::Writer::from_path(path)?",
        "std::fs::write(path, text)",
    ] {
        assert_eq!(changes(code).len(), 1, "{code}");
    }
    assert!(
        changes("disk::remove_file(path)?; File::open(path)?; Output::create(path)?").is_empty()
    );
}

#[test]
fn use_trees_are_read_whole() {
    let module = ["m", "n"].map(str::to_owned);
    let code = "use crate::{a, b::{c, d}};\nfn f() { super::e::g(); grainwake_crate::h(); }";
    let found = internal_paths(code);
    let found: Vec<_> = (found.iter()).map(|path| absolute(&module, path).join("::")).collect();
    assert_eq!(found, ["a", "b::c", "b::d", "m::e::g"]);
    let names = names(&module, "pub use x::{Y, z::W as V};\nmod x;");
    assert_eq!(names["Y"].join("::"), "m::n::x::Y");
    assert_eq!(names["V"].join("::"), "m::n::x::z::W");
}

/// Number of lines of a source file without its unit tests.
fn product_lines(path: &Path) -> usize {
    let text = fs::read_to_string(path).expect("a readable source");
    let lines: Vec<&str> = text.lines().collect();
    let (mut count, mut in_tests) = (0, false);
    for (n, line) in lines.iter().enumerate() {
        let next = lines.get(n + 1).unwrap_or(&"");
        in_tests |= *line == "#[cfg(test)]" && next.contains("mod ") && next.ends_with('{');
        count += usize::from(!in_tests);
        in_tests &= *line != "}";
    }
    count
}

#[test]
fn a_step_is_read_in_few_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table = fs::read_to_string(root.join("../../results/step-files/files.csv"));
    let table = table.expect("a list of the files of a step");
    let of = |part: &str| -> Vec<usize> {
        let files = table.lines().filter_map(|row| row.strip_suffix(part)?.split(',').next());
        files.map(|file| product_lines(&root.join("src").join(file))).collect()
    };
    assert!((5..=9).contains(&of(",control flow").len()));
    let below = of(",below it");
    let lines: usize = below.iter().sum();
    println!("{} files, {lines} lines", below.len());
    assert!((20..=40).contains(&below.len()) && (4000..=8100).contains(&lines));
}
