//! Statistics of a sampled function y(x).

/// Returns the mean over the interval by the trapezoidal rule; a single sample is its own mean.
pub fn mean(x: &[f64], y: &[f64]) -> Option<f64> {
    match (x.first(), x.last()) {
        (Some(a), Some(b)) if b > a => Some(integral(x, y) / (b - a)),
        _ => y.first().copied(),
    }
}

/// Returns the integral by the trapezoidal rule.
fn integral(x: &[f64], y: &[f64]) -> f64 {
    let pairs = x.windows(2).zip(y.windows(2));
    pairs.map(|(x, y)| 0.5 * (x[1] - x[0]) * (y[0] + y[1])).sum()
}

/// Returns dy/dx at the samples: parabolas through three neighbours, one-sided at the ends.
///
/// None below two samples.
pub fn derivative(x: &[f64], y: &[f64]) -> Option<Vec<f64>> {
    let n = x.len().min(y.len());
    if n < 2 {
        return None;
    }
    let rise = |i: usize| (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    let inner = |i: usize| {
        let (before, after) = (x[i] - x[i - 1], x[i + 1] - x[i]);
        (rise(i - 1) * after + rise(i) * before) / (before + after)
    };
    let at = |i: usize| match i {
        0 => rise(0),
        i if i + 1 == n => rise(n - 2),
        i => inner(i),
    };
    Some((0..n).map(at).collect())
}

/// Returns the linearly interpolated value at `at`; none outside the samples.
pub fn interpolate(x: &[f64], y: &[f64], at: f64) -> Option<f64> {
    let after = x.partition_point(|v| *v < at);
    if x.get(after) == Some(&at) {
        return y.get(after).copied();
    }
    let before = after.checked_sub(1)?;
    let (x1, y1) = (*x.get(after)?, *y.get(after)?);
    let (x0, y0) = (x[before], y[before]);
    Some(y0 + (y1 - y0) * (at - x0) / (x1 - x0))
}

/// Returns the value at `at` of the cubic through four neighbours; none outside the samples.
pub fn interpolate_smooth(x: &[f64], y: &[f64], at: f64) -> Option<f64> {
    let straight = interpolate(x, y, at)?;
    if x.len() < 4 {
        return Some(straight);
    }
    let after = x.partition_point(|v| *v < at);
    let first = after.saturating_sub(2).min(x.len() - 4);
    let stencil = first..first + 4;
    let weight = |j: usize| -> f64 {
        let others = stencil.clone().filter(|k| *k != j);
        others.map(|k| (at - x[k]) / (x[j] - x[k])).product()
    };
    Some(stencil.clone().map(|j| weight(j) * y[j]).sum())
}

/// Returns the zero crossings, and whether each is upwards.
pub fn crossings(x: &[f64], y: &[f64]) -> Vec<(f64, bool)> {
    let mut found = Vec::new();
    for i in 1..x.len().min(y.len()) {
        let (a, b) = (y[i - 1], y[i]);
        if (a < 0.0) != (b < 0.0) {
            found.push((x[i - 1] + (x[i] - x[i - 1]) * a / (a - b), b >= 0.0));
        }
    }
    found
}

/// Returns the frequency of oscillations about the mean, from upward crossings; none below two.
pub fn frequency(x: &[f64], y: &[f64]) -> Option<f64> {
    let middle = mean(x, y)?;
    let shifted: Vec<f64> = y.iter().map(|v| v - middle).collect();
    let ups: Vec<f64> =
        crossings(x, &shifted).into_iter().filter_map(|(at, up)| up.then_some(at)).collect();
    let span = ups.last()? - ups.first()?;
    (ups.len() > 1).then(|| (ups.len() - 1) as f64 / span)
}

/// Returns the slope of the least-squares line and the root-mean-square residual.
pub fn line_fit(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let n = x.len().min(y.len()) as f64;
    if n < 2.0 {
        return None;
    }
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sxx: f64 = x.iter().map(|v| (v - mx).powi(2)).sum();
    let sxy: f64 = x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum();
    let slope = sxy / sxx;
    let residual: f64 = x.iter().zip(y).map(|(a, b)| (b - my - slope * (a - mx)).powi(2)).sum();
    sxx.gt(&0.0).then(|| (slope, (residual / n).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine() -> (Vec<f64>, Vec<f64>) {
        let x: Vec<f64> = (0..2001).map(|i| 0.005 * f64::from(i)).collect();
        let y = x.iter().map(|x| 3.0 + (1.7 * x + 0.3).sin()).collect();
        (x, y)
    }

    #[test]
    fn the_derivative_of_a_parabola_is_exact_inside() {
        let x = [0.0, 0.1, 0.4, 0.5];
        let y = x.map(|x| 3.0 * x * x - x);
        let slope = derivative(&x, &y).unwrap();
        assert!((slope[1] + 0.4).abs() < 1e-12 && (slope[2] - 1.4).abs() < 1e-12);
        assert!(derivative(&x[..1], &y[..1]).is_none());
    }

    #[test]
    fn frequency_and_mean_of_a_sine() {
        let (x, y) = sine();
        let f = frequency(&x, &y).unwrap();
        assert!((f * std::f64::consts::TAU / 1.7 - 1.0).abs() < 2e-3, "{f}");
        assert!((mean(&x, &y).unwrap() - 3.0).abs() < 0.12);
    }

    #[test]
    fn cubic_interpolation_is_exact_for_a_cubic() {
        let x: Vec<f64> = [0.0, 0.7, 1.1, 2.0, 2.5, 3.6].to_vec();
        let f = |x: f64| 2.0 - x + 0.5 * x * x - 0.3 * x * x * x;
        let y: Vec<f64> = x.iter().map(|x| f(*x)).collect();
        for at in [0.0, 0.1, 1.05, 1.9, 2.7, 3.6] {
            let found = interpolate_smooth(&x, &y, at).unwrap();
            assert!((found - f(at)).abs() < 1e-13, "{at}: {found}");
        }
        assert_eq!(interpolate_smooth(&x, &y, 3.7), None);
    }

    #[test]
    fn a_noisy_line_is_fitted() {
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        let sign = |x: f64| if x % 2.0 == 0.0 { 0.1 } else { -0.1 };
        let y: Vec<f64> = x.iter().map(|x| 1.0 + 2.0 * x + sign(*x)).collect();
        let (slope, rms) = line_fit(&x, &y).unwrap();
        assert!((slope - 2.0).abs() < 1e-5, "{slope}");
        assert!((rms - 0.1).abs() < 1e-5, "{rms}");
    }

    #[test]
    fn uneven_samples_are_weighted_by_their_interval() {
        assert_eq!(mean(&[0.0, 1.0, 4.0], &[2.0, 2.0, 4.0]), Some((2.0 + 9.0) / 4.0));
        assert_eq!(interpolate(&[0.0, 1.0, 4.0], &[2.0, 2.0, 4.0], 2.5), Some(3.0));
        assert_eq!(interpolate(&[0.0, 1.0], &[2.0, 2.0], 1.5), None);
        assert_eq!(crossings(&[0.0, 1.0, 2.0], &[-1.0, 1.0, -3.0]), [(0.5, true), (1.25, false)]);
        assert_eq!(frequency(&[0.0, 1.0], &[1.0, 1.0]), None);
    }
}
