//! Multi-page TIFF, greyscale, one page per slice along z.

use super::bits::unpack;
use super::description::Description;
use super::geometry::StatedVoxel;
use super::volume::{Volume, Voxels, count};
use crate::error::{Result, ShapeError};
use crate::limits::ReadLimits;
use std::io::Cursor;
use std::path::Path;
use tiff::decoder::ifd::Value;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{CompressionMethod, Tag};
use tiff::{ColorType, TiffError, TiffUnsupportedError};

/// Upper bound of the compression ratio of all TIFF codecs; pages that declare more are refused.
const BEST_RATIO: u64 = 5000;

pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    limits: &ReadLimits,
) -> Result<(Volume, Option<StatedVoxel>)> {
    let malformed = |e: &dyn std::fmt::Display| ShapeError::malformed(path, e);
    let memory = |page: usize| {
        let mut memory = Limits::default();
        memory.decoding_buffer_size = page;
        memory.intermediate_buffer_size = 1 << 30;
        memory.ifd_value_size = bytes.len();
        memory
    };
    let decoder = Decoder::new(Cursor::new(bytes)).map_err(|e| malformed(&e))?;
    let mut decoder = decoder.with_limits(memory(bytes.len()));
    let description = description(&mut decoder);
    description.check_stack(path)?;
    let stated = description.voxel(path)?;
    let mut first: Option<(u32, u32, ColorType)> = None;
    let mut all = Voxels::Labels(Vec::new());
    let mut pages = 0u64;
    loop {
        let (width, height) = decoder.dimensions().map_err(|e| malformed(&e))?;
        let color = decoder.colortype().map_err(|e| malformed(&e))?;
        let bits = match color {
            ColorType::Gray(bits @ (1 | 8 | 16 | 32 | 64)) => bits,
            other => {
                let remedy = "convert it to greyscale of 8, 16 or 32 bits";
                let reason = format!("page {pages} is {other:?}; {remedy}");
                return Err(ShapeError::unsupported(path, reason));
            }
        };
        if bits == 1 && lowest_bit_first(&mut decoder) {
            let reason = "its bits have the lowest one first (FillOrder 2); save it with 8 bits";
            return Err(ShapeError::unsupported(path, reason));
        }
        let page = (width, height, color);
        if *first.get_or_insert(page) != page {
            return Err(malformed(&format!(
                "page {pages} is {width} x {height} {color:?}, unlike the first page"
            )));
        }
        count(path, [width.into(), height.into(), pages + 1], limits)?;
        let size = (u64::from(width) * u64::from(bits)).div_ceil(8) * u64::from(height);
        if size > BEST_RATIO.saturating_mul(bytes.len() as u64) {
            return Err(malformed(&format!(
                "page {pages} claims {width} x {height} voxels, the file has only {} bytes",
                bytes.len()
            )));
        }
        decoder = decoder.with_limits(memory(size as usize));
        let decoded = decoder.read_image().map_err(|e| match compression(&e) {
            Some(method) => {
                let reason = format!(
                    "page {pages} has the compression {method}, which is not read; save it \
                     uncompressed, or with LZW, Deflate or PackBits"
                );
                ShapeError::unsupported(path, reason)
            }
            None => malformed(&format!("page {pages}: {e}")),
        })?;
        let stored = if white_is_zero(&mut decoder) { inverted(decoded) } else { decoded };
        let voxels = match stored {
            DecodingResult::U8(rows) if bits == 1 => {
                Voxels::Labels(unpack(&rows, width as usize, 1).map(u32::from).collect())
            }
            other => voxels(other),
        };
        if voxels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(malformed(&format!("page {pages} is incomplete")));
        }
        all.append(voxels);
        pages += 1;
        if !decoder.more_images() {
            break;
        }
        decoder.next_image().map_err(|e| malformed(&e))?;
    }
    // ImageJ stacks over 4 GiB have one page, with the number of slices in the description.
    if let Some(claimed) = description.images.filter(|images| pages == 1 && *images > 1) {
        let reason = format!(
            "the description states {claimed} slices, but the file has one page (ImageJ writes \
             large stacks so); save it as NPY or as a true multi-page TIFF"
        );
        return Err(ShapeError::unsupported(path, reason));
    }
    let (width, height, _) = first.unwrap_or((0, 0, ColorType::Gray(8)));
    let dims = [width as usize, height as usize, pages as usize];
    Ok((Volume::from_voxels(path, dims, all)?, stated))
}

