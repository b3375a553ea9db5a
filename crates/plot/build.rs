//! Compresses the fonts for the program.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::DeflateEncoder;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let folder = std::env::var("OUT_DIR").unwrap();
    for (name, font) in [("regular", dejavu::sans::regular()), ("oblique", dejavu::sans::oblique())]
    {
        let mut packed = DeflateEncoder::new(Vec::new(), Compression::best());
        packed.write_all(font).unwrap();
        let output = Path::new(&folder).join(format!("{name}.deflate"));
        std::fs::write(output, packed.finish().unwrap()).expect("a writable output folder");
    }
}
