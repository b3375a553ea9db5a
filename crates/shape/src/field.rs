//! A signed distance sampled on a regular grid.

use crate::distance::{Distance, EVERYWHERE};
use crate::error::{Defect, Result, ShapeError, within};
use crate::grid::{self, coordinates, place};
use glam::DVec3;
use rayon::prelude::*;

/// Maximum number of samples of a field.
pub(crate) const MAX_SAMPLES: u64 = 1 << 26;

/// Distance from the surface up to which mesh distances are exact [cells]: the surface, the volume
/// and the normals depend on samples in this band only.
const BAND: f64 = 2.5;

/// Levels between zero and the largest magnitude: a power of two below 2^24, so that single
/// precision represents every level exactly.
const LEVELS: f64 = (1u32 << 17) as f64;

/// Signed distance on a regular grid in the principal frame, interpolated trilinearly.
///
/// Values are integer levels times `quantum` (a few millionths of the size of the shape). Files are
/// therefore exact, and a scaled copy has the same levels.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledField {
    lower: DVec3,
    spacing: f64,
    inverse_spacing: f64,
    dims: [usize; 3],
    /// Index of the last sample along each axis.
    last: DVec3,
    quantum: f64,
    levels: Vec<f32>,
}

/// Name of the number of samples in errors.
pub(crate) const SAMPLES: &str = "samples of the distance field";

/// Refuses a number of samples above the maximum.
fn affordable(samples: f64) -> Result<()> {
    let reason = "too many; ask for fewer cells across the grain";
    within(SAMPLES, samples, 0.0..=MAX_SAMPLES as f64, reason)
}

/// The cell that contains a point, with the position of the point in it.
struct Place {
    cell: [usize; 3],
    index: usize,
    fraction: DVec3,
}

impl SampledField {
    /// Samples `distance` on a grid that covers the box with a margin of `margin` [m] on all sides.
    pub(crate) fn sample(
        distance: &impl Distance,
        lower: DVec3,
        upper: DVec3,
        spacing: f64,
        margin: f64,
    ) -> Result<SampledField> {
        let size = upper - lower + DVec3::splat(2.0 * margin);
        let cells = (size / spacing).ceil().max(DVec3::splat(2.0));
        affordable((cells.x + 1.0) * (cells.y + 1.0) * (cells.z + 1.0))?;
        // One additional layer on all sides for the second differences.
        let wide = [cells.x, cells.y, cells.z].map(|n| n as usize + 3);
        let dims = wide.map(|n| n - 2);
        let origin = 0.5 * (lower + upper) - 0.5 * spacing * cells;
        let first = origin - DVec3::splat(spacing);
        let values = distance.on_grid(first, spacing, wide, BAND, EVERYWHERE);
        let values = unbiased(&values, wide, spacing);
        Self::quantise(origin, spacing, dims, &values)
    }

    /// Returns a larger field with the same samples, extended by `distance` so that it covers the
    /// box with a margin of `margin` [m] on all sides.
    pub(crate) fn extended(
        &self,
        distance: impl Fn(DVec3) -> f64 + Sync,
        lower: DVec3,
        upper: DVec3,
        margin: f64,
    ) -> Result<SampledField> {
        let more = |missing: DVec3| {
            let layers = ((missing + margin) * self.inverse_spacing).ceil();
            layers.max(DVec3::ZERO).to_array()
        };
        let (below, above) = (more(self.lower - lower), more(upper - self.upper()));
        let wide = [0, 1, 2].map(|axis| below[axis] + self.dims[axis] as f64 + above[axis]);
        affordable(wide.iter().product())?;
        let (dims, below) = (wide.map(|n| n as usize), below.map(|n| n as usize));
        let origin = self.lower - self.spacing * coordinates(below);
        let level = |at: [usize; 3]| {
            let [i, j, k] = [0, 1, 2].map(|axis| at[axis].wrapping_sub(below[axis]));
            if i < self.dims[0] && j < self.dims[1] && k < self.dims[2] {
                return self.levels[self.index(i, j, k)];
            }
            let x = origin + self.spacing * coordinates(at);
            (distance(x) / self.quantum).round() as f32
        };
        let count = dims.iter().product::<usize>();
        let levels = (0..count).into_par_iter().map(|n| level(place(dims, n)));
        let (levels, spacing, quantum) = (levels.collect(), self.spacing, self.quantum);
        Ok(Self::from_levels(origin, spacing, dims, quantum, levels))
    }

