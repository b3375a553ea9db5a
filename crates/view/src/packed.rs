//! Arrays of numbers as text: little-endian, deflated, base64. The page unpacks them into typed
//! arrays (`web/src/packed.js`).

use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::{Compression, write::DeflateEncoder};
use serde::Serialize;

/// Packed array of numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Packed {
    /// Type of the numbers: `u8`, `u16`, `u32`, `f32` or `f64`.
    #[serde(rename = "packed")]
    kind: &'static str,
    /// Factor of the numbers; 1 for exact arrays.
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<f64>,
    /// Number that a zero stands for.
    #[serde(skip_serializing_if = "Option::is_none")]
    offset: Option<f64>,
    /// Deflated bytes as base64.
    data: String,
}

impl Packed {
    /// Returns the length of the text [bytes].
    pub fn text_bytes(&self) -> usize {
        self.data.len()
    }

    /// Packs bytes; each is stored as its difference from the one before.
    pub fn bytes(bytes: &[u8]) -> Packed {
        let before = [0].into_iter().chain(bytes.iter().copied());
        let differences: Vec<u8> =
            bytes.iter().zip(before).map(|(b, a)| b.wrapping_sub(a)).collect();
        Packed::new("u8", &differences)
    }

    /// Packs numbers in single precision.
    pub fn singles(numbers: impl IntoIterator<Item = f64>) -> Packed {
        let bytes: Vec<u8> = numbers.into_iter().flat_map(|v| (v as f32).to_le_bytes()).collect();
        Packed::new("f32", &bytes)
    }

    /// Packs numbers in double precision.
    pub fn doubles(numbers: impl IntoIterator<Item = f64>) -> Packed {
        let bytes: Vec<u8> = numbers.into_iter().flat_map(f64::to_le_bytes).collect();
        Packed::new("f64", &bytes)
    }

    /// Packs indices, in 16 bits if all fit.
    pub fn indices(indices: &[usize]) -> Packed {
        if indices.iter().all(|i| u16::try_from(*i).is_ok()) {
            let bytes: Vec<u8> = indices.iter().flat_map(|i| (*i as u16).to_le_bytes()).collect();
            return Packed::new("u16", &bytes);
        }
        let bytes: Vec<u8> = indices.iter().flat_map(|i| (*i as u32).to_le_bytes()).collect();
        Packed::new("u32", &bytes)
    }

    /// Packs numbers in 16 bits, with the resolution of a 65534th of their largest magnitude.
    /// Zero is exact; numbers that are not finite become zero.
    pub fn quantised(numbers: &[f64]) -> Packed {
        let finite = numbers.iter().copied().filter(|v| v.is_finite());
        let largest = finite.fold(0.0, |m: f64, v| m.max(v.abs()));
        let scale = if largest > 0.0 { largest / 32767.0 } else { 1.0 };
        // The conversion of NaN is 0.
        let code = |v: &f64| ((v / scale).round() as i16).wrapping_add(i16::MIN) as u16;
        let bytes: Vec<u8> = numbers.iter().flat_map(|v| code(v).to_le_bytes()).collect();
        let packed = Packed::new("u16", &bytes);
        Packed { scale: Some(scale), offset: Some(-32768.0 * scale), ..packed }
    }

    fn new(kind: &'static str, bytes: &[u8]) -> Packed {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::new(7));
        // Writing to memory cannot fail.
        let deflated = encoder.write_all(bytes).and_then(|()| encoder.finish()).unwrap_or_default();
        Packed { kind, scale: None, offset: None, data: STANDARD.encode(deflated) }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::io::Read as _;

    use super::*;

    /// Returns the bytes of a packed array as the page sees them after inflating.
    pub(crate) fn inflated(packed: &Packed) -> Vec<u8> {
        let deflated = STANDARD.decode(&packed.data).unwrap();
        let mut bytes = Vec::new();
        flate2::read::DeflateDecoder::new(&deflated[..]).read_to_end(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn bytes_are_differences() {
        assert_eq!(inflated(&Packed::bytes(&[5, 7, 2])), [5, 2, 251]);
    }

    #[test]
    fn quantised_numbers_keep_zero_and_their_range() {
        let numbers = [0.0, -2.5e-3, 1e-3, f64::NAN, 2.5e-3];
        let packed = Packed::quantised(&numbers);
        let (scale, offset) = (packed.scale.unwrap(), packed.offset.unwrap());
        let back: Vec<f64> = inflated(&packed)
            .chunks_exact(2)
            .map(|b| f64::from(u16::from_le_bytes([b[0], b[1]])) * scale + offset)
            .collect();
        assert_eq!((back[0], back[3]), (0.0, 0.0));
        for (read, number) in back.iter().zip(numbers).filter(|(_, n)| n.is_finite()) {
            assert!((read - number).abs() <= 0.51 * scale, "{read} {number}");
        }
    }

    #[test]
    fn large_indices_take_32_bits() {
        assert_eq!(Packed::indices(&[1, 65535]).kind, "u16");
        assert_eq!(inflated(&Packed::indices(&[65536])), [0, 0, 1, 0]);
    }
}
