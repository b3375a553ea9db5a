//! Binary encoding of `.grain` files and checkpoints: little-endian numbers without padding,
//! byte strings with their length in front. Numbers are stored exactly.
//!
//! Every writing function fails if the writer fails. Every reading function fails if the reader
//! fails, at an early end, and for a value that is no encoding of its type.
#![allow(clippy::missing_errors_doc, reason = "stated once above")]

use std::io::{self, Read, Write};

use glam::{DQuat, DVec3};
use grainwake_simd::Real;

/// Numbers that are converted at once.
const CHUNK: usize = 512;
/// Largest number of list entries reserved before the entries have been read: a damaged count must
/// not exhaust the memory.
const RESERVED: usize = 4096;

/// Writer of encoded values.
pub struct Encoder<'a>(&'a mut dyn Write);

impl<'a> Encoder<'a> {
    /// Encodes into `out`.
    pub fn new(out: &'a mut dyn Write) -> Encoder<'a> {
        Encoder(out)
    }
    /// Writes one byte.
    pub fn u8(&mut self, value: u8) -> io::Result<()> {
        self.0.write_all(&[value])
    }
    /// Writes a 32-bit integer.
    pub fn u32(&mut self, value: u32) -> io::Result<()> {
        self.0.write_all(&value.to_le_bytes())
    }
    /// Writes a 64-bit integer.
    pub fn u64(&mut self, value: u64) -> io::Result<()> {
        self.0.write_all(&value.to_le_bytes())
    }
    /// Writes a number in double precision.
    pub fn f64(&mut self, value: f64) -> io::Result<()> {
        self.0.write_all(&value.to_le_bytes())
    }
    /// Writes x, y, z.
    pub fn vector(&mut self, value: DVec3) -> io::Result<()> {
        self.reals(&value.to_array())
    }
    /// Writes x, y, z, w.
    pub fn quaternion(&mut self, value: DQuat) -> io::Result<()> {
        self.reals(&value.to_array())
    }
    /// Writes a byte that is 1 for a value, and the value or zero.
    pub fn option(&mut self, value: Option<f64>) -> io::Result<()> {
        self.u8(u8::from(value.is_some()))?;
        self.f64(value.unwrap_or(0.0))
    }
    /// Writes numbers without their count.
    pub fn reals<R: Real>(&mut self, values: &[R]) -> io::Result<()> {
        let mut bytes = [0; 8 * CHUNK];
        for chunk in values.chunks(CHUNK) {
            for (out, value) in bytes.chunks_exact_mut(R::BYTES).zip(chunk) {
                value.write_to(out);
            }
            self.0.write_all(&bytes[..R::BYTES * chunk.len()])?;
        }
        Ok(())
    }
    /// Writes bytes without their length.
    pub fn raw(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }
    /// Writes the length as a 64-bit integer, then the bytes.
    pub fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.u64(bytes.len() as u64)?;
        self.0.write_all(bytes)
    }
    /// Writes a text as [`Encoder::bytes`] does.
    pub fn text(&mut self, text: &str) -> io::Result<()> {
        self.bytes(text.as_bytes())
    }
}

/// Encodes into memory.
pub fn encode(fill: impl FnOnce(&mut Encoder) -> io::Result<()>) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    fill(&mut Encoder(&mut bytes))?;
    Ok(bytes)
}

/// Reader of encoded values. Every method fails with `UnexpectedEof` at the end of the data.
pub struct Decoder<'a>(&'a mut dyn Read);

