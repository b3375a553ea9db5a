//! Vector registers, and the choice among instruction sets, made when the program runs.
//!
//! A [`Kernel`] is written once over [`Vector`] and compiled for each instruction set; [`dispatch`]
//! calls the widest set of the machine. All sets round alike: a product is fused with a sum only
//! where a kernel says `mul_add`, and no result depends on the number of lanes, so results are
//! bitwise identical on all machines. Machines without AVX2 have no fused instruction and call a
//! function.
//!
//! All functions that a kernel calls must be inlined into it, hence the many `inline(always)`:
//! functions that are not inlined are compiled for the baseline. Closures over vectors that are
//! called more than once, also by `map` of an array, are not inlined; use functions or loops.

mod aligned;
mod complex;
mod dispatch;
#[cfg(any(test, not(target_arch = "x86_64")))]
mod plain;
mod precision;
mod rows;
mod scalar;
mod stencil;
#[cfg(test)]
mod tests;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use aligned::Aligned;
pub use complex::{Complex, as_complex, rotated_butterfly};
pub use dispatch::{InstructionSet, dispatch, instructions, limit_instructions};
pub use precision::Precision;
pub use rows::{
    Maximum, Partial, RowWork, along_row, inner_lines, store_in_rows, window, window_mut,
};
pub use scalar::Scalar;
pub use stencil::Stencil;
pub use vector::{Kernel, Real, Registers, Vector};

/// Lanes of the widest register.
pub const MAX_LANES: usize = 16;
/// Length of the longest list whose indices singles hold exactly.
pub const MAX_SINGLE_INDEX: usize = 1 << 24;
