//! Rank statistics and bootstrap intervals of small samples, without an assumption about the
//! distribution of the values.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::distribution::{Beta, ContinuousCDF, Normal};

use crate::measure::mean;

/// Number of samples of the bootstrap.
const SAMPLES: usize = 2000;
/// Largest number of values whose orders are all counted.
const ENUMERATED: usize = 8;
/// Number of random orders or combinations of signs that replace all of them.
const RANDOM_ORDERS: usize = 100_000;
/// Number of differences up to which the signed-rank test counts all combinations of signs.
const EXACT: usize = 200;

/// Estimate with its 95 % confidence interval and two-sided p value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Number of values or pairs.
    pub n: usize,
    /// Estimate.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// Two-sided p value of the null hypothesis that there is no effect.
    pub p: f64,
}

/// Relative difference below which two values are equal: differences of times that agree to this
/// precision differ by rounding only.
const EQUAL: f64 = 1e-9;

fn equal(a: f64, b: f64) -> bool {
    // Censored observations rank as infinite.
    let size = a.abs().max(b.abs());
    a == b || size.is_finite() && (a - b).abs() <= EQUAL * size
}

/// Returns ranks from 1; equal values share their mean rank.
pub fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut out = vec![0.0; values.len()];
    let mut i = 0;
    while i < order.len() {
        let mut j = i;
        while j + 1 < order.len() && equal(values[order[j + 1]], values[order[i]]) {
            j += 1;
        }
        let rank = 0.5 * (i + j) as f64 + 1.0;
        order[i..=j].iter().for_each(|k| out[*k] = rank);
        i = j + 1;
    }
    out
}

/// Returns the product-moment correlation; none if a sample does not vary.
fn pearson(x: &[f64], y: &[f64]) -> Option<f64> {
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        x.iter().zip(y).map(|(a, b)| f(a - mx, b - my)).sum()
    };
    let (xx, yy, xy) = (sum(&|a, _| a * a), sum(&|_, b| b * b), sum(&|a, b| a * b));
    (xx > 0.0 && yy > 0.0).then(|| (xy / (xx * yy).sqrt()).clamp(-1.0, 1.0))
}

/// Computes Spearman's rank correlation; none below four pairs, or if a sample does not vary.
///
/// The interval is Fisher's z with the standard error of Bonett and Wright (2000). The p value is
/// the share of the orders of `y` with as large a correlation: of all orders up to eight pairs, of
/// 100000 random ones beyond.
pub fn spearman(x: &[f64], y: &[f64]) -> Option<Estimate> {
    let n = x.len();
    if n < 4 || y.len() != n {
        return None;
    }
    let (x, y) = (ranks(x), ranks(y));
    let r = pearson(&x, &y)?;
    let quantile = Normal::standard().inverse_cdf(0.975);
    let half_width = quantile * ((1.0 + 0.5 * r * r) / (n as f64 - 3.0)).sqrt();
    // A perfect correlation has no finite z; the value half way to the next smaller one without
    // ties replaces it.
    let steps = (n * (n * n - 1)) as f64;
    let z = r.clamp(-1.0 + 6.0 / steps, 1.0 - 6.0 / steps).atanh();
    let (low, high) = ((z - half_width).tanh(), (z + half_width).tanh());
    Some(Estimate { n, value: r, low, high, p: order_p(&x, &y) })
}

/// Returns the share of the orders of `y` whose covariance with `x` is as large as in the given
/// order.
fn order_p(x: &[f64], y: &[f64]) -> f64 {
    let middle = 0.5 * (x.len() as f64 + 1.0);
    let covariance = |y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - middle) * y).sum::<f64>().abs();
    // Different covariances of ranks differ by a quarter or more, equal ones by rounding only.
    let least = covariance(y) - 1e-6;
    let mut y = y.to_vec();
    let (mut as_far, mut orders) = (0.0, 0.0);
    let mut count = |y: &[f64]| {
        as_far += f64::from(u8::from(covariance(y) >= least));
        orders += 1.0;
    };
    if y.len() <= ENUMERATED {
        for_all_orders(&mut y, 0, &mut count);
    } else {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
        count(&y.clone());
        for _ in 0..RANDOM_ORDERS {
            y.shuffle(&mut random);
            count(&y);
        }
    }
    as_far / orders
}

