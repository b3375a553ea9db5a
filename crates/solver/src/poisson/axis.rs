//! Eigenmodes of the second difference along one axis.
//!
//! Two real lines are transformed as real and imaginary part of one complex line. The
//! cosine transform (type II and its inverse) uses Makhoul's even-odd reordering (1980), so its
//! Fourier transform has the length of the line; any length works, primes included.
//!
//! Legend: z_k spectrum of a pair of lines a + i b; m = n - k the mirror of k.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use super::Ends;
use super::chirp::Fourier;
use crate::math::Real;
use grainwake_simd::{Complex, Kernel, Vector, as_complex};

/// Transforms of one axis and the eigenvalues of minus the second difference.
pub struct AxisTransform<R> {
    /// Number of cells.
    pub n: usize,
    /// Position of cell i in the input of the transform.
    pub order: Vec<usize>,
    /// Eigenvalue of mode k [1/m^2], in the order in which modes are stored. On a periodic axis
    /// index k <= n/2 holds the cosine part of mode k, its mirror the sine part.
    pub eigenvalues: Vec<f64>,
    fourier: Fourier<R>,
    /// cos and sin of pi k / 2n for cosine modes; 1 and 0 on a periodic axis.
    turn: Vec<[R; 2]>,
    /// Factors of the mode k = n/2, its own mirror, in the forward and inverse transform.
    middle: [R; 2],
}

impl<R: Real> AxisTransform<R> {
    /// Transforms of `n` cells, `spacing` [m] apart, with the conditions `ends`.
    pub fn new(n: usize, ends: Ends, spacing: f64) -> AxisTransform<R> {
        let neumann = ends == Ends::Neumann;
        let order = |i: usize| match i {
            _ if !neumann => i,
            _ if i.is_multiple_of(2) => i / 2,
            _ => n - 1 - i / 2,
        };
        let turn = |k: usize| {
            let angle = PI * k as f64 / (2 * n) as f64;
            if neumann { [angle.cos(), angle.sin()] } else { [1.0, 0.0] }
        };
        let eigenvalue = |k: usize| {
            let angle = match ends {
                Ends::Periodic => PI * k.min(n - k) as f64 / n as f64,
                Ends::Neumann => PI * k as f64 / (2 * n) as f64,
            };
            (2.0 * angle.sin() / spacing).powi(2)
        };
        AxisTransform {
            n,
            order: (0..n).map(order).collect(),
            eigenvalues: (0..n).map(eigenvalue).collect(),
            fourier: Fourier::new(n),
            turn: (0..n).map(|k| turn(k).map(R::of)).collect(),
            middle: if neumann {
                [FRAC_1_SQRT_2, 2.0 * FRAC_1_SQRT_2].map(R::of)
            } else {
                [R::of(1.0); 2]
            },
        }
    }

    /// Factor by which a forward and an inverse transform multiply.
    pub fn norm(&self) -> f64 {
        self.n as f64
    }

    /// Length of each of the two buffers.
    pub fn buffer_len(&self) -> usize {
        self.fourier.buffer_len(self.n)
    }

    /// Turns spectra of pairs of lines into modes: real parts belong to the first lines, imaginary
    /// parts to the second lines.
    #[inline(always)]
    fn split<V: Vector<Number = R>>(&self, modes: &mut [Complex<V>]) {
        let (n, half) = (self.n, V::constant(0.5));
        let (low, high) = mirrored(modes);
        let (pairs, turn) = (low.len(), &self.turn[1..]);
        let (high, turn) = (&mut high[..pairs], &turn[..pairs]);
        for k in 0..pairs {
            let (z, w, [cos, sin]) = (&mut low[k], &mut high[pairs - 1 - k], turn[k]);
            let (cos, sin) = (V::splat(cos) * half, V::splat(sin) * half);
            let (p, q, r, t) = (z.re + w.re, z.im - w.im, z.im + w.im, w.re - z.re);
            z.re = cos * p + sin * q;
            z.im = cos * r + sin * t;
            w.re = sin * p - cos * q;
            w.im = sin * r - cos * t;
        }
        if n.is_multiple_of(2) {
            modes[n / 2] = modes[n / 2].scale(self.middle[0]);
        }
    }

    /// Turns modes into spectra of pairs of lines with real and imaginary parts exchanged, which
    /// makes the forward transform an inverse one.
    #[inline(always)]
    fn join<V: Vector<Number = R>>(&self, modes: &mut [Complex<V>]) {
        let n = self.n;
        modes[0] = modes[0].swap_parts();
        let (low, high) = mirrored(modes);
        let (pairs, turn) = (low.len(), &self.turn[1..]);
        let (high, turn) = (&mut high[..pairs], &turn[..pairs]);
        for k in 0..pairs {
            let (x, y, [cos, sin]) = (&mut low[k], &mut high[pairs - 1 - k], turn[k]);
            let (cos, sin) = (V::splat(cos), V::splat(sin));
            let (p, q) = (cos * x.re + sin * y.re, sin * x.re - cos * y.re);
            let (r, t) = (cos * x.im + sin * y.im, sin * x.im - cos * y.im);
            (x.re, x.im) = (q + r, p - t);
            (y.re, y.im) = (r - q, p + t);
        }
        if n.is_multiple_of(2) {
            modes[n / 2] = modes[n / 2].scale(self.middle[1]).swap_parts();
        }
    }
}

/// Modes k = 1, 2... below n/2, and as many mirrors n - k in rising order.
#[inline(always)]
fn mirrored<T>(modes: &mut [T]) -> (&mut [T], &mut [T]) {
    let pairs = modes.len().div_ceil(2) - 1;
    let (low, high) = modes[1..].split_at_mut(pairs);
    let middle = high.len() - pairs;
    (low, &mut high[middle..])
}

/// Transform of a block of lines. It is a kernel of its own, so that its loops are compiled once
/// per instruction set and not once per caller.
pub struct Lines<'a, R> {
    /// Transforms of the axis of the lines.
    pub axis: &'a AxisTransform<R>,
    /// Both buffers, one after the other; the first holds the lines.
    ///
    /// Forward: entry i at `order[i]` -> modes. Inverse: modes -> entry i at `order[i]`, with real
    /// and imaginary parts exchanged, unnormalised.
    pub buffers: &'a mut [R],
    /// Whether modes are transformed to entries.
    pub inverse: bool,
    /// Whether the block has half the lanes of the widest register.
    pub half: bool,
    /// Set to whether the second buffer holds the result.
    pub second: &'a mut bool,
}

impl<R: Real> Kernel for Lines<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        if self.half {
            self.transform::<V::Half>();
        } else {
            self.transform::<V>();
        }
    }
}

impl<R: Real> Lines<'_, R> {
    #[inline(always)]
    fn transform<V: Vector<Number = R>>(self) {
        let axis = self.axis;
        let (a, b) = as_complex::<V>(self.buffers).split_at_mut(axis.buffer_len());
        let first = a.as_ptr();
        if self.inverse {
            axis.join(&mut a[..axis.n]);
        }
        let [found, _] = axis.fourier.run(a, b);
        if !self.inverse {
            axis.split(&mut found[..axis.n]);
        }
        *self.second = first != found.as_ptr();
    }
}
