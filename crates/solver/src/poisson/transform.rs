//! Transforms that diagonalise the second difference along one axis.
//!
//! Two real lines travel as the real and imaginary part of one complex FFT. The cosine transform
//! (type II and its inverse) uses Makhoul's even-odd reordering (1980), so its FFT has the length
//! of the line; any length works, primes included.

use std::f64::consts::PI;
use std::sync::Arc;

use rustfft::{Fft, FftPlanner, num_complex::Complex64};

use super::Ends;

/// Pairs of lines transformed at a time: eight columns fill a cache line.
const PAIRS: usize = 4;

/// Where the lines of a plane lie in memory.
#[derive(Clone, Copy)]
pub struct Lines {
    /// First entry of the first line.
    pub first: usize,
    /// Number of lines.
    pub count: usize,
    /// Distance between lines.
    pub apart: usize,
    /// Distance between the entries of a line.
    pub step: usize,
}

/// Buffers for the lines of one thread.
pub struct LineScratch {
    lines: Vec<Complex64>,
    fft: Vec<Complex64>,
}

impl LineScratch {
    pub fn new(transforms: [&Transform; 2]) -> LineScratch {
        let n = transforms.map(|t| t.n).into_iter().max().unwrap_or(1);
        let fft = transforms.map(Transform::scratch_len).into_iter().max().unwrap_or(0);
        let zero = Complex64::new(0.0, 0.0);
        LineScratch { lines: vec![zero; PAIRS * n], fft: vec![zero; fft] }
    }
    pub fn bytes(&self) -> usize {
        16 * (self.lines.len() + self.fft.len())
    }
}

/// Forward and inverse transform of one axis, and the eigenvalues of minus the second difference.
pub struct Transform {
    n: usize,
    ends: Ends,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    /// Place of entry m of the line in the FFT's input.
    order: Vec<usize>,
    /// exp(i pi k / 2n), cosine transform only.
    turn: Vec<Complex64>,
    /// Eigenvalue of mode m [1/m^2], in the order in which modes are stored.
    pub eigenvalues: Vec<f64>,
}

impl Transform {
    pub fn new(n: usize, ends: Ends, spacing: f64) -> Transform {
        let mut planner = FftPlanner::new();
        let order = match ends {
            Ends::Periodic => (0..n).collect(),
            Ends::Neumann => (0..n).map(|m| if m % 2 == 0 { m / 2 } else { n - 1 - m / 2 }).collect(),
        };
        let turn = (0..n).map(|k| Complex64::from_polar(1.0, PI * k as f64 / (2 * n) as f64)).collect();
        let eigenvalues = (0..n)
            .map(|m| {
                let angle = match ends {
                    Ends::Periodic => PI * m.min(n - m) as f64 / n as f64,
                    Ends::Neumann => PI * m as f64 / (2 * n) as f64,
                };
                (2.0 * angle.sin() / spacing).powi(2)
            })
            .collect();
        let (forward, inverse) = (planner.plan_fft_forward(n), planner.plan_fft_inverse(n));
        Transform { n, ends, forward, inverse, order, turn, eigenvalues }
    }

    /// What forward then inverse multiplies by.
    pub fn norm(&self) -> f64 {
        self.n as f64
    }

    fn scratch_len(&self) -> usize {
        self.forward.get_inplace_scratch_len().max(self.inverse.get_inplace_scratch_len())
    }