/// Calls `visit` with all orders of the values from index `first` on.
fn for_all_orders(values: &mut [f64], first: usize, visit: &mut impl FnMut(&[f64])) {
    if first == values.len() {
        return visit(values);
    }
    for other in first..values.len() {
        values.swap(first, other);
        for_all_orders(values, first + 1, visit);
        values.swap(first, other);
    }
}

/// Fewest paired differences of which an interval reaches 95 %.
pub const FEWEST: usize = 6;

/// Performs Wilcoxon's signed-rank test of paired differences.
///
/// The value is the Hodges-Lehmann estimate, the median of all Walsh averages (pairwise means).
/// The p value is exact given the ties; beyond [`EXACT`] differences p value and interval are those
/// of the normal distribution of the rank sum. None below six differences, because no interval of
/// fewer reaches 95 %; none if a difference is not finite.
pub fn signed_rank(differences: &[f64]) -> Option<Estimate> {
    let n = differences.len();
    if n < FEWEST || !differences.iter().all(|d| d.is_finite()) {
        return None;
    }
    let mut sorted = differences.to_vec();
    sorted.sort_by(f64::total_cmp);
    let averages = n * (n + 1) / 2;
    let untied: Vec<f64> = (1..=n).map(|i| i as f64).collect();
    let cut = critical_value(&untied);
    let nonzero: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
    let sizes: Vec<f64> = nonzero.iter().map(|d| d.abs()).collect();
    let ranks = ranks(&sizes);
    let positive = nonzero.iter().zip(&ranks).filter(|(d, _)| **d > 0.0);
    let statistic: f64 = positive.map(|(_, rank)| rank).sum();
    let average = |k| walsh_average(&sorted, k);
    Some(Estimate {
        n,
        value: 0.5 * (average((averages - 1) / 2) + average(averages / 2)),
        low: average(cut),
        high: average(averages - 1 - cut),
        p: rank_sum_p(&ranks, statistic),
    })
}

/// Returns the Walsh average with `k` smaller ones, by bisection over the floating-point numbers;
/// memory for all averages would grow with the square of the number of differences.
fn walsh_average(sorted: &[f64], k: usize) -> f64 {
    let is_enough = |value: f64| {
        let (mut end, mut count) = (sorted.len(), 0);
        for (i, a) in sorted.iter().enumerate() {
            while end > i && 0.5 * (sorted[end - 1] + a) > value {
                end -= 1;
            }
            count += end.saturating_sub(i);
        }
        count > k
    };
    // Integers in the order of the numbers; the mapping is its own inverse.
    let map = |bits: i64| bits ^ (((bits >> 63) as u64) >> 1) as i64;
    let key = |value: f64| map(value.to_bits() as i64);
    let (mut low, mut high) = (key(sorted[0]), key(sorted[sorted.len() - 1]));
    while low < high {
        let middle = (i128::from(low) + i128::from(high)).div_euclid(2) as i64;
        match is_enough(f64::from_bits(map(middle) as u64)) {
            true => high = middle,
            false => low = middle + 1,
        }
    }
    // No negative zero.
    f64::from_bits(map(high) as u64) + 0.0
}