    fn quantise(
        lower: DVec3,
        spacing: f64,
        dims: [usize; 3],
        values: &[f64],
    ) -> Result<SampledField> {
        let largest =
            values.iter().fold(0.0f64, |m, v| if v.is_nan() { *v } else { m.max(v.abs()) });
        if !(largest.is_finite() && largest > 0.0) {
            return Err(ShapeError::quality(Defect::Empty, "a sampled distance is not finite"));
        }
        let quantum = (largest / LEVELS).log2().ceil().exp2();
        let levels = values.iter().map(|v| (v / quantum).round() as f32).collect();
        Ok(Self::from_levels(lower, spacing, dims, quantum, levels))
    }

    pub(crate) fn from_levels(
        lower: DVec3,
        spacing: f64,
        dims: [usize; 3],
        quantum: f64,
        levels: Vec<f32>,
    ) -> SampledField {
        SampledField {
            lower,
            spacing,
            inverse_spacing: 1.0 / spacing,
            dims,
            last: coordinates(dims.map(|n| n - 1)),
            quantum,
            levels,
        }
    }

    /// Distance between neighbouring samples [m].
    pub fn spacing(&self) -> f64 {
        self.spacing
    }
    /// Samples along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }
    /// Position of the first sample [m].
    pub fn lower(&self) -> DVec3 {
        self.lower
    }
    /// Position of the last sample [m].
    pub fn upper(&self) -> DVec3 {
        self.lower + self.spacing * self.last
    }
    /// Increment of the stored values [m].
    pub fn quantum(&self) -> f64 {
        self.quantum
    }
    /// Stored integer levels, x fastest; the distance is `quantum` times the level.
    pub fn levels(&self) -> &[f32] {
        &self.levels
    }
    /// Mutable view of the levels.
    pub(crate) fn levels_mut(&mut self) -> &mut [f32] {
        &mut self.levels
    }
    /// Index of sample (i, j, k) in [`levels`](Self::levels).
    pub(crate) fn index(&self, i: usize, j: usize, k: usize) -> usize {
        grid::index(self.dims, [i, j, k])
    }

    pub(crate) fn shifted(mut self, by: DVec3) -> SampledField {
        self.lower += by;
        self
    }

    pub(crate) fn scaled(&self, factor: f64) -> SampledField {
        let (lower, spacing) = (self.lower * factor, self.spacing * factor);
        let (quantum, levels) = (self.quantum * factor, self.levels.clone());
        Self::from_levels(lower, spacing, self.dims, quantum, levels)
    }

    /// Returns the signed distance [m] at `x`.
    #[inline]
    pub fn distance(&self, x: DVec3) -> f64 {
        match self.locate(x) {
            Some(place) => self.interpolate(&place),
            None => self.beyond(x).0,
        }
    }

    /// Returns signed distance [m] and gradient at `x`, or `None` off the grid.
    #[inline]
    pub fn distance_and_gradient_on_grid(&self, x: DVec3) -> Option<(f64, DVec3)> {
        let place = self.locate(x)?;
        Some(self.interpolate_with_gradient(&place))
    }

    /// Returns the signed distance [m] at `x` if it is at most `limit`; a larger distance may be
    /// returned as infinity. Points clearly farther than `limit` are rejected cheaply off the grid.
    #[inline]
    pub fn distance_within(&self, x: DVec3, limit: f64) -> f64 {
        match self.locate(x) {
            Some(place) => self.interpolate(&place),
            None if self.is_farther(x, limit) => f64::INFINITY,
            None => self.beyond(x).0,
        }
    }

