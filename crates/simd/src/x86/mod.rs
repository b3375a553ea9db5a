//! Vectors of x86-64: SSE2 (on every machine), AVX2 with FMA, AVX-512.
//!
//! SAFETY of every block here:
//!
//! - Instructions: no other crate can name these types. Generic code gets AVX2 and AVX-512 from
//!   [`crate::dispatch`] alone, after detection of the instruction set on the machine. `Half`,
//!   `Tail` and the vector of doubles need no more than the vector itself. The unsafe functions
//!   require the instruction set of their vector.
//! - Memory: every load and store cuts its slice to the width first, or masks the lanes beyond it.
//!   [`crate::Real`] and [`crate::Vector`] are sealed: a number is `f32` or `f64`, a vector is
//!   `WIDTH` numbers without padding.

/// A vector of one register, or of two side by side.
macro_rules! vector {
    (
        $(#[$doc:meta])*
        $name:ident: $width:literal x $number:ident in [$($i:tt: $register:ident),+],
        half $half:ident, tail $tail:ident, transpose $transpose:path,
        doubles $wide:ident [$($w:tt: $widen:path),+],
        $add:ident, $sub:ident, $mul:ident, $div:ident, $max:ident, $min:ident, $sqrt:ident,
        $chosen:path, $fused:path, $set:ident, $load:ident, $store:ident, $past:ident
        $(; $($own:item)*)?
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub struct $name($(pub(super) $register),+);

        impl Add for $name {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($add(self.$i, other.$i)),+) }
            }
        }
        impl Sub for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($sub(self.$i, other.$i)),+) }
            }
        }
        impl Mul for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($mul(self.$i, other.$i)),+) }
            }
        }
        impl Sealed for $name {}
        impl Vector for $name {
            const WIDTH: usize = $width;
            type Number = $number;
            type Half = $half;
            type Tail = $tail;
            #[inline(always)]
            fn splat(value: $number) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($(splat!($i, $set, value)),+) }
            }
            #[inline(always)]
            fn load(from: &[$number]) -> Self {
                let from = from[..$width].as_ptr();
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($load(from.add($i * $width / 2))),+) }
            }
            #[inline(always)]
            fn store(self, to: &mut [$number]) {
                let to = to[..$width].as_mut_ptr();
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $($store(to.add($i * $width / 2), self.$i));+ }
            }
            #[inline(always)]
            fn store_non_temporal(self, to: &mut [$number]) {
                let register = 0_usize $(.max(size_of_val(&self.$i)))+;
                if !to.as_ptr().addr().is_multiple_of(register) {
                    return self.store(to);
                }
                let to = to[..$width].as_mut_ptr();
                // SAFETY: see the head of `x86/mod.rs`; the registers fall on multiples of their
                // size.
                unsafe { $($past(to.add($i * $width / 2), self.$i));+ }
            }
            #[inline(always)]
            fn fence() {
                // Miri does not know the instruction; its stores are never reordered.
                if !cfg!(miri) {
                    // SAFETY: every machine of this architecture has the instruction.
                    unsafe { _mm_sfence() }
                }
            }
            #[inline(always)]
            fn div(self, divisor: Self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($div(self.$i, divisor.$i)),+) }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($max(self.$i, other.$i)),+) }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($min(self.$i, other.$i)),+) }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($sqrt(self.$i)),+) }
            }
            #[inline(always)]
            fn select_below(self, limit: Self, yes: Self, no: Self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($chosen(self.$i, limit.$i, yes.$i, no.$i)),+) }
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $name($($fused(self.$i, factor.$i, term.$i)),+) }
            }
            $($($own)*)?
            #[inline(always)]
            fn transpose(block: &mut [Self]) {
                // SAFETY: see the head of `x86/mod.rs`.
                unsafe { $transpose(block) }
            }
            #[inline(always)]
            fn add_into(self, sums: &mut [f64]) {
                $(
                    let here = &mut sums[$w * $wide::WIDTH..];
                    // SAFETY: see the head of `x86/mod.rs`.
                    ($wide::load(here) + unsafe { $widen(self) }).store(here);
                )+
            }
        }
    };
}
/// `value` in all lanes of register `i`: names the index that the repetition needs.
macro_rules! splat {
    ($i:tt, $set:ident, $value:ident) => {
        $set($value)
    };
}

mod avx2;
mod avx512;
mod sse2;
mod transpose;

pub use avx2::{Avx2F32x8, Avx2F64x4};
pub use avx512::{Avx512F32x16, Avx512F64x8};
pub use sse2::{Sse2F32x4, Sse2F32x8, Sse2F64x4};

/// Vector of doubles, unchanged. Unsafe like the conversions that stand in its place.
#[inline(always)]
unsafe fn same<V>(v: V) -> V {
    v
}
