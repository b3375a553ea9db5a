//! `grain from-scan --preview`: slices of the image with the labels that would be kept, and those
//! that would be rejected with the reason.

use std::collections::HashMap;
use std::path::Path;

use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::raster::Raster;
use grainwake_plot::scale_bar::ScaleBar;
use grainwake_plot::style::{PAGE, PIXELS_PER_POINT, SMALL, TEXT};
use grainwake_plot::{literal, text};
use grainwake_report::write_file;
use grainwake_shape::scan::{Scan, Volume, Voxels};

use super::refused::{line, trial};
use crate::args::FromScanArgs;
use crate::exit::Exit;
use crate::progress::count;

/// Colours of kept grains, cool; neighbours mostly differ, since a label takes the colour of its
/// number.
const KEPT: [[u8; 3]; 5] =
    [[0, 114, 178], [0, 158, 115], [86, 180, 233], [90, 90, 190], [20, 170, 170]];
/// Colours of rejected labels by reason, warm; further reasons start again.
const REJECTED: [[u8; 3]; 5] =
    [[213, 94, 0], [230, 159, 0], [204, 121, 167], [150, 30, 60], [200, 180, 0]];
/// Grey levels of the image, and levels of each colour.
const GREYS: usize = 64;
const LEVELS: usize = 16;
/// Distance between panels, and the maximum height of a panel [pt].
const GAP: f64 = 10.0;
const TALLEST: f64 = 230.0;
/// Height of a line of text [pt].
const LINE: f64 = 10.5;
/// Height of the line of the scale bar below a panel [pt].
const BAR: f64 = 12.0;
/// Largest length of a scale bar relative to the width of its panel.
const LONGEST: f64 = 0.5;
/// Period of the hatch [pixels]; half of it shows the image.
const HATCH: usize = 14;
/// Minimum size of a region with a number [pt].
const NUMBERED: f64 = 11.0;

/// A slice of the volume: its axes to the right and down, and its position along the third.
struct Slice {
    right: usize,
    down: usize,
    normal: usize,
    at: usize,
}

/// The image with the results of the scan.
struct Image<'a> {
    dims: [usize; 3],
    /// Edge of a voxel [m].
    voxel: f64,
    labels: &'a [u32],
    /// Index of the colour of a label, and whether it is hatched as rejected.
    colours: HashMap<u32, (usize, bool)>,
    /// Grey level of a voxel, 0 to 1.
    grey: Box<dyn Fn(usize) -> f64 + 'a>,
}

/// Draws three slices along z, one along y and one along x, with a legend, of voxels of this edge
/// [m].
pub fn draw(
    picture: &Path,
    args: &FromScanArgs,
    voxel: f64,
    volume: &Volume,
    scan: &Scan,
) -> Result<(), Exit> {
    let Voxels::Labels(labels) = &scan.labels.voxels else {
        return Err(Exit::input("the image has no labels"));
    };
    let kept = scan.grains.iter().filter(|g| g.shape.is_ok());
    let kept = kept.map(|g| (g.label, (g.label as usize % KEPT.len(), false)));
    let rejected = scan.refusals.iter().enumerate().flat_map(|(n, refusal)| {
        refusal.labels.iter().map(move |label| (*label, (rejected_colour(n), true)))
    });
    let dims = volume.dims;
    let colours = kept.chain(rejected).collect();
    let grey = greys(volume, args.threshold.is_some());
    let image = Image { dims, voxel, labels, colours, grey };
    let panels = [(2, 1, 4), (2, 2, 4), (2, 3, 4), (1, 1, 2), (0, 1, 2)].map(|(normal, n, of)| {
        let [right, down] = [[1, 2], [0, 2], [0, 1]][normal];
        Slice { right, down, normal, at: dims[normal] * n / of }
    });
    let legend = legend(args, dims, scan);
    let drawing = page(&image, &panels, &legend);
    let png = drawing.to_png().map_err(Exit::cannot("draw", picture))?;
    write_file(picture, &png).map_err(Exit::cannot("write", picture))
}

/// Returns the grey levels between the 1st and 99th percentile; labels are plain on white.
fn greys<'a>(volume: &'a Volume, grey: bool) -> Box<dyn Fn(usize) -> f64 + 'a> {
    let value = move |n: usize| match &volume.voxels {
        Voxels::Labels(values) => f64::from(values[n]),
        Voxels::Grey(values) => f64::from(values[n]),
    };
    if !grey {
        return Box::new(move |n| if value(n) == 0.0 { 1.0 } else { 0.6 });
    }
    let count = volume.dims.iter().product::<usize>();
    let mut sample: Vec<f64> = (0..count).step_by(count.div_ceil(100_000)).map(value).collect();
    sample.sort_by(f64::total_cmp);
    let (low, high) = (sample[sample.len() / 100], sample[(sample.len() * 99 / 100).max(1) - 1]);
    Box::new(move |n| ((value(n) - low) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0))
}