    /// Returns whether `x`, off the grid, is farther than `limit`, by the distance at the nearest
    /// border point: the body lies beyond the plane through that point normal to the line to `x`. A
    /// conservative test: `false` does not imply that `x` is nearer.
    fn is_farther(&self, x: DVec3, limit: f64) -> bool {
        let border = x.clamp(self.lower, self.upper());
        let away = (x - border).length_squared();
        let limit = limit * limit;
        if away > limit {
            return true;
        }
        let place = self.place((border - self.lower) * self.inverse_spacing);
        // One spacing less, as a bound of the interpolation error.
        let from_border = (self.interpolate(&place) - self.spacing).max(0.0);
        away + from_border * from_border > limit
    }

    /// Returns signed distance [m] and gradient at `x`.
    #[inline]
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        self.distance_and_gradient_on_grid(x).unwrap_or_else(|| self.beyond(x))
    }

    /// Returns the cell around `x`, or `None` if `x` lies off the grid (or is NaN).
    #[inline(always)]
    fn locate(&self, x: DVec3) -> Option<Place> {
        let s = (x - self.lower) * self.inverse_spacing;
        if s.cmpge(DVec3::ZERO).all() && s.cmple(self.last).all() {
            Some(self.place(s))
        } else {
            None
        }
    }

    /// Returns the cell at `s`, a position on the grid in spacings from the first sample.
    #[inline(always)]
    fn place(&self, s: DVec3) -> Place {
        // Conversion via i32 takes one instruction each way; the number of samples along an axis
        // fits.
        let cell = |axis: usize| (s[axis] as i32).clamp(0, self.dims[axis] as i32 - 2);
        let [i, j, k] = [cell(0), cell(1), cell(2)];
        let fraction = s - DVec3::new(f64::from(i), f64::from(j), f64::from(k));
        let cell = [i as usize, j as usize, k as usize];
        Place { cell, index: self.index(cell[0], cell[1], cell[2]), fraction }
    }

    /// Returns the two levels along x at each of the four cell edges parallel to x.
    #[inline(always)]
    fn corners(&self, index: usize) -> [[f64; 2]; 4] {
        let nx = self.dims[0];
        let pair = |at: usize| {
            let p = &self.levels[at..at + 2];
            [f64::from(p[0]), f64::from(p[1])]
        };
        let above = index + nx * self.dims[1];
        [pair(index), pair(index + nx), pair(above), pair(above + nx)]
    }

    #[inline(always)]
    fn interpolate(&self, place: &Place) -> f64 {
        let f = place.fraction;
        let [a, b, c, d] = self.corners(place.index).map(|p| p[0] + f.x * (p[1] - p[0]));
        let low = a + f.y * (b - a);
        let high = c + f.y * (d - c);
        self.quantum * (low + f.z * (high - low))
    }

    #[inline(always)]
    fn interpolate_with_gradient(&self, place: &Place) -> (f64, DVec3) {
        let f = place.fraction;
        let corners = self.corners(place.index);
        let slope = corners.map(|p| p[1] - p[0]);
        let mut value = [0.0; 4];
        for n in 0..4 {
            value[n] = corners[n][0] + f.x * slope[n];
        }
        let [a, b, c, d] = value;
        let low = a + f.y * (b - a);
        let high = c + f.y * (d - c);
        let slope_low = slope[0] + f.y * (slope[1] - slope[0]);
        let slope_high = slope[2] + f.y * (slope[3] - slope[2]);
        let gradient = DVec3::new(
            slope_low + f.z * (slope_high - slope_low),
            (b - a) + f.z * ((d - c) - (b - a)),
            high - low,
        );
        let distance = self.quantum * (low + f.z * (high - low));
        (distance, gradient * (self.quantum * self.inverse_spacing))
    }

    /// Returns distance and direction off the grid. The distance refers to the surface point below
    /// the point where the straight line from that surface point to `x` leaves the grid, found in
    /// three iterations. It is continuous, equals the sampled value on the border of the grid, is
    /// never below the true distance except for the interpolation error, and exceeds it by less
    /// than 1 percent.
    #[cold]
    fn beyond(&self, x: DVec3) -> (f64, DVec3) {
        let (lower, upper) = (self.lower, self.upper());
        let mut foot = self.foot(x.clamp(lower, upper));
        for _ in 0..2 {
            foot = self.foot(leave(foot.clamp(lower, upper), x, lower, upper));
        }
        let reach = x - foot;
        let distance = reach.length();
        (distance, reach / distance)
    }

    /// Returns the surface point nearest to `x`, a point on the border of the grid.
    fn foot(&self, x: DVec3) -> DVec3 {
        let place = self.place((x - self.lower) * self.inverse_spacing);
        x - self.interpolate(&place) * self.smooth_normal(&place)
    }

    /// Interpolates the normal from central differences at the samples; unlike the gradient of the
    /// trilinear interpolant it is continuous.
    fn smooth_normal(&self, place: &Place) -> DVec3 {
        let f = place.fraction;
        let low = DVec3::ONE - f;
        let strides = [1, self.dims[0], self.dims[0] * self.dims[1]];
        let mut sum = DVec3::ZERO;
        for corner in 0..8usize {
            let up = [corner & 1, corner >> 1 & 1, corner >> 2];
            let index = place.index + up[0] + up[1] * strides[1] + up[2] * strides[2];
            let weight = [low.x, f.x][up[0]] * [low.y, f.y][up[1]] * [low.z, f.z][up[2]];
            let slope = |axis: usize| {
                let n = place.cell[axis] + up[axis];
                let (below, above) = (n > 0, n + 1 < self.dims[axis]);
                let a = self.levels[index - usize::from(below) * strides[axis]];
                let b = self.levels[index + usize::from(above) * strides[axis]];
                // One-sided on the border, where the step is half as long.
                f64::from(b - a) * if below && above { 0.5 } else { 1.0 }
            };
            sum += weight * DVec3::new(slope(0), slope(1), slope(2));
        }
        sum.normalize_or_zero()
    }
}

