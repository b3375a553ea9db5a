//! Fonts of the labels: DejaVu Sans. The program holds them compressed.

use std::io::Read as _;
use std::sync::LazyLock;

use flate2::read::DeflateDecoder;

/// Upright font file.
pub static REGULAR: LazyLock<Vec<u8>> =
    LazyLock::new(|| inflate(include_bytes!(concat!(env!("OUT_DIR"), "/regular.deflate"))));
/// Slanted font file.
pub static OBLIQUE: LazyLock<Vec<u8>> =
    LazyLock::new(|| inflate(include_bytes!(concat!(env!("OUT_DIR"), "/oblique.deflate"))));

fn inflate(packed: &[u8]) -> Vec<u8> {
    let mut font = Vec::new();
    DeflateDecoder::new(packed).read_to_end(&mut font).expect("the font of the build");
    font
}