/// Returns greys, followed by the levels of each colour from black to the colour to white.
fn palette() -> Vec<[u8; 3]> {
    let greys = (0..GREYS).map(|n| [(255 * n / (GREYS - 1)) as u8; 3]);
    let levels = KEPT.into_iter().chain(REJECTED).flat_map(|colour| {
        (0..LEVELS).map(move |n| {
            let level = n as f64 / (LEVELS - 1) as f64;
            // The image remains visible as shades of the colour.
            colour.map(|c| (f64::from(c) * (0.45 + 0.55 * level)) as u8)
        })
    });
    greys.chain(levels).collect()
}

fn shade(colour: usize, grey: f64) -> u8 {
    (GREYS + LEVELS * colour + (grey * (LEVELS - 1) as f64).round() as usize) as u8
}

fn plain(grey: f64) -> u8 {
    (grey * (GREYS - 1) as f64).round() as u8
}

/// Returns the colour index of the labels rejected for the n-th reason.
fn rejected_colour(n: usize) -> usize {
    KEPT.len() + n % REJECTED.len()
}

/// Returns whether a pixel of a hatched region shows the colour.
fn hatched(x: usize, y: usize) -> bool {
    (x + y) % HATCH < HATCH / 2
}

impl Image<'_> {
    fn voxel(&self, slice: &Slice, right: usize, down: usize) -> usize {
        let mut at = [0; 3];
        (at[slice.right], at[slice.down], at[slice.normal]) = (right, down, slice.at);
        at[0] + self.dims[0] * (at[1] + self.dims[1] * at[2])
    }

    /// Draws a slice of `width` x `height` pixels.
    fn raster(&self, slice: &Slice, width: usize, height: usize) -> Raster {
        let (nx, ny) = (self.dims[slice.right], self.dims[slice.down]);
        let label =
            |x: usize, y: usize| self.labels[self.voxel(slice, x * nx / width, y * ny / height)];
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let grey = (self.grey)(self.voxel(slice, x * nx / width, y * ny / height));
                let own = label(x, y);
                let (right, below) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
                let edge = own != label(right, y) || own != label(x, below);
                pixels.push(match self.colours.get(&own) {
                    _ if edge => plain(1.0),
                    Some((colour, false)) => shade(*colour, grey),
                    Some((colour, true)) if hatched(x, y) => shade(*colour, 1.0),
                    _ => plain(grey),
                });
            }
        }
        Raster { width, height, pixels, palette: palette() }
    }

    /// Returns the labels of a slice with middle and extent [voxels].
    fn regions(&self, slice: &Slice) -> Vec<(u32, [f64; 2], usize)> {
        let mut sums: HashMap<u32, [usize; 3]> = HashMap::new();
        for down in 0..self.dims[slice.down] {
            for right in 0..self.dims[slice.right] {
                let label = self.labels[self.voxel(slice, right, down)];
                let sum = sums.entry(label).or_default();
                *sum = [sum[0] + 1, sum[1] + right, sum[2] + down];
            }
        }
        let middle = |[n, x, y]: [usize; 3]| [x, y].map(|s| s as f64 / n as f64 + 0.5);
        let known = sums.into_iter().filter(|(label, _)| *label != 0);
        let mut all: Vec<_> =
            known.map(|(label, sum)| (label, middle(sum), sum[0].isqrt())).collect();
        all.sort_by_key(|(label, ..)| *label);
        all
    }
}

/// A row of the legend: colours, whether they are hatched, and the text.
struct Row {
    colours: Vec<usize>,
    hatch: bool,
    text: String,
}

fn legend(args: &FromScanArgs, dims: [usize; 3], scan: &Scan) -> Vec<Row> {
    let kept = scan.grains.iter().filter(|g| g.shape.is_ok()).count();
    let [nx, ny, nz] = dims;
    let name = args.image.file_name().unwrap_or_default().to_string_lossy();
    let threshold = scan.threshold.map_or(String::new(), |t| format!(", threshold {t:.1}"));
    let title = format!("{name}: {nx} x {ny} x {nz} voxels of {}{threshold}", args.voxel);
    let head = Row { colours: Vec::new(), hatch: false, text: title };
    let kept = Row {
        colours: (0..KEPT.len()).collect(),
        hatch: false,
        text: format!("{} kept", count(kept, "grain")),
    };
    let rejected = scan.refusals.iter().enumerate().flat_map(|(n, refusal)| {
        let colours = vec![rejected_colour(n)];
        let reason = Row { colours, hatch: true, text: line(refusal) };
        let trial = trial(refusal, args.rescue);
        let trial = trial.map(|text| Row { colours: Vec::new(), hatch: false, text });
        std::iter::once(reason).chain(trial)
    });
    [head, kept].into_iter().chain(rejected).collect()
}

