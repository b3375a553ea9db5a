//! Greyscale PNG, one slice of a folder.

use super::bits::unpack;
use super::volume::{Volume, Voxels, count};
use crate::error::{Result, ShapeError};
use crate::limits::ReadLimits;
use png::{BitDepth, ColorType, Decoder, Transformations};
use std::io::Cursor;
use std::path::Path;

pub(super) fn read(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Volume> {
    let malformed = |e: png::DecodingError| ShapeError::malformed(path, e);
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::IDENTITY);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(malformed)?;
    let (color, depth) = reader.output_color_type();
    if color != ColorType::Grayscale {
        let reason = format!("it is {color:?}; convert it to greyscale of 8 or 16 bits");
        return Err(ShapeError::unsupported(path, reason));
    }
    let (width, height) = (reader.info().width, reader.info().height);
    count(path, [width.into(), height.into(), 1], limits)?;
    let size = reader.output_buffer_size().ok_or_else(|| {
        ShapeError::malformed(path, format!("it claims {width} x {height} pixels"))
    })?;
    let mut rows = vec![0; size];
    reader.next_frame(&mut rows).map_err(malformed)?;
    let packed = |bits| unpack(&rows, width as usize, bits).map(u32::from).collect();
    let labels: Vec<u32> = match depth {
        BitDepth::One => packed(1),
        BitDepth::Two => packed(2),
        BitDepth::Four => packed(4),
        BitDepth::Eight => rows.iter().map(|v| u32::from(*v)).collect(),
        BitDepth::Sixteen => {
            rows.as_chunks().0.iter().map(|v| u32::from(u16::from_be_bytes(*v))).collect()
        }
    };
    Volume::from_voxels(path, [width as usize, height as usize, 1], Voxels::Labels(labels))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(color: ColorType, depth: BitDepth, size: [u32; 2], rows: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.write_header().unwrap().write_image_data(rows).unwrap();
        bytes
    }

    fn open(bytes: &[u8]) -> Result<Volume> {
        read(Path::new("a.png"), bytes, &ReadLimits::default())
    }

    #[test]
    fn all_depths_are_read() {
        let grey = |depth, rows: &[u8]| open(&write(ColorType::Grayscale, depth, [3, 2], rows));
        let expect = |values: [u32; 6]| Volume::from_labels([3, 2, 1], values.to_vec()).unwrap();
        let bits = grey(BitDepth::One, &[0b1010_0000, 0b0100_0000]).unwrap();
        assert_eq!(bits, expect([1, 0, 1, 0, 1, 0]));
        let nibbles = grey(BitDepth::Four, &[0x12, 0x30, 0x45, 0x60]).unwrap();
        assert_eq!(nibbles, expect([1, 2, 3, 4, 5, 6]));
        let bytes = grey(BitDepth::Eight, &[1, 2, 3, 4, 5, 255]).unwrap();
        assert_eq!(bytes, expect([1, 2, 3, 4, 5, 255]));
        let words = [0, 1, 0, 2, 0, 3, 0, 4, 0, 5, 1, 0];
        assert_eq!(grey(BitDepth::Sixteen, &words).unwrap(), expect([1, 2, 3, 4, 5, 256]));
    }

    #[test]
    fn colours_and_damaged_files_are_refused() {
        let colour = open(&write(ColorType::Rgb, BitDepth::Eight, [1, 1], &[1, 2, 3]));
        assert!(matches!(colour, Err(ShapeError::Unsupported { .. })), "{colour:?}");
        let good = write(ColorType::Grayscale, BitDepth::Eight, [8, 8], &[7; 64]);
        for length in 0..good.len() - 12 {
            assert!(open(&good[..length]).is_err(), "{length} bytes");
        }
        let mut large = good;
        // A million pixels along both edges, without a valid checksum and with one.
        large[16..20].copy_from_slice(&1_000_000u32.to_be_bytes());
        large[20..24].copy_from_slice(&1_000_000u32.to_be_bytes());
        assert!(open(&large).is_err());
        let sum = crc32(&large[12..29]);
        large[29..33].copy_from_slice(&sum.to_be_bytes());
        let error = open(&large).unwrap_err();
        assert!(matches!(error, ShapeError::TooLarge { .. }), "{error}");
    }

    fn crc32(bytes: &[u8]) -> u32 {
        let mut crc = flate2::Crc::new();
        crc.update(bytes);
        crc.sum()
    }
}