/// Returns the two-sided p value of a sum of ranks with random signs.
fn rank_sum_p(ranks: &[f64], statistic: f64) -> f64 {
    if ranks.len() > EXACT {
        let variance: f64 = ranks.iter().map(|rank| 0.25 * rank * rank).sum();
        let away = (statistic - 0.5 * ranks.iter().sum::<f64>()).abs() - 0.5;
        return (2.0 * Normal::standard().cdf(-away / variance.sqrt())).min(1.0);
    }
    let counts = rank_sum_counts(ranks);
    let at = (2.0 * statistic).round() as usize;
    let total: f64 = counts.iter().sum();
    let lower: f64 = counts[..=at.min(counts.len() - 1)].iter().sum::<f64>() / total;
    let upper: f64 = counts[at.min(counts.len())..].iter().sum::<f64>() / total;
    (2.0 * lower.min(upper)).min(1.0)
}

/// Returns the two-sided p value of the sum of values whose signs are random: the share of the
/// combinations of signs for which the sum is as far from zero. None below six values.
///
/// It counts all combinations up to 20 values, and draws 100000 of them beyond.
pub fn sign_flip_p(values: &[f64]) -> Option<f64> {
    if values.len() < 6 {
        return None;
    }
    // Sums that differ by rounding only are equal.
    let size: f64 = values.iter().map(|v| v.abs()).sum();
    let least = values.iter().sum::<f64>().abs() - EQUAL * size;
    let as_far = |sums: &[f64]| sums.iter().filter(|sum| sum.abs() >= least).count() as f64;
    if values.len() <= 20 {
        let add = |sums: Vec<f64>, v: &f64| sums.iter().flat_map(|s| [s + v, s - v]).collect();
        let sums = values.iter().fold(vec![0.0], add);
        return Some(as_far(&sums) / sums.len() as f64);
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
    let mut sum = || values.iter().map(|v| if random.random() { *v } else { -v }).sum();
    let sums: Vec<f64> = (0..RANDOM_ORDERS).map(|_| sum()).collect();
    // The observed combination is one of them.
    Some((as_far(&sums) + 1.0) / (sums.len() as f64 + 1.0))
}

/// Counts the sign combinations with each sum of positive ranks, indexed by twice the sum.
fn rank_sum_counts(ranks: &[f64]) -> Vec<f64> {
    let mut counts = vec![1.0];
    for rank in ranks {
        let step = (2.0 * rank).round() as usize;
        let mut next = vec![0.0; counts.len() + step];
        for (sum, count) in counts.iter().enumerate() {
            next[sum] += count;
            next[sum + step] += count;
        }
        counts = next;
    }
    counts
}

/// Number of Walsh averages outside the 95 % interval at each end: the tabulated critical value of
/// the ranks 1 to n.
fn critical_value(ranks: &[f64]) -> usize {
    if ranks.len() > EXACT {
        let deviation = ranks.iter().map(|rank| 0.25 * rank * rank).sum::<f64>().sqrt();
        let quantile = Normal::standard().inverse_cdf(0.025);
        return (0.5 * ranks.iter().sum::<f64>() + quantile * deviation - 0.5) as usize;
    }
    let counts = rank_sum_counts(ranks);
    let total: f64 = counts.iter().sum();
    let mut sum = 0.0;
    let mut cut = 0;
    // Sums of whole ranks have even indices.
    for (i, count) in counts.iter().enumerate().step_by(2) {
        sum += count;
        if sum / total > 0.025 {
            break;
        }
        cut = i / 2;
    }
    cut
}

/// Returns the 95 % interval of the mean over models of the mean over members, by a bootstrap that
/// draws models and numbers of members with replacement. A sample has the same numbers for all
/// models, because members with the same number have the same start.
///
/// Equal arguments give equal results.
pub fn bootstrap_interval(models: &[Vec<f64>]) -> Option<[f64; 2]> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
    let largest = models.iter().map(Vec::len).max().unwrap_or(0);
    let mut sample = || {
        // Numbers of members as parts of their count, since models may have different counts.
        let places: Vec<f64> = (0..largest).map(|_| random.random()).collect();
        let drawn = |members: &Vec<f64>| {
            let place = |at: &f64| members[(at * members.len() as f64) as usize];
            mean(places[..members.len()].iter().map(place))
        };
        let means = (0..models.len()).filter_map(|_| {
            let model = models.get(random.random_range(0..models.len()))?;
            drawn(model)
        });
        mean(means)
    };
    let samples: Vec<f64> = (0..SAMPLES).filter_map(|_| sample()).collect();
    Some([quantile(&samples, 0.025)?, quantile(&samples, 0.975)?])
}

