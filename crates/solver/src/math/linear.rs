//! Dense 6 x 6 systems: the coupled translation and rotation of one grain.

/// Six generalised components: translation, then rotation.
pub type Vector6 = [f64; 6];
/// Row-major 6 x 6 matrix.
pub type Matrix6 = [[f64; 6]; 6];

/// Solves `a x = b` by Gaussian elimination with partial pivoting; `None` if singular.
pub fn solve6(mut a: Matrix6, mut b: Vector6) -> Option<Vector6> {
    for column in 0..6 {
        let pivot =
            (column..6).max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs()))?;
        if a[pivot][column] == 0.0 || !a[pivot][column].is_finite() {
            return None;
        }
        a.swap(column, pivot);
        b.swap(column, pivot);
        for row in column + 1..6 {
            let factor = a[row][column] / a[column][column];
            for k in column..6 {
                a[row][k] -= factor * a[column][k];
            }
            b[row] -= factor * b[column];
        }
    }
    for row in (0..6).rev() {
        let known: f64 = (row + 1..6).map(|k| a[row][k] * b[k]).sum();
        b[row] = (b[row] - known) / a[row][row];
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_system_with_a_zero_on_the_diagonal() {
        let mut a = [[0.0; 6]; 6];
        for (i, row) in a.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value = ((3 * i + 5 * j) % 7) as f64 - 2.5;
            }
        }
        a[0][0] = 0.0;
        let x = [1.0, -2.0, 3.0, 0.5, -0.25, 4.0];
        let b = a.map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum());
        let found = solve6(a, b).unwrap();
        for (found, x) in found.iter().zip(x) {
            assert!((found - x).abs() < 1e-12, "{found} {x}");
        }
        assert_eq!(solve6([[0.0; 6]; 6], b), None);
    }
}
