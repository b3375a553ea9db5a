//! What a scan makes of an edge of known radius.
//!
//! Along the normal section of an edge that turns by an angle, curvature is a box: the angle over its
//! width. The scanner's blur and the smoothing of the image widen it, the level set outside stretches
//! it, the Gaussian of the measurement widens it again; what then exceeds the curvature of the
//! inscribed sphere is taken for the corner. All lengths are shares of R_in.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

/// What a measurement does to an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chain {
    /// Standard deviation of blur and smoothing of the image.
    pub image: f64,
    /// Distance of the level set from the surface.
    pub level: f64,
    /// Standard deviation of the Gaussian that the curvatures come from.
    pub width: f64,
    /// Largest radius of a corner.
    pub corner: f64,
}

/// Step along the section.
const STEP: f64 = 0.01;
/// Reach of the section on either side of the edge.
const HALF: usize = 160;
/// Images are not taken for sharper than this: a step resolves it.
const FINEST: f64 = 0.01;

impl Chain {
    /// Area of the corner and turning of the surface in it, both per length of an edge of this radius
    /// that turns by `angle`.
    fn of_edge(&self, radius: f64, angle: f64) -> (f64, f64) {
        let image = self.image.max(FINEST);
        let half = (0.5 * angle * radius).max(0.01 * image);
        let curvature = |s: f64| {
            let step = |s: f64| error_function(s / (SQRT_2 * image));
            angle * (step(s + half) - step(s - half)) / (4.0 * half)
        };
        // Place and curvature on the level set, the middle of the edge first; the section is symmetric.
        let mut place = 0.0;
        let outside: Vec<(f64, f64)> = (0..HALF)
            .map(|n| {
                let k = curvature((n as f64 + 0.5) * STEP);
                let stretched = STEP * (1.0 + self.level * k);
                place += stretched;
                (place - 0.5 * stretched, k * STEP)
            })
            .collect();
        let smoothed = |s: f64| {
            let sum: f64 = outside
                .iter()
                .map(|(at, turn)| {
                    turn * (bell((s - at) / self.width) + bell((s + at) / self.width))
                })
                .sum();
            sum / (self.width * (2.0 * PI).sqrt())
        };
        let (mut area, mut turn) = (0.0, 0.0);
        for n in 0..2 * HALF {
            let k = smoothed((n as f64 + 0.5) * STEP);
            if k * (self.corner + self.level) <= 1.0 {
                break;
            }
            area += 2.0 * STEP * (1.0 - self.level * k);
            turn += 2.0 * STEP * k;
        }
        (area, turn)
    }

    /// What is measured of a body with edges like this, as long as those of a cube, and corners like
    /// its, which are taken as they are.
    fn of_body(&self, radius: f64, angle: f64) -> f64 {
        let (area, turn) = self.of_edge(radius, angle);
        let length = 24.0 * (1.0 - radius);
        let corners = 4.0 * PI * radius;
        (length * area + corners * radius) / (length * turn + corners)
    }
}

/// Spread of what two measurements and this model agree to: about what it is off without noise.
const MISFIT: f64 = 0.01;
/// Spread of the angles that edges turn by, about a right angle.
const ANGLES: f64 = 0.4;
/// Angles that are tried.
const BLUNTEST: f64 = 0.25 * PI;
const SHARPEST: f64 = 0.7 * PI;
const TRIED: usize = 24;

/// Radius of the edges that two measurements of different widths found these values for. The wider
/// one tells at what angle the edges turn: blunt ones are rounded more. Where edges are round, the
/// angle matters little, and is about a right one.
pub(super) fn radius_of(found: [(Chain, f64); 2]) -> f64 {
    let [(narrow, value), (wide, other)] = found;
    let tried = (0..=TRIED).map(|n| {
        let angle = BLUNTEST + (SHARPEST - BLUNTEST) * n as f64 / TRIED as f64;
        let radius = inverse(|r| narrow.of_body(r, angle), value);
        // The narrow one is off where it is sharper than any radius makes it.
        let narrow = (narrow.of_body(radius, angle) - value) / MISFIT;
        let wide = (wide.of_body(radius, angle) - other) / MISFIT;
        let unusual = (angle - FRAC_PI_2) / ANGLES;
        (narrow * narrow + wide * wide + unusual * unusual, radius)
    });
    tried
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(0.0, |(_, radius)| radius)
}

/// Where a growing function between 0 and 1 has this value; the nearer end where it has not.
fn inverse(function: impl Fn(f64) -> f64, value: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if function(middle) < value {
            low = middle;
        } else {
            high = middle;
        }
    }
    // A bisection never gets to the ends.
    if low == 0.0 {
        0.0
    } else if high == 1.0 {
        1.0
    } else {
        0.5 * (low + high)
    }
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

    fn chain(image: f64, width: f64) -> Chain {
        Chain {
            image,
            level: 0.4,
            width,
            corner: 0.99,
        }
    }

    #[test]
    fn an_edge_that_hardly_anything_widens_has_its_radius() {
        for radius in [0.1, 0.4, 0.8] {
            let found = chain(0.0, 0.02).of_body(radius, FRAC_PI_2);
            assert!((found - radius).abs() < 0.03, "{found} for {radius}");
        }
    }

    #[test]
    fn two_widths_tell_radius_and_angle() {
        for image in [0.027, 0.055] {
            for degrees in [60f64, 70.0, 90.0, 110.0] {
                for radius in [0.0, 0.2, 0.5, 0.8] {
                    let found = [0.14, 0.21].map(|width| {
                        let chain = chain(image, width);
                        (chain, chain.of_body(radius, degrees.to_radians()))
                    });
                    let back = radius_of(found);
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