/// Returns the 95 % interval of the mean over models of the share of their members with an event;
/// a member is 1 with the event and 0 without. It is the interval of Clopper and Pearson with
/// models as units and the sum of their shares as the number of events.
pub fn share_interval(models: &[Vec<f64>]) -> Option<[f64; 2]> {
    let n = models.len() as f64;
    let events: f64 = models.iter().filter_map(|m| mean(m.iter().copied())).sum();
    let bound = |a: f64, b: f64, p: f64| Some(Beta::new(a, b).ok()?.inverse_cdf(p));
    let low = if events > 0.0 { bound(events, n - events + 1.0, 0.025)? } else { 0.0 };
    let high = if events < n { bound(events + 1.0, n - events, 0.975)? } else { 1.0 };
    (n > 0.0).then_some([low, high])
}

/// Returns the 95 % interval of the mean over models of the differences of outcomes of their
/// members, each -1, 0 or 1.
///
/// It is that of [`bootstrap_interval`], which has no width if all differences are equal. Then the
/// limit of Clopper and Pearson for the number of models bounds the part of the models with another
/// difference.
pub fn difference_interval(models: &[Vec<f64>]) -> Option<[f64; 2]> {
    let first = *models.iter().flatten().next()?;
    if models.iter().flatten().any(|value| *value != first) {
        return bootstrap_interval(models);
    }
    let other = 1.0 - 0.025_f64.powf(1.0 / models.len() as f64);
    Some([-1.0, 1.0].map(|outcome| first + other * (outcome - first)))
}

/// Returns the median; none of an empty sample.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// Returns the quantile of a sample, linearly interpolated; none of an empty sample.
pub fn quantile(values: &[f64], part: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = part.clamp(0.0, 1.0) * last as f64;
    let low = at.floor() as usize;
    let (part, next) = (at - low as f64, sorted[(low + 1).min(last)]);
    // Without arithmetic where an infinite value would give none.
    Some(if part == 0.0 || next == sorted[low] {
        sorted[low]
    } else {
        sorted[low] + part * (next - sorted[low])
    })
}

/// Tests whether the first of two paired positive samples has the larger relative spread.
///
/// This is the Pitman-Morgan test by ranks on logarithms: the variances are equal if and only if
/// sum and difference are uncorrelated.
pub fn relative_spread_test(first: &[f64], second: &[f64]) -> Option<Estimate> {
    if first.iter().chain(second).any(|v| *v <= 0.0) {
        return None;
    }
    let pairs = first.iter().zip(second).map(|(a, b)| (a.ln(), b.ln()));
    let (sums, differences): (Vec<f64>, Vec<f64>) = pairs.map(|(a, b)| (a + b, a - b)).unzip();
    spearman(&sums, &differences)
}

/// Adjusts p values for their number: rejecting those below a rate keeps the expected share of
/// false rejections below that rate (Benjamini and Hochberg 1995).
pub fn false_discovery_adjusted(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*b].total_cmp(&p[*a]));
    let mut out = vec![1.0; p.len()];
    let mut smallest: f64 = 1.0;
    for (larger, i) in order.into_iter().enumerate() {
        smallest = smallest.min(p[i] * p.len() as f64 / (p.len() - larger) as f64);
        out[i] = smallest;
    }
    out
}

/// Returns the standard deviation divided by the mean.
pub fn coefficient_of_variation(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (values.len() > 1 && mean != 0.0).then(|| (square / (n - 1.0)).sqrt() / mean.abs())
}
