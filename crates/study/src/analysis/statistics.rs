//! Statistics of small observations by ranks: no assumption on how values are spread.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// An estimate with its 95 % confidence interval and two-sided p value.
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
    /// Probability of a result at least as far from zero if there were no effect.
    pub p: f64,
}

/// Ranks from 1; equal values share the mean of their ranks.
pub fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut out = vec![0.0; values.len()];
    let mut i = 0;
    while i < order.len() {
        let mut j = i;
        while j + 1 < order.len() && values[order[j + 1]] == values[order[i]] {
            j += 1;
        }
        let rank = 0.5 * (i + j) as f64 + 1.0;
        order[i..=j].iter().for_each(|k| out[*k] = rank);
        i = j + 1;
    }
    out
}

/// Product-moment correlation; none if a side does not vary.
fn pearson(x: &[f64], y: &[f64]) -> Option<f64> {
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        x.iter().zip(y).map(|(a, b)| f(a - mx, b - my)).sum()
    };
    let (xx, yy, xy) = (sum(&|a, _| a * a), sum(&|_, b| b * b), sum(&|a, b| a * b));
    (xx > 0.0 && yy > 0.0).then(|| (xy / (xx * yy).sqrt()).clamp(-1.0, 1.0))
}

/// Spearman's rank correlation. The interval is Fisher's z with the standard error of Bonett and
/// Wright (2000), the p value that of Student's t with n - 2 degrees of freedom. None below four
/// pairs, or if a side does not vary.
pub fn spearman(x: &[f64], y: &[f64]) -> Option<Estimate> {
    let n = x.len();
    if n < 4 || y.len() != n {
        return None;
    }
    let r = pearson(&ranks(x), &ranks(y))?;
    let reach = normal_quantile(0.975) * ((1.0 + 0.5 * r * r) / (n as f64 - 3.0)).sqrt();
    // A perfect order has no finite z; the next best possible one stands for it.
    let steps = (n * (n * n - 1)) as f64;
    let z = r.clamp(-1.0 + 6.0 / steps, 1.0 - 6.0 / steps).atanh();
    let freedom = n as f64 - 2.0;
    let p = match StudentsT::new(0.0, 1.0, freedom) {
        Ok(t) if r.abs() < 1.0 => 2.0 * t.sf(r.abs() * (freedom / (1.0 - r * r)).sqrt()),
        _ => 0.0,
    };
    Some(Estimate {
        n,
        value: r,
        low: (z - reach).tanh(),
        high: (z + reach).tanh(),
        p,
    })
}

/// Wilcoxon's signed-rank test of paired differences: their Hodges-Lehmann estimate (the median of
/// all means of two), its interval, and the exact p value given the ties. None below six
/// differences: no interval of fewer reaches 95 %.
pub fn signed_rank(differences: &[f64]) -> Option<Estimate> {
    let n = differences.len();
    if n < 6 {
        return None;
    }
    let mut means: Vec<f64> = Vec::with_capacity(n * (n + 1) / 2);
    for i in 0..n {
        means.extend(differences[i..].iter().map(|d| 0.5 * (d + differences[i])));
    }
    means.sort_by(f64::total_cmp);
    let plain: Vec<f64> = (1..=n).map(|i| i as f64).collect();
    let cut = critical(&distribution(&plain));
    let other: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
    let sizes: Vec<f64> = other.iter().map(|d| d.abs()).collect();
    let ranked = ranks(&sizes);
    let positive: f64 = other
        .iter()
        .zip(&ranked)
        .filter(|(d, _)| **d > 0.0)
        .map(|(_, r)| r)
        .sum();
    let law = distribution(&ranked);
    let at = (2.0 * positive).round() as usize;
    let total: f64 = law.iter().sum();
    let below: f64 = law[..=at.min(law.len() - 1)].iter().sum::<f64>() / total;
    let above: f64 = law[at.min(law.len())..].iter().sum::<f64>() / total;
    Some(Estimate {
        n,
        value: median(&means)?,
        low: means[cut],
        high: means[means.len() - 1 - cut],
        p: (2.0 * below.min(above)).min(1.0),
    })
}

/// How many of all signs give each sum of positive ranks, by twice the sum.
fn distribution(ranks: &[f64]) -> Vec<f64> {
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

/// Number of means of two to leave out at each end for 95 %: the tables' critical value.
fn critical(law: &[f64]) -> usize {
    let total: f64 = law.iter().sum();
    let mut sum = 0.0;
    let mut cut = 0;
    // Sums of whole ranks stand at even places.
    for (i, count) in law.iter().enumerate().step_by(2) {
        sum += count;
        if sum / total > 0.025 {
            break;
        }
        cut = i / 2;
    }
    cut
}

/// Median; none of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The value below which a part of the sorted values lies, between values in proportion.
pub fn quantile(values: &[f64], part: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = part.clamp(0.0, 1.0) * last as f64;
    let low = at.floor() as usize;
    let high = (low + 1).min(last);
    Some(sorted[low] + (at - low as f64) * (sorted[high] - sorted[low]))
}

/// Of two paired observations of positive values: whether the first is spread more widely, relative to
/// its size. The Pitman-Morgan test by ranks on logarithms: the spreads are equal if and only if
/// sum and difference are uncorrelated.
pub fn relative_spread_test(first: &[f64], second: &[f64]) -> Option<Estimate> {
    if first.iter().chain(second).any(|v| *v <= 0.0) {
        return None;
    }
    let pairs = || first.iter().zip(second).map(|(a, b)| (a.ln(), b.ln()));
    let sums: Vec<f64> = pairs().map(|(a, b)| a + b).collect();
    let differences: Vec<f64> = pairs().map(|(a, b)| a - b).collect();
    spearman(&sums, &differences)
}

/// Standard deviation over mean.
pub fn coefficient_of_variation(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (values.len() > 1 && mean != 0.0).then(|| (square / (n - 1.0)).sqrt() / mean.abs())
}

fn normal_quantile(p: f64) -> f64 {
    Normal::new(0.0, 1.0).map_or(1.96, |normal| normal.inverse_cdf(p))
}
