//! Rendered images of grains.

use crate::{Field, Shape};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// An RGB image, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels along a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue of every pixel.
    pub pixels: Vec<[u8; 3]>,
}

/// Background.
const PAPER: [u8; 3] = [255, 255, 255];
/// Colour of a fully lit grain.
const STONE: DVec3 = DVec3::new(222.0, 200.0, 165.0);
/// Colour of a surface node.
const NODE: [u8; 3] = [150, 30, 30];
/// Edge length of a node marker [pixels].
const DOT: usize = 2;
/// Rays along the edge of a pixel.
const RAYS: usize = 2;

/// A viewing direction, given by the right and up directions of the image in the grain's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Direction to the right in the image.
    pub right: DVec3,
    /// Upward direction in the image.
    pub up: DVec3,
}

impl View {
    /// View along the short axis: the broadest side, long axis to the right.
    pub const BROAD: View = View { right: DVec3::X, up: DVec3::Y };
    /// View along the intermediate axis: long axis to the right, short axis up.
    pub const SIDE: View = View { right: DVec3::X, up: DVec3::Z };
    /// View along the long axis.
    pub const END: View = View { right: DVec3::Y, up: DVec3::Z };
}

impl Picture {
    /// Returns an empty image.
    pub fn blank(width: usize, height: usize) -> Picture {
        Picture { width, height, pixels: vec![PAPER; width * height] }
    }

    /// Copies another image into this one, with its upper left corner at column `x`, row `y`.
    pub fn paste(&mut self, other: &Picture, x: usize, y: usize) {
        let width = other.width.min(self.width.saturating_sub(x));
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let to = x + self.width * (y + row);
            let from = other.width * row;
            self.pixels[to..to + width].copy_from_slice(&other.pixels[from..from + width]);
        }
    }

    /// Renders a grain in orthographic projection, lit from the upper left. The image is `pixels`
    /// wide and high and shows `width` [m]; with `nodes` the surface nodes are drawn as dots.
    pub fn of(shape: &Shape, view: View, pixels: usize, width: f64, nodes: bool) -> Picture {
        let towards_eye = view.right.cross(view.up);
        let light = (0.55 * towards_eye + 0.6 * view.up - 0.5 * view.right).normalize();
        let start = shape.bounding_radius() * 1.01;
        let step = width / (pixels * RAYS) as f64;
        let place = |n: usize| (n as f64 + 0.5 - 0.5 * (pixels * RAYS) as f64) * step;
        let mut picture = Picture::blank(pixels, pixels);
        let rows = picture.pixels.par_chunks_mut(pixels).enumerate();
        rows.for_each(|(row, line)| {
            for (column, pixel) in line.iter_mut().enumerate() {
                let mut sum = DVec3::ZERO;
                for ray in 0..RAYS * RAYS {
                    let (i, j) = (RAYS * column + ray % RAYS, RAYS * row + ray / RAYS);
                    let from = place(i) * view.right - place(j) * view.up + start * towards_eye;
                    sum += trace(shape, from, -towards_eye, 2.0 * start)
                        .map_or(DVec3::from_array(PAPER.map(f64::from)), |normal| {
                            shade(normal, light, towards_eye)
                        });
                }
                let mean = sum / (RAYS * RAYS) as f64;
                *pixel = mean.to_array().map(|v| v.round() as u8);
            }
        });
        if nodes {
            picture.mark_nodes(shape, view, width);
        }
        picture
    }

    /// Renders three sides of a grain in a row: broad side, long side, end. `turn` maps the frame
    /// of the image to the grain's own; each side shows `width` [m].
    pub fn sides(shape: &Shape, turn: DMat3, pixels: usize, width: f64, nodes: bool) -> Picture {
        let mut picture = Picture::blank(3 * pixels, pixels);
        for (n, view) in [View::BROAD, View::SIDE, View::END].into_iter().enumerate() {
            let view = View { right: turn * view.right, up: turn * view.up };
            let side = Picture::of(shape, view, pixels, width, nodes);
            picture.paste(&side, n * pixels, 0);
        }
        picture
    }

    /// Draws a square of `DOT` pixels with this upper left corner.
    fn dot(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        for y in y..(y + DOT).min(self.height) {
            for x in x..(x + DOT).min(self.width) {
                self.pixels[x + self.width * y] = colour;
            }
        }
    }

    fn mark_nodes(&mut self, shape: &Shape, view: View, width: f64) {
        let towards_eye = view.right.cross(view.up);
        let scale = self.width as f64 / width;
        let clearance = 1e-2 * shape.equivalent_diameter();
        for node in shape.nodes() {
            let normal = shape.distance_and_gradient(node.position).1;
            let from = node.position + clearance * normal.normalize_or_zero();
            let away = 2.1 * shape.bounding_radius();
            let hidden =
                normal.dot(towards_eye) <= 0.0 || trace(shape, from, towards_eye, away).is_some();
            if hidden {
                continue;
            }
            let x = 0.5 * self.width as f64 + scale * node.position.dot(view.right);
            let y = 0.5 * self.height as f64 - scale * node.position.dot(view.up);
            self.dot(x as usize, y as usize, NODE);
        }
    }
}

/// Returns the normal at the point where a ray meets the surface.
fn trace(shape: &Shape, from: DVec3, along: DVec3, reach: f64) -> Option<DVec3> {
    let close = 1e-4 * shape.bounding_radius();
    // Distances outside the box cost more, and many rays miss the grain.
    let [entry, exit] = shape.box_crossing(0.01 * shape.bounding_radius(), from, along);
    let (mut t, reach) = (entry.max(0.0), exit.min(reach));
    for _ in 0..400 {
        if t > reach {
            return None;
        }
        let (distance, gradient) = shape.distance_and_gradient(from + t * along);
        if distance < close {
            return Some(smooth_normal(shape, from + t * along).unwrap_or(gradient));
        }
        // Reduced step: trilinear values may overestimate the distance.
        t += 0.9 * distance;
    }
    None
}

/// Returns the normal from differences over the spacing of a sampled field. The gradient of the
/// trilinear interpolant jumps between cells, which shows as steps.
fn smooth_normal(shape: &Shape, at: DVec3) -> Option<DVec3> {
    let Field::Sampled(field) = shape.field() else {
        return None;
    };
    let difference = |axis: DVec3| {
        let step = 0.5 * field.spacing() * axis;
        shape.distance(at + step) - shape.distance(at - step)
    };
    let [x, y, z] = DVec3::AXES.map(difference);
    DVec3::new(x, y, z).try_normalize()
}

/// Diffuse light with a dark rim, so that light faces contrast with the background.
fn shade(normal: DVec3, light: DVec3, towards_eye: DVec3) -> DVec3 {
    let lit = normal.dot(light).max(0.0);
    let rim = normal.dot(towards_eye).clamp(0.0, 1.0);
    STONE * ((0.25 + 0.75 * lit) * (0.45 + 0.55 * rim.sqrt())).min(1.0)
}
