//! Compresses the bundle of the page for the program.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::DeflateEncoder;

fn main() {
    let bundle = "web/dist/view.js";
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={bundle}");
    let mut packed = DeflateEncoder::new(Vec::new(), Compression::best());
    packed.write_all(&std::fs::read(bundle).expect("the bundle")).unwrap();
    let output = Path::new(&std::env::var("OUT_DIR").unwrap()).join("view.js.deflate");
    std::fs::write(output, packed.finish().unwrap()).expect("a writable output folder");
}