/// Returns the name of the compression method if it is the reason of an error.
fn compression(error: &TiffError) -> Option<String> {
    let TiffError::UnsupportedError(TiffUnsupportedError::UnsupportedCompressionMethod(method)) =
        error
    else {
        return None;
    };
    Some(match method {
        CompressionMethod::ModernJPEG => "JPEG".to_owned(),
        CompressionMethod::Unknown(34925) => "LZMA".to_owned(),
        CompressionMethod::Unknown(34933) => "PNG".to_owned(),
        CompressionMethod::Unknown(number) => format!("number {number}"),
        other => format!("{other:?}"),
    })
}

/// Returns whether the page says that white is zero, in which case the decoder inverts its values.
fn white_is_zero(decoder: &mut Decoder<Cursor<&[u8]>>) -> bool {
    number(decoder, Tag::PhotometricInterpretation) == Some(0)
}

/// Returns the values as they are stored. Programs write masks and labels with white as zero
/// (ImageJ with an inverting lookup table, tifffile for booleans), where the value of the grains is
/// still the larger one.
fn inverted(page: DecodingResult) -> DecodingResult {
    use DecodingResult as Page;
    match page {
        Page::U8(v) => Page::U8(v.into_iter().map(|v| !v).collect()),
        Page::U16(v) => Page::U16(v.into_iter().map(|v| !v).collect()),
        Page::U32(v) => Page::U32(v.into_iter().map(|v| !v).collect()),
        Page::U64(v) => Page::U64(v.into_iter().map(|v| !v).collect()),
        Page::F32(v) => Page::F32(v.into_iter().map(|v| 1.0 - v).collect()),
        Page::F64(v) => Page::F64(v.into_iter().map(|v| 1.0 - v).collect()),
        other => other,
    }
}

fn number(decoder: &mut Decoder<Cursor<&[u8]>>, tag: Tag) -> Option<u32> {
    decoder.find_tag(tag).ok().flatten()?.into_u32().ok()
}

/// Returns whether the bits of a byte are stored from the lowest to the highest.
fn lowest_bit_first(decoder: &mut Decoder<Cursor<&[u8]>>) -> bool {
    number(decoder, Tag::FillOrder) == Some(2)
}

/// Returns the description of the first page.
fn description(decoder: &mut Decoder<Cursor<&[u8]>>) -> Description {
    let resolution = [Tag::XResolution, Tag::YResolution].map(|tag| match decoder.find_tag(tag) {
        Ok(Some(Value::Rational(pixels, unit))) => Some(f64::from(pixels) / f64::from(unit)),
        _ => None,
    });
    let text = decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap_or_default();
    Description::parse(&text, resolution)
}

