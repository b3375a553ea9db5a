//! Traits of numbers, of their vectors and of kernels; they refer to each other.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Sub};

use super::MAX_LANES;

/// Prevents implementations of [`Real`] and [`Vector`] in other crates. Unsafe code relies on two
/// facts: a `Real` is `f32` or `f64`, and a `Vector` is `WIDTH` numbers without padding.
pub trait Sealed {}

impl Sealed for f32 {}
impl Sealed for f64 {}

/// Number of a field, `f64` or `f32`. Sums over the grid and the motion of grains are doubles for
/// either. Sealed: unsafe code relies on `f64` or `f32`.
pub trait Real:
    Sealed
    + Registers
    + Copy
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// Size [bytes].
    const BYTES: usize = size_of::<Self>();
    /// Numbers in a cache line and in the widest register: 8 or 16.
    const LANES: usize = 64 / Self::BYTES;
    /// Number nearest to `value`.
    fn of(value: f64) -> Self;
    /// Value in double precision.
    fn wide(self) -> f64;
    /// `self * factor + term`, rounded once.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// Reciprocal square root within 0.035: the exponent is halved and negated.
    fn rsqrt_estimate(self) -> Self;
    /// Writes the number to the first bytes of `to`, little-endian.
    fn write_to(self, to: &mut [u8]);
    /// Reads a number from the first bytes of `from`, little-endian.
    fn read_from(from: &[u8]) -> Self;
}

/// Constant of the estimate: 1.5 times the bits of a double near one.
pub const RSQRT_MAGIC_F64: u64 = 0x5fe6_eb50_c7b5_37a9;
/// Constant of the estimate: 1.5 times the bits of a single near one.
pub const RSQRT_MAGIC_F32: u32 = 0x5f37_5a86;

macro_rules! real {
    ($number:ident, $rsqrt_magic:ident) => {
        impl Real for $number {
            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $number
            }
            #[inline(always)]
            fn wide(self) -> f64 {
                self.into()
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                $number::mul_add(self, factor, term)
            }
            #[inline(always)]
            fn rsqrt_estimate(self) -> Self {
                $number::from_bits($rsqrt_magic.wrapping_sub(self.to_bits() >> 1))
            }
            fn write_to(self, to: &mut [u8]) {
                to[..Self::BYTES].copy_from_slice(&self.to_le_bytes());
            }
            fn read_from(from: &[u8]) -> Self {
                let mut bytes = [0; Self::BYTES];
                bytes.copy_from_slice(&from[..Self::BYTES]);
                $number::from_le_bytes(bytes)
            }
        }
    };
}
real!(f64, RSQRT_MAGIC_F64);
real!(f32, RSQRT_MAGIC_F32);

/// Kernels of a number with the vectors of each instruction set.
///
/// Only the vector of the baseline has a name outside this crate: safe code cannot execute
/// instructions that the machine lacks.
pub trait Registers: Sealed + Sized {
    /// Vector of [`crate::InstructionSet::Baseline`].
    type Baseline: Vector<Number = Self>;
    /// Runs `kernel` with the vectors of [`crate::InstructionSet::Avx2`].
    ///
    /// # Safety
    /// The machine must have AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    unsafe fn with_avx2<K: Kernel<Number = Self>>(kernel: K);
    /// Runs `kernel` with the vectors of [`crate::InstructionSet::Avx512`].
    ///
    /// # Safety
    /// The machine must have AVX2, FMA, AVX-512F and AVX-512VL.
    #[cfg(target_arch = "x86_64")]
    unsafe fn with_avx512<K: Kernel<Number = Self>>(kernel: K);
}

/// Computation compiled for every instruction set.
pub trait Kernel {
    /// Type of its numbers.
    type Number: Real;
    /// Computes with the widest vectors of the instruction set; mark it `inline(always)`.
    fn run<V: Vector<Number = Self::Number>>(self);
}

