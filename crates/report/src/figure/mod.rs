//! Figures.
mod axis;
mod colormap;
mod lines;
mod style;
mod svg;
mod text;