/// Returns the voxels of a page: labels if every value is one, and grey values otherwise.
fn voxels(page: DecodingResult) -> Voxels {
    use DecodingResult as Page;
    fn integers<T: Copy + TryInto<u32>>(page: Vec<T>, grey: fn(T) -> f32) -> Voxels {
        let labels: Option<Vec<u32>> = page.iter().map(|v| (*v).try_into().ok()).collect();
        labels.map_or_else(|| Voxels::Grey(page.into_iter().map(grey).collect()), Voxels::Labels)
    }
    match page {
        Page::U8(v) => integers(v, f32::from),
        Page::U16(v) => integers(v, f32::from),
        Page::U32(v) => integers(v, |v| v as f32),
        Page::U64(v) => integers(v, |v| v as f32),
        Page::I8(v) => integers(v, f32::from),
        Page::I16(v) => integers(v, f32::from),
        Page::I32(v) => integers(v, |v| v as f32),
        Page::I64(v) => integers(v, |v| v as f32),
        Page::F16(v) => Voxels::Grey(v.into_iter().map(|v| v.to_f32()).collect()),
        Page::F32(v) => Voxels::Grey(v),
        Page::F64(v) => Voxels::Grey(v.into_iter().map(|v| v as f32).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use rand::{RngExt, SeedableRng};
    use tiff::encoder::colortype::{
        ColorType as Written, Gray8, Gray16, Gray32, Gray32Float, RGB8,
    };
    use tiff::encoder::{TiffEncoder, TiffValue};

    fn write<C: Written>(pages: &[&[C::Inner]], width: u32, height: u32) -> Vec<u8>
    where
        [C::Inner]: TiffValue,
    {
        let mut bytes = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
        for page in pages {
            encoder.write_image::<C>(width, height, page).unwrap();
        }
        bytes.into_inner()
    }

    fn open(bytes: &[u8]) -> Result<Volume> {
        read(Path::new("a.tif"), bytes, &ReadLimits::default()).map(|(volume, _)| volume)
    }

    #[test]
    fn all_depths_are_read_page_by_page() {
        let expect = Volume::from_labels([3, 1, 2], vec![0, 1, 2, 3, 4, 5]).unwrap();
        assert_eq!(open(&write::<Gray8>(&[&[0, 1, 2], &[3, 4, 5]], 3, 1)).unwrap(), expect);
        assert_eq!(open(&write::<Gray16>(&[&[0, 1, 2], &[3, 4, 5]], 3, 1)).unwrap(), expect);
        assert_eq!(open(&write::<Gray32>(&[&[0, 1, 2], &[3, 4, 5]], 3, 1)).unwrap(), expect);
        let whole: [&[f32]; 2] = [&[0.0, 1.0, 2.0], &[3.0, 4.0, 5.0]];
        assert_eq!(open(&write::<Gray32Float>(&whole, 3, 1)).unwrap(), expect);
        let grey = open(&write::<Gray32Float>(&[&[0.5, 1.0]], 2, 1)).unwrap();
        assert_eq!(grey.voxels, Voxels::Grey(vec![0.5, 1.0]));
    }

    /// A file of one strip with the given tags beside those of the layout.
    fn raw(width: u32, height: u32, tags: &[(u16, u32)], data: &[u8]) -> Vec<u8> {
        let mut entries = tags.to_vec();
        let size = data.len() as u32;
        entries.extend([(256, width), (257, height), (278, height), (279, size)]);
        let start = 8 + 2 + 12 * (entries.len() as u32 + 1) + 4;
        entries.push((273, start));
        entries.sort();
        let mut bytes = b"II*\0\x08\0\0\0".to_vec();
        bytes.extend((entries.len() as u16).to_le_bytes());
        for (tag, value) in entries {
            bytes.extend(tag.to_le_bytes());
            bytes.extend(4u16.to_le_bytes());
            bytes.extend(1u32.to_le_bytes());
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend(0u32.to_le_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn a_mask_of_single_bits_is_read() {
        // Ten columns take two bytes; the six last bits of a row are padding.
        let rows = [0b1010_0001, 0b0111_1111, 0b0000_0000, 0b1000_0000];
        let expect: Vec<u32> = vec![1, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0];
        let mask = open(&raw(10, 2, &[(258, 1), (259, 1), (262, 1)], &rows)).unwrap();
        assert_eq!(mask, Volume::from_labels([10, 2, 1], expect).unwrap());
        let tags = [(258, 1), (259, 1), (262, 1), (266, 2)];
        let error = open(&raw(10, 2, &tags, &rows)).unwrap_err();
        assert!(error.to_string().contains("FillOrder 2"), "{error}");
    }

    #[test]
    fn values_are_the_stored_ones_where_white_is_zero() {
        let labels =
            |values: &[u32]| Volume::from_labels([values.len(), 1, 1], values.to_vec()).unwrap();
        let page = |bits, width, data: &[u8]| {
            open(&raw(width, 1, &[(258, bits), (259, 1), (262, 0)], data)).unwrap()
        };
        assert_eq!(page(1, 3, &[0b1010_0000]), labels(&[1, 0, 1]));
        assert_eq!(page(8, 3, &[0, 255, 7]), labels(&[0, 255, 7]));
        assert_eq!(page(16, 2, &[1, 0, 0, 2]), labels(&[1, 512]));
        assert_eq!(page(32, 1, &[7, 0, 0, 0]), labels(&[7]));
        let mut tags = vec![(258, 32), (259, 1), (262, 0), (339, 3)];
        let floats: Vec<u8> = [0.25f32, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let grey = open(&raw(2, 1, &tags, &floats)).unwrap();
        assert_eq!(grey.voxels, Voxels::Grey(vec![0.25, 0.0]));
        tags[2].1 = 1;
        assert_eq!(open(&raw(2, 1, &tags, &floats)).unwrap(), grey);
    }

    #[test]
    fn a_compression_that_is_not_read_is_named() {
        for (number, name) in [(7, "JPEG"), (50000, "ZSTD"), (34925, "LZMA"), (4, "Fax4")] {
            let tags = [(258, 1), (259, number), (262, 1)];
            let error = open(&raw(8, 1, &tags, &[0; 64])).unwrap_err();
            let message = error.to_string();
            assert!(matches!(error, ShapeError::Unsupported { .. }), "{message}");
            assert!(message.contains(&format!("compression {name},")), "{message}");
        }
    }

    #[test]
    fn damaged_and_absurd_files_are_refused() {
        let colour = open(&write::<RGB8>(&[&[1, 2, 3]], 1, 1));
        assert!(matches!(colour, Err(ShapeError::Unsupported { .. })), "{colour:?}");
        let nan = open(&write::<Gray32Float>(&[&[f32::NAN, 1.0]], 2, 1));
        let message = nan.unwrap_err().to_string();
        assert!(message.contains("not a finite number"), "{message}");
        let good = write::<Gray8>(&[&[7; 64], &[9; 64]], 8, 8);
        for length in 0..good.len() {
            assert!(open(&good[..length]).is_err(), "{length} bytes");
        }
        // Width and height of 10^6 in the directory of the last page, and arbitrary bytes
        // elsewhere: an error or an image, never a panic.
        let mut random = Random::seed_from_u64(3);
        for at in 0..good.len() {
            for _ in 0..4 {
                let mut bad = good.clone();
                bad[at] = random.random();
                let _ = open(&bad);
            }
        }
    }

    /// A header that declares a million voxels along every axis.
    #[test]
    fn a_million_cubed_is_refused_before_memory_is_asked_for() {
        for edge in [1_000_000u32, 20_000] {
            let mut bytes = b"II*\0\x08\0\0\0".to_vec();
            let entries: [(u16, u32); 8] = [
                (256, edge),
                (257, edge),
                (258, 8),
                (259, 1),
                (262, 1),
                (273, 8),
                (278, edge),
                (279, edge),
            ];
            bytes.extend_from_slice(&(entries.len() as u16).to_le_bytes());
            for (tag, value) in entries {
                bytes.extend_from_slice(&tag.to_le_bytes());
                bytes.extend_from_slice(&4u16.to_le_bytes());
                bytes.extend_from_slice(&1u32.to_le_bytes());
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            bytes.extend_from_slice(&0u32.to_le_bytes());
            let error = open(&bytes).unwrap_err();
            let expected = if edge > 100_000 {
                matches!(error, ShapeError::TooLarge { .. })
            } else {
                matches!(error, ShapeError::Malformed { .. })
            };
            assert!(expected, "{error}");
        }
    }
}
