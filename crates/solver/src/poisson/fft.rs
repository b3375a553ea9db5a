//! Complex Fourier transforms of lengths with small prime factors, one line per lane.
//!
//! Stockham's self-sorting scheme: one pass over the data per factor, from one buffer to the other,
//! no bit reversal. Factors 2, 3, 4, 5, 7 and 8 have butterflies of their own, other primes a loop
//! over pairs of outputs; beyond `LARGEST_PRIME` the length is padded instead (`axis.rs`).
//!
//! Outputs of a butterfly come in pairs k, r - k: with e_k the cosine sum over x_t + x_{r-t} and
//! o_k the sine sum over x_t - x_{r-t} they are e_k - i o_k and e_k + i o_k.
//!
//! Legend: r radix; blocks number of groups with different twiddle factors; stride product of the
//! radices of the earlier passes.

use std::f64::consts::PI;

use crate::math::Real;
use grainwake_simd::{Complex, Vector, rotated_butterfly};

/// Largest prime factor that is transformed by its definition (measured: decision 0005).
pub const LARGEST_PRIME: usize = 113;
/// Outputs (and their mirrors) of a prime radix that are summed in one loop over its inputs.
const TOGETHER: usize = 4;

/// exp(-2 pi i numerator / denominator).
pub fn root(numerator: usize, denominator: usize) -> [f64; 2] {
    let angle = -2.0 * PI * (numerator % denominator) as f64 / denominator as f64;
    [angle.cos(), angle.sin()]
}

/// Factors in the order of the passes.
pub fn factors(mut n: usize) -> Vec<usize> {
    let mut found = Vec::new();
    // As few passes as possible for the powers of two.
    let mut twos = n.trailing_zeros();
    n >>= twos;
    while twos > 0 {
        let taken = match twos {
            1 | 2 => twos,
            4 => 2,
            _ => 3,
        };
        found.push(1 << taken);
        twos -= taken;
    }
    for radix in [3, 5, 7] {
        while n.is_multiple_of(radix) {
            found.push(radix);
            n /= radix;
        }
    }
    let mut radix = 11;
    while n > 1 {
        if radix * radix > n {
            radix = n;
        }
        if n.is_multiple_of(radix) {
            found.push(radix);
            n /= radix;
        } else {
            radix += 2;
        }
    }
    found
}

/// One pass of the transform.
struct Pass<R> {
    radix: usize,
    blocks: usize,
    stride: usize,
    /// Twiddle factors: `radix - 1` for each block.
    turn: Vec<[R; 2]>,
    /// Cosines and sines of a prime radix without a butterfly, in the order in which `modes` reads.
    circle: Vec<[R; 2]>,
}

/// Planned transform.
pub struct Fft<R> {
    passes: Vec<Pass<R>>,
}

