//! The tridiagonal systems left along z, one for each pair of modes along x and y.
//!
//! With lambda = lambda_x + lambda_y and b = 2 + lambda dz^2 each reads
//! -x[k-1] + b x[k] - x[k+1] = -dz^2 f[k], with b lowered by one next to a Neumann end and the
//! corners closed by Sherman-Morrison on a periodic axis. A whole row of x modes is eliminated at
//! a time, so that the arithmetic runs along contiguous memory.

use super::Ends;
use crate::grid::RowColumn;

/// Pivots (and the corner vector of a periodic axis) of one row of columns.
pub struct ColumnScratch {
    pivots: Vec<f64>,
    corner: Vec<f64>,
    carry: Vec<f64>,
    mean: Vec<f64>,
}

impl ColumnScratch {
    pub fn new(nx: usize, nz: usize) -> ColumnScratch {
        ColumnScratch {
            pivots: vec![0.0; nx * nz],
            corner: vec![0.0; nx * nz],
            carry: vec![0.0; nx],
            mean: vec![0.0; nz],
        }
    }
    pub fn bytes(&self) -> usize {
        8 * (self.pivots.len() + self.corner.len() + self.carry.len() + self.mean.len())
    }
}

pub struct Tridiagonal {
    n: usize,
    ends: Ends,
    square: f64,
    scale: f64,
}

impl Tridiagonal {
    /// `scale` multiplies the right-hand side (the normalisation of the transforms).
    pub fn new(n: usize, ends: Ends, spacing: f64, scale: f64) -> Tridiagonal {
        Tridiagonal {
            n,
            ends,
            square: spacing * spacing,
            scale,
        }
    }

    /// Solves all columns of a row: eigenvalues `lambda_x` along the row, `lambda_y` of the row.
    pub fn solve(
        &self,
        column: &mut RowColumn,
        lambda_x: &[f64],
        lambda_y: f64,
        scratch: &mut ColumnScratch,
    ) {
        // Only the first mode of the first row can have a zero eigenvalue.
        let singular = lambda_y + lambda_x[0] == 0.0;
        match self.ends {
            _ if self.n == 1 => self.solve_flat(column, lambda_x, lambda_y),
            Ends::Neumann => self.solve_neumann(column, lambda_x, lambda_y, singular, scratch),
            Ends::Periodic => {
                if singular {
                    for k in 1..=self.n {
                        scratch.mean[k - 1] = column.row(k)[0];
                    }
                }
                self.solve_periodic(column, lambda_x, lambda_y, scratch);
                if singular {
                    self.solve_mean(column, &mut scratch.mean, &mut scratch.pivots);
                }
            }
        }
    }

    fn solve_flat(&self, column: &mut RowColumn, lambda_x: &[f64], lambda_y: f64) {
        for (value, lambda) in column.row(1).iter_mut().zip(lambda_x) {
            let lambda = lambda + lambda_y;
            *value = if lambda == 0.0 {
                0.0
            } else {
                -self.scale * *value / lambda
            };
        }
    }

    fn solve_neumann(
        &self,
        column: &mut RowColumn,
        lambda_x: &[f64],
        lambda_y: f64,
        singular: bool,
        scratch: &mut ColumnScratch,
    ) {
        let (n, nx) = (self.n, lambda_x.len());
        let factor = -self.square * self.scale;
        let carry = &mut scratch.carry[..nx];
        carry.fill(0.0);
        let mut before: &mut [f64] = &mut vec_of_zeros(&mut scratch.corner)[..nx];
        for (k, pivots) in (1..=n).zip(scratch.pivots.chunks_exact_mut(nx)) {
            let open = 2.0 - f64::from(u8::from(k == 1)) - f64::from(u8::from(k == n));
            let row = column.row(k);
            for i in 0..nx {
                let b = open + (lambda_x[i] + lambda_y) * self.square;
                let pivot = 1.0 / (b - before[i]);
                let value = (factor * row[i] + carry[i]) * pivot;
                pivots[i] = pivot;
                carry[i] = value;
                row[i] = value;
            }
            if singular && k == n {
                // The mean mode: its last pivot vanishes; the value there is pinned to zero.
                pivots[0] = 0.0;
                carry[0] = 0.0;
                row[0] = 0.0;
            }
            before = pivots;
        }
        for k in (1..n).rev() {
            let pivots = &scratch.pivots[(k - 1) * nx..k * nx];
            let row = column.row(k);
            for i in 0..nx {
                carry[i] = row[i] + pivots[i] * carry[i];
                row[i] = carry[i];
            }
        }
    }

    fn solve_periodic(
        &self,
        column: &mut RowColumn,
        lambda_x: &[f64],
        lambda_y: f64,
        scratch: &mut ColumnScratch,
    ) {
        let (n, nx) = (self.n, lambda_x.len());
        let factor = -self.square * self.scale;
        let ColumnScratch { pivots, corner, .. } = scratch;
        for i in 0..nx {
            // A = T + u v^T with u = (g, 0.., -1), v = (1, 0.., -1/g), g = -b.
            let b = 2.0 + (lambda_x[i] + lambda_y) * self.square;
            let g = -b;
            let (mut pivot, mut y, mut q) = (0.0, 0.0, 0.0);
            for k in 1..=n {
                let mut diagonal = b;
                let mut u = 0.0;
                if k == 1 {
                    diagonal -= g;
                    u += g;
                }
                if k == n {
                    diagonal -= 1.0 / g;
                    u -= 1.0;
                }
                let value = &mut column.row(k)[i];
                pivot = 1.0 / (diagonal - pivot);
                y = (factor * *value + y) * pivot;
                q = (u + q) * pivot;
                *value = y;
                pivots[(k - 1) * nx + i] = pivot;
                corner[(k - 1) * nx + i] = q;
            }
            for k in (1..n).rev() {
                let at = (k - 1) * nx + i;
                y = column.row(k)[i] + pivots[at] * y;
                q = corner[at] + pivots[at] * q;
                column.row(k)[i] = y;
                corner[at] = q;
            }
            let (y_last, q_last) = (column.row(n)[i], corner[(n - 1) * nx + i]);
            let share = (y - y_last / g) / (1.0 + q - q_last / g);
            for k in 1..=n {
                column.row(k)[i] -= share * corner[(k - 1) * nx + i];
            }
        }
    }

    /// The mean mode of a periodic axis: its first value is pinned to zero.
    fn solve_mean(&self, column: &mut RowColumn, f: &mut [f64], pivots: &mut [f64]) {
        let (n, factor) = (self.n, -self.square * self.scale);
        let (mut pivot, mut y) = (0.0, 0.0);
        for k in 1..n {
            pivot = 1.0 / (2.0 - pivot);
            y = (factor * f[k] + y) * pivot;
            pivots[k] = pivot;
            f[k] = y;
        }
        column.row(1)[0] = 0.0;
        y = 0.0;
        for k in (1..n).rev() {
            y = f[k] + pivots[k] * y;
            column.row(k + 1)[0] = y;
        }
    }
}

fn vec_of_zeros(values: &mut [f64]) -> &mut [f64] {
    values.fill(0.0);
    values
}
