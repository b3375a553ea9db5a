//! Drawings in SVG and PNG: axes, curves, markers, labels, colour maps and rasters.
//!
//! A [`Drawing`] is described once and written as SVG, and as PNG in an embedded font. The same
//! description gives the same bytes. This crate depends on no other crate of the workspace: it draws
//! values on axes, whatever they describe.
//!
//! Lengths on paper are in points [pt], with y downwards. Labels use a small markup for italics and
//! scripts, see [`text`].

pub mod axis;
pub mod colormap;
pub mod contour;
pub mod frame;
pub mod lines;
pub mod plan;
pub mod raster;
pub mod style;
pub mod svg;
pub mod text;

pub use axis::minus;
pub use style::COLUMN;
pub use svg::Drawing;
pub use text::{escape, html, literal, plain};
