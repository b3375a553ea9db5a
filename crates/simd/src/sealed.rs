//! Supertrait of the traits that no other crate may implement.

/// Prevents implementations of [`crate::Real`] and [`crate::Vector`] in other crates. Unsafe code
/// relies on two facts: a `Real` is `f32` or `f64`, and a `Vector` is `WIDTH` numbers without
/// padding.
pub trait Sealed {}

impl Sealed for f32 {}
impl Sealed for f64 {}
