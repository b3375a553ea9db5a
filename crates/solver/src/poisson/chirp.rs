//! Fourier transforms of lengths with a large prime factor, as a convolution with a chirp
//! (Bluestein): k t = (k^2 + t^2 - (k - t)^2) / 2.

use super::fft::{Fft, LARGEST_PRIME, factors, root};
use crate::math::Real;
use grainwake_simd::{Complex, Vector};

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
