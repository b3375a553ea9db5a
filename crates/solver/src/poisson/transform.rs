//! Transforms that diagonalise the second difference along one axis.
//!
//! Two real lines travel as the real and imaginary part of one complex FFT. The cosine transform
//! (type II and its inverse) uses Makhoul's even-odd reordering (1980), so its FFT has the length
//! of the line; any length works, primes included.

use std::f64::consts::PI;
use std::sync::Arc;

use rustfft::{Fft, FftPlanner, num_complex::Complex64};

use super::Ends;

/// Lines transformed at a time: eight neighbouring columns fill a cache line.
const LINES: usize = 8;

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
        let fft = transforms
            .map(Transform::scratch_len)
            .into_iter()
            .max()
            .unwrap_or(0);
        LineScratch {
            lines: vec![Complex64::ZERO; LINES / 2 * n],
            fft: vec![Complex64::ZERO; fft],
        }
    }
    pub fn bytes(&self) -> usize {
        size_of::<Complex64>() * (self.lines.len() + self.fft.len())
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
            Ends::Neumann => (0..n)
                .map(|m| if m % 2 == 0 { m / 2 } else { n - 1 - m / 2 })
                .collect(),
        };
        let turn = (0..n)
            .map(|k| Complex64::from_polar(1.0, PI * k as f64 / (2 * n) as f64))
            .collect();
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
        Transform {
            n,
            ends,
            forward,
            inverse,
            order,
            turn,
            eigenvalues,
        }
    }

    /// What forward then inverse multiplies by.
    pub fn norm(&self) -> f64 {
        self.n as f64
    }

    fn scratch_len(&self) -> usize {
        self.forward
            .get_inplace_scratch_len()
            .max(self.inverse.get_inplace_scratch_len())
    }

    /// Lines -> modes, in place.
    pub fn forward(&self, plane: &mut [f64], at: Lines, scratch: &mut LineScratch) {
        let (n, LineScratch { lines, fft }) = (self.n, scratch);
        for group in self.groups(at) {
            let lines = &mut lines[..group.pairs() * n];
            group.load(plane, lines, &self.order);
            self.forward.process_with_scratch(lines, fft);
            let half = |z: Complex64, w: Complex64| {
                let (sum, difference) = (z + w.conj(), z - w.conj());
                (
                    sum * 0.5,
                    Complex64::new(0.5 * difference.im, -0.5 * difference.re),
                )
            };
            match self.ends {
                Ends::Neumann => group.store(plane, n, |p, k| {
                    let line = &lines[p * n..(p + 1) * n];
                    let (va, vb) = half(line[k], line[if k == 0 { 0 } else { n - k }]);
                    let t = self.turn[k];
                    (t.re * va.re + t.im * va.im, t.re * vb.re + t.im * vb.im)
                }),
                // Index k <= n/2 holds the cosine part of mode k, index n - k its sine part.
                Ends::Periodic => group.store(plane, n, |p, k| {
                    let line = &lines[p * n..(p + 1) * n];
                    let (va, vb) = half(line[k], line[if k == 0 { 0 } else { n - k }]);
                    if 2 * k <= n {
                        (va.re, vb.re)
                    } else {
                        (-va.im, -vb.im)
                    }
                }),
            }
        }
    }

    /// Modes -> lines, in place, unnormalised.
    pub fn inverse(&self, plane: &mut [f64], at: Lines, scratch: &mut LineScratch) {
        let (n, LineScratch { lines, fft }) = (self.n, scratch);
        for group in self.groups(at) {
            let lines = &mut lines[..group.pairs() * n];
            let combine =
                |va: Complex64, vb: Complex64| Complex64::new(va.re - vb.im, va.im + vb.re);
            match self.ends {
                Ends::Neumann => group.load_modes(plane, lines, n, |k, [a, b], [am, bm]| {
                    let t = self.turn[k];
                    combine(t * Complex64::new(a, -am), t * Complex64::new(b, -bm))
                }),
                Ends::Periodic => group.load_modes(plane, lines, n, |k, [a, b], [am, bm]| {
                    if k == 0 || 2 * k == n {
                        Complex64::new(a, b)
                    } else if 2 * k < n {
                        combine(Complex64::new(a, am), Complex64::new(b, bm))
                    } else {
                        combine(Complex64::new(am, -a), Complex64::new(bm, -b))
                    }
                }),
            }
            self.inverse.process_with_scratch(lines, fft);
            group.store(plane, n, |p, m| {
                let value = lines[p * n + self.order[m]];
                (value.re, value.im)
            });
        }
    }

    fn groups(&self, at: Lines) -> impl Iterator<Item = Group> + use<> {
        let count = if self.n == 1 { 0 } else { at.count };
        (0..count).step_by(LINES).map(move |start| Group {
            first: at.first + start * at.apart,
            lines: (count - start).min(LINES),
            apart: at.apart,
            step: at.step,
        })
    }
}

