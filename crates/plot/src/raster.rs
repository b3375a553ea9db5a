//! Rasters with a palette, and PNG encoding.

use resvg::tiny_skia;

/// An image as palette indices, row by row from the top.
#[derive(Clone, Debug)]
pub struct Raster {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Palette index of each pixel.
    pub pixels: Vec<u8>,
    /// At most 256 sRGB colours.
    pub palette: Vec<[u8; 3]>,
}

impl Raster {
    /// Converts to full colours; `None` if there are no pixels or too few indices.
    pub fn to_pixmap(&self) -> Option<tiny_skia::Pixmap> {
        let size = tiny_skia::IntSize::from_wh(self.width as u32, self.height as u32)?;
        let colour =
            |index: &u8| self.palette.get(usize::from(*index)).copied().unwrap_or([255; 3]);
        let data = self.pixels.iter().map(colour).flat_map(|[r, g, b]| [r, g, b, 255]).collect();
        tiny_skia::Pixmap::from_vec(data, size)
    }

    /// Encodes a PNG file with a palette; empty if the sizes are inconsistent.
    pub fn to_png(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        encoder.set_palette(self.palette.concat());
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&self.pixels)?;
            writer.finish()
        });
        if written.is_err() {
            out.clear();
        }
        out
    }
}

/// A picture of sRGB pixels, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Red, green and blue of each pixel.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// Converts to the pixels of a drawing; `None` if the sizes are inconsistent.
    pub(crate) fn to_pixmap(&self) -> Option<tiny_skia::Pixmap> {
        let size = tiny_skia::IntSize::from_wh(self.width as u32, self.height as u32)?;
        let data = self.pixels.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
        tiny_skia::Pixmap::from_vec(data, size)
    }

    /// Encodes a PNG file.
    ///
    /// # Errors
    /// The reason, if the encoder refuses the picture.
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        self.encoded(None)
    }

    /// Encodes a PNG file that is marked as 300 dots per inch.
    pub(crate) fn to_print_png(&self) -> Result<Vec<u8>, String> {
        let per_metre = (300.0 / 0.0254_f64).round() as u32;
        let unit = png::Unit::Meter;
        self.encoded(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit }))
    }

    fn encoded(&self, dimensions: Option<png::PixelDimensions>) -> Result<Vec<u8>, String> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_pixel_dims(dimensions);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&self.pixels)?;
            writer.finish()
        });
        written.map(|()| out).map_err(|error| error.to_string())
    }

    /// Decodes a PNG file that [`Picture::to_png`] has encoded.
    ///
    /// # Errors
    /// The reason, if the file is damaged or holds another kind of picture.
    pub fn from_png(bytes: &[u8]) -> Result<Picture, String> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .map_err(|error| error.to_string())?;
        let size = reader.output_buffer_size().ok_or("the picture is too large")?;
        let mut pixels = vec![0; size];
        let info = reader.next_frame(&mut pixels).map_err(|error| error.to_string())?;
        if info.color_type != png::ColorType::Rgb || info.bit_depth != png::BitDepth::Eight {
            return Err("the picture has no 8-bit RGB pixels".to_owned());
        }
        Ok(Picture { width: info.width as usize, height: info.height as usize, pixels })
    }

    /// Returns the picture at another size, each pixel the mean of the area it covers.
    pub fn resized(&self, width: usize, height: usize) -> Picture {
        let mut pixels = Vec::with_capacity(3 * width * height);
        let spans = |count: usize, from: usize| -> Vec<(usize, usize)> {
            let edge = |i: usize| i * from / count;
            (0..count).map(|i| (edge(i), edge(i + 1).max(edge(i) + 1).min(from))).collect()
        };
        let columns = spans(width, self.width);
        for (top, bottom) in spans(height, self.height) {
            for &(left, right) in &columns {
                let mut sum = [0usize; 3];
                for row in top..bottom {
                    let start = 3 * (row * self.width + left);
                    for pixel in self.pixels[start..start + 3 * (right - left)].chunks_exact(3) {
                        for (sum, value) in sum.iter_mut().zip(pixel) {
                            *sum += usize::from(*value);
                        }
                    }
                }
                let count = (bottom - top) * (right - left);
                pixels.extend(sum.map(|sum| ((sum + count / 2) / count) as u8));
            }
        }
        Picture { width, height, pixels }
    }
}