impl<R: Real> Fft<R> {
    /// Plans for `n` points.
    pub fn new(n: usize) -> Fft<R> {
        let (mut left, mut stride) = (n, 1);
        let pass = |radix: usize| {
            let blocks = left / radix;
            let turn = (0..blocks)
                .flat_map(|p| (1..radix).map(move |t| root(p * t, left).map(R::of)))
                .collect();
            let pass = Pass {
                radix,
                blocks,
                stride,
                turn,
                circle: if radix > 8 { circle(radix) } else { Vec::new() },
            };
            left = blocks;
            stride *= radix;
            pass
        };
        Fft { passes: factors(n).into_iter().map(pass).collect() }
    }

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
) where
    Short: Butterfly<R>,
{
    let (stride, span) = (pass.stride, pass.blocks * pass.stride);
    let mut from: [&[Complex<V>]; R] = [&[]; R];
    for t in 0..R {
        from[t] = &source[t * span..][..span];
    }
    let target = &mut target[..R * span];
    if pass.blocks == 1 {
        let to: [_; R] = cut(target, span);
        for q in 0..span {
            let mut x = [Complex::zero(); R];
            for t in 0..R {
                x[t] = from[t][q];
            }
            let y = Short::apply(x);
            for t in 0..R {
                to[t][q] = y[t];
            }
        }
    } else if stride == 1 {
        let (to, _) = target.as_chunks_mut::<R>();
        for ((p, turn), to) in pass.turn.chunks_exact(R - 1).enumerate().zip(to) {
            let mut x = [Complex::zero(); R];
            for t in 0..R {
                x[t] = from[t][p];
            }
            let y = Short::apply(x);
            to[0] = y[0];
            for t in 1..R {
                to[t] = y[t].times(turn[t - 1]);
            }
        }
    } else {
        let blocks = target.chunks_exact_mut(R * stride);
        for ((p, turn), block) in pass.turn.chunks_exact(R - 1).enumerate().zip(blocks) {
            let mut here: [&[Complex<V>]; R] = [&[]; R];
            for t in 0..R {
                here[t] = &from[t][p * stride..][..stride];
            }
            let to: [_; R] = cut(block, stride);
            for q in 0..stride {
                let mut x = [Complex::zero(); R];
                for t in 0..R {
                    x[t] = here[t][q];
                }
                let y = Short::apply(x);
                to[0][q] = y[0];
                for t in 1..R {
                    to[t][q] = y[t].times(turn[t - 1]);
                }
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
        let mut sum = source[at];
        for t in 1..=half {
            let (b, e) = (source[at + t * span], source[at + (r - t) * span]);
            sum = sum + (b + e);
            source[at + t * span] = b + e;
            source[at + (r - t) * span] = b - e;
        }
        let (p, q) = (at / stride, at % stride);
        let to = stride * r * p + q;
        target[to] = sum;
        let mut k = 1;
        while k <= half {
            if k + TOGETHER <= half + 1 {
                modes::<V, TOGETHER>(pass, source, target, at, to, k);
                k += TOGETHER;
            } else {
                modes::<V, 1>(pass, source, target, at, to, k);
                k += 1;
            }
        }
    }
}

/// Computes outputs k..k + K of a prime radix and their mirrors.
#[inline(always)]
fn modes<V: Vector, const K: usize>(
    pass: &Pass<V::Number>,
    source: &[Complex<V>],
    target: &mut [Complex<V>],
    at: usize,
    to: usize,
    k: usize,
) {
    let (r, stride, span) = (pass.radix, pass.stride, pass.blocks * pass.stride);
    let half = r / 2;
    let (mut even, mut odd) = ([source[at]; K], [Complex::zero(); K]);
    let (circle, _) = pass.circle[(k - 1) * half..(k - 1 + K) * half].as_chunks::<K>();
    let (mut sum, mut difference) = (at + span, at + (r - 1) * span);
    for circle in circle {
        let (b, e) = (source[sum], source[difference]);
        for m in 0..K {
            let [cos, sin] = circle[m];
            even[m] = even[m] + b.scale(cos);
            odd[m] = odd[m] + e.scale(sin);
        }
        sum += span;
        difference -= span;
    }
    let turn = &pass.turn[at / stride * (r - 1)..][..r - 1];
    for m in 0..K {
        let k = k + m;
        let [y, z] = rotated_butterfly(even[m], odd[m]);
        target[to + stride * k] = y.times(turn[k - 1]);
        target[to + stride * (r - k)] = z.times(turn[r - k - 1]);
    }
}

/// Cosines and sines of 2 pi k t / r in the order in which `prime_step` sums.
fn circle<R: Real>(r: usize) -> Vec<[R; 2]> {
    let half = r / 2;
    let mut found = Vec::with_capacity(half * half);
    let mut k = 1;
    while k <= half {
        let together = if k + TOGETHER <= half + 1 { TOGETHER } else { 1 };
        for t in 1..=half {
            for m in 0..together {
                let [cos, sin] = root((k + m) * t, r);
                found.push([cos, -sin].map(R::of));
            }
        }
        k += together;
    }
    found
}

/// Fourier transform of fixed length `R`.
trait Butterfly<const R: usize> {
    /// Returns X_k = sum over t of x_t exp(-2 pi i k t / R).
    fn apply<V: Vector>(x: [Complex<V>; R]) -> [Complex<V>; R];
}

/// Transforms of the lengths 2, 3, 4, 5, 7 and 8.
struct Short;

impl Butterfly<2> for Short {
    #[inline(always)]
    fn apply<V: Vector>([a, b]: [Complex<V>; 2]) -> [Complex<V>; 2] {
        [a + b, a - b]
    }
}

impl Butterfly<3> for Short {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c]: [Complex<V>; 3]) -> [Complex<V>; 3] {
        const SIN: f64 = 0.866_025_403_784_438_6;
        let sum = b + c;
        let [y, z] =
            rotated_butterfly(a - sum.scale(V::Number::of(0.5)), (b - c).scale(V::Number::of(SIN)));
        [a + sum, y, z]
    }
}

