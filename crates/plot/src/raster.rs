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

/// Encodes an opaque pixmap as RGB PNG, marked as 300 dots per inch.
///
/// # Errors
/// The reason, if the encoder refuses the image.
pub fn encode_png(width: u32, height: u32, pixmap: &tiny_skia::Pixmap) -> Result<Vec<u8>, String> {
    let pixels: Vec<u8> = pixmap.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let per_metre = (300.0 / 0.0254_f64).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions {
        xppu: per_metre,
        yppu: per_metre,
        unit: png::Unit::Meter,
    }));
    let mut writer = encoder.write_header().map_err(|error| error.to_string())?;
    writer.write_image_data(&pixels).map_err(|error| error.to_string())?;
    writer.finish().map_err(|error| error.to_string())?;
    Ok(out)
}
