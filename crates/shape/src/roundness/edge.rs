//! What a scan makes of an edge of known radius.
//!
//! In the normal section of an edge the body is a wedge with a rounded tip. The surface that a scan
//! gives is where the shares of solid, after the scanner's blur and the smoothing of the image, are
//! one half. Along that line curvature is a function of the arc; the level set outside stretches it,
//! the Gaussian of the measurement widens it; what then exceeds the curvature of the inscribed
//! sphere is taken for the corner. All lengths are shares of R_in.
//!
//! Symbols in the code: s standard deviation, u its multiples, z depth below the surface in them,
//! x across the edge and y the height over it, k curvature.

use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

/// Weights, whose sum is 1, and standard deviations of the Gaussians that blur and smoothing of an
/// image amount to.
pub(crate) type Kernel = [(f64, f64); 2];

/// What a measurement does to an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chain {
    /// What has gone over the shares of solid.
    pub image: Kernel,
    /// Distance of the level set from the surface.
    pub level: f64,
    /// Standard deviations of the Gaussians that the curvatures come from.
    pub widths: [f64; 2],
    /// Largest radius of a corner.
    pub corner: f64,
}

/// Step along the section.
const STEP: f64 = 0.01;
/// Reach of the section on either side of the edge.
const HALF: usize = 160;
/// Images are not taken for sharper than this: a step resolves it.
const FINEST: f64 = 0.01;
/// Points of the surface on one side of the edge.
const POINTS: usize = 64;
/// Beyond the rounded tip and so many standard deviations the faces are flat.
const FLAT: f64 = 5.0;
/// Points of a Gaussian on either side, and how many of them to a standard deviation.
const BELL: (i32, f64) = (20, 4.0);

