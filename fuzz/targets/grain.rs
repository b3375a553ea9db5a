//! `.grain` files: read, and queried if they are accepted. Each input is read as it is, and with
//! its length and checksum renewed, so that damage reaches the decoder.

#![no_main]

use std::path::Path;

use grainwake_shape::Shape;
use libfuzzer_sys::fuzz_target;
use sha2::{Digest, Sha256};

fuzz_target!(|bytes: &[u8]| {
    query(bytes);
    query(&renewed(bytes));
});

fn query(bytes: &[u8]) {
    if let Ok(shape) = Shape::from_bytes(bytes, Path::new("fuzzed.grain")) {
        let (distance, gradient) = shape.distance_and_gradient(shape.upper());
        assert!(distance.is_finite() && gradient.is_finite());
        let again = Shape::from_bytes(&shape.to_bytes(), Path::new("again.grain"));
        assert!(again.is_ok_and(|again| again.digest() == shape.digest()));
    }
}

/// Returns the file with the length of its body (bytes 12 to 19) and its checksum (the last 32
/// bytes) corrected.
fn renewed(bytes: &[u8]) -> Vec<u8> {
    let mut file = bytes[..bytes.len().saturating_sub(32)].to_vec();
    let body = file.len().saturating_sub(20) as u64;
    if let Some(length) = file.get_mut(12..20) {
        length.copy_from_slice(&body.to_le_bytes());
    }
    let checksum = Sha256::digest(&file);
    file.extend(checksum);
    file
}
