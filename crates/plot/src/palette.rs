//! Palette of few colours for many pictures: median cut over a histogram.

use crate::raster::Picture;

/// Bits per component of a cell of the histogram.
const BITS: u32 = 7;
const CELLS: usize = 1 << (3 * BITS);

/// Histogram of the colours of pictures.
#[derive(Clone)]
pub struct Histogram {
    counts: Vec<u64>,
}

impl Default for Histogram {
    fn default() -> Histogram {
        Histogram { counts: vec![0; CELLS] }
    }
}

/// Colours, and the nearest of them for any colour.
pub struct Palette {
    /// sRGB colours.
    pub colours: Vec<[u8; 3]>,
    nearest: Vec<u8>,
}

/// Cell of a colour.
fn cell(rgb: &[u8]) -> usize {
    rgb.iter().fold(0, |cell, value| cell << BITS | usize::from(*value >> (8 - BITS)))
}

/// Component `axis` of the colour of a cell, 0 to 127.
fn component(cell: usize, axis: usize) -> usize {
    cell >> (BITS as usize * (2 - axis)) & ((1 << BITS) - 1)
}

/// Colour of a cell. The first and the last value are kept, so that white stays white.
fn colour(cell: usize) -> [f64; 3] {
    [0, 1, 2].map(|axis| component(cell, axis) as f64 * 255.0 / ((1 << BITS) - 1) as f64)
}

impl Histogram {
    /// Counts the colours of a picture.
    pub fn add(&mut self, picture: &Picture) {
        for pixel in picture.pixels.chunks_exact(3) {
            self.counts[cell(pixel)] += 1;
        }
    }

    /// Returns a palette of at most `size` colours.
    pub fn palette(&self, size: usize) -> Palette {
        let used: Vec<usize> = (0..CELLS).filter(|cell| self.counts[*cell] > 0).collect();
        let mut boxes = vec![used.clone()];
        while boxes.len() < size {
            let Some(widest) = (0..boxes.len()).max_by_key(|i| self.spread(&boxes[*i])) else {
                break;
            };
            if self.spread(&boxes[widest]) == 0 {
                break;
            }
            let whole = boxes.swap_remove(widest);
            let (low, high) = self.split(whole);
            boxes.push(low);
            boxes.push(high);
        }
        let colours: Vec<[f64; 3]> = boxes.iter().map(|cells| self.mean(cells)).collect();
        let mut nearest = vec![0; CELLS];
        for cell in used {
            let own = colour(cell);
            let distance = |c: &[f64; 3]| (0..3).map(|i| (c[i] - own[i]).powi(2)).sum::<f64>();
            let best = (0..colours.len())
                .min_by(|a, b| distance(&colours[*a]).total_cmp(&distance(&colours[*b])));
            nearest[cell] = best.unwrap_or(0) as u8;
        }
        let rounded = colours.iter().map(|c| c.map(|value| value.round() as u8)).collect();
        Palette { colours: rounded, nearest }
    }

    /// Square of the widest extent of a box, times the root of its number of pixels.
    fn spread(&self, cells: &[usize]) -> u64 {
        let (_, extent) = widest_axis(cells);
        let pixels: u64 = cells.iter().map(|cell| self.counts[*cell]).sum();
        (extent * extent) as u64 * (pixels as f64).sqrt().ceil() as u64
    }

    /// Splits a box across its widest axis, at the median pixel.
    fn split(&self, mut cells: Vec<usize>) -> (Vec<usize>, Vec<usize>) {
        let (axis, _) = widest_axis(&cells);
        cells.sort_by_key(|cell| (component(*cell, axis), *cell));
        let all: u64 = cells.iter().map(|cell| self.counts[*cell]).sum();
        let mut sum = 0;
        let half = cells.iter().position(|cell| {
            sum += self.counts[*cell];
            2 * sum >= all
        });
        // A plane of equal components stays together.
        let value = component(cells[half.unwrap_or(0)], axis);
        let first = component(cells[0], axis);
        let at = if value == first { value + 1 } else { value };
        let high = cells.split_off(cells.partition_point(|cell| component(*cell, axis) < at));
        (cells, high)
    }

    fn mean(&self, cells: &[usize]) -> [f64; 3] {
        let all: f64 = cells.iter().map(|cell| self.counts[*cell] as f64).sum();
        let sum = |axis: usize| {
            let of_cell = |cell: &usize| self.counts[*cell] as f64 * colour(*cell)[axis];
            cells.iter().map(of_cell).sum::<f64>()
        };
        if all > 0.0 { [0, 1, 2].map(|axis| sum(axis) / all) } else { [0.0; 3] }
    }
}

/// Axis of the largest extent of some cells, and that extent.
fn widest_axis(cells: &[usize]) -> (usize, usize) {
    let extent = |axis: usize| {
        let values = || cells.iter().map(|cell| component(*cell, axis));
        values().max().unwrap_or(0) - values().min().unwrap_or(0)
    };
    let axes = [0, 1, 2].map(|axis| (axis, extent(axis)));
    axes.into_iter().max_by_key(|(axis, extent)| (*extent, 2 - axis)).unwrap_or((0, 0))
}

impl Palette {
    /// Returns the nearest colour of each pixel.
    pub fn indices(&self, picture: &Picture) -> Vec<u8> {
        picture.pixels.chunks_exact(3).map(|pixel| self.nearest[cell(pixel)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(pixels: Vec<u8>) -> Picture {
        Picture { width: pixels.len() / 3, height: 1, pixels }
    }

    #[test]
    fn few_colours_are_kept() {
        let shown = picture(vec![255, 255, 255, 0, 0, 0, 200, 0, 0, 255, 255, 255]);
        let mut histogram = Histogram::default();
        histogram.add(&shown);
        let palette = histogram.palette(255);
        assert_eq!(palette.colours.len(), 3);
        let indices = palette.indices(&shown);
        assert_eq!((indices[0], indices[0] == indices[1]), (indices[3], false));
        assert_eq!(palette.colours[usize::from(indices[0])], [255; 3]);
        let red = palette.colours[usize::from(indices[2])];
        assert!(red[0].abs_diff(200) < 4 && red[1] == 0, "{red:?}");
    }

    #[test]
    fn a_gradient_has_no_visible_steps() {
        let ramp = (0..=255u8).flat_map(|v| [v, 255 - v / 2, 128]).collect();
        let shown = picture(ramp);
        let mut histogram = Histogram::default();
        histogram.add(&shown);
        let palette = histogram.palette(255);
        for (pixel, index) in shown.pixels.chunks_exact(3).zip(palette.indices(&shown)) {
            let given = palette.colours[usize::from(index)];
            for axis in 0..3 {
                assert!(given[axis].abs_diff(pixel[axis]) < 6, "{given:?} for {pixel:?}");
            }
        }
    }
}
