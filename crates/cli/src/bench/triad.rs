//! Memory bandwidth of the machine.

use std::time::Instant;

use rayon::prelude::*;

/// Smallest number of doubles in each array of the triad, 64 MiB. The three arrays are as large as
/// the fields, so that caches act alike, and large enough to hide the scheduling of threads.
const MIN_TRIAD_LENGTH: usize = 1 << 23;
const TRIAD_REPEATS: usize = 8;

/// Bandwidth of a = b + s c over three arrays of `length` doubles, best of several [bytes/s].
pub fn bandwidth(length: usize) -> f64 {
    const CHUNK: usize = 1 << 16;
    let length = length.max(MIN_TRIAD_LENGTH);
    let make = |value: f64| {
        let mut array = vec![0.0; length];
        array.par_chunks_mut(CHUNK).for_each(|chunk| chunk.fill(value));
        array
    };
    let (mut a, b, c) = (make(0.0), make(1.0), make(2.0));
    let mut best = f64::INFINITY;
    for repeat in 0..TRIAD_REPEATS {
        let s = std::hint::black_box(repeat as f64);
        let start = Instant::now();
        a.par_chunks_mut(CHUNK).zip(b.par_chunks(CHUNK)).zip(c.par_chunks(CHUNK)).for_each(
            |((a, b), c)| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + s * c;
                }
            },
        );
        best = best.min(start.elapsed().as_secs_f64());
        std::hint::black_box(&a);
    }
    (3 * 8 * length) as f64 / best
}
