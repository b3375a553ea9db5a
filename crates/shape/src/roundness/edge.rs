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

/// A section through an edge in the image.
#[derive(Clone, Debug, Default)]
pub(super) struct Section {
    /// Where the level set turns on one side of the edge: arc length from its middle, and by how much.
    turns: Vec<(f64, f64)>,
    /// By how much the surface is shorter than that of the body.
    pub shorter: f64,
    /// Area of the body's section that lies outside of it.
    pub outside: f64,
}

/// Edges that would be measured as those of a body are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edges {
    pub radius: f64,
    /// Angle by which the surface turns in them.
    pub angle: f64,
}

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
    /// Section through such an edge.
    pub(super) fn section(&self, edges: Edges) -> Section {
        let Edges { radius, angle } = edges;
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
            // At the point before, where the two chords meet.
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
        Section {
            turns,
            shorter: 2.0 * (own - length),
            outside: 2.0 * outside,
        }
    }

    /// Area of the corner and turning of the surface in it, both per length of an edge with this
    /// section, as a Gaussian of this width sees it.
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
    fn of_body(&self, edges: Edges) -> [f64; 2] {
        let section = self.section(edges);
        let (length, corners) = body(edges.radius);
        self.widths.map(|width| {
            let (area, turn) = self.of_edge(&section, width);
            (length * area + corners * edges.radius) / (length * turn + corners).max(1e-9)
        })
    }

    /// Length of such edges of a body for whose corners the narrower Gaussian finds this turning.
    pub(super) fn length(&self, edges: Edges, section: &Section, turning: f64) -> f64 {
        let (length, corners) = body(edges.radius);
        let (_, turn) = self.of_edge(section, self.widths[0]);
        turning * length / (length * turn + corners).max(1e-9)
    }
}

/// Length of the edges of a cube with edges of this radius, and the turning of the surface at its
/// corners.
fn body(radius: f64) -> (f64, f64) {
    (24.0 * (1.0 - radius), 4.0 * PI * radius)
}

/// Spread of what two measurements and this model agree to: about what it is off without noise.
const MISFIT: f64 = 0.01;
/// Spread of the angles that edges turn by, about a right angle.
const ANGLES: f64 = 0.4;
/// Sharp edges of right angles.
const RIGHT: Edges = Edges {
    radius: 0.0,
    angle: FRAC_PI_2,
};
/// Angles for which the model is worked out, a right one among them: the first, and their steps.
const BLUNTEST: f64 = 0.25 * PI;
const APART: f64 = 0.05 * PI;
const TRIED: usize = 9;
/// Steps of the radii for which it is worked out.
const RADII: usize = 16;
/// Parts that its steps of angle and radius are cut into.
const FINER: [usize; 2] = [9, 30];

/// The edges for which measurements of two widths found these values. The wider
/// one tells at what angle the edges turn: blunt ones are rounded more. Where edges are round, the
/// angle matters little, and is about a right one.
pub(super) fn edges_of(chain: &Chain, found: [f64; 2]) -> Edges {
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
            for (width, value) in found.iter().enumerate() {
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

/// Step of the table, of `steps`, in which part `n` lies when each is cut into `parts`, and how far in.
fn between(n: usize, parts: usize, steps: usize) -> (usize, f64) {
    let step = (n / parts).min(steps - 1);
    (step, (n - step * parts) as f64 / parts as f64)
}

fn bell(x: f64) -> f64 {
    (-0.5 * x * x).exp()
}

/// To 1.5e-7 (Abramowitz and Stegun 1964, 7.1.26); `falling` is exp(-x^2), which whoever asks has anyway.
fn error_function(x: f64, falling: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let series = [
        1.061_405_429,
        -1.453_152_027,
        1.421_413_741,
        -0.284_496_736,
        0.254_829_592,
    ];
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
            let chain = Chain {
                widths: [0.02, 0.03],
                ..chain(0.0)
            };
            let [found, _] = chain.of_body(Edges { radius, ..RIGHT });
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
            let section = chain.section(Edges { radius, ..RIGHT });
            for (width, exact) in chain.widths.into_iter().zip(exact) {
                let (area, turn) = chain.of_edge(&section, width);
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
                    let angle = degrees.to_radians();
                    let back = edges_of(&chain, chain.of_body(Edges { radius, angle })).radius;
                    // The guess of a right angle draws a little, most where an edge is sharp.
                    let bound = if radius < 0.1 { 0.1 } else { 0.05 };
                    println!("{image} {degrees} {radius}: {back:.3}");
                    assert!((back - radius).abs() < bound, "{degrees} {radius}: {back}");
                }
            }
        }
    }

    /// A quarter plane under a Gaussian is half where the product of two error functions is.
    #[test]
    fn an_image_takes_length_and_area_off_an_edge() {
        let (s, step) = (0.05, 1e-4);
        let half = |x: f64| 0.5 * (1.0 + error_function(x / (SQRT_2 * s), bell(x / s)));
        // Depth below the one face at each depth below the other, from the middle on.
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
        println!(
            "{shorter:.5} {:.5}, {outside:.6} {:.6}",
            found.shorter, found.outside
        );
        assert!((found.shorter / shorter - 1.0).abs() < 0.02);
        assert!((found.outside / (2.0 * outside) - 1.0).abs() < 0.05);
    }

    #[test]
    fn the_error_function_is_right() {
        for (x, exact) in [(0.0, 0.0), (0.5, 0.520_499_877_8), (-1.5, -0.966_105_146_5)] {
            assert!(
                (error_function(x, (-x * x).exp()) - exact).abs() < 2e-7,
                "{x}"
            );
        }
    }
}
