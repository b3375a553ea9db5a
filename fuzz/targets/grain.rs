//! `.grain` files: read, and queried if they are accepted. Each input is read as it is, and with
//! its length and checksum renewed, so that damage reaches the decoder.

#![no_main]

#[path = "../../crates/shape/tests/common/renewed.rs"]
mod renewed;

use std::path::Path;

use grainwake_shape::Shape;
use libfuzzer_sys::fuzz_target;
use renewed::renewed;

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
