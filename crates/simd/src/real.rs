//! Numbers of fields: single or double precision.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Sub};

use serde::{Deserialize, Serialize};

use super::Registers;
use super::sealed::Sealed;

/// Precision of the fields of a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// Single precision: half the memory, up to twice the speed.
    #[serde(rename = "f32")]
    Single,
    /// Double precision.
    #[default]
    #[serde(rename = "f64")]
    Double,
}

impl std::str::FromStr for Precision {
    type Err = String;
    fn from_str(name: &str) -> Result<Precision, String> {
        match name {
            "f64" => Ok(Precision::Double),
            "f32" => Ok(Precision::Single),
            _ => Err("accepted: f64, f32".into()),
        }
    }
}

impl std::fmt::Display for Precision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Precision::Single => "f32",
            Precision::Double => "f64",
        })
    }
}

impl Precision {
    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Precision::Single => f32::BYTES,
            Precision::Double => f64::BYTES,
        }
    }
}

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
