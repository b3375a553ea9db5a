//! Tridiagonal systems along z, one for each pair of modes along x and y.
//!
//! With lambda = lambda_x + lambda_y and b = 2 + lambda dz^2 each reads
//! -x[k-1] + b x[k] - x[k+1] = -dz^2 f[k], with b lowered by one next to a Neumann end and the
//! corners closed by Sherman-Morrison on a periodic axis. Blocks of columns that fit the cache are
//! solved one after the other, so that each mode is read from and written to memory once. The
//! solution is in double precision for either type of field: the lowest modes of a wide flat box
//! have lambda dz^2 below the rounding of singles.
//!
//! Legend: f right-hand side; y solution of the system without its corners; q solution for the
//! corner vector u; g = -b.

use super::Ends;
use crate::grid::Columns;
use crate::math::{Aligned, Real};
use grainwake_simd::{Kernel, Vector};

/// Scratch for one block of columns.
pub struct ColumnScratch {
    /// Solutions y of the systems without corners: a row of zeros, then one row for each k.
    pub values: Aligned<f64>,
    /// Inverse pivots, in rows as `values`.
    pub pivots: Aligned<f64>,
    /// Solutions q for the corner vector, in rows as `values`; empty unless z is periodic.
    pub corner: Aligned<f64>,
    /// One row: the solution of the plane above, or the factor of q.
    pub carry: Aligned<f64>,
    /// Right-hand side of the mean mode and pivots of its system.
    pub mean: [Vec<f64>; 2],
}

/// Tridiagonal systems along z, one for each pair of modes along x and y.
#[derive(Clone, Copy)]
pub struct Tridiagonal {
    /// Number of cells along z.
    pub n: usize,
    /// Conditions at both ends.
    pub ends: Ends,
    /// Square of the spacing dz [m^2].
    pub square: f64,
    /// Factor of the right-hand side: the normalisation of the transforms.
    pub scale: f64,
}

/// Solves all columns of a block.
pub struct Solve<'a, 'b, R> {
    pub system: Tridiagonal,
    /// Right-hand sides, overwritten by the solutions.
    pub columns: &'a mut Columns<'b, R>,
    /// Sum of the eigenvalues along x and y of each column [1/m^2].
    pub lambda: &'a [f64],
    /// Whether the first column is the mean mode of a system defined up to a constant.
    pub singular: bool,
    pub scratch: &'a mut ColumnScratch,
}

impl<R: Real> Kernel for Solve<'_, '_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(mut self) {
        let Solve { system, singular, .. } = self;
        let ColumnScratch { values, pivots, corner, .. } = &mut *self.scratch;
        for rows in [values, pivots, corner] {
            rows.iter_mut().take(self.lambda.len()).for_each(|first| *first = 0.0);
        }
        match system.ends {
            _ if system.n == 1 => self.solve_flat(),
            Ends::Neumann => self.solve_neumann::<V>(),
            Ends::Periodic => {
                if singular {
                    for k in 0..system.n {
                        self.scratch.mean[0][k] = self.columns.row(k)[0].wide();
                    }
                }
                self.solve_periodic::<V>();
                if singular {
                    self.solve_mean();
                }
            }
        }
        if singular {
            self.subtract_mean();
        }
    }
}

/// First entries of the vectors in a row of `width`, a multiple of `V::WIDTH`.
#[inline(always)]
fn starts<V: Vector>(width: usize) -> impl Iterator<Item = usize> {
    (0..width / V::WIDTH).map(|n| n * V::WIDTH)
}

/// Rows of k - 1 and k in a list of rows that starts with a row of zeros.
#[inline(always)]
fn rows_at(values: &mut [f64], k: usize, width: usize) -> (&mut [f64], &mut [f64]) {
    values[k * width..][..2 * width].split_at_mut(width)
}

impl<R: Real> Solve<'_, '_, R> {
    #[inline(always)]
    fn solve_flat(&mut self) {
        let scale = self.system.scale;
        for (value, lambda) in self.columns.row(0).iter_mut().zip(self.lambda) {
            *value = R::of(if *lambda == 0.0 { 0.0 } else { -scale * value.wide() / lambda });
        }
    }

    #[inline(always)]
    fn solve_neumann<V: Vector<Number = f64>>(&mut self) {
        let Tridiagonal { n, square, scale, .. } = self.system;
        let (columns, lambda) = (&mut *self.columns, self.lambda);
        let ColumnScratch { values, pivots, carry, .. } = &mut *self.scratch;
        let width = lambda.len();
        let (one, factor) = (V::constant(1.0), V::constant(-square * scale));
        let square = V::constant(square);
        for k in 0..n {
            let neighbours = u8::from(k > 0) + u8::from(k + 1 < n);
            let neighbours = V::constant(f64::from(neighbours));
            let row = &columns.row(k)[..width];
            let (pivots_before, pivots) = rows_at(pivots, k, width);
            let (values_before, values) = rows_at(values, k, width);
            for i in starts::<V>(width) {
                let b = neighbours + V::load(&lambda[i..]) * square;
                let pivot = one.div(b - V::load(&pivots_before[i..]));
                let f = factor * V::load_from(&row[i..]) + V::load(&values_before[i..]);
                pivot.store(&mut pivots[i..]);
                (f * pivot).store(&mut values[i..]);
            }
        }
        if self.singular {
            // The last pivot of the mean mode vanishes; its last value is zero for the time being.
            values[n * width] = 0.0;
        }
        let carry = &mut carry[..width];
        carry.copy_from_slice(&values[n * width..][..width]);
        for (last, carry) in columns.row(n - 1).iter_mut().zip(&*carry) {
            *last = R::of(*carry);
        }
        for k in (0..n - 1).rev() {
            let row = &mut columns.row(k)[..width];
            let (_, values) = rows_at(values, k, width);
            let (_, pivots) = rows_at(pivots, k, width);
            for i in starts::<V>(width) {
                let x = V::load(&values[i..]) + V::load(&pivots[i..]) * V::load(&carry[i..]);
                x.store(&mut carry[i..]);
                x.store_to(&mut row[i..]);
            }
        }
    }

