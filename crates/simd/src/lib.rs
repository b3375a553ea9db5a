//! Vector registers and the choice among instruction sets, made once when the program runs.
//!
//! A [`Kernel`] is written once over [`Vector`] and compiled for each instruction set; [`dispatch`]
//! calls the widest that the machine has. All of them round alike: a product is fused with a sum where a
//! kernel says so and nowhere else, and no result depends on the number of lanes, so the bits are the same
//! everywhere. (Machines without AVX2 have no such instruction and pay for it with a call.)
//!
//! Everything that a kernel calls must be inlined into it, hence the many `inline(always)`: what is
//! left outside would be compiled for the oldest machine. So would be closures over vectors, also those
//! given to `map` of an array: where they are called more than once they are not inlined, and then every
//! operation in them is a call. Write functions that are always inlined, or loops.

mod aligned;
mod complex;
mod one;
#[cfg(any(test, not(target_arch = "x86_64")))]
mod plain;
mod real;
mod rows;
mod stencil;
#[cfg(test)]
mod tests;
#[cfg(target_arch = "x86_64")]
mod x86;
#[cfg(target_arch = "x86_64")]
mod x86_transpose;

use std::ops::{Add, Mul, Sub};
use std::sync::atomic::{AtomicU8, Ordering};

pub use aligned::Aligned;
pub use complex::{Complex, turned};
pub use one::One;
pub use real::{Precision, Real};
pub use rows::{Partial, RowWork, along_row, window, window_mut};
pub use stencil::Stencil;

/// Numbers of the widest register.
pub const MOST: usize = 16;
/// Entries of a list whose places singles can hold.
pub const MOST_PLACES: usize = 1 << 24;

