//! Samples of distance and mean distance around the surface of a shape, interpolated for several
//! points at a time.

use grainwake_shape::SampledField;

use grainwake_simd::Vector;

/// Distance that stands for infinity in single precision [m].
pub const INFINITE_DISTANCE: f64 = 1e30;

/// Samples of one shape.
pub struct BandSamples {
    pub distances: SampledField,
    /// Mean distance less distance, in levels of `distances`.
    pub mean_excess: Vec<f32>,
}

/// Distance from a surface, mean distance, and gradient of the distance in the frame of the grain.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceDistance<T> {
    /// Signed distance [m].
    pub distance: T,
    /// Distance averaged over the kernel of the band [m].
    pub mean_distance: T,
    /// Gradient of the distance.
    pub gradient: [T; 3],
}

/// A sampled distance field with its constants in vector registers.
pub struct SampleGrid<'a, V> {
    lower: [V; 3],
    inverse: V,
    /// Index of the last sample along each axis.
    last: [V; 3],
    /// Samples from one row and one plane to the next.
    strides: [V; 2],
    /// Distance per level [m].
    quantum: V,
    /// Gradient per level and spacing.
    slope: V,
    levels: &'a [f32],
    mean_excess: &'a [f32],
}

impl<'a, V: Vector> SampleGrid<'a, V> {
    #[inline(always)]
    pub fn new(samples: &'a BandSamples) -> SampleGrid<'a, V> {
        let field = &samples.distances;
        let (dims, inverse) = (field.dims(), 1.0 / field.spacing());
        let mut lower = [V::constant(0.0); 3];
        let mut last = lower;
        for axis in 0..3 {
            lower[axis] = V::constant(field.lower()[axis]);
            last[axis] = V::constant(dims[axis] as f64 - 1.0);
        }
        let (row, plane) = (dims[0], dims[0] * dims[1]);
        SampleGrid {
            lower,
            inverse: V::constant(inverse),
            last,
            strides: [V::constant(row as f64), V::constant(plane as f64)],
            quantum: V::constant(field.quantum()),
            slope: V::constant(field.quantum() * inverse),
            levels: field.levels(),
            mean_excess: &samples.mean_excess,
        }
    }

    /// Interpolates the samples at `x`, in the frame of the grain. Off the grid the distances are
    /// [`INFINITE_DISTANCE`].
    #[inline(always)]
    pub fn surface_distance(&self, x: [V; 3]) -> SurfaceDistance<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let mut cell = [zero; 3];
        let mut fraction = [zero; 3];
        let mut off_grid = zero;
        for axis in 0..3 {
            let s = (x[axis] - self.lower[axis]) * self.inverse;
            let nearest = s.max(zero).min(self.last[axis]);
            off_grid = off_grid + (s - nearest).abs();
            cell[axis] = nearest.floor().min(self.last[axis] - one);
            fraction[axis] = nearest - cell[axis];
        }
        let [row, plane] = self.strides;
        let [fx, fy, fz] = fraction;
        // Value and slope on the four edges along x.
        let (at, levels) = (cell[0] + row * cell[1] + plane * cell[2], self.levels);
        let [a, s] = edge(levels, at, fx);
        let [b, t] = edge(levels, at + row, fx);
        let [c, u] = edge(levels, at + plane, fx);
        let [d, v] = edge(levels, at + plane + row, fx);
        let (low, high) = (a + fy * (b - a), c + fy * (d - c));
        let (slope_low, slope_high) = (s + fy * (t - s), u + fy * (v - u));
        let gradient = [
            self.slope * (slope_low + fz * (slope_high - slope_low)),
            self.slope * ((b - a) + fz * ((d - c) - (b - a))),
            self.slope * (high - low),
        ];
        let distance = self.quantum * (low + fz * (high - low));
        let excess = self.mean_excess;
        let [[a, _], [b, _]] = [edge(excess, at, fx), edge(excess, at + row, fx)];
        let [[c, _], [d, _]] = [edge(excess, at + plane, fx), edge(excess, at + plane + row, fx)];
        let (low, high) = (a + fy * (b - a), c + fy * (d - c));
        let mean_distance = self.quantum.mul_add(low + fz * (high - low), distance);
        let infinite = V::constant(INFINITE_DISTANCE);
        SurfaceDistance {
            distance: zero.select_below(off_grid, infinite, distance),
            mean_distance: zero.select_below(off_grid, infinite, mean_distance),
            gradient,
        }
    }
}

/// Value at the fraction `x` of the edge from sample `at` to the next along x, and their
/// difference.
#[inline(always)]
fn edge<V: Vector>(levels: &[f32], at: V, x: V) -> [V; 2] {
    let [low, high] = V::gather_pairs(levels, at);
    let slope = high - low;
    [low + x * slope, slope]
}
