//! Figures of a suite: curves, points and fields from run folders beside reference data.

mod build;
mod draw;
mod plot;
mod raw;
mod spec;

pub(crate) use build::build;
pub use draw::DrawnFigure;
pub(crate) use raw::RawFigure;
pub use spec::FigureSpec;
