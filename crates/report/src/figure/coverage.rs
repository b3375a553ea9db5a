//! Coverage of a picture by outlines, to leave out what they hide.

use grainwake_plot::equal_aspect::Window;

use super::grain_surface::Outline;

/// Cells of a window, each covered or not.
pub struct Coverage {
    low: (f64, f64),
    /// Edge of a cell [m].
    edge: f64,
    across: usize,
    covered: Vec<bool>,
}

impl Coverage {
    /// Uncovered window with cells of this edge [m].
    pub fn new(window: Window, edge: f64) -> Coverage {
        let count = |length: f64| (length / edge).ceil().max(1.0) as usize;
        let (across, up) = (count(window.width()), count(window.height()));
        Coverage { low: window.low, edge, across, covered: vec![false; across * up] }
    }

    /// Returns the cells whose centres lie between two coordinates, along an axis of `count` cells.
    fn range(&self, (from, to): (f64, f64), low: f64, count: usize) -> std::ops::Range<usize> {
        let cell = |x: f64| (((x - low) / self.edge + 0.5).floor().max(0.0) as usize).min(count);
        cell(from)..cell(to).max(cell(from))
    }

    /// Returns the rows whose centres lie between two coordinates, with the coordinate of each.
    fn rows(&self, ends: (f64, f64)) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (low, edge) = (self.low.1, self.edge);
        let rows = self.range(ends, low, self.covered.len() / self.across);
        rows.map(move |row| (row, low + (row as f64 + 0.5) * edge))
    }

    /// Returns whether a circle is covered except for half a cell at its edge, as far as it lies in
    /// the window.
    pub fn hides(&self, (x, y): (f64, f64), radius: f64) -> bool {
        let radius = radius - 0.5 * self.edge;
        self.rows((y - radius, y + radius)).all(|(row, at)| {
            let half = (radius.powi(2) - (at - y).powi(2)).max(0.0).sqrt();
            let columns = self.range((x - half, x + half), self.low.0, self.across);
            let first = row * self.across;
            self.covered[first + columns.start..first + columns.end].iter().all(|covered| *covered)
        })
    }

    /// Covers the cells whose centres lie inside these outlines, and not in their holes.
    pub fn add(&mut self, outlines: &[Outline]) {
        let edges = || {
            let of_ring = |ring: &'_ Outline| {
                let next = ring.iter().cycle().skip(1).copied();
                ring.iter().copied().zip(next).collect::<Vec<_>>()
            };
            outlines.iter().flat_map(of_ring)
        };
        let low = edges().map(|(a, _)| a.1).fold(f64::INFINITY, f64::min);
        let high = edges().map(|(a, _)| a.1).fold(f64::NEG_INFINITY, f64::max);
        for (row, y) in self.rows((low, high)) {
            let crossing = |((x0, y0), (x1, y1)): ((f64, f64), (f64, f64))| {
                ((y0 > y) != (y1 > y)).then(|| x0 + (y - y0) / (y1 - y0) * (x1 - x0))
            };
            let mut crossings: Vec<f64> = edges().filter_map(crossing).collect();
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let columns = self.range((pair[0], pair[1]), self.low.0, self.across);
                let first = row * self.across;
                self.covered[first + columns.start..first + columns.end].fill(true);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_cover_their_area_without_holes() {
        let window = Window { low: (1.0, 2.0), high: (11.0, 10.0) };
        let mut coverage = Coverage::new(window, 0.1);
        let square = |a: f64| {
            vec![(6.0 - a, 6.0 - a), (6.0 + a, 6.0 - a), (6.0 + a, 6.0 + a), (6.0 - a, 6.0 + a)]
        };
        coverage.add(&[square(3.0), square(1.0)]);
        let area = coverage.covered.iter().filter(|covered| **covered).count() as f64 * 0.01;
        assert!((area - 32.0).abs() < 0.5, "{area}");
        assert!(coverage.hides((8.0, 8.0), 0.5) && !coverage.hides((8.0, 8.0), 1.2));
        assert!(!coverage.hides((6.0, 6.0), 0.2) && !coverage.hides((4.5, 6.0), 0.8));
        // Only the part in the window counts.
        coverage.add(&[vec![(-5.0, -5.0), (2.0, -5.0), (2.0, 20.0), (-5.0, 20.0)]]);
        assert!(coverage.hides((0.0, 6.0), 1.8) && coverage.hides((50.0, 6.0), 1.0));
    }
}