/// Returns samples with an unbiased trilinear interpolant; drops the outermost layer. Interpolating
/// the original samples overestimates by h^2/12 times the Laplacian, which shrinks convex bodies by
/// 0.1 percent or more. The correction is reduced where the field bends within a few cells: second
/// differences near a crease are meaningless.
fn unbiased(values: &[f64], wide: [usize; 3], spacing: f64) -> Vec<f64> {
    let [nx, ny, nz] = wide;
    let strides = [1, nx, nx * ny];
    let mut out = Vec::with_capacity((nx - 2) * (ny - 2) * (nz - 2));
    for k in 1..nz - 1 {
        for j in 1..ny - 1 {
            for i in 1..nx - 1 {
                let at = i + nx * (j + ny * k);
                let differences: f64 = strides
                    .iter()
                    .map(|s| values[at + s] - 2.0 * values[at] + values[at - s])
                    .sum();
                let bend = differences.abs() / spacing;
                let trust = (2.0 - 2.0 * bend).clamp(0.0, 1.0);
                out.push(values[at] - trust * differences / 12.0);
            }
        }
    }
    out
}

/// Returns the point where the line from `inside` towards `x` leaves the box.
fn leave(inside: DVec3, x: DVec3, lower: DVec3, upper: DVec3) -> DVec3 {
    let reach = x - inside;
    let mut t: f64 = 1.0;
    for axis in 0..3 {
        if x[axis] > upper[axis] {
            t = t.min((upper[axis] - inside[axis]) / reach[axis]);
        } else if x[axis] < lower[axis] {
            t = t.min((lower[axis] - inside[axis]) / reach[axis]);
        }
    }
    (inside + t.max(0.0) * reach).clamp(lower, upper)
}

#[cfg(test)]
mod tests;