/// Arranges the panels in rows of three, with the legend below.
fn page(image: &Image, panels: &[Slice], legend: &[Row]) -> Drawing {
    let widest = (PAGE - 2.0 * GAP) / 3.0;
    let size = |slice: &Slice| {
        let [nx, ny] = [slice.right, slice.down].map(|axis| image.dims[axis] as f64);
        let scale = (widest / nx).min(TALLEST / ny);
        [nx * scale, ny * scale]
    };
    let rows: Vec<&[Slice]> = panels.chunks(3).collect();
    let tall = |row: &[Slice]| row.iter().map(|s| size(s)[1]).fold(0.0, f64::max);
    let body: f64 = rows.iter().map(|row| tall(row) + LINE + BAR + GAP).sum();
    let mut drawing = Drawing::new(PAGE, body + LINE * legend.len() as f64 + GAP);
    let mut top = 0.0;
    for row in rows {
        for (n, slice) in row.iter().enumerate() {
            let left = n as f64 * (widest + GAP);
            panel(&mut drawing, image, slice, [left, top + LINE], size(slice));
        }
        top += tall(row) + LINE + BAR + GAP;
    }
    for (n, row) in legend.iter().enumerate() {
        entry(&mut drawing, row, top + LINE * (n as f64 + 0.5), n == 0);
    }
    drawing
}

/// Draws a slice with its position, the numbers of its larger labels and a scale bar.
fn panel(
    drawing: &mut Drawing,
    image: &Image,
    slice: &Slice,
    [left, top]: [f64; 2],
    [width, height]: [f64; 2],
) {
    let axes = ["x", "y", "z"];
    let [right, down, normal] = [slice.right, slice.down, slice.normal].map(|axis| axes[axis]);
    let title = format!("*{normal}* = {} ({right} right, {down} down)", slice.at);
    drawing.text((left, top - 3.0), Anchor::Start, &title);
    let [across, along] = [width, height].map(|s| ((s * PIXELS_PER_POINT) as usize).max(1));
    drawing.raster(left, top, width, height, image.raster(slice, across, along));
    drawing.outline(left, top, width, height);
    let scale = width / image.dims[slice.right] as f64;
    let bar = ScaleBar::within(LONGEST * width / scale * image.voxel);
    // The ends of the bar are within the panel.
    let place = (left + 0.5, top + height + 0.5 * BAR + 1.0);
    bar.draw(drawing, place, scale / image.voxel, SMALL);
    for (label, [x, y], extent) in image.regions(slice) {
        if extent as f64 * scale > NUMBERED {
            let at = (left + scale * x, top + scale * y + 0.36 * SMALL);
            drawing.note_with_halo(at, Anchor::Middle, "#000000", &label.to_string());
        }
    }
}

/// Draws a row of the legend at this height; the first is a title.
fn entry(drawing: &mut Drawing, row: &Row, middle: f64, title: bool) {
    let swatch = 8.0;
    let side = (swatch * PIXELS_PER_POINT) as usize;
    for (n, colour) in row.colours.iter().enumerate() {
        let at = |n: usize| {
            if row.hatch && !hatched(n % side, n / side) { plain(0.8) } else { shade(*colour, 0.8) }
        };
        let pixels = (0..side * side).map(at).collect();
        let raster = Raster { width: side, height: side, pixels, palette: palette() };
        drawing.raster((swatch + 2.0) * n as f64, middle - 0.5 * swatch, swatch, swatch, raster);
    }
    let size = if title { TEXT } else { SMALL };
    let indent = match (title, row.colours.len()) {
        (true, _) => 0.0,
        (false, 0) => swatch + 4.0,
        (false, n) => (swatch + 2.0) * n as f64 + 2.0,
    };
    let mut label = row.text.trim().to_owned();
    while text::width(&literal(&label), size) > PAGE - indent && label.pop().is_some() {}
    let base = (indent, middle + 0.36 * size);
    drawing.label(base, Anchor::Start, size, "#222222", &literal(&label));
}
