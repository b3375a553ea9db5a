//! Animated GIF of pictures of one size.

use std::borrow::Cow;

use crate::palette::{Histogram, Palette};
use crate::raster::Picture;

/// Largest number of colours; one entry of the 256 stands for an unchanged pixel.
const COLOURS: usize = 255;

/// Encodes an endless animation of `count` pictures, each shown for `delay` [s].
///
/// `picture(i)` gives picture i; all have one size and share 255 colours. Each is asked for twice,
/// so that only one is in memory. A picture stores only what differs from the one before it.
///
/// # Errors
/// The first error of `picture`, or the reason why the encoder refuses the pictures.
pub fn encode_gif(
    count: usize,
    delay: f64,
    picture: &dyn Fn(usize) -> Result<Picture, String>,
) -> Result<Vec<u8>, String> {
    let mut histogram = Histogram::default();
    for i in 0..count {
        histogram.add(&picture(i)?);
    }
    let palette = histogram.palette(COLOURS);
    let first = picture(0)?;
    let side = |length: usize| u16::try_from(length).map_err(|_| "the pictures are too large");
    let (width, height) = (side(first.width)?, side(first.height)?);
    let refused = |error: gif::EncodingError| error.to_string();
    let mut colours = palette.colours.concat();
    colours.resize(3 * (COLOURS + 1), 0);
    let mut out = Vec::new();
    let mut encoder = gif::Encoder::new(&mut out, width, height, &colours).map_err(refused)?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(refused)?;
    let mut shown = Vec::new();
    for i in 0..count {
        let picture = if i == 0 { first.clone() } else { picture(i)? };
        if (picture.width, picture.height) != (first.width, first.height) {
            return Err("the pictures have several sizes".to_owned());
        }
        let frame = frame(&picture, &palette, &mut shown, delay);
        encoder.write_frame(&frame).map_err(refused)?;
    }
    drop(encoder);
    Ok(out)
}

/// Returns the part of a picture that differs from the indices `shown`, which it updates.
fn frame(
    picture: &Picture,
    palette: &Palette,
    shown: &mut Vec<u8>,
    delay: f64,
) -> gif::Frame<'static> {
    let indices = palette.indices(picture);
    let width = picture.width;
    let changed = |at: usize| shown.get(at) != Some(&indices[at]);
    let rows = (0..picture.height).filter(|row| (0..width).any(|x| changed(row * width + x)));
    let rows: Vec<usize> = rows.collect();
    // A frame has at least one pixel.
    let (top, bottom) = (rows.first().copied().unwrap_or(0), rows.last().map_or(1, |row| row + 1));
    let columns = (0..width).filter(|x| (top..bottom).any(|row| changed(row * width + x)));
    let columns: Vec<usize> = columns.collect();
    let left = columns.first().copied().unwrap_or(0);
    let right = columns.last().map_or(left + 1, |column| column + 1);
    let places = (top..bottom).flat_map(|row| (left..right).map(move |x| row * width + x));
    let pixel = |at: usize| if changed(at) { indices[at] } else { COLOURS as u8 };
    let buffer: Vec<u8> = places.map(pixel).collect();
    *shown = indices;
    gif::Frame {
        delay: (100.0 * delay).round().clamp(2.0, 1000.0) as u16,
        dispose: gif::DisposalMethod::Keep,
        transparent: Some(COLOURS as u8),
        left: left as u16,
        top: top as u16,
        width: (right - left) as u16,
        height: (bottom - top) as u16,
        buffer: Cow::Owned(buffer),
        ..gif::Frame::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A white picture with a dark square at column `x`.
    fn square(x: usize) -> Picture {
        let (width, height) = (40, 20);
        let inside =
            |at: usize| (x..x + 6).contains(&(at % width)) && (5..11).contains(&(at / width));
        let colour = |at: usize| if inside(at) { [20, 40, 200] } else { [255; 3] };
        Picture { width, height, pixels: (0..width * height).flat_map(colour).collect() }
    }

    #[test]
    fn an_animation_shows_its_pictures() {
        let bytes = encode_gif(4, 0.08, &|i| Ok(square(3 + 5 * i))).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::Indexed);
        let mut decoder = options.read_info(bytes.as_slice()).unwrap();
        assert_eq!((decoder.width(), decoder.height()), (40, 20));
        let palette = decoder.global_palette().unwrap().to_vec();
        let mut canvas = vec![0; 800];
        let mut count = 0;
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            assert_eq!(frame.delay, 8);
            let (width, left, top) =
                (usize::from(frame.width), usize::from(frame.left), usize::from(frame.top));
            for (at, index) in frame.buffer.iter().enumerate() {
                if Some(*index) != frame.transparent {
                    canvas[(top + at / width) * 40 + left + at % width] = *index;
                }
            }
            let expected = square(3 + 5 * count);
            for (at, index) in canvas.iter().enumerate() {
                let given = &palette[3 * usize::from(*index)..3 * usize::from(*index) + 3];
                for axis in 0..3 {
                    assert!(given[axis].abs_diff(expected.pixels[3 * at + axis]) < 4);
                }
            }
            if count > 0 {
                assert!(width < 20, "only the changed part is stored");
            }
            count += 1;
        }
        assert_eq!(count, 4);
    }

    #[test]
    fn equal_pictures_and_several_sizes() {
        let still = encode_gif(3, 0.1, &|_| Ok(square(3))).unwrap();
        assert!(still.starts_with(b"GIF89a"));
        let mixed = |i: usize| Ok(if i == 0 { square(3) } else { square(3).resized(20, 10) });
        assert!(encode_gif(2, 0.1, &mixed).unwrap_err().contains("several sizes"));
    }
}
