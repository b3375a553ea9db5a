//! A drawing with rasters below vectors, written as SVG and PNG from one description.

use std::sync::{Arc, OnceLock};

use base64::Engine;
use resvg::{tiny_skia, usvg};

use crate::font;
use crate::raster::{Picture, Raster};
use crate::style;
use crate::text;

/// Point of a label that lies at the given position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// Left end.
    Start,
    /// Middle.
    Middle,
    /// Right end.
    End,
}

/// A drawing of fixed size [pt], with y downwards.
#[derive(Clone, Debug)]
pub struct Drawing {
    width: f64,
    height: f64,
    images: Vec<Placed>,
    vectors: String,
}

/// Image that fills a rectangle.
#[derive(Clone, Debug)]
struct Placed {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
    image: Image,
}

#[derive(Clone, Debug)]
enum Image {
    Raster(Raster),
    Picture(Picture),
}

impl Image {
    /// Returns the pixels; `None` if there are none.
    fn to_pixmap(&self) -> Option<tiny_skia::Pixmap> {
        match self {
            Image::Raster(raster) => raster.to_pixmap(),
            Image::Picture(picture) => picture.to_pixmap(),
        }
    }

    /// Encodes a PNG file; empty if the sizes are inconsistent.
    fn to_png(&self) -> Vec<u8> {
        match self {
            Image::Raster(raster) => raster.to_png(),
            Image::Picture(picture) => picture.to_png().unwrap_or_default(),
        }
    }
}

/// Formats a value for SVG with at most two decimals.
pub fn number(value: f64) -> String {
    let mut text = format!("{value:.2}");
    if text.contains('.') {
        text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
    }
    if text == "-0" { "0".to_owned() } else { text }
}

/// Returns SVG path data through `points` [pt].
pub fn path_data(points: &[(f64, f64)], closed: bool) -> String {
    let mut data = String::with_capacity(12 * points.len());
    for (i, (x, y)) in points.iter().enumerate() {
        data.push(if i == 0 { 'M' } else { 'L' });
        data.push_str(&number(*x));
        data.push(' ');
        data.push_str(&number(*y));
    }
    if closed {
        data.push('Z');
    }
    data
}

impl Drawing {
    /// Creates an empty drawing of the given size [pt].
    pub fn new(width: f64, height: f64) -> Drawing {
        Drawing { width, height, images: Vec::new(), vectors: String::new() }
    }

    /// Width [pt].
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Height [pt].
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Inserts another drawing with its upper left corner at `(x, y)` [pt]; the prefix `tag` keeps
    /// the identifiers of its clip paths unique.
    pub fn inset(&mut self, other: &Drawing, x: f64, y: f64, tag: &str) {
        let moved = |placed: &Placed| Placed { x: x + placed.x, y: y + placed.y, ..placed.clone() };
        self.images.extend(other.images.iter().map(moved));
        let vectors = rename_clips(&other.vectors, &format!("clip-{tag}-"));
        self.vectors.push_str(&format!(
            "<g transform=\"translate({} {})\">\n{vectors}</g>\n",
            number(x),
            number(y)
        ));
    }

    /// Adds a raster that fills the rectangle [pt], below all vectors.
    pub fn raster(&mut self, x: f64, y: f64, width: f64, height: f64, raster: Raster) {
        self.images.push(Placed { x, y, width, height, image: Image::Raster(raster) });
    }

    /// Adds a picture that fills the rectangle [pt], below all vectors.
    pub fn picture(&mut self, x: f64, y: f64, width: f64, height: f64, picture: Picture) {
        self.images.push(Placed { x, y, width, height, image: Image::Picture(picture) });
    }

    /// Adds a path with SVG attributes `style`.
    pub fn path(&mut self, data: &str, style: &str) {
        self.vectors.push_str(&format!("<path d=\"{data}\" {style}/>\n"));
    }

    /// Adds a stroked line through `points` [pt]; `dash` is an SVG dash pattern.
    pub fn line(&mut self, points: &[(f64, f64)], colour: &str, width: f64, dash: Option<&str>) {
        let dash = dash.map(|dash| format!(" stroke-dasharray=\"{dash}\"")).unwrap_or_default();
        let style = format!(
            "fill=\"none\" stroke=\"{colour}\" stroke-width=\"{}\" stroke-linejoin=\"round\"{dash}",
            number(width)
        );
        self.path(&path_data(points, false), &style);
    }

    /// Adds a rectangle [pt] with SVG attributes `style`.
    pub fn rectangle(&mut self, x: f64, y: f64, width: f64, height: f64, style: &str) {
        let [x, y, width, height] = [x, y, width, height].map(number);
        self.vectors.push_str(&format!(
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" {style}/>\n"
        ));
    }

    /// Adds the outline of a frame [pt].
    pub fn outline(&mut self, x: f64, y: f64, width: f64, height: f64) {
        let (ink, hair) = (style::INK, style::HAIR);
        let style = format!("fill=\"none\" stroke=\"{ink}\" stroke-width=\"{hair}\"");
        self.rectangle(x, y, width, height, &style);
    }

