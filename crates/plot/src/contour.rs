//! Contour lines of values on a grid (marching squares), joined into closed loops.

use std::collections::HashMap;

/// Returns the closed contours at `level` of values on an `nx` by `ny` grid, in grid coordinates
/// (the first value lies at (0, 0)). Points outside the grid are below the level, so that all
/// contours close.
pub fn closed_contours(
    nx: usize,
    ny: usize,
    value: impl Fn(usize, usize) -> f64,
    level: f64,
) -> Vec<Vec<(f64, f64)>> {
    // A layer of outside values surrounds the grid.
    let at = |i: usize, j: usize| {
        let inside = i > 0 && j > 0 && i <= nx && j <= ny;
        let v = if inside { value(i - 1, j - 1) } else { f64::NEG_INFINITY };
        if v.is_nan() { f64::NEG_INFINITY } else { v }
    };
    let cross = |a: f64, b: f64| {
        let t = (level - a) / (b - a);
        // Next to the outside layer the contour lies half a cell from the last value.
        if t.is_finite() && a.is_finite() && b.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
    };
    // Key of an edge: its lower left node, and whether it is vertical; crossed at most once.
    let mut next: HashMap<(usize, usize, bool), (usize, usize, bool)> = HashMap::new();
    let mut order = Vec::new();
    for j in 0..=ny {
        for i in 0..=nx {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let bits = corners
                .iter()
                .enumerate()
                .fold(0, |bits, (n, v)| bits | (usize::from(*v >= level) << n));
            let edges = [(i, j, false), (i + 1, j, true), (i, j + 1, false), (i, j, true)];
            let middle =
                corners.iter().map(|v| v.max(level - 1e3 * level.abs() - 1.0)).sum::<f64>() / 4.0
                    >= level;
            for (from, to) in segments(bits, middle) {
                next.insert(edges[*from], edges[*to]);
                order.push(edges[*from]);
            }
        }
    }
    let place = |(i, j, up): (usize, usize, bool)| {
        let (x, y) = (i as f64 - 1.0, j as f64 - 1.0);
        if up {
            (x, y + cross(at(i, j), at(i, j + 1)))
        } else {
            (x + cross(at(i, j), at(i + 1, j)), y)
        }
    };
    let mut out = Vec::new();
    for start in order {
        let mut ring = Vec::new();
        let mut edge = start;
        while let Some(following) = next.remove(&edge) {
            ring.push(place(edge));
            edge = following;
        }
        if ring.len() > 2 {
            out.push(ring);
        }
    }
    out
}

/// Returns the segments of a cell, directed with high values on the left. Edges: 0 bottom,
/// 1 right, 2 top, 3 left.
fn segments(bits: usize, middle: bool) -> &'static [(usize, usize)] {
    match bits {
        1 => &[(0, 3)],
        2 => &[(1, 0)],
        3 => &[(1, 3)],
        4 => &[(2, 1)],
        5 if middle => &[(0, 1), (2, 3)],
        5 => &[(0, 3), (2, 1)],
        6 => &[(2, 0)],
        7 => &[(2, 3)],
        8 => &[(3, 2)],
        9 => &[(0, 2)],
        10 if middle => &[(1, 2), (3, 0)],
        10 => &[(1, 0), (3, 2)],
        11 => &[(1, 2)],
        12 => &[(3, 1)],
        13 => &[(0, 1)],
        14 => &[(3, 0)],
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(ring: &[(f64, f64)]) -> f64 {
        let closed = ring.iter().zip(ring.iter().cycle().skip(1));
        0.5 * closed.map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>()
    }

    #[test]
    fn a_disc_becomes_one_loop_of_its_area() {
        let value = |i: usize, j: usize| 8.0 - (i as f64 - 15.3).hypot(j as f64 - 14.8);
        let got = closed_contours(32, 30, value, 0.0);
        assert_eq!(got.len(), 1);
        let exact = std::f64::consts::PI * 64.0;
        assert!((area(&got[0]) / exact - 1.0).abs() < 0.01, "{}", area(&got[0]));
    }

    #[test]
    fn holes_turn_the_other_way_and_edges_close() {
        let ring = |i: usize, j: usize| {
            let r = (i as f64 - 10.0).hypot(j as f64 - 10.0);
            2.0 - (r - 6.0).abs()
        };
        let got = closed_contours(21, 21, ring, 0.0);
        assert_eq!(got.len(), 2);
        assert!(area(&got[0]) * area(&got[1]) < 0.0);
        let full = closed_contours(4, 3, |_, _| 1.0, 0.5);
        assert_eq!(full.len(), 1);
        assert!((area(&full[0]) - 11.5).abs() < 1e-9, "{}", area(&full[0]));
    }

    #[test]
    fn saddles_and_broken_values_do_not_break_loops() {
        let checker = |i: usize, j: usize| if (i + j).is_multiple_of(2) { 1.0 } else { 0.0 };
        assert!(closed_contours(6, 6, checker, 0.5).iter().all(|ring| ring.len() > 2));
        assert!(closed_contours(6, 6, |_, _| f64::NAN, 0.5).is_empty());
        assert!(closed_contours(0, 0, |_, _| 1.0, 0.5).is_empty());
    }
}
