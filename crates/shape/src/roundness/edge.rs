//! Image of an edge of known radius: forward model of the measurement of scanned edges.
//!
//! The normal section of an edge is a wedge with a rounded tip. The scanned surface is the contour
//! at which the solid fraction, after the blur of the scanner and the smoothing of the image, is
//! one half. The curvature along this contour is a function of the arc length. The exterior level
//! set stretches the contour and the Gaussian of the measurement widens the curvature; the part
//! above the curvature of the inscribed sphere counts as the corner. All lengths are relative to
//! R_in.
//!
//! Symbols: s standard deviation, u multiples of s, z depth below the surface in multiples of s, x
//! coordinate across the edge, y height above it, k curvature.

use crate::filter::Kernel;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

/// A section through an edge in the image.
#[derive(Clone, Debug, Default)]
pub(super) struct Section {
    /// Turning of the level set on one side of the edge: arc lengths from the middle and angles.
    turns: Vec<(f64, f64)>,
    /// Decrease of the length of the surface relative to the body.
    pub shorter: f64,
    /// Area of the section of the body outside the surface.
    pub outside: f64,
}

/// Edge parameters that reproduce the measurement of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edges {
    pub radius: f64,
    /// Angle by which the surface turns at the edges.
    pub angle: f64,
}

/// Parameters of the measurement chain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chain {
    /// Kernel applied to the solid fractions.
    pub image: Kernel,
    /// Distance of the level set from the surface.
    pub level: f64,
    /// Standard deviations of the Gaussians used for the curvatures.
    pub widths: [f64; 2],
    /// Largest radius that counts as a corner.
    pub corner: f64,
}

/// Step along the section.
const STEP: f64 = 0.01;
/// Half-width of the section [steps].
const HALF: usize = 160;
/// Minimum standard deviation of the image kernel, resolved by one step.
const FINEST: f64 = 0.01;
/// Points of the surface on one side of the edge.
const POINTS: usize = 64;
/// Distance from the rounded tip beyond which the faces are flat [standard deviations].
const FLAT: f64 = 5.0;
/// Points of a Gaussian on either side, and points per standard deviation.
const BELL: (i32, f64) = (20, 4.0);

impl Chain {
    /// Computes the section through an edge with these parameters.
    pub(super) fn section(&self, edges: Edges) -> Section {
        let Edges { radius, angle } = edges;
        let image = self.image.map(|(weight, s)| (weight, s.max(FINEST)));
        let (sine, cosine) = (0.5 * angle).sin_cos();
        // Height of the body above the line across the edge, relative to the intersection of the
        // faces.
        let body = |x: f64| {
            let x = x.abs();
            if x < radius * sine {
                (radius * radius - x * x).sqrt() - radius / cosine
            } else {
                -x * sine / cosine
            }
        };
        let bells: Vec<(f64, f64)> = (-BELL.0..=BELL.0)
            .map(|n| f64::from(n) / BELL.1)
            .map(|u| (u, bell(u) / (BELL.1 * (2.0 * PI).sqrt())))
            .collect();
        let widest = image.iter().fold(0.0, |s: f64, (_, t)| s.max(*t));
        // Newton's method for the height at which the solid fraction is one half.
        let surface = |x: f64, from: f64| {
            let mut y = from;
            for _ in 0..12 {
                let (mut share, mut slope) = (-0.5, 0.0);
                for (weight, s) in image {
                    for (u, part) in &bells {
                        let z = (body(x + s * u) - y) / s;
                        let bell = bell(z);
                        let below = 0.5 * (1.0 + error_function(z / SQRT_2, bell));
                        share += weight * part * below;
                        slope += weight * part * bell / (s * (2.0 * PI).sqrt());
                    }
                }
                let step = (share / slope.max(1e-9)).clamp(-widest, widest);
                y += step;
                if step.abs() < 1e-7 {
                    break;
                }
            }
            y
        };
        let step = (radius * sine + FLAT * widest * cosine) / POINTS as f64;
        let (mut height, mut tilt, mut place) = (surface(0.0, body(0.0)), 0.0, 0.0);
        let mut turns = Vec::with_capacity(POINTS + 1);
        let mut length = 0.0;
        let mut outside = 0.5 * (body(0.0) - height) * step;
        for n in 1..=POINTS {
            let next = surface(step * n as f64, height - step * f64::tan(tilt));
            let steeper = f64::atan2(height - next, step);
            let turn = steeper - tilt;
            // At the preceding point, where the two chords meet.
            turns.push((place + 0.5 * self.level * turn, turn));
            let chord = step.hypot(height - next);
            place += self.level * turn + chord;
            length += chord;
            outside += (body(step * n as f64) - next) * step;
            (height, tilt) = (next, steeper);
        }
        let turn = 0.5 * angle - tilt;
        turns.push((place + 0.5 * self.level * turn, turn));
        let own = 0.5 * angle * radius + FLAT * widest;
        Section { turns, shorter: 2.0 * (own - length), outside: 2.0 * outside }
    }