/// A register of `WIDTH` numbers.
///
/// Sealed: unsafe code relies on `WIDTH` numbers without padding, for which all bits are valid.
/// [`super::dispatch`] alone names vectors wider than the baseline, inside a kernel and on a
/// machine that has their instructions. Hence the safe functions of a vector may execute them.
pub trait Vector:
    Sealed + Copy + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// Number of lanes: 8, 4 or 1 doubles, 16, 8, 4 or 1 singles.
    const WIDTH: usize;
    /// Type of the numbers.
    type Number: Real;
    /// Vector of half a cache line of the same instruction set.
    type Half: Vector<Number = Self::Number>;
    /// Vector of four lanes of the same instruction set.
    type Tail: Vector<Number = Self::Number>;
    /// Vector with `value` in every lane.
    fn splat(value: Self::Number) -> Self;
    /// Vector with the number nearest to `value` in every lane.
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::splat(Self::Number::of(value))
    }
    /// Loads the first `WIDTH` numbers of `from`.
    fn load(from: &[Self::Number]) -> Self;
    /// Overwrites the first `WIDTH` numbers of `to`.
    fn store(self, to: &mut [Self::Number]);
    /// Overwrites the first `WIDTH` numbers of `to` with a non-temporal store, which bypasses the
    /// caches, if `to` is aligned to the register. Call [`Self::fence`] before another thread
    /// reads.
    #[inline(always)]
    fn store_non_temporal(self, to: &mut [Self::Number]) {
        self.store(to);
    }
    /// Orders earlier non-temporal stores before all later stores.
    #[inline(always)]
    fn fence() {}
    /// Loads the first `WIDTH` numbers of either precision, rounded to `Self::Number`.
    #[inline(always)]
    fn load_from<R: Real>(from: &[R]) -> Self {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        for i in 0..Self::WIDTH {
            lanes[i] = Self::Number::of(from[..Self::WIDTH][i].wide());
        }
        Self::load(&lanes)
    }
    /// Overwrites the first `WIDTH` numbers of either precision with the lanes, rounded.
    #[inline(always)]
    fn store_to<R: Real>(self, to: &mut [R]) {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        self.store(&mut lanes);
        for i in 0..Self::WIDTH {
            to[..Self::WIDTH][i] = R::of(lanes[i].wide());
        }
    }
    /// Loads up to `WIDTH` numbers of a list that may be shorter; lanes beyond its end are zero.
    #[inline(always)]
    fn load_partial<R: Real>(from: &[R]) -> Self {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        for (lane, entry) in lanes[..Self::WIDTH].iter_mut().zip(from) {
            *lane = Self::Number::of(entry.wide());
        }
        Self::load(&lanes)
    }
    /// Adds the lanes to up to `WIDTH` numbers of a list that may be shorter.
    #[inline(always)]
    fn add_partial<R: Real>(self, to: &mut [R]) {
        (Self::load_partial(to) + self).store_partial(to);
    }
    /// Overwrites up to `WIDTH` numbers of a list that may be shorter.
    #[inline(always)]
    fn store_partial<R: Real>(self, to: &mut [R]) {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        self.store(&mut lanes);
        for (entry, lane) in to.iter_mut().zip(&lanes[..Self::WIDTH]) {
            *entry = R::of(lane.wide());
        }
    }
    /// Overwrites the first numbers of a list that may be shorter with the lanes from `skip` on.
    #[inline(always)]
    fn store_from(self, skip: usize, to: &mut [Self::Number]) {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        self.store(&mut lanes);
        for (entry, lane) in to.iter_mut().zip(&lanes[skip..Self::WIDTH]) {
            *entry = *lane;
        }
    }
    /// Lane indices 0, 1, 2...
    #[inline(always)]
    fn ramp() -> Self {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        for i in 0..Self::WIDTH {
            lanes[i] = Self::Number::of(RAMP[i]);
        }
        Self::load(&lanes)
    }
    /// Lane-wise quotient.
    fn div(self, divisor: Self) -> Self;
    /// Lane-wise maximum: `self` where it is greater, else `other`.
    fn max(self, other: Self) -> Self;
    /// Lane-wise minimum: `self` where it is smaller, else `other`.
    fn min(self, other: Self) -> Self;
    /// Lane-wise `yes` where `self` is below `limit`, else `no`.
    fn select_below(self, limit: Self, yes: Self, no: Self) -> Self;
    /// Lane-wise 1 where `self` is below `limit`, else 0.
    #[inline(always)]
    fn is_below(self, limit: Self) -> Self {
        self.select_below(limit, Self::constant(1.0), Self::constant(0.0))
    }
    /// Bit mask of the lanes below `limit`.
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        self.is_below(limit).store(&mut lanes);
        let lanes = lanes[..Self::WIDTH].iter().enumerate();
        lanes.fold(0, |mask, (n, lane)| mask | u32::from(lane.wide() > 0.0) << n)
    }
    /// Lane-wise `self * factor + term`, rounded once.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// Lane-wise absolute value.
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(Self::constant(0.0) - self)
    }
    /// Lanes shifted up by one; lane 0 is the last lane of `before`.
    #[inline(always)]
    fn shift(self, before: Self) -> Self {
        let mut lanes = [[Self::Number::default(); MAX_LANES]; 2];
        before.store(&mut lanes[0]);
        self.store(&mut lanes[1]);
        lanes[1].copy_within(..Self::WIDTH - 1, 1);
        lanes[1][0] = lanes[0][Self::WIDTH - 1];
        Self::load(&lanes[1])
    }
    /// Lane-wise floor.
    #[inline(always)]
    fn floor(self) -> Self {
        self.map_lanes(f64::floor)
    }
    /// Lane-wise square root.
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map_lanes(f64::sqrt)
    }
    /// Applies `f` to each lane in double precision.
    #[inline(always)]
    fn map_lanes(self, f: impl Fn(f64) -> f64) -> Self {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        self.store(&mut lanes);
        for lane in &mut lanes[..Self::WIDTH] {
            *lane = Self::Number::of(f(lane.wide()));
        }
        Self::load(&lanes)
    }
    /// Lane-wise reciprocal square root of numbers that are not negative, within 1e-10 or the
    /// rounding of singles; finite and large for 0. It takes a fifth of the time of `sqrt` and
    /// `div`.
    #[inline(always)]
    fn rsqrt(self) -> Self {
        let (half, more) = (Self::constant(-0.5) * self, Self::constant(1.5));
        let mut inverse = self.rsqrt_estimate();
        // Newton's iteration: the error falls from 0.035 to 0.002, 5e-6 and 4e-11.
        for _ in 0..3 {
            inverse = inverse * (half * inverse).mul_add(inverse, more);
        }
        inverse
    }
    /// Reciprocal square root within 0.035: the exponent is halved and negated.
    #[inline(always)]
    fn rsqrt_estimate(self) -> Self {
        let mut lanes = [Self::Number::default(); MAX_LANES];
        self.store(&mut lanes);
        for lane in &mut lanes[..Self::WIDTH] {
            *lane = lane.rsqrt_estimate();
        }
        Self::load(&lanes)
    }
    /// Entries `at` and `at + 1` of `from` for each lane; the lanes of `at` are whole numbers.
    #[inline(always)]
    fn gather_pairs(from: &[f32], at: Self) -> [Self; 2] {
        let mut lanes = [[Self::Number::default(); MAX_LANES]; 2];
        at.store(&mut lanes[0]);
        for n in 0..Self::WIDTH {
            let at = lanes[0][n].wide() as usize;
            let pair = &from[at..at + 2];
            lanes[0][n] = Self::Number::of(f64::from(pair[0]));
            lanes[1][n] = Self::Number::of(f64::from(pair[1]));
        }
        lanes.map(|lanes| Self::load(&lanes))
    }
    /// Transposes the block of the first `WIDTH` vectors.
    fn transpose(block: &mut [Self]);
    /// Adds the lanes, as doubles, to the first `WIDTH` entries of `sums`.
    fn add_into(self, sums: &mut [f64]);
}

/// Lane indices 0, 1, 2...
const RAMP: [f64; MAX_LANES] =
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];