    #[inline(always)]
    fn solve_periodic<V: Vector<Number = f64>>(&mut self) {
        let Tridiagonal { n, square, scale, .. } = self.system;
        let (columns, lambda) = (&mut *self.columns, self.lambda);
        let ColumnScratch { values, pivots, corner, carry, .. } = &mut *self.scratch;
        let width = lambda.len();
        let (one, two, zero) = (V::constant(1.0), V::constant(2.0), V::constant(0.0));
        let (square, factor) = (V::constant(square), V::constant(-square * scale));
        // A = T + u v^T with u = (g, 0.., -1), v = (1, 0.., -1/g), g = -b.
        for k in 0..n {
            let row = &columns.row(k)[..width];
            let (pivots_before, pivots) = rows_at(pivots, k, width);
            let (values_before, values) = rows_at(values, k, width);
            let (corner_before, corner) = rows_at(corner, k, width);
            for i in starts::<V>(width) {
                let b = two + V::load(&lambda[i..]) * square;
                let g = zero - b;
                let (mut diagonal, mut u) = (b, zero);
                if k == 0 {
                    (diagonal, u) = (diagonal - g, u + g);
                }
                if k + 1 == n {
                    (diagonal, u) = (diagonal - one.div(g), u - one);
                }
                let pivot = one.div(diagonal - V::load(&pivots_before[i..]));
                let f = factor * V::load_from(&row[i..]) + V::load(&values_before[i..]);
                let u = u + V::load(&corner_before[i..]);
                pivot.store(&mut pivots[i..]);
                (f * pivot).store(&mut values[i..]);
                (u * pivot).store(&mut corner[i..]);
            }
        }
        for k in (1..n).rev() {
            let (_, pivots) = rows_at(pivots, k - 1, width);
            let (values, values_after) = rows_at(&mut values[width..], k - 1, width);
            let (corner, corner_after) = rows_at(&mut corner[width..], k - 1, width);
            for i in starts::<V>(width) {
                let pivot = V::load(&pivots[i..]);
                let y = V::load(&values[i..]) + pivot * V::load(&values_after[i..]);
                let q = V::load(&corner[i..]) + pivot * V::load(&corner_after[i..]);
                y.store(&mut values[i..]);
                q.store(&mut corner[i..]);
            }
        }
        let share = &mut carry[..width];
        let [y, q] = [&*values, &*corner].map(|rows| [&rows[width..], &rows[n * width..]]);
        for i in starts::<V>(width) {
            let g = zero - (two + V::load(&lambda[i..]) * square);
            let [y, y_end] = y.map(|row| V::load(&row[i..]));
            let [q, q_end] = q.map(|row| V::load(&row[i..]));
            (y - y_end.div(g)).div(one + q - q_end.div(g)).store(&mut share[i..]);
        }
        for k in 0..n {
            let row = &mut columns.row(k)[..width];
            let (_, values) = rows_at(values, k, width);
            let (_, corner) = rows_at(corner, k, width);
            for i in starts::<V>(width) {
                let x = V::load(&values[i..]) - V::load(&share[i..]) * V::load(&corner[i..]);
                x.store_to(&mut row[i..]);
            }
        }
    }

    /// Makes the mean of the first column zero.
    fn subtract_mean(&mut self) {
        let n = self.system.n;
        let sum: f64 = (0..n).map(|k| self.columns.row(k)[0].wide()).sum();
        let mean = sum / n as f64;
        for k in 0..n {
            let value = &mut self.columns.row(k)[0];
            *value = R::of(value.wide() - mean);
        }
    }

    /// Solves the mean mode of a periodic axis with the first value zero.
    #[inline(always)]
    fn solve_mean(&mut self) {
        let Tridiagonal { n, square, scale, .. } = self.system;
        let ([f, pivots], factor) = (&mut self.scratch.mean, -square * scale);
        let (mut pivot, mut y) = (0.0, 0.0);
        for k in 1..n {
            pivot = 1.0 / (2.0 - pivot);
            y = (factor * f[k] + y) * pivot;
            pivots[k] = pivot;
            f[k] = y;
        }
        self.columns.row(0)[0] = R::default();
        y = 0.0;
        for k in (1..n).rev() {
            y = f[k] + pivots[k] * y;
            self.columns.row(k)[0] = R::of(y);
        }
    }
}