    /// Adds a label of text size with its baseline at `(x, y)` [pt].
    pub fn text(&mut self, at: (f64, f64), anchor: Anchor, label: &str) {
        self.label(at, anchor, style::TEXT, style::INK, label);
    }

    /// Adds a label of text size that runs upwards; the middle of its baseline is at `(x, y)` [pt].
    pub fn upward_text(&mut self, at: (f64, f64), label: &str) {
        self.upward_label(at, Anchor::Middle, style::TEXT, style::INK, label);
    }

    /// Adds a small label, vertically centred at `(x, y)` [pt].
    pub fn note(&mut self, (x, y): (f64, f64), anchor: Anchor, label: &str) {
        let base = (x, y + 0.36 * style::SMALL);
        self.label(base, anchor, style::SMALL, style::INK, label);
    }

    /// Adds a label with its baseline at `(x, y)` [pt].
    pub fn label(&mut self, at: (f64, f64), anchor: Anchor, size: f64, colour: &str, label: &str) {
        let style = format!("fill=\"{colour}\"");
        self.styled_label(at, anchor, size, &style, label);
    }

    /// Adds a label that runs upwards, with its baseline at `(x, y)` [pt].
    pub fn upward_label(
        &mut self,
        (x, y): (f64, f64),
        anchor: Anchor,
        size: f64,
        colour: &str,
        label: &str,
    ) {
        let turn = format!("rotate(-90 {} {})", number(x), number(y));
        let style = format!("fill=\"{colour}\" transform=\"{turn}\"");
        self.styled_label((x, y), anchor, size, &style, label);
    }

    /// Adds a small label with a white halo, legible over colours; baseline at `(x, y)` [pt].
    pub fn note_with_halo(&mut self, at: (f64, f64), anchor: Anchor, colour: &str, label: &str) {
        let halo = "fill=\"none\" stroke=\"#ffffff\" stroke-width=\"1.8\" \
                    stroke-linejoin=\"round\" stroke-opacity=\"0.85\"";
        self.styled_label(at, anchor, style::SMALL, halo, label);
        self.label(at, anchor, style::SMALL, colour, label);
    }

    fn styled_label(
        &mut self,
        (x, y): (f64, f64),
        anchor: Anchor,
        size: f64,
        style: &str,
        label: &str,
    ) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (x, y, spans) = (number(x), number(y), text::spans(label, size));
        self.vectors.push_str(&format!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" text-anchor=\"{anchor}\" \
             {style}>{spans}</text>\n",
            number(size)
        ));
    }

    /// Begins clipping to a rectangle [pt], up to `end_clip`; `name` must start with "clip-" and be
    /// unique in the drawing.
    pub fn begin_clip(&mut self, name: &str, x: f64, y: f64, width: f64, height: f64) {
        let [x, y, width, height] = [x, y, width, height].map(number);
        self.vectors.push_str(&format!(
            "<clipPath id=\"{name}\"><rect x=\"{x}\" y=\"{y}\" width=\"{width}\" \
             height=\"{height}\"/></clipPath>\n<g clip-path=\"url(#{name})\">\n"
        ));
    }

    /// Ends the last clipping.
    pub fn end_clip(&mut self) {
        self.vectors.push_str("</g>\n");
    }

    /// Returns the SVG document; the prefix `name` keeps its identifiers unique on a page.
    pub fn to_svg(&self, name: &str, title: &str, description: &str) -> String {
        let (width, height) = (number(self.width), number(self.height));
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}pt\" height=\"{height}pt\" \
             viewBox=\"0 0 {width} {height}\" \
             role=\"img\" aria-labelledby=\"{name}-title {name}-description\" font-family=\"{}\">\n\
             <title id=\"{name}-title\">{}</title>\n<desc id=\"{name}-description\">{}</desc>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n",
            style::FONT,
            text::escape(title),
            text::escape(description)
        );
        for Placed { x, y, width, height, image } in &self.images {
            let data = base64::engine::general_purpose::STANDARD.encode(image.to_png());
            let [x, y, width, height] = [*x, *y, *width, *height].map(number);
            out.push_str(&format!(
                "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
                 preserveAspectRatio=\"none\" href=\"data:image/png;base64,{data}\"/>\n"
            ));
        }
        out + &rename_clips(&self.vectors, &format!("{name}-clip-")) + "</svg>\n"
    }

    /// Renders a PNG file at 300 dots per inch, in the embedded font.
    ///
    /// # Errors
    /// The reason, if the drawing has no pixels or cannot be rendered.
    pub fn to_png(&self) -> Result<Vec<u8>, String> {
        let scale = style::PIXELS_PER_POINT;
        let size = [self.width, self.height].map(|length| (length * scale).round() as u32);
        self.to_picture(size, scale)?.to_print_png()
    }

    /// Renders a picture of `size` pixels at `scale` pixels per point, white beyond the drawing.
    ///
    /// # Errors
    /// The reason, if there are no pixels or the drawing cannot be rendered.
    pub fn to_picture(&self, size: [u32; 2], scale: f64) -> Result<Picture, String> {
        let pixmap = self.render(size, scale)?;
        let pixels = pixmap.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        Ok(Picture { width: size[0] as usize, height: size[1] as usize, pixels })
    }

    fn render(&self, size: [u32; 2], scale: f64) -> Result<tiny_skia::Pixmap, String> {
        let mut pixmap =
            tiny_skia::Pixmap::new(size[0], size[1]).ok_or("the drawing has no pixels")?;
        pixmap.fill(tiny_skia::Color::WHITE);
        for Placed { x, y, width, height, image } in &self.images {
            let picture = image.to_pixmap().ok_or("an image has no pixels")?;
            let transform = tiny_skia::Transform::from_row(
                (scale * width / f64::from(picture.width())) as f32,
                0.0,
                0.0,
                (scale * height / f64::from(picture.height())) as f32,
                (scale * x) as f32,
                (scale * y) as f32,
            );
            let paint = tiny_skia::PixmapPaint {
                quality: tiny_skia::FilterQuality::Bilinear,
                ..Default::default()
            };
            pixmap.draw_pixmap(0, 0, picture.as_ref(), &paint, transform, None);
        }
        let document = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" \
             viewBox=\"0 0 {w} {h}\" font-family=\"DejaVu Sans\">{}</svg>",
            self.vectors,
            w = number(self.width),
            h = number(self.height)
        );
        let tree =
            usvg::Tree::from_str(&document, &options()).map_err(|error| error.to_string())?;
        resvg::render(
            &tree,
            tiny_skia::Transform::from_scale(scale as f32, scale as f32),
            &mut pixmap.as_mut(),
        );
        Ok(pixmap)
    }
}

