//! Wadell roundness in three dimensions (Eq. 39).
//!
//! Corners of a grain are the parts of its surface with a larger principal curvature k1 above that
//! of the largest inscribed sphere, 1 / R_in, by 1 percent (so that the side of a cylinder is no
//! corner). Roundness is the mean of the corner radii 1 / k1 over R_in. The weight is the turning
//! of the surface, k1 dA: the length of a rounded edge times its angle, independent of its radius.
//! Sharp edges, which have no area, therefore keep their weight.
//!
//! Curvatures are evaluated on the exterior level set at distance t, where even a sharp edge has
//! the radius t. They follow from Gaussian derivatives of the distance at two widths, and the
//! roundness is extrapolated to zero width.
//!
//! Scanned surfaces are measured by a separate method: [`scan`].

mod band;
mod edge;
mod scan;

use crate::distance::Distance;
use crate::filter::Kernel;
use band::Band;
use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Samples along the radius of the inscribed sphere.
const CELLS: f64 = 10.0;
/// Distance of the level set from the surface [cells].
const LEVEL: f64 = 4.0;
/// Widths of the Gaussian (standard deviations) [samples].
const WIDTHS: [f64; 2] = [1.0, 1.5];
/// Upper bound of corner radii relative to R_in.
const CORNER: f64 = 0.99;
/// Support of the Gaussian [widths].
const REACH: f64 = 4.5;
/// Origin of a surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Surface {
    /// A closed form or a mesh.
    Exact,
    /// A generated grain, whose faces are not aligned with its axes. A separate variant keeps the
    /// committed grains of the study bit-identical to the generator's output.
    Family,
    /// An image with the kernel of blur and smoothing [m], and the points [m] of the surface where
    /// the grain was separated from its neighbours.
    Scanned { image: Kernel, cuts: Vec<DVec3> },
}

/// Returns the smallest resolved detail relative to R_in, the width of the wider Gaussian, for the
/// `method` of a provenance.
pub(crate) fn cutoff(method: &str) -> f64 {
    if method == "scan" { scan::WIDTHS[1] } else { WIDTHS[1] / CELLS }
}

/// Result of a roundness measurement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    pub roundness: f64,
    /// Edge losses due to the image.
    pub lost: Option<Lost>,
}

impl Reading {
    fn of(roundness: f64) -> Reading {
        Reading { roundness, lost: None }
    }
}

/// Edge losses of a body whose image conserves its volume: rounding shortens the surface and moves
/// the rest of it slightly outwards.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lost {
    /// Area [m^2].
    pub area: f64,
    /// Volume beside the edges [m^3].
    pub volume: f64,
    /// Distance of an exterior level set [m], and its area [m^2].
    pub level: f64,
    pub area_there: f64,
}

impl Lost {
    /// Returns the area [m^2] of a body whose image has the area `area`.
    pub(crate) fn restored(&self, area: f64) -> f64 {
        // Steiner's formula for the increase of the area with the distance.
        let growth = (self.area_there - area) / self.level - 4.0 * PI * self.level;
        area + self.area - self.volume / area * growth
    }
}

/// Returns the roundness of the body in the box with the largest inscribed sphere of radius
/// `inscribed`, or `None` if the grid would be too large.
pub(crate) fn measure(
    distance: &dyn Distance,
    lower: DVec3,
    upper: DVec3,
    inscribed: f64,
    surface: &Surface,
) -> Option<Reading> {
    match surface {
        Surface::Exact => {
            // The grid is rotated: edges aligned with it would have few, regularly spaced samples.
            let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.37, 0.81, -0.52)));
            let middle = 0.5 * (lower + upper);
            let turned =
                |x: DVec3, hint: &mut u32| distance.near(middle + turn * (x - middle), hint);
            // Bounding box of the rotated box.
            let half = turn.transpose().abs() * (0.5 * (upper - lower));
            of_exact(&turned, middle - half, middle + half, inscribed).map(Reading::of)
        }
        Surface::Family => of_exact(distance, lower, upper, inscribed).map(Reading::of),
        Surface::Scanned { image, cuts } => {
            scan::measure(distance, [lower, upper], inscribed, *image, cuts)
        }
    }
}