impl Butterfly<4> for Short {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c, d]: [Complex<V>; 4]) -> [Complex<V>; 4] {
        let (s, t, u) = (a + c, a - c, b + d);
        let [y, z] = rotated_butterfly(t, b - d);
        [s + u, y, s - u, z]
    }
}

impl Butterfly<5> for Short {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c, d, e]: [Complex<V>; 5]) -> [Complex<V>; 5] {
        const COS: [f64; 2] = [0.309_016_994_374_947_45, -0.809_016_994_374_947_5];
        const SIN: [f64; 2] = [0.951_056_516_295_153_5, 0.587_785_252_292_473_1];
        let (p, q, r, s) = (b + e, c + d, b - e, c - d);
        let [y1, y4] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[0])) + q.scale(V::Number::of(COS[1])),
            r.scale(V::Number::of(SIN[0])) + s.scale(V::Number::of(SIN[1])),
        );
        let [y2, y3] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[1])) + q.scale(V::Number::of(COS[0])),
            r.scale(V::Number::of(SIN[1])) - s.scale(V::Number::of(SIN[0])),
        );
        [a + p + q, y1, y2, y3, y4]
    }
}

impl Butterfly<7> for Short {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c, d, e, f, g]: [Complex<V>; 7]) -> [Complex<V>; 7] {
        const COS: [f64; 3] =
            [0.623_489_801_858_733_6, -0.222_520_933_956_314_34, -0.900_968_867_902_419_1];
        const SIN: [f64; 3] =
            [0.781_831_482_468_029_8, 0.974_927_912_181_823_6, 0.433_883_739_117_558_1];
        let (p, q, r) = (b + g, c + f, d + e);
        let (u, v, w) = (b - g, c - f, d - e);
        let [y1, y6] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[0]))
                + q.scale(V::Number::of(COS[1]))
                + r.scale(V::Number::of(COS[2])),
            u.scale(V::Number::of(SIN[0]))
                + v.scale(V::Number::of(SIN[1]))
                + w.scale(V::Number::of(SIN[2])),
        );
        let [y2, y5] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[1]))
                + q.scale(V::Number::of(COS[2]))
                + r.scale(V::Number::of(COS[0])),
            u.scale(V::Number::of(SIN[1]))
                - v.scale(V::Number::of(SIN[2]))
                - w.scale(V::Number::of(SIN[0])),
        );
        let [y3, y4] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[2]))
                + q.scale(V::Number::of(COS[0]))
                + r.scale(V::Number::of(COS[1])),
            u.scale(V::Number::of(SIN[2])) - v.scale(V::Number::of(SIN[0]))
                + w.scale(V::Number::of(SIN[1])),
        );
        [a + p + q + r, y1, y2, y3, y4, y5, y6]
    }
}

impl Butterfly<8> for Short {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c, d, e, f, g, h]: [Complex<V>; 8]) -> [Complex<V>; 8] {
        use std::f64::consts::FRAC_1_SQRT_2;
        // Transforms of length four of the even and of the odd inputs.
        let [p, q, r, s] = <Short as Butterfly<4>>::apply([a, c, e, g]);
        let [t, u, v, w] = <Short as Butterfly<4>>::apply([b, d, f, h]);
        let half = V::Number::of(FRAC_1_SQRT_2);
        // Times exp(-i pi / 4) and exp(-3 i pi / 4).
        let u = Complex { re: u.re + u.im, im: u.im - u.re }.scale(half);
        let w = Complex { re: w.im - w.re, im: V::constant(0.0) - (w.re + w.im) }.scale(half);
        let [y2, y6] = rotated_butterfly(r, v);
        [p + t, q + u, y2, s + w, p - t, q - u, y6, s - w]
    }
}