/// A register of `WIDTH` numbers.
pub trait Vector:
    Copy + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// Numbers held: 8, 4 or 1 doubles, 16, 8, 4 or 1 singles.
    const WIDTH: usize;
    /// What it holds.
    type Number: Real;
    /// The vector of half a cache line of the same instruction set.
    type Half: Vector<Number = Self::Number>;
    /// The vector of four lanes of the same instruction set.
    type Tail: Vector<Number = Self::Number>;
    /// The same number in every lane.
    fn splat(value: Self::Number) -> Self;
    /// The number nearest to `value` in every lane.
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::splat(Self::Number::of(value))
    }
    /// The first `WIDTH` numbers of `from`.
    fn load(from: &[Self::Number]) -> Self;
    /// Overwrites the first `WIDTH` numbers of `to`.
    fn store(self, to: &mut [Self::Number]);
    /// The same past the caches where `to` starts on a register: they need not fetch first what is overwritten
    /// as a whole, nor keep what is not read soon. [`Self::fence`] before another thread reads it.
    #[inline(always)]
    fn store_past(self, to: &mut [Self::Number]) {
        self.store(to);
    }
    /// Lets nothing written later be seen before what [`Self::store_past`] wrote.
    #[inline(always)]
    fn fence() {}
    /// The first `WIDTH` of other numbers, rounded to these.
    #[inline(always)]
    fn load_from<R: Real>(from: &[R]) -> Self {
        let mut lanes = [Self::Number::default(); MOST];
        for i in 0..Self::WIDTH {
            lanes[i] = Self::Number::of(from[..Self::WIDTH][i].wide());
        }
        Self::load(&lanes)
    }
    /// Overwrites the first `WIDTH` of other numbers, rounded to those.
    #[inline(always)]
    fn store_to<R: Real>(self, to: &mut [R]) {
        let mut lanes = [Self::Number::default(); MOST];
        self.store(&mut lanes);
        for i in 0..Self::WIDTH {
            to[..Self::WIDTH][i] = R::of(lanes[i].wide());
        }
    }
    /// As many of other numbers as there are, no more than `WIDTH`, then zeros.
    #[inline(always)]
    fn load_some<R: Real>(from: &[R]) -> Self {
        let mut lanes = [Self::Number::default(); MOST];
        for (lane, entry) in lanes[..Self::WIDTH].iter_mut().zip(from) {
            *lane = Self::Number::of(entry.wide());
        }
        Self::load(&lanes)
    }
    /// Adds the lanes to as many of other numbers as there are, no more than `WIDTH`.
    #[inline(always)]
    fn add_some<R: Real>(self, to: &mut [R]) {
        (Self::load_some(to) + self).store_some(to);
    }
    /// Overwrites as many of other numbers as there are, no more than `WIDTH`.
    #[inline(always)]
    fn store_some<R: Real>(self, to: &mut [R]) {
        let mut lanes = [Self::Number::default(); MOST];
        self.store(&mut lanes);
        for (entry, lane) in to.iter_mut().zip(&lanes[..Self::WIDTH]) {
            *entry = R::of(lane.wide());
        }
    }
    /// Overwrites as many numbers as there are, no more than there are such lanes, with the lanes from `skip` on.
    #[inline(always)]
    fn store_from(self, skip: usize, to: &mut [Self::Number]) {
        let mut lanes = [Self::Number::default(); MOST];
        self.store(&mut lanes);
        for (entry, lane) in to.iter_mut().zip(&lanes[skip..Self::WIDTH]) {
            *entry = *lane;
        }
    }
    /// The numbers of the lanes.
    #[inline(always)]
    fn ramp() -> Self {
        let mut lanes = [Self::Number::default(); MOST];
        for i in 0..Self::WIDTH {
            lanes[i] = Self::Number::of(RAMP[i]);
        }
        Self::load(&lanes)
    }
    /// Lane-wise quotient.
    fn over(self, divisor: Self) -> Self;
    /// Lane-wise `self` where it is greater, else `other`.
    fn larger(self, other: Self) -> Self;
    /// Lane-wise `self` where it is smaller, else `other`.
    fn smaller(self, other: Self) -> Self;
    /// Lane-wise `yes` where it is smaller than `limit`, else `no`.
    fn where_below(self, limit: Self, yes: Self, no: Self) -> Self;
    /// Lane-wise 1 where it is smaller than `limit`, else 0.
    #[inline(always)]
    fn is_below(self, limit: Self) -> Self {
        self.where_below(limit, Self::constant(1.0), Self::constant(0.0))
    }
    /// The lanes that are smaller than `limit`, as bits.
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        let mut lanes = [Self::Number::default(); MOST];
        self.is_below(limit).store(&mut lanes);
        let lanes = lanes[..Self::WIDTH].iter().enumerate();
        lanes.fold(0, |mask, (n, lane)| {
            mask | u32::from(lane.wide() > 0.0) << n
        })
    }
    /// Lane-wise `self * factor + term`, rounded once.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// Lane-wise absolute value.
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.larger(Self::constant(0.0) - self)
    }
    /// Whether every lane is zero.
    #[inline(always)]
    fn is_zero(self) -> bool {
        let mut lanes = [Self::Number::default(); MOST];
        self.store(&mut lanes);
        lanes[..Self::WIDTH].iter().all(|lane| lane.wide() == 0.0)
    }
    /// The lanes moved up by one, the last of `before` first.
    #[inline(always)]
    fn behind(self, before: Self) -> Self {
        let mut lanes = [[Self::Number::default(); MOST]; 2];
        before.store(&mut lanes[0]);
        self.store(&mut lanes[1]);
        lanes[1].copy_within(..Self::WIDTH - 1, 1);
        lanes[1][0] = lanes[0][Self::WIDTH - 1];
        Self::load(&lanes[1])
    }
    /// Lane-wise largest whole number that is not greater.
    #[inline(always)]
    fn floor(self) -> Self {
        self.each(f64::floor)
    }
    /// Lane-wise square root.
    #[inline(always)]
    fn root(self) -> Self {
        self.each(f64::sqrt)
    }
    /// Lane-wise `f`, one by one.
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        let mut lanes = [Self::Number::default(); MOST];
        self.store(&mut lanes);
        for lane in &mut lanes[..Self::WIDTH] {
            *lane = Self::Number::of(f(lane.wide()));
        }
        Self::load(&lanes)
    }
    /// Lane-wise one over the square root of what is not negative, within 1e-10 or what singles can hold; some
    /// large number of 0. A root and a quotient take five times as long.
    #[inline(always)]
    fn inverse_root(self) -> Self {
        let (half, more) = (Self::constant(-0.5) * self, Self::constant(1.5));
        let mut inverse = self.inverse_root_guess();
        // Newton's iteration: the error goes from .035 to .002, 5e-6 and 4e-11.
        for _ in 0..3 {
            inverse = inverse * (half * inverse).mul_add(inverse, more);
        }
        inverse
    }
    /// The same within .035: half the exponent, turned around.
    #[inline(always)]
    fn inverse_root_guess(self) -> Self {
        let mut lanes = [Self::Number::default(); MOST];
        self.store(&mut lanes);
        for lane in &mut lanes[..Self::WIDTH] {
            *lane = lane.inverse_root_guess();
        }
        Self::load(&lanes)
    }
    /// Of each lane of `at`, a whole number, the entry of `from` there and the next.
    #[inline(always)]
    fn pairs(from: &[i16], at: Self) -> [Self; 2] {
        let mut lanes = [[Self::Number::default(); MOST]; 2];
        at.store(&mut lanes[0]);
        for n in 0..Self::WIDTH {
            let at = lanes[0][n].wide() as usize;
            let pair = &from[at..at + 2];
            lanes[0][n] = Self::Number::of(f64::from(pair[0]));
            lanes[1][n] = Self::Number::of(f64::from(pair[1]));
        }
        lanes.map(|lanes| Self::load(&lanes))
    }
    /// Swaps rows and columns of `WIDTH` vectors.
    fn transpose(block: &mut [Self]);
    /// Adds the lanes, as doubles, to the first `WIDTH` of `sums`.
    fn add_to(self, sums: &mut [f64]);
    /// Raises the first `WIDTH` of `tops` to the lanes, as doubles, where those are greater.
    fn raise(self, tops: &mut [f64]);
}

