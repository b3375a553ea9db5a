//! The largest inscribed sphere of a body.

use crate::distance::Distance;
use crate::grid::{coordinates, index, place};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Samples across the shortest extent for the initial guess.
const ACROSS: f64 = 12.0;
/// Number of local maxima of the samples that are refined.
const CANDIDATES: usize = 4;

/// Returns position and value of the maximum of a concave function in a ball of radius `reach`
/// about `start`, by the ellipsoid method (Shor; Yudin and Nemirovski 1976). `depth` returns value
/// and ascent direction. The position error is at most `reach` times 0.945 to the power of
/// `rounds`; the search ends early if it cannot exceed `beat`.
pub(crate) fn deepest(
    mut depth: impl FnMut(DVec3) -> (f64, DVec3),
    start: DVec3,
    reach: f64,
    rounds: usize,
    beat: f64,
) -> (DVec3, f64) {
    let mut x = start;
    let mut shape = DMat3::IDENTITY * (reach * reach);
    let mut best = (x, depth(x).0);
    for _ in 0..rounds {
        let (value, uphill) = depth(x);
        if value > best.1 {
            best = (x, value);
        }
        let stretched = shape * uphill;
        let squared = uphill.dot(stretched);
        // Upper bound of the increase of a concave function in the ellipsoid.
        let rise = squared.sqrt();
        if rise.is_nan() || rise <= 0.0 || value + rise < beat {
            break;
        }
        let step = stretched / rise;
        // The smallest ellipsoid around the half that may contain the maximum.
        x += step / 4.0;
        let outer = DMat3::from_cols(step * step.x, step * step.y, step * step.z);
        shape = (shape - outer * 0.5) * (9.0 / 8.0);
    }
    best
}

/// Returns centre and radius [m] of the largest sphere in the body within the box, accurate to
/// about a millionth of the box if the depth is concave around its maximum. The search starts from
/// the minima of `about`, an approximate distance.
pub(crate) fn sphere(
    distance: &impl Distance,
    about: &impl Distance,
    lower: DVec3,
    upper: DVec3,
) -> (DVec3, f64) {
    let size = upper - lower;
    let spacing = (size.min_element() / ACROSS).max(size.max_element() / 200.0);
    let dims = (size / spacing).ceil().to_array().map(|n| n as usize + 1);
    let position = |n: usize| lower + spacing * coordinates(place(dims, n));
    let depths: Vec<f64> = (0..dims.iter().product())
        .into_par_iter()
        .map_init(|| 0, |hint, n| -about.near(position(n), hint))
        .collect();
    let highest = |n: usize| {
        let at = place(dims, n);
        (0..27usize).all(|m| {
            let to = [m % 3, m / 3 % 3, m / 9];
            let other: Option<Vec<usize>> =
                (0..3).map(|a| (at[a] + to[a]).checked_sub(1).filter(|i| *i < dims[a])).collect();
            other.is_none_or(|o| depths[index(dims, [o[0], o[1], o[2]])] <= depths[n])
        })
    };
    let mut candidates: Vec<usize> = (0..depths.len()).filter(|n| highest(*n)).collect();
    candidates.sort_by(|p, q| depths[*q].total_cmp(&depths[*p]).then(p.cmp(q)));
    let step = 1e-4 * spacing;
    let mut closing_in = distance.closing_in(step);
    let mut depth = |x: DVec3| {
        let (distance, slope) = closing_in(x);
        (-distance, -slope)
    };
    let mut best = (0.5 * (lower + upper), 0.0);
    for start in candidates.iter().take(CANDIDATES) {
        let candidate = deepest(&mut depth, position(*start), 5.0 * spacing, 240, best.1);
        if candidate.1 > best.1 {
            best = candidate;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn a_turned_box_a_long_cone_and_two_balls() {
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 1.1, -0.4));
        let boxed = |x: DVec3, _: &mut u32| {
            let q = (turn * x).abs() - DVec3::new(2.0, 0.7, 0.5);
            q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
        };
        let (_, radius) = sphere(&boxed, &boxed, DVec3::splat(-2.2), DVec3::splat(2.2));
        assert!((radius - 0.5).abs() < 1e-6, "{radius}");
        // A slowly widening needle with a flat base: the ridge of the depth rises slowly and is
        // oblique to the grid.
        let half = 0.08f64;
        let cone = |x: DVec3, _: &mut u32| {
            let y = turn * x;
            let flank = y.truncate().length() * half.cos() + (y.z - 3.0) * half.sin();
            flank.max(-y.z)
        };
        let exact = 3.0 * half.sin() / (1.0 + half.sin());
        let (_, radius) = sphere(&cone, &cone, DVec3::splat(-3.2), DVec3::splat(3.2));
        assert!((radius / exact - 1.0).abs() < 1e-5, "{radius} {exact}");
        let balls = |x: DVec3, _: &mut u32| {
            let left = (x + 1.2 * DVec3::X).length() - 0.99;
            left.min((x - 1.2 * DVec3::X).length() - 1.0)
        };
        let (centre, radius) =
            sphere(&balls, &balls, DVec3::new(-2.2, -1.0, -1.0), DVec3::new(2.2, 1.0, 1.0));
        assert!((radius - 1.0).abs() < 1e-5 && centre.distance(1.2 * DVec3::X) < 1e-4);
    }
}
