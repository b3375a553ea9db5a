//! Compression of the integer levels of a field: differences from the Lorenzo predictor (exact for
//! sums of functions of two coordinates each, hence small in smooth fields), as variable-length
//! integers, deflated.

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use std::io::{Read, Write};

/// Largest level that single precision represents exactly.
const LARGEST: i64 = 1 << 24;

/// Predicts sample (i, j, k) from its seven predecessors; samples off the grid count as 0.
fn predict(values: &[i64], dims: [usize; 3], i: usize, j: usize, k: usize) -> i64 {
    let at = |di: usize, dj: usize, dk: usize| {
        if i < di || j < dj || k < dk {
            0
        } else {
            values[(i - di) + dims[0] * ((j - dj) + dims[1] * (k - dk))]
        }
    };
    at(1, 0, 0) + at(0, 1, 0) + at(0, 0, 1) - at(1, 1, 0) - at(0, 1, 1) - at(1, 0, 1) + at(1, 1, 1)
}

fn places(dims: [usize; 3]) -> impl Iterator<Item = (usize, usize, usize)> {
    let [nx, ny, nz] = dims;
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j, k))))
}

pub(super) fn pack(levels: &[f32], dims: [usize; 3]) -> Vec<u8> {
    let values: Vec<i64> = levels.iter().map(|v| *v as i64).collect();
    let mut bytes = Vec::with_capacity(2 * values.len());
    for (n, (i, j, k)) in places(dims).enumerate() {
        let difference = values[n] - predict(&values, dims, i, j, k);
        let mut rest = ((difference << 1) ^ (difference >> 63)) as u64;
        while rest >= 0x80 {
            bytes.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        bytes.push(rest as u8);
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    // Writing to memory cannot fail.
    let packed = encoder.write_all(&bytes).and_then(|()| encoder.finish());
    packed.unwrap_or_default()
}

/// Returns the levels, or `None` if the bytes are not the output of [`pack`] for these dimensions.
pub(super) fn unpack(packed: &[u8], dims: [usize; 3]) -> Option<Vec<f32>> {
    let count = dims.iter().product::<usize>();
    let mut bytes = Vec::new();
    // Five bytes hold any admissible difference; one more detects an overlong stream.
    ZlibDecoder::new(packed).take(5 * count as u64 + 1).read_to_end(&mut bytes).ok()?;
    // Every level takes a byte or more: few bytes must not claim memory for many levels.
    if bytes.len() < count {
        return None;
    }
    let mut stream = bytes.into_iter();
    let mut values: Vec<i64> = Vec::with_capacity(count);
    for (i, j, k) in places(dims) {
        let mut rest = 0u64;
        for shift in (0..).step_by(7) {
            let byte = stream.next()?;
            if shift > 28 {
                return None;
            }
            rest |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                break;
            }
        }
        let difference = (rest >> 1) as i64 ^ -((rest & 1) as i64);
        let value = difference + predict(&values, dims, i, j, k);
        if value.abs() > LARGEST {
            return None;
        }
        values.push(value);
    }
    stream.next().is_none().then(|| values.into_iter().map(|v| v as f32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn any_levels_come_back() {
        let dims = [5, 4, 3];
        let mut random = Random::seed_from_u64(9);
        let level = |_| random.random_range(-(1 << 23)..1 << 23) as f32;
        let levels: Vec<f32> = (0..60).map(level).collect();
        assert_eq!(unpack(&pack(&levels, dims), dims), Some(levels.clone()));
        assert_eq!(unpack(&pack(&levels, dims), [5, 4, 4]), None);
        assert_eq!(unpack(&pack(&levels, dims), [5, 4, 2]), None);
        assert_eq!(unpack(b"nonsense", dims), None);
    }
}
