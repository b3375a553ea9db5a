//! Reduction of curves to the segments and points that are visible.

/// Splits a curve at the points without a position.
pub fn segments(
    points: &[(f64, f64)],
    position: impl Fn((f64, f64)) -> Option<(f64, f64)>,
) -> Vec<Vec<(f64, f64)>> {
    let mut out = vec![Vec::new()];
    for point in points {
        match position(*point) {
            Some(at) => {
                out.last_mut().into_iter().for_each(|segment: &mut Vec<_>| segment.push(at))
            }
            None => out.push(Vec::new()),
        }
    }
    out.retain(|segment| segment.len() > 1);
    out
}

/// Removes points within 0.2 pt of the previous one; the last point stays.
pub fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::with_capacity(points.len());
    for (i, p) in points.iter().enumerate() {
        let far = out.last().is_none_or(|last| (p.0 - last.0).hypot(p.1 - last.1) > 0.2);
        if far || i + 1 == points.len() {
            out.push(*p);
        }
    }
    out
}

/// Reduces a long curve to its visible points: the first, lowest, highest and last one per 0.5 pt
/// of width.
pub fn simplified(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() < 1200 {
        return points.to_vec();
    }
    let mut out: Vec<(f64, f64)> = Vec::new();
    let mut start = 0;
    while start < points.len() {
        let column = (2.0 * points[start].0).floor();
        let length =
            points[start..].iter().take_while(|p| (2.0 * p.0).floor() == column).count().max(1);
        let bucket = &points[start..start + length];
        let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let mut keep = [
            bucket.first(),
            bucket.iter().min_by(by_height),
            bucket.iter().max_by(by_height),
            bucket.last(),
        ]
        .into_iter()
        .flatten()
        .copied()
        .collect::<Vec<_>>();
        keep.sort_by(|a, b| a.0.total_cmp(&b.0));
        keep.dedup();
        out.extend(keep);
        start += length;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_curves_keep_their_peaks() {
        let mut points: Vec<(f64, f64)> = (0..20_000).map(|i| (f64::from(i) * 0.01, 0.0)).collect();
        points[7777].1 = 9.0;
        points[7778].1 = -9.0;
        let kept = simplified(&points);
        assert!(kept.len() < 2000, "{}", kept.len());
        assert!(kept.contains(&points[7777]) && kept.contains(&points[7778]));
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[19_999]));
    }

    #[test]
    fn curves_break_where_nothing_was_measured() {
        let points = [(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 1.0), (4.0, 2.0)];
        let split = segments(&points, |(x, y)| y.is_finite().then_some((x, y)));
        assert_eq!(split, [vec![(0.0, 1.0), (1.0, 2.0)], vec![(3.0, 1.0), (4.0, 2.0)]]);
    }
}
