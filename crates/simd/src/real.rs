//! The numbers that fields are made of.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Sub};

use serde::{Deserialize, Serialize};

use super::Registers;

/// Precision of the fields of a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// Single: half the memory, up to twice the speed.
    #[serde(rename = "f32")]
    Single,
    /// Double.
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

/// A number of a field, `f64` or `f32`. Sums over the grid, and the motion of grains, are doubles
/// whatever the fields are.
pub trait Real:
    Registers
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
    /// Its size.
    const BYTES: usize = size_of::<Self>();
    /// How many fill a cache line, and the widest register: 8 or 16.
    const LANES: usize = 64 / Self::BYTES;
    /// The nearest number to `value`.
    fn of(value: f64) -> Self;
    /// Its value.
    fn wide(self) -> f64;
    /// `self * factor + term`, rounded once.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// One over its square root within .035: half the exponent, turned around.
    fn inverse_root_guess(self) -> Self;
    /// Writes it to the first bytes of `to`, little end first.
    fn write_to(self, to: &mut [u8]);
    /// Reads it from the first bytes of `from`, little end first.
    fn read_from(from: &[u8]) -> Self;
}

/// Bits of a number near one, plus half of them.
pub const INVERSE_ROOT_OF_ONE: u64 = 0x5fe6_eb50_c7b5_37a9;
/// The same of a single.
pub const INVERSE_ROOT_OF_ONE_SINGLE: u32 = 0x5f37_5a86;

macro_rules! real {
    ($number:ident, $inverse_root_of_one:ident) => {
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
            fn inverse_root_guess(self) -> Self {
                $number::from_bits($inverse_root_of_one.wrapping_sub(self.to_bits() >> 1))
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
real!(f64, INVERSE_ROOT_OF_ONE);
real!(f32, INVERSE_ROOT_OF_ONE_SINGLE);