    /// Lines -> modes, in place.
    pub fn forward(&self, plane: &mut [f64], at: Lines, scratch: &mut LineScratch) {
        self.for_groups(at, |pairs, group| {
            let LineScratch { lines, fft } = &mut *scratch;
            let n = self.n;
            for m in 0..n {
                for p in 0..pairs {
                    let (a, b) = group.entries(p, m);
                    let imaginary = b.map_or(0.0, |b| plane[b]);
                    lines[p * n + self.order[m]] = Complex64::new(plane[a], imaginary);
                }
            }
            self.forward.process_with_scratch(&mut lines[..pairs * n], fft);
            for k in 0..n {
                let mirror = if k == 0 { 0 } else { n - k };
                for p in 0..pairs {
                    let (z, w) = (lines[p * n + k], lines[p * n + mirror].conj());
                    let (va, ib) = ((z + w) * 0.5, (z - w) * 0.5);
                    let vb = Complex64::new(ib.im, -ib.re);
                    let (a, b) = group.entries(p, k);
                    plane[a] = self.mode(k, va);
                    if let Some(b) = b {
                        plane[b] = self.mode(k, vb);
                    }
                }
            }
        });
    }

    /// Modes -> lines, in place, unnormalised.
    pub fn inverse(&self, plane: &mut [f64], at: Lines, scratch: &mut LineScratch) {
        self.for_groups(at, |pairs, group| {
            let LineScratch { lines, fft } = &mut *scratch;
            let n = self.n;
            for k in 0..n {
                let mirror = n - k;
                for p in 0..pairs {
                    let (a, b) = group.entries(p, k);
                    let (am, bm) = group.entries(p, mirror % n);
                    let pair = |at: usize, mirrored: usize| {
                        let mirrored = if k == 0 { 0.0 } else { plane[mirrored] };
                        self.spectrum(k, plane[at], mirrored)
                    };
                    let va = pair(a, am);
                    let vb = match (b, bm) {
                        (Some(b), Some(bm)) => pair(b, bm),
                        _ => Complex64::new(0.0, 0.0),
                    };
                    lines[p * n + k] = Complex64::new(va.re - vb.im, va.im + vb.re);
                }
            }
            self.inverse.process_with_scratch(&mut lines[..pairs * n], fft);
            for m in 0..n {
                for p in 0..pairs {
                    let value = lines[p * n + self.order[m]];
                    let (a, b) = group.entries(p, m);
                    plane[a] = value.re;
                    if let Some(b) = b {
                        plane[b] = value.im;
                    }
                }
            }
        });
    }

    /// Real coefficient stored for the complex coefficient `k` of a real line.
    #[inline(always)]
    fn mode(&self, k: usize, v: Complex64) -> f64 {
        match self.ends {
            Ends::Neumann => self.turn[k].re * v.re + self.turn[k].im * v.im,
            Ends::Periodic if 2 * k <= self.n => v.re,
            // Index n - k holds the sine part of mode k; v here is the conjugate of that mode.
            Ends::Periodic => -v.im,
        }
    }

    /// Complex coefficient `k` of a real line from its stored modes `k` and `n - k`.
    #[inline(always)]
    fn spectrum(&self, k: usize, here: f64, mirrored: f64) -> Complex64 {
        match self.ends {
            Ends::Neumann => self.turn[k] * Complex64::new(here, -mirrored),
            Ends::Periodic if k == 0 || 2 * k == self.n => Complex64::new(here, 0.0),
            Ends::Periodic if 2 * k < self.n => Complex64::new(here, mirrored),
            Ends::Periodic => Complex64::new(mirrored, -here),
        }
    }

    fn for_groups(&self, at: Lines, mut f: impl FnMut(usize, Group)) {
        if self.n == 1 {
            return;
        }
        for start in (0..at.count).step_by(2 * PAIRS) {
            let lines = (at.count - start).min(2 * PAIRS);
            f(lines.div_ceil(2), Group { at, start, lines });
        }
    }
}

/// A few neighbouring lines.
#[derive(Clone, Copy)]
struct Group {
    at: Lines,
    start: usize,
    lines: usize,
}

impl Group {
    /// Memory positions of entry `m` of both lines of pair `p`; an odd count leaves one alone.
    #[inline(always)]
    fn entries(&self, p: usize, m: usize) -> (usize, Option<usize>) {
        let a = self.at.first + (self.start + 2 * p) * self.at.apart + m * self.at.step;
        (a, (2 * p + 1 < self.lines).then_some(a + self.at.apart))
    }
}
