//! Eigenmodes of the second difference along one axis, by Fourier transforms of any length.
//!
//! Two real lines are transformed as real and imaginary part of one complex line. The
//! cosine transform (type II and its inverse) uses Makhoul's even-odd reordering (1980), so its
//! Fourier transform has the length of the line. A length with a large prime factor is transformed
//! by a convolution with a chirp (Bluestein): k t = (k^2 + t^2 - (k - t)^2) / 2.
//!
//! Legend: z_k spectrum of a pair of lines a + i b; m = n - k the mirror of k.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use super::Ends;
use super::fft::{Fft, LARGEST_PRIME, factors, root};
use crate::math::{Aligned, Real};
use grainwake_simd::{Complex, Kernel, Vector, as_complex, dispatch};

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

/// Both buffers of the transforms, one set per thread.
pub struct Buffers<R>(Aligned<R>);

impl<R: Real> Buffers<R> {
    /// Buffers for the transforms along x and y.
    pub fn new(axes: [&AxisTransform<R>; 2]) -> Buffers<R> {
        let longest = axes[0].buffer_len().max(axes[1].buffer_len());
        Buffers(Aligned::zeros(4 * R::LANES * longest))
    }
    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
    /// Input lines of a transform along `axis`.
    #[inline(always)]
    pub fn lines<V: Vector<Number = R>>(&mut self, axis: &AxisTransform<R>) -> &mut [Complex<V>] {
        &mut as_complex::<V>(&mut self.0)[..axis.n]
    }
    /// Transforms the input lines and returns the result.
    #[inline(always)]
    pub fn transform<V: Vector<Number = R>>(
        &mut self,
        axis: &AxisTransform<R>,
        inverse: bool,
    ) -> &[Complex<V>] {
        let len = axis.buffer_len();
        let buffers = &mut self.0[..4 * V::WIDTH * len];
        let mut second = false;
        dispatch(TransformLines {
            axis,
            buffers,
            inverse,
            half: 2 * V::WIDTH == R::LANES,
            second: &mut second,
        });
        &as_complex::<V>(buffers)[if second { len } else { 0 }..][..axis.n]
    }
}

/// Transform of a block of lines. It is a kernel of its own, so that its loops are compiled once
/// per instruction set and not once per caller.
struct TransformLines<'a, R> {
    axis: &'a AxisTransform<R>,
    /// Both buffers, one after the other; the first holds the lines.
    ///
    /// Forward: entry i at `order[i]` -> modes. Inverse: modes -> entry i at `order[i]`, with real
    /// and imaginary parts exchanged, unnormalised.
    buffers: &'a mut [R],
    /// Whether modes are transformed to entries.
    inverse: bool,
    /// Whether the block has half the lanes of the widest register.
    half: bool,
    /// Set to whether the second buffer holds the result.
    second: &'a mut bool,
}

impl<R: Real> Kernel for TransformLines<'_, R> {
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

impl<R: Real> TransformLines<'_, R> {
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

/// Planned transform of any length.
pub enum Fourier<R> {
    /// Transform of a length with small prime factors.
    Direct(Fft<R>),
    /// Transform of another length by a padded convolution.
    Padded(Chirp<R>),
}

/// Planned convolution.
pub struct Chirp<R> {
    fft: Fft<R>,
    /// exp(-pi i t^2 / n), t < n.
    chirp: Vec<[R; 2]>,
    /// Transform of the conjugate chirp over the padded length, over that length.
    spectrum: Vec<[R; 2]>,
}

impl<R: Real> Fourier<R> {
    /// Plans for `n` points.
    pub fn new(n: usize) -> Fourier<R> {
        if factors(n).into_iter().all(|factor| factor <= LARGEST_PRIME) {
            return Fourier::Direct(Fft::new(n));
        }
        let padded = padded(n);
        // t^2 modulo 2n keeps the angle exact for long lines.
        let chirp: Vec<[f64; 2]> = (0..n).map(|t| root(t * t, 2 * n)).collect();
        let mut kernel = vec![[0.0; 2]; padded];
        for (t, [re, im]) in chirp.iter().enumerate() {
            kernel[t] = [*re, -im];
            kernel[(padded - t) % padded] = [*re, -im];
        }
        let roots: Vec<[f64; 2]> = (0..padded).map(|t| root(t, padded)).collect();
        let spectrum = (0..padded)
            .map(|k| {
                let mut sum = [0.0; 2];
                for (t, [re, im]) in kernel.iter().enumerate() {
                    let [c, s] = roots[k * t % padded];
                    sum[0] += re * c - im * s;
                    sum[1] += re * s + im * c;
                }
                sum.map(|value| R::of(value / padded as f64))
            })
            .collect();
        Fourier::Padded(Chirp {
            fft: Fft::new(padded),
            chirp: chirp.into_iter().map(|turn| turn.map(R::of)).collect(),
            spectrum,
        })
    }

    /// Length of each of the two buffers for `n` points.
    pub fn buffer_len(&self, n: usize) -> usize {
        match self {
            Fourier::Direct(_) => n,
            Fourier::Padded(chirp) => chirp.spectrum.len(),
        }
    }

    /// Transforms the first entries of `a`, using both buffers; returns the one with the result,
    /// then the other.
    #[inline(always)]
    pub fn run<'a, V: Vector<Number = R>>(
        &self,
        a: &'a mut [Complex<V>],
        b: &'a mut [Complex<V>],
    ) -> [&'a mut [Complex<V>]; 2] {
        let (fft, chirp) = match self {
            Fourier::Direct(fft) => (fft, None),
            Fourier::Padded(chirp) => (&chirp.fft, Some(chirp)),
        };
        if let Some(Chirp { chirp, .. }) = chirp {
            for (x, turn) in a.iter_mut().zip(chirp) {
                *x = x.times(*turn);
            }
            a[chirp.len()..].fill(Complex::zero());
        }
        let mut buffers = [a, b];
        for time in 0..1 + usize::from(chirp.is_some()) {
            let [a, b] = buffers;
            buffers = fft.run(a, b);
            // With real and imaginary parts exchanged, a forward transform is an inverse one.
            match chirp {
                Some(plan) if time == 0 => {
                    for (x, turn) in buffers[0].iter_mut().zip(&plan.spectrum) {
                        *x = x.times(*turn).swap_parts();
                    }
                }
                Some(plan) => {
                    for (x, turn) in buffers[0].iter_mut().zip(&plan.chirp) {
                        *x = x.swap_parts().times(*turn);
                    }
                }
                None => {}
            }
        }
        buffers
    }
}

/// Smallest length with butterflies alone that holds the convolution.
fn padded(n: usize) -> usize {
    (2 * n - 1..)
        .find(|len| factors(*len).into_iter().all(|factor| [2, 3, 4, 5, 8].contains(&factor)))
        .unwrap_or(2 * n)
}