/// Replaces the prefix "clip-" of the identifiers of clip paths.
fn rename_clips(vectors: &str, prefix: &str) -> String {
    let used = vectors.replace("#clip-", &format!("#{prefix}"));
    used.replace("id=\"clip-", &format!("id=\"{prefix}"))
}

/// Returns rendering options that contain the embedded fonts only.
fn options() -> usvg::Options<'static> {
    static FONTS: OnceLock<Arc<usvg::fontdb::Database>> = OnceLock::new();
    let fonts = FONTS.get_or_init(|| {
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(font::REGULAR.clone());
        fonts.load_font_data(font::OBLIQUE.clone());
        Arc::new(fonts)
    });
    let font_family = "DejaVu Sans".to_owned();
    usvg::Options { font_family, fontdb: fonts.clone(), ..Default::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(number(1.0), "1");
        assert_eq!(number(-0.001), "0");
        assert_eq!(number(2.505), "2.5");
        assert_eq!(number(100.0), "100");
        assert_eq!(path_data(&[(0.0, 1.0), (2.0, 3.5)], true), "M0 1L2 3.5Z");
    }

    #[test]
    fn text_is_set_without_system_fonts() {
        let mut drawing = Drawing::new(60.0, 20.0);
        let blank = drawing.to_png().unwrap();
        let label = "√*x*_{2} kiss";
        drawing.label((5.0, 14.0), Anchor::Start, 10.0, "#000000", label);
        let png = drawing.to_png().unwrap();
        let ink = |png: &[u8]| {
            let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
            let mut data = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut data).unwrap();
            data.iter().filter(|&&v| v < 128).count()
        };
        assert_eq!(ink(&blank), 0);
        assert!(ink(&png) > 500, "{} dark samples", ink(&png));
    }

    #[test]
    fn a_picture_at_its_own_size_keeps_its_pixels() {
        let pixels = (0..3 * 7 * 5).map(|i| (i * 37 % 256) as u8).collect();
        let picture = Picture { width: 7, height: 5, pixels };
        let mut drawing = Drawing::new(11.0, 9.0);
        drawing.picture(2.0, 3.0, 7.0, 5.0, picture.clone());
        let drawn = drawing.to_picture([11, 9], 1.0).unwrap();
        let row = |image: &Picture, x: usize, y: usize| {
            let start = 3 * (x + image.width * y);
            image.pixels[start..start + 21].to_vec()
        };
        assert!((0..5).all(|y| row(&drawn, 2, 3 + y) == row(&picture, 0, y)));
        assert_eq!(drawn.pixels[..3 * 11 * 3], [255; 3 * 11 * 3]);
        assert!(drawing.to_svg("f", "t", "d").contains("data:image/png;base64,iVBOR"));
    }

    #[test]
    fn rasters_fill_their_place() {
        let mut drawing = Drawing::new(20.0, 10.0);
        let raster = Raster {
            width: 2,
            height: 1,
            pixels: vec![0, 1],
            palette: vec![[255, 0, 0], [0, 0, 255]],
        };
        drawing.raster(0.0, 0.0, 20.0, 10.0, raster);
        let png = drawing.to_png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&png)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        let row = &data[3 * (info.width * (info.height / 2)) as usize..][..3 * info.width as usize];
        assert_eq!(&row[3 * 4..][..3], &[255, 0, 0]);
        assert_eq!(&row[row.len() - 3 * 4..][..3], &[0, 0, 255]);
        assert!(drawing.to_svg("f", "t", "d").contains("data:image/png;base64,iVBOR"));
    }
}