fn of_exact(distance: &dyn Distance, lower: DVec3, upper: DVec3, inscribed: f64) -> Option<f64> {
    let spacing = inscribed / CELLS;
    let level = LEVEL * spacing;
    let band = Band::around(distance, lower, upper, spacing, [level, REACH * WIDTHS[1]])?;
    let mesh = band.surface();
    let mut areas = vec![0.0; mesh.vertices.len()];
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        let third = mesh.twice_area(face).length() / 6.0;
        for v in triangle {
            areas[*v as usize] += third;
        }
    }
    // Surface radius below a vertex from the larger curvature of the level set.
    let radius = |k1: f64| {
        if k1 > 0.0 { 1.0 / k1 - level } else { f64::INFINITY }
    };
    let [narrow, wide] = WIDTHS.map(|width| {
        let turned: Vec<(f64, f64)> = mesh
            .vertices
            .par_iter()
            .zip(&areas)
            .map(|(x, area)| {
                let [k1, k2] = band.curvatures(*x, width, REACH);
                let radius = radius(k1);
                if radius < CORNER * inscribed {
                    let weight = area * k1 * (1.0 - level * k2).max(0.0);
                    (weight, weight * radius / inscribed)
                } else {
                    (0.0, 0.0)
                }
            })
            .collect();
        let (weight, sum) = turned.iter().fold((0.0, 0.0), |s, t| (s.0 + t.0, s.1 + t.1));
        if weight > 0.0 {
            sum / weight
        } else {
            // No corners: a sphere, or a rod with spherical ends.
            1.0
        }
    });
    // The bands along the edges in which the Gaussian covers face and edge scale with its width.
    let slope = (wide - narrow) / (WIDTHS[1] - WIDTHS[0]);
    Some((narrow - slope * WIDTHS[0]).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn turn() -> DQuat {
        DQuat::from_scaled_axis(DVec3::new(0.37, 0.81, -0.52))
    }

    fn rounded_cube(radius: f64) -> impl Fn(DVec3, &mut u32) -> f64 + Sync {
        move |x, _| {
            let q = (turn() * x).abs() - DVec3::splat(0.5 - radius);
            q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - radius
        }
    }

    /// Reference for a spheroid in closed form: semi-axes `a` along the axis and `b` across it.
    fn of_spheroid(a: f64, b: f64) -> f64 {
        let inscribed = a.min(b);
        let (mut weight, mut sum) = (0.0, 0.0);
        let n = 200_000;
        for i in 0..n {
            let (s, c) = (std::f64::consts::PI * (i as f64 + 0.5) / n as f64).sin_cos();
            let stretch = (a * a * s * s + b * b * c * c).sqrt();
            // Curvatures along the meridian and around the axis.
            let larger = (a * b / stretch.powi(3)).max(a / (b * stretch));
            if larger * inscribed * CORNER > 1.0 {
                let turn = larger * stretch * b * s;
                weight += turn;
                sum += turn / (larger * inscribed);
            }
        }
        if weight > 0.0 { sum / weight } else { 1.0 }
    }

    #[test]
    fn turned_rounded_cubes_have_twice_their_radius() {
        let cube = DVec3::splat(0.9);
        for radius in [0.0, 0.1, 0.2, 0.3, 0.4] {
            let found = measure(&rounded_cube(radius), -cube, cube, 0.5, &Surface::Exact)
                .unwrap()
                .roundness;
            println!("rounded cube {radius}: {found:.4}");
            assert!((found - 2.0 * radius).abs() < 0.02, "{radius}: {found}");
        }
    }

    #[test]
    fn ellipsoids_have_the_mean_of_the_definition() {
        for axes in [
            [1.0, 1.0, 1.0],
            [1.5, 1.0, 1.0],
            [2.0, 1.0, 1.0],
            [3.0, 1.0, 1.0],
            [1.0, 1.0, 0.7],
            [1.0, 1.0, 0.5],
        ] {
            let axes = DVec3::from_array(axes);
            let exact =
                if axes.z < 1.0 { of_spheroid(axes.z, 1.0) } else { of_spheroid(axes.x, 1.0) };
            let body = |x: DVec3, _: &mut u32| crate::analytic::ellipsoid_distance(axes, x);
            let found = measure(&body, -axes, axes, axes.z, &Surface::Exact).unwrap().roundness;
            println!("ellipsoid {axes}: {found:.4}, exact {exact:.4}");
            assert!((found - exact).abs() < 0.02, "{axes}: {found} for {exact}");
        }
    }

    #[test]
    fn cylinders_are_sharp_capsules_round_and_worn_rims_between() {
        for (length, rounding, exact) in [
            (1.0, 0.0, 0.0),
            (2.0, 0.0, 0.0),
            (4.0, 0.0, 0.0),
            (2.0, 1.0, 1.0),
            (4.0, 1.0, 1.0),
            (3.0, 0.5, 0.5),
        ] {
            // Rims of radius `rounding` on a cylinder of radius 1.
            let body = |x: DVec3, _: &mut u32| {
                let y = turn() * x;
                let across = y.truncate().length() - 1.0 + rounding;
                let q = glam::DVec2::new(across, y.z.abs() - 0.5 * length + rounding);
                q.max(glam::DVec2::ZERO).length() + q.max_element().min(0.0) - rounding
            };
            let inscribed = 1f64.min(0.5 * length);
            let half = DVec3::splat(2.5);
            let found = measure(&body, -half, half, inscribed, &Surface::Exact).unwrap().roundness;
            println!("cylinder {length} {rounding}: {found:.4}");
            assert!((found - exact).abs() < 0.08, "{found} for {exact}");
        }
    }
}