    /// Returns area and turning of the corner region, both per length of an edge with this section,
    /// as measured with a Gaussian of this width.
    pub(super) fn of_edge(&self, section: &Section, width: f64) -> (f64, f64) {
        let smoothed = |s: f64| {
            let turns = section.turns.iter();
            let sum: f64 = turns
                .map(|(at, turn)| turn * (bell((s - at) / width) + bell((s + at) / width)))
                .sum();
            sum / (width * (2.0 * PI).sqrt())
        };
        let bound = 1.0 / (self.corner + self.level);
        let (mut area, mut turn, mut before) = (0.0, 0.0, f64::NAN);
        for n in 0..HALF {
            let k = smoothed((n as f64 + 0.5) * STEP);
            let mut part = 2.0 * STEP;
            if k <= bound {
                if n == 0 {
                    break;
                }
                // The corner ends between the middle of the preceding step and that of this step.
                part *= (before - bound) / (before - k) - 0.5;
            }
            area += part * (1.0 - self.level * k.max(bound));
            turn += part * k.max(bound);
            if k <= bound {
                break;
            }
            before = k;
        }
        (area, turn)
    }

    /// Returns the values measured with both widths on a body with such edges, of the total length
    /// of a cube's edges, and with a cube's corners, which are not blurred.
    fn of_body(&self, edges: Edges) -> [f64; 2] {
        let section = self.section(edges);
        let (length, corners) = body(edges.radius);
        self.widths.map(|width| {
            let (area, turn) = self.of_edge(&section, width);
            (length * area + corners * edges.radius) / (length * turn + corners).max(1e-9)
        })
    }

    /// Returns the length of such edges on a body for which the narrower Gaussian measures this
    /// turning.
    pub(super) fn length(&self, edges: Edges, section: &Section, turning: f64) -> f64 {
        let (length, corners) = body(edges.radius);
        let (_, turn) = self.of_edge(section, self.widths[0]);
        turning * length / (length * turn + corners).max(1e-9)
    }
}

/// Returns the total edge length of a cube with edges of this radius, and the turning at its
/// corners.
fn body(radius: f64) -> (f64, f64) {
    (24.0 * (1.0 - radius), 4.0 * PI * radius)
}

/// Standard deviation of the disagreement between measurement and model, about the model error
/// without noise.
const MISFIT: f64 = 0.01;
/// Prior standard deviation of the turning angle about a right angle.
const ANGLES: f64 = 0.4;
/// Sharp right-angled edges.
const RIGHT: Edges = Edges { radius: 0.0, angle: FRAC_PI_2 };
/// First turning angle of the model table and its increment; the table includes a right angle.
const BLUNTEST: f64 = 0.25 * PI;
const APART: f64 = 0.05 * PI;
const TRIED: usize = 9;
/// Number of radius increments of the model table.
const RADII: usize = 16;
/// Subdivisions of the angle and radius increments for the interpolation.
const FINER: [usize; 2] = [9, 30];

/// Returns the edge parameters for values measured with two widths. The value from the wider
/// Gaussian determines the angle, because blunt edges are rounded more. For round edges the angle
/// has little influence and stays near a right angle.
pub(super) fn edges_of(chain: &Chain, measured: [f64; 2]) -> Edges {
    let table: Vec<[f64; 2]> = (0..=TRIED * (RADII + 1) + RADII)
        .into_par_iter()
        .map(|n| {
            let (angle, radius) = (n / (RADII + 1), n % (RADII + 1));
            chain.of_body(Edges {
                angle: BLUNTEST + APART * angle as f64,
                radius: radius as f64 / RADII as f64,
            })
        })
        .collect();
    let [angles, radii] = [TRIED * FINER[0], RADII * FINER[1]];
    let (mut best, mut edges) = (f64::INFINITY, RIGHT);
    for n in 0..=angles {
        let (row, u) = between(n, FINER[0], TRIED);
        let angle = BLUNTEST + APART * n as f64 / FINER[0] as f64;
        let unusual = (angle - FRAC_PI_2) / ANGLES;
        for m in 0..=radii {
            let (column, v) = between(m, FINER[1], RADII);
            let at = row * (RADII + 1) + column;
            let mut misfit = unusual * unusual;
            for (width, value) in measured.iter().enumerate() {
                let near = |n: usize| table[n][width] * (1.0 - v) + table[n + 1][width] * v;
                let model = near(at) * (1.0 - u) + near(at + RADII + 1) * u;
                misfit += ((model - value) / MISFIT).powi(2);
            }
            if misfit < best {
                let radius = m as f64 / radii as f64;
                (best, edges) = (misfit, Edges { radius, angle });
            }
        }
    }
    edges
}