/// The widest vectors of a number for each instruction set.
pub trait Registers: Sized {
    /// Of [`Level::Common`].
    type Common: Vector<Number = Self>;
    /// Of [`Level::Avx2`].
    type Avx2: Vector<Number = Self>;
    /// Of [`Level::Avx512`].
    type Avx512: Vector<Number = Self>;
}

#[cfg(target_arch = "x86_64")]
impl Registers for f64 {
    type Common = x86::Pairs;
    type Avx2 = x86::Four;
    type Avx512 = x86::Eight;
}
#[cfg(target_arch = "x86_64")]
impl Registers for f32 {
    type Common = x86::SinglesTwice;
    type Avx2 = x86::EightSingles;
    type Avx512 = x86::SixteenSingles;
}
#[cfg(not(target_arch = "x86_64"))]
impl Registers for f64 {
    type Common = plain::Plain<f64, 4>;
    type Avx2 = Self::Common;
    type Avx512 = Self::Common;
}
#[cfg(not(target_arch = "x86_64"))]
impl Registers for f32 {
    type Common = plain::Plain<f32, 8>;
    type Avx2 = Self::Common;
    type Avx512 = Self::Common;
}

/// Numbers of the lanes.
pub const RAMP: [f64; MOST] = {
    let mut ramp = [0.0; MOST];
    let mut i = 0;
    while i < MOST {
        ramp[i] = i as f64;
        i += 1;
    }
    ramp
};

