//! Choice among instruction sets, made when the program runs.

use std::sync::atomic::{AtomicU8, Ordering};

#[cfg(not(target_arch = "x86_64"))]
use super::plain::Plain;
#[cfg(target_arch = "x86_64")]
use super::x86::{Avx2F32x8, Avx2F64x4, Avx512F32x16, Avx512F64x8, Sse2F32x8, Sse2F64x4};
use super::{Kernel, Registers};

#[cfg(target_arch = "x86_64")]
macro_rules! registers {
    ($number:ident, $baseline:ident, $avx2:ident, $avx512:ident) => {
        impl Registers for $number {
            type Baseline = $baseline;
            #[target_feature(enable = "avx2,fma")]
            unsafe fn with_avx2<K: Kernel<Number = Self>>(kernel: K) {
                kernel.run::<$avx2>();
            }
            #[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
            unsafe fn with_avx512<K: Kernel<Number = Self>>(kernel: K) {
                kernel.run::<$avx512>();
            }
        }
    };
}
#[cfg(target_arch = "x86_64")]
registers!(f64, Sse2F64x4, Avx2F64x4, Avx512F64x8);
#[cfg(target_arch = "x86_64")]
registers!(f32, Sse2F32x8, Avx2F32x8, Avx512F32x16);
#[cfg(not(target_arch = "x86_64"))]
impl Registers for f64 {
    type Baseline = Plain<f64, 4>;
}
#[cfg(not(target_arch = "x86_64"))]
impl Registers for f32 {
    type Baseline = Plain<f32, 8>;
}

/// Instruction set of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum InstructionSet {
    /// Instructions of every machine: SSE2 on x86-64.
    Baseline = 1,
    /// AVX2 with FMA: registers of four doubles or eight singles.
    Avx2 = 2,
    /// AVX-512: registers of eight doubles or sixteen singles.
    Avx512 = 3,
}

impl InstructionSet {
    /// All instruction sets, the narrowest first.
    pub const ALL: [InstructionSet; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// Widest instruction set of this machine, or the baseline with `--cfg narrow_registers`: the
    /// thread sanitizer ignores accesses of more than 16 bytes.
    pub fn widest() -> InstructionSet {
        #[cfg(target_arch = "x86_64")]
        if !cfg!(narrow_registers)
            && is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
        {
            let has_avx512 =
                is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl");
            return if has_avx512 { InstructionSet::Avx512 } else { InstructionSet::Avx2 };
        }
        InstructionSet::Baseline
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            InstructionSet::Baseline => "baseline",
            InstructionSet::Avx2 => "avx2",
            InstructionSet::Avx512 => "avx512",
        }
    }
}

impl std::str::FromStr for InstructionSet {
    type Err = String;
    fn from_str(name: &str) -> Result<InstructionSet, String> {
        let found = Self::ALL.into_iter().find(|set| set.name() == name);
        found.ok_or_else(|| "accepted: baseline, avx2, avx512".into())
    }
}

/// Instruction set in use; 0 before the first call of [`instructions`].
static IN_USE: AtomicU8 = AtomicU8::new(0);

/// Instruction set in use: the widest of this machine, or less after [`limit_instructions`].
pub fn instructions() -> InstructionSet {
    match IN_USE.load(Ordering::Relaxed) {
        3 => InstructionSet::Avx512,
        2 => InstructionSet::Avx2,
        1 => InstructionSet::Baseline,
        _ => limit_instructions(InstructionSet::Avx512),
    }
}

/// Makes the whole program use the widest instruction set of this machine up to `highest`, and
/// returns it.
pub fn limit_instructions(highest: InstructionSet) -> InstructionSet {
    let set = InstructionSet::widest().min(highest);
    IN_USE.store(set as u8, Ordering::Relaxed);
    set
}

/// Runs `kernel` with the instruction set of [`instructions`].
pub fn dispatch<K: Kernel>(kernel: K) {
    match instructions() {
        // SAFETY: `instructions` never exceeds the sets detected on this machine.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { K::Number::with_avx512(kernel) },
        // SAFETY: see above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { K::Number::with_avx2(kernel) },
        _ => kernel.run::<<K::Number as Registers>::Baseline>(),
    }
}
