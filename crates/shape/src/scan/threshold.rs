//! Segmentation of grey values: thresholds and the median filter.

use rayon::prelude::*;

/// Threshold between solid and void in a grey image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold {
    /// Values of at least this grey value are solid.
    Value(f64),
    /// Otsu's threshold between two classes (Otsu 1979).
    Otsu,
    /// The upper of Otsu's two thresholds between three classes (Liao and others 2001): for images
    /// of solid, an intermediate phase such as resin, and void.
    Otsu3,
}

const BINS: usize = 1024;
const BINS3: usize = 256;

impl Threshold {
    /// Returns the grey value of the threshold, or `None` if all values are equal. The value
    /// `except` is ignored.
    pub(crate) fn of(self, values: &[f32], except: Option<f32>) -> Option<f64> {
        match self {
            Threshold::Value(v) => Some(v),
            Threshold::Otsu => otsu(values, except),
            Threshold::Otsu3 => otsu3(values, except),
        }
    }
}

/// Returns counts by bin, the lowest value and the bin width, without the value `except`.
fn histogram(values: &[f32], except: Option<f32>, bins: usize) -> Option<(Vec<f64>, f64, f64)> {
    let start = || (f32::INFINITY, f32::NEG_INFINITY);
    let counts = |v: &f32| Some(*v) != except;
    let used = values.par_iter().filter(|v| counts(v));
    let (low, high) = used.map(|v| (*v, *v)).reduce(start, |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let (low, high) = (f64::from(low), f64::from(high));
    let width = (high - low) / bins as f64;
    if width.is_nan() || width <= 0.0 {
        return None;
    }
    let mut bars = vec![0.0; bins];
    for v in values.iter().filter(|v| counts(v)) {
        bars[(((f64::from(*v) - low) / width) as usize).min(bins - 1)] += 1.0;
    }
    Some((bars, low, width))
}

/// Returns cumulative sums of counts and of counts times bin index.
fn sums(counts: &[f64]) -> Vec<(f64, f64)> {
    let mut sum = (0.0, 0.0);
    let mut out = vec![sum];
    for (bin, count) in counts.iter().enumerate() {
        sum = (sum.0 + count, sum.1 + count * (bin as f64 + 0.5));
        out.push(sum);
    }
    out
}

/// Returns the between-class variance (up to constants) of the bins from `a` to `b`.
fn share(sums: &[(f64, f64)], a: usize, b: usize) -> f64 {
    let (count, moment) = (sums[b].0 - sums[a].0, sums[b].1 - sums[a].1);
    if count > 0.0 { moment * moment / count } else { 0.0 }
}

fn otsu(values: &[f32], except: Option<f32>) -> Option<f64> {
    let (counts, low, width) = histogram(values, except, BINS)?;
    let sums = sums(&counts);
    let score = |b: usize| share(&sums, 0, b) + share(&sums, b, BINS);
    // All thresholds in an empty interval between the classes are equivalent; its middle is
    // returned.
    let best = (1..BINS).map(score).fold(0.0, f64::max);
    let good: Vec<usize> = (1..BINS).filter(|b| score(*b) >= best * (1.0 - 1e-12)).collect();
    let middle = 0.5 * (good[0] + good[good.len() - 1]) as f64;
    Some(low + width * middle)
}

fn otsu3(values: &[f32], except: Option<f32>) -> Option<f64> {
    let (counts, low, width) = histogram(values, except, BINS3)?;
    let sums = sums(&counts);
    let mut best = (0.0, 1);
    for a in 1..BINS3 {
        for b in a + 1..BINS3 {
            let score = share(&sums, 0, a) + share(&sums, a, b) + share(&sums, b, BINS3);
            if score > best.0 {
                best = (score, b);
            }
        }
    }
    Some(low + width * best.1 as f64)
}

/// Returns the median of the 3 x 3 x 3 voxels around each voxel; border values are continued
/// outwards.
pub(crate) fn median(values: &[f32], dims: [usize; 3]) -> Vec<f32> {
    let [nx, ny, nz] = dims;
    let mut out = vec![0.0f32; values.len()];
    out.par_chunks_mut(nx).enumerate().for_each(|(row, line)| {
        let (j, k) = (row % ny, row / ny);
        let around = |n: usize, last: usize| [n.saturating_sub(1), n, (n + 1).min(last)];
        let rows: Vec<&[f32]> = around(k, nz - 1)
            .into_iter()
            .flat_map(|c| around(j, ny - 1).map(|b| &values[nx * (b + ny * c)..][..nx]))
            .collect();
        for (i, out) in line.iter_mut().enumerate() {
            let columns = around(i, nx - 1);
            let mut window = [0.0f32; 27];
            for (slot, value) in
                window.iter_mut().zip(rows.iter().flat_map(|r| columns.map(|a| r[a])))
            {
                *slot = value;
            }
            *out = *window.select_nth_unstable_by(13, f32::total_cmp).1;
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use rand::{RngExt, SeedableRng};

    /// Classes with these grey values and counts, with normal noise.
    fn classes(greys: &[(f32, usize)], noise: f64) -> Vec<f32> {
        let mut random = Random::seed_from_u64(3);
        let mut values = Vec::new();
        for (grey, count) in greys {
            for _ in 0..*count {
                let sum: f64 = (0..12).map(|_| random.random::<f64>()).sum();
                values.push(grey + (noise * (sum - 6.0)) as f32);
            }
        }
        values
    }

    #[test]
    fn thresholds_fall_between_the_classes() {
        let two = classes(&[(10.0, 6000), (60.0, 3000)], 5.0);
        let found = Threshold::Otsu.of(&two, None).unwrap();
        assert!((25.0..45.0).contains(&found), "{found}");
        let three = classes(&[(10.0, 6000), (35.0, 3000), (80.0, 3000)], 4.0);
        let found = Threshold::Otsu3.of(&three, None).unwrap();
        assert!((47.0..68.0).contains(&found), "{found}");
        // A binary image: midway.
        let binary = Threshold::Otsu.of(&[0.0, 0.0, 200.0, 200.0, 0.0], None).unwrap();
        assert!((binary - 100.0).abs() < 1.0, "{binary}");
        assert_eq!(Threshold::Otsu.of(&[7.0; 50], None), None);
        assert_eq!(Threshold::Otsu.of(&[0.0, 0.0, 7.0, 7.0], Some(0.0)), None);
    }

    #[test]
    fn the_median_takes_single_voxels_out_and_leaves_a_plane() {
        let dims = [9, 8, 7];
        let mut values: Vec<f32> = (0..504).map(|n| if n % 9 < 4 { 0.0 } else { 1.0 }).collect();
        let plane = values.clone();
        values[4 + 9 * (4 + 8 * 3)] = 50.0;
        values[2 + 9 * (2 + 8 * 2)] = -50.0;
        assert_eq!(median(&values, dims), plane);
    }
}
