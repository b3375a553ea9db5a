//! Principal axes with deterministic order and signs.

use glam::{DMat3, DVec3};

/// Relative difference of second moments that is rounding error.
const ROUNDING: f64 = 1e-13;

/// Returns eigenvalues (largest first) and unit eigenvectors (columns) of a symmetric matrix, by
/// Jacobi rotations. For equal eigenvalues the original axes are kept.
pub(crate) fn symmetric_eigen(matrix: DMat3) -> (DVec3, DMat3) {
    let mut a = matrix.to_cols_array_2d();
    let mut v = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..50 {
        let off = a[0][1].powi(2) + a[1][2].powi(2) + a[0][2].powi(2);
        let scale = a[0][0].powi(2) + a[1][1].powi(2) + a[2][2].powi(2);
        // Threshold below rounding noise, so that a symmetric body keeps its given axes.
        if off <= 1e-24 * scale {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    // Equal eigenvalues keep their order, whatever their rounding errors.
    let equal = ROUNDING * (a[0][0].abs() + a[1][1].abs() + a[2][2].abs());
    let mut order = [0usize, 1, 2];
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if a[order[j]][order[j]] > a[order[i]][order[i]] + equal {
            order.swap(i, j);
        }
    }
    let values = DVec3::from_array(order.map(|i| a[i][i]));
    let axes = order.map(|i| DVec3::from_array(v[i]));
    (values, DMat3::from_cols(axes[0], axes[1], axes[2]))
}

/// Applies one Jacobi rotation that zeroes entry (p, q); `v` holds the eigenvectors as rows.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    // The rounding errors of equal moments, which depend on the unit, must not turn the axes.
    let equal = ROUNDING * (a[p][p].abs() + a[q][q].abs());
    let mut difference = a[q][q] - a[p][p];
    if difference.abs() <= equal {
        difference = 0.0;
    }
    if a[p][q] == 0.0 || (difference == 0.0 && a[p][q].abs() <= equal) {
        return;
    }
    let theta = difference / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    for k in 0..3 {
        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
        (v[p][k], v[q][k]) = (c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]);
    }
}

/// Returns the axes (columns) of the principal frame: x along the largest second moment (smallest
/// moment of inertia), z along the smallest, right-handed. The positive ends of x and y are those
/// with the longer tail (positive third moment) or, for a symmetric body, with the larger source
/// coordinate.
pub(crate) fn axes(second: DMat3, volume: f64, third: impl Fn(DMat3) -> DVec3) -> DMat3 {
    let (values, eigen) = symmetric_eigen(second);
    let tails = third(eigen);
    let mut columns = [eigen.x_axis, eigen.y_axis];
    for (n, column) in columns.iter_mut().enumerate() {
        let spread = volume * (values[n] / volume).abs().powf(1.5);
        let flip = if tails[n].abs() > 1e-5 * spread {
            tails[n] < 0.0
        } else {
            let c = *column;
            let largest = if c.x.abs() >= c.y.abs() - 1e-9 && c.x.abs() >= c.z.abs() - 1e-9 {
                c.x
            } else if c.y.abs() >= c.z.abs() - 1e-9 {
                c.y
            } else {
                c.z
            };
            largest < 0.0
        };
        if flip {
            *column = -*column;
        }
    }
    let z = columns[0].cross(columns[1]);
    DMat3::from_cols(columns[0], columns[1], z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn eigenpairs_of_a_rotated_diagonal_are_found() {
        for i in 0..100 {
            let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
            let turn = DQuat::from_scaled_axis(6.0 * (u.fract() - DVec3::splat(0.5)));
            let r = DMat3::from_quat(turn);
            let matrix = r * DMat3::from_diagonal(DVec3::new(1.0, 3.0, 2.0)) * r.transpose();
            let (values, axes) = symmetric_eigen(matrix);
            assert!((values - DVec3::new(3.0, 2.0, 1.0)).length() < 1e-11);
            let rebuilt = axes * DMat3::from_diagonal(values) * axes.transpose();
            assert!(rebuilt.abs_diff_eq(matrix, 1e-11));
            assert!((axes.x_axis.dot(r.y_axis).abs() - 1.0).abs() < 1e-11);
        }
    }

    /// The corner tetrahedron and a prism on its edge, with the rounding errors of several units.
    #[test]
    fn rounding_errors_do_not_turn_equal_axes() {
        let tetrahedron = |e: [f64; 3]| {
            DMat3::from_cols(
                DVec3::new(3.0 + e[0], -1.0, -1.0),
                DVec3::new(-1.0, 3.0 + e[1], -1.0),
                DVec3::new(-1.0, -1.0, 3.0 + e[2]),
            )
        };
        let prism = |e: [f64; 3]| {
            DMat3::from_cols(
                DVec3::new(2.0 + e[0], e[1], 0.0),
                DVec3::new(e[1], 2.0 + e[2], 0.5),
                DVec3::new(0.0, 0.5, 1.0),
            )
        };
        for matrix in [&tetrahedron as &dyn Fn([f64; 3]) -> DMat3, &prism] {
            let (_, axes) = symmetric_eigen(matrix([0.0; 3]));
            for n in 1..64 {
                let error = [n % 4, n / 4 % 4, n / 16].map(|k| 4e-16 * (f64::from(k) - 1.5));
                let (_, other) = symmetric_eigen(matrix(error));
                assert!(other.abs_diff_eq(axes, 1e-9), "{error:?}: {other} instead of {axes}");
            }
        }
    }

    #[test]
    fn equal_moments_keep_the_given_axes_and_the_frame_is_right_handed() {
        let axes = axes(DMat3::IDENTITY * 2.0, 1.0, |_| DVec3::ZERO);
        assert_eq!(axes, DMat3::IDENTITY);
        let flipped = super::axes(DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0)), 1.0, |_| {
            DVec3::new(-1.0, 1.0, 0.0)
        });
        assert_eq!(flipped.x_axis, -DVec3::Z);
        assert!((flipped.determinant() - 1.0).abs() < 1e-15);
    }
}
