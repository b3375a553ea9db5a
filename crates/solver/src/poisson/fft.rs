//! Complex Fourier transforms of lengths with small prime factors, one line per lane.
//!
//! Stockham's self-sorting scheme: one pass over the data per factor, from one buffer to the other,
//! no bit reversal. Factors 2, 3, 4, 5, 7 and 8 have butterflies of their own, other primes a loop
//! over groups of outputs. `plan.rs` chooses the factors.
//!
//! Outputs of a butterfly come in pairs k, r - k: with e_k the cosine sum over x_t + x_{r-t} and
//! o_k the sine sum over x_t - x_{r-t} they are e_k - i o_k and e_k + i o_k.
//!
//! Legend: r radix; blocks number of groups with different twiddle factors; stride product of the
//! radices of the earlier passes.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::math::Real;
use grainwake_simd::{Complex, Vector, rotated_butterfly};

/// Outputs (and their mirrors) of a prime radix that are summed in one loop over its inputs.
pub const TOGETHER: usize = 4;

/// One pass of the transform.
pub struct Pass<R> {
    pub radix: usize,
    pub blocks: usize,
    pub stride: usize,
    /// Twiddle factors: `radix - 1` for each block.
    pub turn: Vec<[R; 2]>,
    /// Cosine and minus sine of 2 pi k t / r of a prime radix without a butterfly: groups of
    /// [`TOGETHER`] outputs k = 1..=r/2, in each group all t = 1..=r/2, for each t the outputs.
    pub circle: Vec<[R; 2]>,
}

/// Planned transform.
pub struct Fft<R> {
    /// Number of points, the length of each buffer.
    pub len: usize,
    /// Passes in order.
    pub passes: Vec<Pass<R>>,
}

impl<R: Real> Fft<R> {
    /// Transforms `a`, using both buffers; returns the one with the result, then the other.
    #[inline(always)]
    pub fn run<'a, V: Vector<Number = R>>(
        &self,
        mut a: &'a mut [Complex<V>],
        mut b: &'a mut [Complex<V>],
    ) -> [&'a mut [Complex<V>]; 2] {
        for pass in &self.passes {
            match pass.radix {
                2 => step::<V, 2>(pass, a, b),
                3 => step::<V, 3>(pass, a, b),
                4 => step::<V, 4>(pass, a, b),
                5 => step::<V, 5>(pass, a, b),
                7 => step::<V, 7>(pass, a, b),
                8 => step::<V, 8>(pass, a, b),
                _ => prime_step(pass, a, b),
            }
            std::mem::swap(&mut a, &mut b);
        }
        [a, b]
    }
}

/// Pass with a butterfly.
#[inline(always)]
fn step<V: Vector, const R: usize>(
    pass: &Pass<V::Number>,
    source: &[Complex<V>],
    target: &mut [Complex<V>],
) {
    let (stride, span) = (pass.stride, pass.blocks * pass.stride);
    let mut from: [&[Complex<V>]; R] = [&[]; R];
    for t in 0..R {
        from[t] = &source[t * span..][..span];
    }
    let target = &mut target[..R * span];
    if pass.blocks == 1 {
        // All twiddle factors of the last pass are one.
        let to: [_; R] = cut(target, span);
        for q in 0..span {
            let y = butterfly(&from, q);
            for t in 0..R {
                to[t][q] = y[t];
            }
        }
        return;
    }
    let turns = pass.turn.chunks_exact(R - 1);
    if stride == 1 {
        // Slices of one entry in the first pass would cost 7 % of the instructions of a step.
        let (to, _) = target.as_chunks_mut::<R>();
        for ((p, turn), to) in turns.enumerate().zip(to) {
            let y = butterfly(&from, p);
            to[0] = y[0];
            for t in 1..R {
                to[t] = y[t].times(turn[t - 1]);
            }
        }
        return;
    }
    for ((p, turn), block) in turns.enumerate().zip(target.chunks_exact_mut(R * stride)) {
        let here = from.map(|from| &from[p * stride..][..stride]);
        let to: [_; R] = cut(block, stride);
        for q in 0..stride {
            let y = butterfly(&here, q);
            to[0][q] = y[0];
            for t in 1..R {
                to[t][q] = y[t].times(turn[t - 1]);
            }
        }
    }
}

/// Splits `R` slices of `len` entries off `rest`.
#[inline(always)]
fn cut<T, const R: usize>(mut rest: &mut [T], len: usize) -> [&mut [T]; R] {
    let mut slices = std::array::from_fn(|_| Default::default());
    for slice in &mut slices {
        (*slice, rest) = rest.split_at_mut(len);
    }
    slices
}