/// Returns the table interval, of `steps`, that contains subdivision `n` of `parts` per interval,
/// and the fraction within it.
fn between(n: usize, parts: usize, steps: usize) -> (usize, f64) {
    let step = (n / parts).min(steps - 1);
    (step, (n - step * parts) as f64 / parts as f64)
}

fn bell(x: f64) -> f64 {
    (-0.5 * x * x).exp()
}

/// Error function, accurate to 1.5e-7 (Abramowitz and Stegun 1964, 7.1.26); `falling` is exp(-x^2),
/// which every caller has at hand.
fn error_function(x: f64, falling: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let series = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    let sum = series.iter().fold(0.0, |sum, c| sum * t + c) * t;
    (1.0 - sum * falling).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(image: f64) -> Chain {
        Chain {
            image: [(1.0, image), (0.0, image)],
            level: 0.4,
            widths: [0.14, 0.21],
            corner: 0.99,
        }
    }

    #[test]
    fn an_edge_that_hardly_anything_widens_has_its_radius() {
        for radius in [0.1, 0.4, 0.8] {
            let chain = Chain { widths: [0.02, 0.03], ..chain(0.0) };
            let [found, _] = chain.of_body(Edges { radius, ..RIGHT });
            assert!((found - radius).abs() < 0.03, "{found} for {radius}");
        }
    }

    /// Two-dimensional reference: the quarter plane on a grid with steps of 0.01, blurred by a
    /// Gaussian, exact distances from the contour at one half, and their curvature after another
    /// Gaussian.
    #[test]
    fn the_section_is_what_two_dimensions_give() {
        for (image, radius, exact) in [
            (0.0275, 0.0, [0.1859, 0.2623]),
            (0.055, 0.0, [0.2263, 0.2947]),
            (0.055, 0.2, [0.3173, 0.3710]),
            (0.055, 0.4, [0.4716, 0.5077]),
            (0.0275, 0.8, [0.8154, 0.8259]),
        ] {
            let chain = chain(image);
            let section = chain.section(Edges { radius, ..RIGHT });
            for (width, exact) in chain.widths.into_iter().zip(exact) {
                let (area, turn) = chain.of_edge(&section, width);
                println!("{image} {radius} {width}: {:.4}, {exact}", area / turn);
                // The wider Gaussian extends through the body, which the section model ignores.
                assert!((area / turn - exact).abs() < 0.008, "{}", area / turn);
            }
        }
    }

    #[test]
    fn two_widths_tell_radius_and_angle() {
        for image in [0.027, 0.055] {
            for degrees in [60f64, 70.0, 90.0, 110.0] {
                for radius in [0.0, 0.2, 0.5, 0.8] {
                    let chain = chain(image);
                    let angle = degrees.to_radians();
                    let back = edges_of(&chain, chain.of_body(Edges { radius, angle })).radius;
                    // The prior on the angle biases the result slightly, most for sharp edges.
                    let bound = if radius < 0.1 { 0.1 } else { 0.05 };
                    println!("{image} {degrees} {radius}: {back:.3}");
                    assert!((back - radius).abs() < bound, "{degrees} {radius}: {back}");
                }
            }
        }
    }

    /// A blurred quarter plane is one half where the product of two error functions is one half.
    #[test]
    fn an_image_takes_length_and_area_off_an_edge() {
        let (s, step) = (0.05, 1e-4);
        let half = |x: f64| 0.5 * (1.0 + error_function(x / (SQRT_2 * s), bell(x / s)));
        // Depth below one face as a function of the depth below the other, from the bisector on.
        let other = |depth: f64| {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if half(middle) * half(depth) < 0.5 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        };
        let middle = (0..).map(|n| f64::from(n) * step).find(|d| other(*d) <= *d);
        let middle = middle.unwrap();
        let (mut length, mut outside) = (0.0, 0.5 * middle * middle);
        for n in 0..3000 {
            let depth = middle + f64::from(n) * step;
            let (here, next) = (other(depth), other(depth + step));
            length += step.hypot(here - next);
            outside += 0.5 * step * (here + next);
        }
        let chain = chain(s);
        let found = chain.section(RIGHT);
        let shorter = 2.0 * (middle + 3000.0 * step - length);
        println!("{shorter:.5} {:.5}, {outside:.6} {:.6}", found.shorter, found.outside);
        assert!((found.shorter / shorter - 1.0).abs() < 0.02);
        assert!((found.outside / (2.0 * outside) - 1.0).abs() < 0.05);
    }

    #[test]
    fn the_error_function_is_right() {
        for (x, exact) in [(0.0, 0.0), (0.5, 0.520_499_877_8), (-1.5, -0.966_105_146_5)] {
            assert!((error_function(x, (-x * x).exp()) - exact).abs() < 2e-7, "{x}");
        }
    }
}