/// Asks for the entries of a list from `at` to `at + count` to be brought near: short rows end before the
/// processor guesses that they are read. Nothing happens where there are none.
#[inline(always)]
pub fn prefetch<T>(list: &[T], at: usize, count: usize) {
    #[cfg(target_arch = "x86_64")]
    prefetch_to::<{ std::arch::x86_64::_MM_HINT_T0 }, T>(list, at, count);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (list, at, count);
}

/// The same, not quite so near: what is read soon but not next.
#[inline(always)]
pub fn prefetch_ahead<T>(list: &[T], at: usize, count: usize) {
    #[cfg(target_arch = "x86_64")]
    prefetch_to::<{ std::arch::x86_64::_MM_HINT_T1 }, T>(list, at, count);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (list, at, count);
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn prefetch_to<const HINT: i32, T>(list: &[T], at: usize, count: usize) {
    use std::arch::x86_64::_mm_prefetch;
    const LINE: usize = 64;
    let end = at.wrapping_add(count).min(list.len());
    if at >= end {
        return;
    }
    let mut line = list.as_ptr().wrapping_add(at);
    let end = list.as_ptr().wrapping_add(end);
    line = line.wrapping_byte_sub(line.addr() % LINE);
    while line < end {
        // SAFETY: a prefetch changes nothing, wherever it is.
        unsafe { _mm_prefetch::<HINT>(line.cast()) };
        line = line.wrapping_byte_add(LINE);
    }
}

/// Work compiled for every instruction set.
pub trait Kernel {
    /// What it works on.
    type Number: Real;
    /// The work, with the widest vectors of the instruction set; mark it `inline(always)`.
    fn run<V: Vector<Number = Self::Number>>(self);
}

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// What every machine has: pairs of doubles, fours of singles on x86-64.
    Common = 1,
    /// AVX2 with FMA: registers of four doubles or eight singles.
    Avx2 = 2,
    /// AVX-512: registers of eight doubles or sixteen singles.
    Avx512 = 3,
}

/// Level in use; 0 before the first question.
static LEVEL: AtomicU8 = AtomicU8::new(0);

/// The level in use.
pub fn level() -> Level {
    match LEVEL.load(Ordering::Relaxed) {
        3 => Level::Avx512,
        2 => Level::Avx2,
        1 => Level::Common,
        _ => limit_level(Level::Avx512),
    }
}

/// Uses the widest level of this machine up to `highest` from now on, in the whole program (to
/// compare levels); returns it.
pub fn limit_level(highest: Level) -> Level {
    let level = widest().min(highest);
    LEVEL.store(level as u8, Ordering::Relaxed);
    level
}

#[cfg(target_arch = "x86_64")]
fn widest() -> Level {
    if !(is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")) {
        Level::Common
    } else if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
        Level::Avx512
    } else {
        Level::Avx2
    }
}
#[cfg(not(target_arch = "x86_64"))]
fn widest() -> Level {
    Level::Common
}

/// Runs `kernel` with the instruction set of [`level`].
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) {
    match level() {
        // SAFETY: `level` never exceeds what was detected on this machine.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { with_avx512(kernel) },
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { with_avx2(kernel) },
        _ => kernel.run::<<K::Number as Registers>::Common>(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn with_avx512<K: Kernel>(kernel: K) {
    kernel.run::<<K::Number as Registers>::Avx512>();
}
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<K: Kernel>(kernel: K) {
    kernel.run::<<K::Number as Registers>::Avx2>();
}

/// The numbers of `values` as complex lanes; `values` must be aligned as [`super::Aligned`] is.
#[inline(always)]
pub fn as_complex<V: Vector>(values: &mut [V::Number]) -> &mut [Complex<V>] {
    // SAFETY: every `Vector` here is `WIDTH` numbers without padding, for which any bits are valid.
    let (head, lanes, _) = unsafe { values.align_to_mut::<Complex<V>>() };
    assert!(head.is_empty(), "lanes start on a cache line");
    lanes
}
