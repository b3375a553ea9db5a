//! Tests of shapes: from scans and meshes to grain files.

mod bodies;
mod case_grains;
mod common;
mod family;
mod grey;
mod mesh;
mod packing;
mod render;
mod rescue;
mod roundness;
mod scan;
mod surroundings;
mod tiled;
mod tiles;
mod touching;