impl<'a> Decoder<'a> {
    /// Decodes from `input`.
    pub fn new(input: &'a mut dyn Read) -> Decoder<'a> {
        Decoder(input)
    }
    fn array<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes)?;
        Ok(bytes)
    }
    /// Reads one byte.
    pub fn u8(&mut self) -> io::Result<u8> {
        self.array::<1>().map(|[byte]| byte)
    }
    /// Reads a 32-bit integer.
    pub fn u32(&mut self) -> io::Result<u32> {
        self.array().map(u32::from_le_bytes)
    }
    /// Reads a 64-bit integer.
    pub fn u64(&mut self) -> io::Result<u64> {
        self.array().map(u64::from_le_bytes)
    }
    /// Reads a number in double precision.
    pub fn f64(&mut self) -> io::Result<f64> {
        self.array().map(f64::from_le_bytes)
    }
    /// Reads x, y, z.
    pub fn vector(&mut self) -> io::Result<DVec3> {
        self.numbers().map(DVec3::from_array)
    }
    /// Reads x, y, z, w; the quaternion is not normalised.
    pub fn quaternion(&mut self) -> io::Result<DQuat> {
        self.numbers().map(DQuat::from_array)
    }
    /// Reads a value written by [`Encoder::option`].
    pub fn option(&mut self) -> io::Result<Option<f64>> {
        let (flag, value) = (self.u8()?, self.f64()?);
        match flag {
            0 => Ok(None),
            1 => Ok(Some(value)),
            _ => Err(invalid(format!("{flag} is not 0 or 1"))),
        }
    }
    /// Reads `N` numbers.
    pub fn numbers<const N: usize>(&mut self) -> io::Result<[f64; N]> {
        let mut values = [0.0; N];
        self.fill(&mut values)?;
        Ok(values)
    }
    /// Reads as many numbers as `values` holds.
    pub fn fill<R: Real>(&mut self, values: &mut [R]) -> io::Result<()> {
        let mut bytes = [0; 8 * CHUNK];
        for chunk in values.chunks_mut(CHUNK) {
            let bytes = &mut bytes[..R::BYTES * chunk.len()];
            self.0.read_exact(bytes)?;
            for (value, bytes) in chunk.iter_mut().zip(bytes.chunks_exact(R::BYTES)) {
                *value = R::read_from(bytes);
            }
        }
        Ok(())
    }
    /// Reads a byte string written by [`Encoder::bytes`].
    pub fn bytes(&mut self) -> io::Result<Vec<u8>> {
        let length = self.u64()?;
        let mut bytes = Vec::new();
        self.0.take(length).read_to_end(&mut bytes)?;
        if bytes.len() as u64 == length {
            Ok(bytes)
        } else {
            Err(io::ErrorKind::UnexpectedEof.into())
        }
    }
    /// Reads a text written by [`Encoder::text`].
    pub fn text(&mut self) -> io::Result<String> {
        String::from_utf8(self.bytes()?).map_err(|_| invalid("a text is not UTF-8"))
    }
    /// Reads `count` entries of a list.
    pub fn list<T>(
        &mut self,
        count: usize,
        mut read: impl FnMut(&mut Self) -> io::Result<T>,
    ) -> io::Result<Vec<T>> {
        let mut list = Vec::with_capacity(count.min(RESERVED));
        for _ in 0..count {
            list.push(read(self)?);
        }
        Ok(list)
    }
    /// Reads a 64-bit count of `what` that must equal `count`.
    pub fn expect(&mut self, count: usize, what: &str) -> io::Result<()> {
        let found = self.u64()?;
        if found == count as u64 {
            return Ok(());
        }
        Err(invalid(format!("the checkpoint has {found} {what}, this case has {count}")))
    }
    /// Reads a 64-bit count of `what` that is at most `limit`.
    pub fn count(&mut self, limit: u64, what: &str) -> io::Result<usize> {
        let count = self.u64()?;
        usize::try_from(count)
            .ok()
            .filter(|_| count <= limit)
            .ok_or_else(|| invalid(format!("{count} {what}, at most {limit} are possible")))
    }
}

/// Returns an error of kind `InvalidData`.
pub fn invalid(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_bit_for_bit() {
        let singles: Vec<f32> = (0..1300).map(|i| i as f32 * 0.1).collect();
        let bytes = encode(|out| {
            out.u8(7)?;
            out.u32(1 << 30)?;
            out.vector(DVec3::new(0.1, -0.0, f64::MIN_POSITIVE))?;
            out.quaternion(DQuat::from_xyzw(0.5, -0.5, 0.5, -0.5))?;
            out.option(Some(1.0 / 3.0))?;
            out.option(None)?;
            out.text("grain")?;
            out.reals(&singles)
        })
        .unwrap();
        let mut slice = &bytes[..];
        let mut input = Decoder::new(&mut slice);
        assert_eq!((input.u8().unwrap(), input.u32().unwrap()), (7, 1 << 30));
        let vector = input.vector().unwrap();
        assert_eq!(vector.y.to_bits(), (-0.0f64).to_bits());
        assert_eq!((vector.x, vector.z), (0.1, f64::MIN_POSITIVE));
        assert_eq!(input.quaternion().unwrap().to_array(), [0.5, -0.5, 0.5, -0.5]);
        assert_eq!(input.option().unwrap(), Some(1.0 / 3.0));
        assert_eq!(input.option().unwrap(), None);
        assert_eq!(input.text().unwrap(), "grain");
        let mut back = vec![0f32; singles.len()];
        input.fill(&mut back).unwrap();
        assert_eq!(back, singles);
        assert!(slice.is_empty());
    }

    #[test]
    fn damaged_lengths_are_errors_and_reserve_no_memory() {
        let bytes = encode(|out| out.u64(u64::MAX / 2)).unwrap();
        let decode = |read: &mut dyn FnMut(&mut Decoder) -> io::Error| {
            let mut slice = &bytes[..];
            read(&mut Decoder::new(&mut slice)).kind()
        };
        let eof = io::ErrorKind::UnexpectedEof;
        assert_eq!(decode(&mut |input| input.bytes().unwrap_err()), eof);
        let huge = usize::MAX / 2;
        let list = |input: &mut Decoder| input.list(huge, |d| d.u64()).unwrap_err();
        assert_eq!(decode(&mut { list }), eof);
        let count = |input: &mut Decoder| input.count(9, "grains").unwrap_err();
        assert_eq!(decode(&mut { count }), io::ErrorKind::InvalidData);
    }
}
