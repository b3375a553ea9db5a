//! Drawings in SVG and PNG: axes, curves, markers, labels, colour maps and rasters.
//!
//! A [`Drawing`] is described once and written as SVG, and as PNG in an embedded font. Equal
//! descriptions result in equal bytes. The crate depends on no other crate of the workspace.
//!
//! Lengths on paper are in points [pt], with y downwards. Labels use a small markup for italics and
//! scripts, see [`text`].

pub mod animation;
pub mod axis;
pub mod colormap;
pub mod contour;
mod curve;
pub mod drawing;
pub mod equal_aspect;
mod figure;
mod font;
pub mod frame;
pub mod legend;
mod palette;
pub mod raster;
pub mod scale_bar;
pub mod stacked;
pub mod style;
pub mod text;
mod ticks;

pub use axis::minus;
pub use drawing::Drawing;
pub use figure::Figure;
pub use style::COLUMN;
pub use text::{letter, lettered, literal, plain};
