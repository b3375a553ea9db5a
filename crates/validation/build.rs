//! Puts the suites of the source tree, small files, into the program, compressed. A copy of the
//! crate without the tree has none.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::DeflateEncoder;

/// Files of a suite: its cases, grains and reference data.
const KINDS: [&str; 3] = ["toml", "csv", "grain"];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a readable folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else if KINDS.iter().any(|kind| path.extension().is_some_and(|end| end == *kind)) {
            found.push(path);
        }
    }
}

fn main() {
    let root = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("../../validation");
    println!("cargo:rerun-if-changed=build.rs");
    let mut found = Vec::new();
    if root.is_dir() {
        println!("cargo:rerun-if-changed={}", root.display());
        files(&root, &mut found);
    }
    found.sort();
    let mut text = String::from("[\n");
    let mut packed = DeflateEncoder::new(Vec::new(), Compression::best());
    for path in found {
        let contents = std::fs::read(&path).expect("a readable file");
        let name = path.strip_prefix(&root).unwrap().components();
        let name: Vec<_> = name.map(|part| part.as_os_str().to_str().expect("UTF-8")).collect();
        writeln!(text, "    ({:?}, {}),", name.join("/"), contents.len()).unwrap();
        packed.write_all(&contents).unwrap();
    }
    text += "]\n";
    let output = PathBuf::from(std::env::var("OUT_DIR").unwrap());
    std::fs::write(output.join("suites.rs"), text).expect("a writable output folder");
    std::fs::write(output.join("suites.deflate"), packed.finish().unwrap()).unwrap();
}
