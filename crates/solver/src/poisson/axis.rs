//! Eigenmodes of the second difference along one axis, by Fourier transforms of any length.
//!
//! Two real lines are transformed as real and imaginary part of one complex line. The
//! cosine transform (type II and its inverse) uses Makhoul's even-odd reordering (1980), so its
//! Fourier transform has the length of the line. A length with a large prime factor is transformed
//! by a convolution with a chirp (Bluestein): k t = (k^2 + t^2 - (k - t)^2) / 2.
//!
//! Legend: z_k spectrum of a pair of lines a + i b; m = n - k the mirror of k.

use super::fft::Fft;
use crate::math::Real;
use grainwake_simd::{Complex, Kernel, Vector, as_complex, dispatch};

/// Transforms of one axis and the eigenvalues of minus the second difference.
pub struct AxisTransform<R> {
    /// Number of cells n.
    pub n: usize,
    /// Position of cell i in the input of the transform.
    pub order: Vec<usize>,
    /// Eigenvalue of mode k [1/m^2], in the order in which modes are stored. On a periodic axis
    /// index k <= n/2 holds the cosine part of mode k, its mirror the sine part.
    pub eigenvalues: Vec<f64>,
    pub fourier: Fourier<R>,
    /// cos and sin of pi k / 2n for cosine modes; 1 and 0 on a periodic axis.
    pub turn: Vec<[R; 2]>,
    /// Factors of the mode k = n/2, its own mirror, in the forward and inverse transform.
    pub middle: [R; 2],
}

impl<R: Real> AxisTransform<R> {
    /// Turns spectra of pairs of lines into modes: real parts belong to the first lines, imaginary
    /// parts to the second lines.
    #[inline(always)]
    fn split<V: Vector<Number = R>>(&self, modes: &mut [Complex<V>]) {
        let half = V::constant(0.5);
        for ((z, w), [cos, sin]) in mirrored(modes).zip(&self.turn[1..]) {
            let (cos, sin) = (V::splat(*cos) * half, V::splat(*sin) * half);
            let (p, q, r, t) = (z.re + w.re, z.im - w.im, z.im + w.im, w.re - z.re);
            z.re = cos * p + sin * q;
            z.im = cos * r + sin * t;
            w.re = sin * p - cos * q;
            w.im = sin * r - cos * t;
        }
        if self.n.is_multiple_of(2) {
            modes[self.n / 2] = modes[self.n / 2].scale(self.middle[0]);
        }
    }

    /// Turns modes into spectra of pairs of lines with real and imaginary parts exchanged, which
    /// makes the forward transform an inverse one.
    #[inline(always)]
    fn join<V: Vector<Number = R>>(&self, modes: &mut [Complex<V>]) {
        modes[0] = modes[0].swap_parts();
        for ((x, y), [cos, sin]) in mirrored(modes).zip(&self.turn[1..]) {
            let (cos, sin) = (V::splat(*cos), V::splat(*sin));
            let (p, q) = (cos * x.re + sin * y.re, sin * x.re - cos * y.re);
            let (r, t) = (cos * x.im + sin * y.im, sin * x.im - cos * y.im);
            (x.re, x.im) = (q + r, p - t);
            (y.re, y.im) = (r - q, p + t);
        }
        if self.n.is_multiple_of(2) {
            modes[self.n / 2] = modes[self.n / 2].scale(self.middle[1]).swap_parts();
        }
    }
}

/// Transform of pairs of lines. It is a kernel of its own, so that its loops are compiled once per
/// instruction set and not once per direction.
struct TransformLines<'a, R> {
    axis: &'a AxisTransform<R>,
    /// Both buffers, one after the other; the first holds the lines.
    buffers: &'a mut [R],
    /// True for modes to cells, false for cells to modes.
    inverse: bool,
    /// True if a register of the lines is half as wide as the widest one.
    half: bool,
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
        let (a, b) = as_complex::<V>(self.buffers).split_at_mut(self.axis.fourier.fft.len);
        if self.inverse {
            self.axis.join(&mut a[..self.axis.n]);
        }
        let [found, _] = self.axis.fourier.run(a, b);
        if !self.inverse {
            self.axis.split(&mut found[..self.axis.n]);
        }
    }
}

/// Transforms the pairs of lines in the first of two `buffers`, one after the other; returns the
/// result.
///
/// Forward: cell i at `order[i]` -> modes. Inverse: modes -> cell i at `order[i]`, with real and
/// imaginary parts exchanged, unnormalised.
#[inline(always)]
pub fn transform_lines<'a, V: Vector<Number: Real>>(
    axis: &AxisTransform<V::Number>,
    buffers: &'a mut [V::Number],
    inverse: bool,
) -> &'a [Complex<V>] {
    let half = 2 * V::WIDTH == V::Number::LANES;
    dispatch(TransformLines { axis, buffers: &mut *buffers, inverse, half });
    // Each pass swaps the buffers; a convolution has two rounds of all passes.
    let fft = &axis.fourier.fft;
    let swapped = axis.fourier.chirp.is_none() && fft.passes.len() % 2 == 1;
    let start = if swapped { fft.len } else { 0 };
    &as_complex::<V>(buffers)[start..][..axis.n]
}

/// Modes k = 1, 2... below n/2, each with its mirror n - k.
#[inline(always)]
fn mirrored<T>(modes: &mut [T]) -> impl Iterator<Item = (&mut T, &mut T)> {
    let below_half = (modes.len() - 1) / 2;
    let (low, high) = modes[1..].split_at_mut(below_half);
    low.iter_mut().zip(high.iter_mut().rev())
}

/// Planned transform of any length.
pub struct Fourier<R> {
    /// Transform of the length, or of the padded length.
    pub fft: Fft<R>,
    /// Convolution of a length with a large prime factor.
    pub chirp: Option<Chirp<R>>,
}

/// Planned convolution.
pub struct Chirp<R> {
    /// exp(-pi i t^2 / n), t < n.
    pub turn: Vec<[R; 2]>,
    /// Transform of the conjugate chirp over the padded length, over that length.
    pub spectrum: Vec<[R; 2]>,
}

impl<R: Real> Fourier<R> {
    /// Transforms the first entries of `a`, using both buffers; returns the one with the result,
    /// then the other.
    #[inline(always)]
    pub fn run<'a, V: Vector<Number = R>>(
        &self,
        mut a: &'a mut [Complex<V>],
        mut b: &'a mut [Complex<V>],
    ) -> [&'a mut [Complex<V>]; 2] {
        // `fft.run` is inlined once; a second copy nearly doubles the compile time of this crate.
        for round in 0..1 + usize::from(self.chirp.is_some()) {
            if let Some(Chirp { turn, .. }) = self.chirp.as_ref().filter(|_| round == 0) {
                for (x, turn) in a.iter_mut().zip(turn) {
                    *x = x.times(*turn);
                }
                a[turn.len()..].fill(Complex::zero());
            } else if let Some(Chirp { spectrum, .. }) = &self.chirp {
                // With real and imaginary parts exchanged, a forward transform is an inverse one.
                for (x, factor) in a.iter_mut().zip(spectrum) {
                    *x = x.times(*factor).swap_parts();
                }
            }
            [a, b] = self.fft.run(a, b);
        }
        if let Some(Chirp { turn, .. }) = &self.chirp {
            for (x, turn) in a.iter_mut().zip(turn) {
                *x = x.swap_parts().times(*turn);
            }
        }
        [a, b]
    }
}
