//! NPY arrays of numbers (numpy.save), indexed [z][y][x].
//!
//! The header is parsed here instead of by the crate `npyz`, which multiplies the declared
//! dimensions unchecked and parses them recursively, so that a malicious header can abort the
//! program.

use super::volume::{Volume, Voxels, count};
use crate::error::{Result, ShapeError};
use crate::grid::place;
use crate::limits::ReadLimits;
use std::path::Path;

/// Maximum header size [bytes].
const LONGEST_HEADER: usize = 1 << 16;
/// Number of leading bytes that contain the complete header.
pub(super) const HEAD: u64 = LONGEST_HEADER as u64 + 12;

pub(super) fn read(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Volume> {
    header(path, bytes, limits)?.volume(path, bytes, true)
}

/// Content of a header.
pub(super) struct Array {
    number: Number,
    dims: [usize; 3],
    fortran: bool,
    /// Offset of the values [bytes].
    start: usize,
}

impl Array {
    /// Returns the size of the file [bytes].
    pub(super) fn bytes(&self) -> u64 {
        let values = self.dims.iter().product::<usize>() as u64;
        self.start as u64 + values * self.number.width as u64
    }

    /// Decodes the volume from the bytes of the file, which may end one byte after the values if
    /// they are not the `whole` file. Refuses surplus data.
    pub(super) fn volume(&self, path: &Path, bytes: &[u8], whole: bool) -> Result<Volume> {
        let data = bytes.get(self.start..).unwrap_or(&[]);
        if bytes.len() as u64 > self.bytes() {
            let has = if whole { data.len().to_string() } else { "more".to_owned() };
            let has = format!("the file has {has} after the header");
            let reason = self.number.surplus(self.dims, &has);
            return Err(ShapeError::unsupported(path, format!("{reason}; save one array alone")));
        }
        self.number.volume(path, self.dims, self.fortran, data)
    }
}

/// Parses the header from the beginning of a file.
pub(super) fn header(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Array> {
    let malformed = |reason: &str| ShapeError::malformed(path, reason);
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(malformed("it does not begin with the NPY signature"));
    }
    let early = || malformed("the NPY header ends early");
    let version = *bytes.get(6).ok_or_else(early)?;
    let (length, start) = match (version, bytes.get(8..12)) {
        (1, Some(b)) => (usize::from(u16::from_le_bytes([b[0], b[1]])), 10),
        (2 | 3, Some(b)) => (u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize, 12),
        (_, None) => return Err(early()),
        _ => return Err(malformed("unknown NPY version")),
    };
    if length > LONGEST_HEADER {
        return Err(malformed("the NPY header is longer than 64 KiB"));
    }
    let header = bytes.get(start..start + length).ok_or_else(early)?;
    let header = std::str::from_utf8(header).map_err(|_| malformed("the header is not text"))?;
    let header = Header::parse(header)
        .ok_or_else(|| malformed("the header lacks a readable descr, fortran_order or shape"))?;
    let [nz, ny, nx] = header.shape[..] else {
        let reason =
            format!("an array of the shape {:?}; a volume has three axes, [z][y][x]", header.shape);
        return Err(ShapeError::unsupported(path, reason));
    };
    count(path, [nx, ny, nz], limits)?;
    let dims = [nx as usize, ny as usize, nz as usize];
    let number = Number::parse(&header.descr).ok_or_else(|| {
        let (descr, remedy) = (&header.descr, "save numbers of one of these types");
        ShapeError::unsupported(path, format!("values of type {descr:?}; {remedy}: {TYPES}"))
    })?;
    Ok(Array { number, dims, fortran: header.fortran, start: start + length })
}

impl Number {
    /// Describes the data that a header states, and what the file `has` instead: surplus data
    /// indicates slices that would be lost without notice.
    pub(super) fn surplus(&self, [nx, ny, nz]: [usize; 3], has: &str) -> String {
        let width = self.width;
        let needed = (nx * ny * nz) as u64 * width as u64;
        format!(
            "the header states {nx} x {ny} x {nz} voxels of {width} bytes, {needed} bytes; {has}"
        )
    }

    /// Decodes voxels in `data`, x fastest, or z fastest in Fortran order.
    pub(super) fn volume(
        &self,
        path: &Path,
        dims: [usize; 3],
        fortran: bool,
        data: &[u8],
    ) -> Result<Volume> {
        let voxels: usize = dims.iter().product();
        let needed = voxels as u64 * self.width as u64;
        if (data.len() as u64) < needed {
            let has = data.len();
            let reason = format!("the header claims {needed} bytes of data, the file has {has}");
            return Err(ShapeError::malformed(path, reason));
        }
        // Index of voxel n (x fastest) in the file.
        let index = |n: usize| {
            let [i, j, k] = place(dims, n);
            if fortran { k + dims[2] * (j + dims[1] * i) } else { n }
        };
        let values = (0..voxels).map(|n| self.value(&data[self.width * index(n)..]));
        let label = |v: f64| (v >= 0.0 && v <= f64::from(u32::MAX)).then_some(v as u32);
        let labels = (self.kind != b'f').then(|| values.clone().map(label).collect());
        let voxels = match labels.flatten() {
            Some(labels) => Voxels::Labels(labels),
            None => Voxels::Grey(values.map(|v| v as f32).collect()),
        };
        Volume::from_voxels(path, dims, voxels)
    }
}

struct Header {
    descr: String,
    fortran: bool,
    shape: Vec<u64>,
}

impl Header {
    /// Parses a line such as {'descr': '<u2', 'fortran_order': False, 'shape': (4, 3, 2), }.
    fn parse(text: &str) -> Option<Header> {
        let after = |key: &str| {
            let at = text.find(&format!("'{key}'")).or_else(|| text.find(&format!("\"{key}\"")))?;
            let rest = text[at + key.len() + 2..].trim_start();
            Some(rest.strip_prefix(':')?.trim_start())
        };
        let descr = after("descr")?;
        let quote = descr.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
        let descr = descr[1..].split(quote).next()?.to_owned();
        let fortran = match after("fortran_order")? {
            rest if rest.starts_with("True") => true,
            rest if rest.starts_with("False") => false,
            _ => return None,
        };
        let shape = after("shape")?.strip_prefix('(')?.split(')').next()?;
        let shape = shape
            .split(',')
            .map(str::trim)
            .filter(|n| !n.is_empty())
            .map(|n| n.trim_end_matches('L').parse().ok())
            .collect::<Option<Vec<u64>>>()?;
        Some(Header { descr, fortran, shape })
    }
}

/// Types that are read, for messages.
pub(super) const TYPES: &str =
    "booleans, integers of 8 to 64 bits, floating-point numbers of 16, 32 or 64 bits";

/// A numeric type: byte order, kind (b, i, u, f) and width in bytes.
pub(super) struct Number {
    pub big: bool,
    pub kind: u8,
    pub width: usize,
}

impl Number {
    fn parse(descr: &str) -> Option<Number> {
        let [order, kind, width] = *descr.as_bytes() else {
            return None;
        };
        let number = Number {
            big: match order {
                b'<' | b'|' | b'=' => false,
                b'>' => true,
                _ => return None,
            },
            kind,
            width: usize::from(width.wrapping_sub(b'0')),
        };
        match (kind, number.width) {
            (b'b', 1) | (b'i' | b'u', 1 | 2 | 4 | 8) | (b'f', 2 | 4 | 8) => Some(number),
            _ => None,
        }
    }

    /// Decodes the number at the start of `bytes`, which contain at least its width.
    fn value(&self, bytes: &[u8]) -> f64 {
        let mut raw = [0u8; 8];
        for (n, byte) in bytes[..self.width].iter().enumerate() {
            raw[if self.big { self.width - 1 - n } else { n }] = *byte;
        }
        let bits = u64::from_le_bytes(raw);
        match (self.kind, self.width) {
            (b'f', 2) => half(bits as u16),
            (b'f', 4) => f64::from(f32::from_bits(bits as u32)),
            (b'f', _) => f64::from_bits(bits),
            (b'i', width) => {
                let unused = 64 - 8 * width as u32;
                ((bits << unused) as i64 >> unused) as f64
            }
            _ => bits as f64,
        }
    }
}

/// Decodes a number of half precision: sign, 5 bits of the exponent, 10 bits of the fraction.
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    sign * match exponent {
        0 => fraction * 2f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * 2f64.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend_from_slice(&(header.len() as u16).to_le_bytes());
        bytes.extend_from_slice(header.as_bytes());
        bytes.extend_from_slice(data);
        bytes
    }

    fn open(bytes: &[u8]) -> Result<Volume> {
        read(Path::new("a.npy"), bytes, &ReadLimits::default())
    }

    #[test]
    fn every_type_and_both_orders_are_read() {
        let header = |descr: &str, fortran: &str| {
            format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': (1, 2, 3), }}\n")
        };
        let expect = Volume::from_labels([3, 2, 1], vec![0, 1, 2, 3, 4, 5]).unwrap();
        assert_eq!(open(&file(&header("|u1", "False"), &[0, 1, 2, 3, 4, 5])).unwrap(), expect);
        assert_eq!(open(&file(&header("|u1", "True"), &[0, 3, 1, 4, 2, 5])).unwrap(), expect);
        let big: Vec<u8> = (0..6u16).flat_map(u16::to_be_bytes).collect();
        assert_eq!(open(&file(&header(">u2", "False"), &big)).unwrap(), expect);
        let signed: Vec<u8> = (0..6i64).flat_map(i64::to_le_bytes).collect();
        assert_eq!(open(&file(&header("<i8", "False"), &signed)).unwrap(), expect);
        let whole: Vec<u8> = (0..6).flat_map(|v| (v as f32).to_le_bytes()).collect();
        assert_eq!(open(&file(&header("<f4", "False"), &whole)).unwrap(), expect);
        let grey: Vec<u8> = (0..6).flat_map(|v| (f64::from(v) - 0.5).to_le_bytes()).collect();
        let read = open(&file(&header("<f8", "False"), &grey)).unwrap();
        assert_eq!(read.voxels, Voxels::Grey(vec![-0.5, 0.5, 1.5, 2.5, 3.5, 4.5]));
        // Half precision: 0, 1, -2, 65504, the smallest number, 1/3.
        let half = [0u16, 0x3c00, 0xc000, 0x7bff, 1, 0x3555];
        let half: Vec<u8> = half.iter().flat_map(|v| v.to_le_bytes()).collect();
        let read = open(&file(&header("<f2", "False"), &half)).unwrap();
        let expect = vec![0.0, 1.0, -2.0, 65504.0, 2f32.powi(-24), 0.333_251_95];
        assert_eq!(read.voxels, Voxels::Grey(expect));
        let other = open(&file(&header("<c8", "False"), &[0; 48])).unwrap_err().to_string();
        for word in ["\"<c8\"", "integers of 8 to 64 bits", "numbers of 16, 32 or 64 bits"] {
            assert!(other.contains(word), "`{word}` is missing in: {other}");
        }
        let negative: Vec<u8> = (-3..3i16).flat_map(i16::to_le_bytes).collect();
        let read = open(&file(&header("<i2", "False"), &negative)).unwrap();
        assert_eq!(read.voxels, Voxels::Grey(vec![-3.0, -2.0, -1.0, 0.0, 1.0, 2.0]));
    }

    #[test]
    fn surplus_data_are_refused() {
        let header = "{'descr': '<u2', 'fortran_order': False, 'shape': (1, 2, 3), }";
        assert!(open(&file(header, &[7; 12])).is_ok());
        // A second array in the file, as two calls of numpy.save leave it.
        for surplus in [1, 90] {
            let error = open(&file(header, &[7; 102][..12 + surplus])).unwrap_err().to_string();
            let words = format!(
                "the header states 3 x 2 x 1 voxels of 2 bytes, 12 bytes; the file has {} after",
                12 + surplus
            );
            assert!(error.contains(&words), "{error}");
        }
    }

    #[test]
    fn damaged_and_absurd_files_are_refused() {
        let header =
            |shape: &str| format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
        let huge = open(&file(&header("(1000000, 1000000, 1000000)"), &[]));
        assert!(matches!(huge, Err(ShapeError::TooLarge { .. })), "{huge:?}");
        let overflow = open(&file(&header("(4294967296, 4294967296, 4294967296)"), &[]));
        assert!(matches!(overflow, Err(ShapeError::TooLarge { .. })));
        let short = open(&file(&header("(2, 2, 2)"), &[0; 31]));
        assert!(matches!(short, Err(ShapeError::Malformed { .. })), "{short:?}");
        let empty = open(&file(&header("(2, 0, 2)"), &[]));
        assert!(matches!(empty, Err(ShapeError::Malformed { .. })));
        let flat = open(&file(&header("(2, 2)"), &[0; 16]));
        assert!(matches!(flat, Err(ShapeError::Unsupported { .. })));
        let nan: Vec<u8> = [f32::NAN; 8].iter().flat_map(|v| v.to_le_bytes()).collect();
        let nan = open(&file(&header("(2, 2, 2)"), &nan));
        let message = nan.unwrap_err().to_string();
        assert!(message.contains("x 0, y 0, z 0 is NaN"), "{message}");
        let nested = "(".repeat(60_000);
        assert!(open(&file(&header(&nested), &[])).is_err());
        let good = file(&header("(2, 2, 2)"), &[0; 32]);
        for length in 0..good.len() {
            assert!(open(&good[..length]).is_err());
        }
        for at in 0..good.len() - 32 {
            let mut bad = good.clone();
            bad[at] = 0xff;
            let _ = open(&bad);
        }
    }
}