/// A few neighbouring lines; an odd count leaves the last one without a partner.
#[derive(Clone, Copy)]
struct Group {
    first: usize,
    lines: usize,
    apart: usize,
    step: usize,
}

impl Group {
    fn pairs(&self) -> usize {
        self.lines.div_ceil(2)
    }

    /// Packs the lines in the order of the FFT's input.
    #[inline]
    fn load(&self, plane: &[f64], lines: &mut [Complex64], order: &[usize]) {
        let n = order.len();
        if self.step == 1 {
            for p in 0..self.pairs() {
                let [a, b] = self.rows(p);
                let (a, b) = (&plane[a..a + n], &plane[b..b + n]);
                let line = &mut lines[p * n..(p + 1) * n];
                for m in 0..n {
                    line[order[m]] = Complex64::new(a[m], b[m]);
                }
            }
        } else {
            for (m, &to) in order.iter().enumerate() {
                let entries = &plane[self.first + m * self.step..][..self.lines];
                for (p, pair) in entries.chunks(2).enumerate() {
                    lines[p * n + to] = Complex64::new(pair[0], pair[pair.len() - 1]);
                }
            }
        }
    }

    /// Packs spectra: `f(k, [a, b] at k, [a, b] at n - k)`, zero standing for the entry n.
    #[inline]
    fn load_modes(
        &self,
        plane: &[f64],
        lines: &mut [Complex64],
        n: usize,
        f: impl Fn(usize, [f64; 2], [f64; 2]) -> Complex64,
    ) {
        if self.step == 1 {
            for p in 0..self.pairs() {
                let [a, b] = self.rows(p);
                let (a, b) = (&plane[a..a + n], &plane[b..b + n]);
                let line = &mut lines[p * n..(p + 1) * n];
                line[0] = f(0, [a[0], b[0]], [0.0; 2]);
                for k in 1..n {
                    line[k] = f(k, [a[k], b[k]], [a[n - k], b[n - k]]);
                }
            }
        } else {
            for k in 0..n {
                let entries = &plane[self.first + k * self.step..][..self.lines];
                let mirrored = &plane[self.first + (n - k) % n * self.step..][..self.lines];
                for (p, (pair, mirror)) in entries.chunks(2).zip(mirrored.chunks(2)).enumerate() {
                    let last = pair.len() - 1;
                    let mirror = if k == 0 {
                        [0.0; 2]
                    } else {
                        [mirror[0], mirror[last]]
                    };
                    lines[p * n + k] = f(k, [pair[0], pair[last]], mirror);
                }
            }
        }
    }

    /// Stores `f(pair, entry)` for both lines of each pair.
    #[inline]
    fn store(&self, plane: &mut [f64], n: usize, f: impl Fn(usize, usize) -> (f64, f64)) {
        if self.step == 1 {
            for p in 0..self.pairs() {
                let [a, b] = self.rows(p);
                for m in 0..n {
                    // A line without a partner is its own: the second store repeats the first.
                    let (first, second) = f(p, m);
                    plane[b + m] = if a == b { first } else { second };
                    plane[a + m] = first;
                }
            }
        } else {
            for m in 0..n {
                let entries = &mut plane[self.first + m * self.step..][..self.lines];
                for (p, pair) in entries.chunks_mut(2).enumerate() {
                    let (first, second) = f(p, m);
                    pair[0] = first;
                    if let Some(entry) = pair.get_mut(1) {
                        *entry = second;
                    }
                }
            }
        }
    }

    /// First entries of the two rows of pair `p`.
    #[inline]
    fn rows(&self, p: usize) -> [usize; 2] {
        let a = self.first + 2 * p * self.apart;
        [
            a,
            if 2 * p + 1 < self.lines {
                a + self.apart
            } else {
                a
            },
        ]
    }
}