/// Pass of any odd prime radix; `source` is overwritten.
#[inline(always)]
fn prime_step<V: Vector>(
    pass: &Pass<V::Number>,
    source: &mut [Complex<V>],
    target: &mut [Complex<V>],
) {
    let (r, stride, span) = (pass.radix, pass.stride, pass.blocks * pass.stride);
    let half = r / 2;
    for at in 0..span {
        let first = source[at];
        let mut sum = first;
        for t in 1..=half {
            let (low, high) = (source[at + t * span], source[at + (r - t) * span]);
            sum = sum + (low + high);
            source[at + t * span] = low + high;
            source[at + (r - t) * span] = low - high;
        }
        let (p, q) = (at / stride, at % stride);
        let target = &mut target[stride * r * p + q..];
        let turn = &pass.turn[p * (r - 1)..][..r - 1];
        target[0] = sum;
        for (group, circle) in pass.circle.chunks_exact(half * TOGETHER).enumerate() {
            let (mut even, mut odd) = ([first; TOGETHER], [Complex::zero(); TOGETHER]);
            for (circle, t) in circle.as_chunks::<TOGETHER>().0.iter().zip(1..) {
                let (sum, difference) = (source[at + t * span], source[at + (r - t) * span]);
                for m in 0..TOGETHER {
                    let [cos, sin] = circle[m];
                    even[m] = even[m] + sum.scale(cos);
                    odd[m] = odd[m] + difference.scale(sin);
                }
            }
            let outputs = 1 + group * TOGETHER..=half;
            for ((k, even), odd) in outputs.zip(even).zip(odd) {
                let [y, z] = rotated_butterfly(even, odd);
                target[stride * k] = y.times(turn[k - 1]);
                target[stride * (r - k)] = z.times(turn[r - k - 1]);
            }
        }
    }
}

/// Transform of entry `q` of each of `R` = 2, 3, 4, 5, 7 or 8 slices: X_k is the sum over t of
/// x_t exp(-2 pi i k t / R).
#[inline(always)]
fn butterfly<V: Vector, const R: usize>(from: &[&[Complex<V>]; R], q: usize) -> [Complex<V>; R] {
    let mut x = [Complex::zero(); R];
    for t in 0..R {
        x[t] = from[t][q];
    }
    let mut y = x;
    match R {
        2 => (y[0], y[1]) = (x[0] + x[1], x[0] - x[1]),
        3 => return odd_butterfly(x, [[-0.5, 0.866_025_403_784_438_6]]),
        4 => y.copy_from_slice(&four([x[0], x[1], x[2], x[3]])),
        5 => {
            let roots = [
                [0.309_016_994_374_947_45, 0.951_056_516_295_153_5],
                [-0.809_016_994_374_947_5, 0.587_785_252_292_473_1],
            ];
            return odd_butterfly(x, roots);
        }
        7 => {
            let roots = [
                [0.623_489_801_858_733_6, 0.781_831_482_468_029_8],
                [-0.222_520_933_956_314_34, 0.974_927_912_181_823_6],
                [-0.900_968_867_902_419_1, 0.433_883_739_117_558_1],
            ];
            return odd_butterfly(x, roots);
        }
        _ => {
            // Transforms of length four of the even and of the odd inputs.
            let [p, q, r, s] = four([x[0], x[2], x[4], x[6]]);
            let [t, u, v, w] = four([x[1], x[3], x[5], x[7]]);
            let half = V::Number::of(FRAC_1_SQRT_2);
            // Times exp(-i pi / 4) and exp(-3 i pi / 4).
            let u = Complex { re: u.re + u.im, im: u.im - u.re }.scale(half);
            let w = Complex { re: w.im - w.re, im: V::constant(0.0) - (w.re + w.im) }.scale(half);
            let [y2, y6] = rotated_butterfly(r, v);
            y.copy_from_slice(&[p + t, q + u, y2, s + w, p - t, q - u, y6, s - w]);
        }
    }
    y
}

#[inline(always)]
fn four<V: Vector>([a, b, c, d]: [Complex<V>; 4]) -> [Complex<V>; 4] {
    let (s, t, u) = (a + c, a - c, b + d);
    let [y, z] = rotated_butterfly(t, b - d);
    [s + u, y, s - u, z]
}

/// Transform of an odd length `R` = 2 `H` + 1; `roots` has the cosine and sine of 2 pi n / `R`,
/// n = 1..=`H`.
#[inline(always)]
fn odd_butterfly<V: Vector, const R: usize, const H: usize>(
    x: [Complex<V>; R],
    roots: [[f64; 2]; H],
) -> [Complex<V>; R] {
    let mut y = [x[0]; R];
    for t in 1..=H {
        y[0] = y[0] + (x[t] + x[R - t]);
    }
    for k in 1..=H {
        let [cos, sin] = roots[k - 1].map(V::Number::of);
        let mut even = x[0] + (x[1] + x[R - 1]).scale(cos);
        let mut odd = (x[1] - x[R - 1]).scale(sin);
        for t in 2..=H {
            let n = k * t % R;
            // The angles n and R - n have the same cosine and opposite sines.
            let [cos, sin] = if n <= H { roots[n - 1] } else { roots[R - n - 1] };
            let sin = if n <= H { sin } else { -sin };
            even = even + (x[t] + x[R - t]).scale(V::Number::of(cos));
            odd = odd + (x[t] - x[R - t]).scale(V::Number::of(sin));
        }
        [y[k], y[R - k]] = rotated_butterfly(even, odd);
    }
    y
}