impl Chain {
    /// Where the level set turns on one side of the edge: arc length from its middle, and by how much.
    /// Of an edge of this radius that turns by `angle`.
    fn outline(&self, radius: f64, angle: f64) -> Vec<(f64, f64)> {
        let image = self.image.map(|(weight, s)| (weight, s.max(FINEST)));
        let (sine, cosine) = (0.5 * angle).sin_cos();
        // Height of the body over the line across the edge, from where the faces would meet.
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
        // Newton's method for the height at which half of the image is solid.
        let surface = |x: f64, from: f64| {
            let mut y = from;
            for _ in 0..12 {
                let (mut share, mut slope) = (-0.5, 0.0);
                for (weight, s) in image {
                    for (u, part) in &bells {
                        let z = (body(x + s * u) - y) / s;
                        share += weight * part * 0.5 * (1.0 + error_function(z / SQRT_2));
                        slope += weight * part * bell(z) / (s * (2.0 * PI).sqrt());
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
        let mut found = Vec::with_capacity(POINTS + 1);
        for n in 1..=POINTS {
            let next = surface(step * n as f64, height - step * f64::tan(tilt));
            let steeper = f64::atan2(height - next, step);
            let turn = steeper - tilt;
            // At the point before, where the two chords meet.
            found.push((place + 0.5 * self.level * turn, turn));
            place += self.level * turn + step.hypot(height - next);
            (height, tilt) = (next, steeper);
        }
        let turn = 0.5 * angle - tilt;
        found.push((place + 0.5 * self.level * turn, turn));
        found
    }

    /// Area of the corner and turning of the surface in it, both per length of an edge with this
    /// outline, as a Gaussian of this width sees it.
    fn of_edge(&self, outline: &[(f64, f64)], width: f64) -> (f64, f64) {
        let smoothed = |s: f64| {
            let sum: f64 = outline
                .iter()
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
                // The corner ends between the middles of this step and the one before.
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

    /// What is measured with both widths of a body with edges like this, as long as those of a cube, and
    /// corners like its, which are taken as they are.
    fn of_body(&self, radius: f64, angle: f64) -> [f64; 2] {
        let outline = self.outline(radius, angle);
        let length = 24.0 * (1.0 - radius);
        let corners = 4.0 * PI * radius;
        self.widths.map(|width| {
            let (area, turn) = self.of_edge(&outline, width);
            (length * area + corners * radius) / (length * turn + corners).max(1e-9)
        })
    }
}

/// Spread of what two measurements and this model agree to: about what it is off without noise.
const MISFIT: f64 = 0.01;
/// Spread of the angles that edges turn by, about a right angle.
const ANGLES: f64 = 0.4;
/// Angles for which the model is worked out, a right one among them: the first, and their steps.
const BLUNTEST: f64 = 0.25 * PI;
const APART: f64 = 0.05 * PI;
const TRIED: usize = 9;
/// Steps of the radii for which it is worked out.
const RADII: usize = 16;
/// Parts that its steps of angle and radius are cut into.
const FINER: [usize; 2] = [9, 30];

/// Radius of the edges for which measurements of two widths found these values. The wider
/// one tells at what angle the edges turn: blunt ones are rounded more. Where edges are round, the
/// angle matters little, and is about a right one.
pub(super) fn radius_of(chain: &Chain, found: [f64; 2]) -> f64 {
    let table: Vec<[f64; 2]> = (0..=TRIED * (RADII + 1) + RADII)
        .into_par_iter()
        .map(|n| {
            let (angle, radius) = (n / (RADII + 1), n % (RADII + 1));
            let angle = BLUNTEST + APART * angle as f64;
            chain.of_body(radius as f64 / RADII as f64, angle)
        })
        .collect();
    let [angles, radii] = [TRIED * FINER[0], RADII * FINER[1]];
    let (mut best, mut radius) = (f64::INFINITY, 0.0);
    for n in 0..=angles {
        let (row, u) = between(n, FINER[0], TRIED);
        let unusual = (BLUNTEST + APART * n as f64 / FINER[0] as f64 - FRAC_PI_2) / ANGLES;
        for m in 0..=radii {
            let (column, v) = between(m, FINER[1], RADII);
            let at = row * (RADII + 1) + column;
            let mut misfit = unusual * unusual;
            for (width, value) in found.iter().enumerate() {
                let near = |n: usize| table[n][width] * (1.0 - v) + table[n + 1][width] * v;
                let model = near(at) * (1.0 - u) + near(at + RADII + 1) * u;
                misfit += ((model - value) / MISFIT).powi(2);
            }
            if misfit < best {
                (best, radius) = (misfit, m as f64 / radii as f64);
            }
        }
    }
    radius
}

/// Step of the table, of `steps`, in which part `n` lies when each is cut into `parts`, and how far in.
fn between(n: usize, parts: usize, steps: usize) -> (usize, f64) {
    let step = (n / parts).min(steps - 1);
    (step, (n - step * parts) as f64 / parts as f64)
}

fn bell(x: f64) -> f64 {
    (-0.5 * x * x).exp()
}

/// To 1.5e-7 (Abramowitz and Stegun 1964, 7.1.26).
fn error_function(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let series = [
        1.061_405_429,
        -1.453_152_027,
        1.421_413_741,
        -0.284_496_736,
        0.254_829_592,
    ];
    let sum = series.iter().fold(0.0, |sum, c| sum * t + c) * t;
    (1.0 - sum * (-x * x).exp()).copysign(x)
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
            let chain = Chain {
                widths: [0.02, 0.03],
                ..chain(0.0)
            };
            let [found, _] = chain.of_body(radius, FRAC_PI_2);
            assert!((found - radius).abs() < 0.03, "{found} for {radius}");
        }
    }

    /// The same worked out in two dimensions: the quarter plane on a grid of steps of .01, blurred by a Gaussian,
    /// exact distances from its half-way line, and their curvature after another Gaussian.
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
            let outline = chain.outline(radius, FRAC_PI_2);
            for (width, exact) in chain.widths.into_iter().zip(exact) {
                let (area, turn) = chain.of_edge(&outline, width);
                println!("{image} {radius} {width}: {:.4}, {exact}", area / turn);
                // The wider Gaussian reaches through the body, which the section knows nothing of.
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
                    let back = radius_of(&chain, chain.of_body(radius, degrees.to_radians()));
                    // The guess of a right angle draws a little, most where an edge is sharp.
                    let bound = if radius < 0.1 { 0.1 } else { 0.05 };
                    println!("{image} {degrees} {radius}: {back:.3}");
                    assert!((back - radius).abs() < bound, "{degrees} {radius}: {back}");
                }
            }
        }
    }

    #[test]
    fn the_error_function_is_right() {
        for (x, exact) in [(0.0, 0.0), (0.5, 0.520_499_877_8), (-1.5, -0.966_105_146_5)] {
            assert!((error_function(x) - exact).abs() < 2e-7, "{x}");
        }
    }
}
