//! Wadell roundness in three dimensions (Eq. 39).
//!
//! The corners of a grain are the parts of its surface whose larger principal curvature k1 exceeds
//! that of the largest inscribed sphere, 1 / R_in (by 1 percent: the side of a cylinder is no
//! corner). Roundness is the mean of their radii 1 / k1
//! over R_in, weighted by how much the surface turns there, k1 dA: the length of a rounded edge
//! times its angle, whatever its radius, so that sharp edges, which have no area, keep their say.
//!
//! Curvatures are those of the level set at the distance t outside, where even a sharp edge has
//! the radius t: they come from derivatives of a Gaussian of the distance, at two widths, and the
//! roundness is extrapolated to the width zero.
//!
//! Scans have their own rule: [`scan`].

mod edge;
mod scan;

use crate::distance::Distance;
use crate::surface::{Samples, extract};
use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;

/// Samples along the radius of the inscribed sphere.
const CELLS: f64 = 10.0;
/// Distance of the level set from the surface [samples].
const LEVEL: f64 = 4.0;
/// Widths of the Gaussian (standard deviations) [samples].
const WIDTHS: [f64; 2] = [1.0, 1.5];
/// Radii below this share of R_in are corners.
const CORNER: f64 = 0.99;
/// Reach of the Gaussian in widths.
const REACH: f64 = 4.5;
/// Most samples of a grid.
const LARGEST: f64 = 5e7;

/// What the surface comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Surface {
    /// A closed form or a mesh.
    Exact,
    /// A grain of a family, none of whose faces lie along its axes. Told apart so that the
    /// committed grains of the study stay what the generator gives, to the bit.
    Family,
    /// An image, which blur and smoothing of this standard deviation [m] have gone over.
    Scanned { image: f64 },
}

/// Detail finer than this share of R_in is smoothed away: the wider Gaussian. By the method of the
/// provenance.
pub(crate) fn cutoff(method: &str) -> f64 {
    if method == "scan" {
        scan::WIDTHS[1]
    } else {
        WIDTHS[1] / CELLS
    }
}

/// Distance less the level on a grid around the level set; farther off it is only a bound.
struct Band {
    dims: [usize; 3],
    lower: DVec3,
    spacing: f64,
    values: Vec<f32>,
}

/// Roundness of the body in the box with the largest inscribed sphere of radius `inscribed`, or
/// none where the grid would be too large.
pub(crate) fn measure(
    distance: &impl Distance,
    lower: DVec3,
    upper: DVec3,
    inscribed: f64,
    surface: Surface,
) -> Option<f64> {
    match surface {
        Surface::Exact => {
            // Edges along the grid would have few and regular samples: it is turned.
            let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.37, 0.81, -0.52)));
            let middle = 0.5 * (lower + upper);
            let turned =
                |x: DVec3, hint: &mut u32| distance.near(middle + turn * (x - middle), hint);
            // Of the box about the turned box.
            let half = turn.transpose().abs() * (0.5 * (upper - lower));
            of_exact(&turned, middle - half, middle + half, inscribed)
        }
        Surface::Family => of_exact(distance, lower, upper, inscribed),
        Surface::Scanned { image } => scan::measure(distance, lower, upper, inscribed, image),
    }
}

fn of_exact(distance: &impl Distance, lower: DVec3, upper: DVec3, inscribed: f64) -> Option<f64> {
    let spacing = inscribed / CELLS;
    let level = LEVEL * spacing;
    let near = |x: DVec3, hint: &mut u32| distance.near(x, hint);
    let band = Band::around(&near, lower, upper, spacing, [level, REACH * WIDTHS[1]])?;
    let mesh = extract(&Samples {
        dims: band.dims,
        lower: band.lower,
        spacing,
        values: &band.values,
    });
    let mut areas = vec![0.0; mesh.vertices.len()];
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(face);
        for v in triangle {
            areas[*v as usize] += (b - a).cross(c - a).length() / 6.0;
        }
    }
    // Radius of the surface under a vertex from the larger curvature of the level set there.
    let radius = |k1: f64| {
        if k1 > 0.0 {
            1.0 / k1 - level
        } else {
            f64::INFINITY
        }
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
        let (weight, sum) = turned
            .iter()
            .fold((0.0, 0.0), |s, t| (s.0 + t.0, s.1 + t.1));
        if weight > 0.0 {
            sum / weight
        } else {
            // No corner at all: a sphere, or a rod with spherical ends.
            1.0
        }
    });
    // The bands along the edges where the Gaussian sees face and edge are as wide as it is.
    let slope = (wide - narrow) / (WIDTHS[1] - WIDTHS[0]);
    Some((narrow - slope * WIDTHS[0]).clamp(0.0, 1.0))
}

impl Band {
    /// All around the body.
    fn whole(
        distance: &impl Distance,
        lower: DVec3,
        upper: DVec3,
        spacing: f64,
        [level, reach]: [f64; 2],
    ) -> Option<Band> {
        let cells = ((upper - lower + DVec3::splat(2.0 * (level + reach))) / spacing).ceil();
        if cells.element_product() > LARGEST {
            return None;
        }
        let first = 0.5 * (lower + upper) - 0.5 * spacing * cells;
        let dims = cells.to_array().map(|n| n as usize + 1);
        let values = distance.on_grid(first, spacing, dims);
        Some(Band {
            dims,
            lower: first,
            spacing,
            values: values.iter().map(|v| (v - level) as f32).collect(),
        })
    }

    fn around(
        distance: &(impl Fn(DVec3, &mut u32) -> f64 + Sync),
        lower: DVec3,
        upper: DVec3,
        spacing: f64,
        [level, reach]: [f64; 2],
    ) -> Option<Band> {
        const BLOCK: usize = 8;
        let reach = reach.ceil() + 2.0;
        let margin = level + reach * spacing;
        let blocks = ((upper - lower + DVec3::splat(2.0 * margin)) / (spacing * BLOCK as f64))
            .ceil()
            .to_array();
        if blocks.iter().product::<f64>() > 1e5 {
            return None;
        }
        let blocks = blocks.map(|n| n as usize);
        let dims = blocks.map(|n| n * BLOCK);
        let first =
            0.5 * (lower + upper) - 0.5 * spacing * DVec3::from_array(dims.map(|n| n as f64 - 1.0));
        let at = |i: usize, j: usize, k: usize| {
            first + spacing * DVec3::new(i as f64, j as f64, k as f64)
        };
        // Values are needed where a Gaussian about the level set reaches, corners included.
        let needed = 3f64.sqrt() * (reach + 0.5 * BLOCK as f64) * spacing;
        let near: Vec<f64> = (0..blocks.iter().product())
            .into_par_iter()
            .map_init(
                || 0,
                |hint, n| {
                    let (i, j, k) = (
                        n % blocks[0],
                        n / blocks[0] % blocks[1],
                        n / blocks[0] / blocks[1],
                    );
                    let half = spacing * DVec3::splat(0.5 * (BLOCK as f64 - 1.0));
                    distance(at(BLOCK * i, BLOCK * j, BLOCK * k) + half, hint) - level
                },
            )
            .collect();
        let mut values = vec![0.0f32; dims.iter().product()];
        values
            .par_chunks_mut(dims[0])
            .enumerate()
            .for_each(|(row, line)| {
                let (j, k) = (row % dims[1], row / dims[1]);
                let mut hint = 0;
                for (i, value) in line.iter_mut().enumerate() {
                    let block = i / BLOCK + blocks[0] * (j / BLOCK + blocks[1] * (k / BLOCK));
                    let centre = near[block];
                    *value = if centre.abs() > needed {
                        centre as f32
                    } else {
                        (distance(at(i, j, k), &mut hint) - level) as f32
                    };
                }
            });
        Some(Band {
            dims,
            lower: first,
            spacing,
            values,
        })
    }

    /// Principal curvatures, the larger first, of the level set through `x`, where the field is
    /// smoothed by a Gaussian of this width [samples] and this reach [widths].
    fn curvatures(&self, x: DVec3, width: f64, reach: f64) -> [f64; 2] {
        let (gradient, hessian) = self.derivatives(x, width, reach);
        principal(gradient, hessian)
    }

    /// Gradient and second derivatives at `x` of the field smoothed by a Gaussian of this width
    /// [samples] and this reach [widths].
    fn derivatives(&self, x: DVec3, width: f64, reach: f64) -> (DVec3, DMat3) {
        let s = (x - self.lower) / self.spacing;
        let reach = (reach * width).ceil() as i64;
        let taps: [Vec<[f64; 3]>; 3] = std::array::from_fn(|axis| {
            let centre = s[axis].round() as i64;
            (centre - reach..=centre + reach)
                .map(|n| {
                    // Derivatives of the Gaussian by the position of its centre.
                    let d = (n as f64 - s[axis]) / width;
                    let g = (-0.5 * d * d).exp();
                    [g, g * d / width, g * (d * d - 1.0) / (width * width)]
                })
                .collect()
        });
        let total: f64 = (0..3)
            .map(|axis| taps[axis].iter().map(|t| t[0]).sum::<f64>())
            .product();
        let start: [usize; 3] =
            std::array::from_fn(|axis| (s[axis].round() as i64 - reach).max(0) as usize);
        let [mut gx, mut gy, mut gz] = [0.0; 3];
        let [mut xx, mut yy, mut zz, mut xy, mut yz, mut zx] = [0.0; 6];
        for (k, z) in taps[2].iter().enumerate() {
            // Sums over x and y of the derivatives (by x, by y).
            let [mut p00, mut p10, mut p20, mut p01, mut p11, mut p02] = [0.0; 6];
            for (j, y) in taps[1].iter().enumerate() {
                let row =
                    start[0] + self.dims[0] * ((start[1] + j) + self.dims[1] * (start[2] + k));
                let [mut q0, mut q1, mut q2] = [0.0; 3];
                let line = self.values.get(row..row + taps[0].len()).unwrap_or(&[]);
                for (value, x) in line.iter().zip(&taps[0]) {
                    let v = f64::from(*value);
                    q0 += v * x[0];
                    q1 += v * x[1];
                    q2 += v * x[2];
                }
                p00 += y[0] * q0;
                p10 += y[0] * q1;
                p20 += y[0] * q2;
                p01 += y[1] * q0;
                p11 += y[1] * q1;
                p02 += y[2] * q0;
            }
            gx += z[0] * p10;
            gy += z[0] * p01;
            gz += z[1] * p00;
            xx += z[0] * p20;
            yy += z[0] * p02;
            zz += z[2] * p00;
            xy += z[0] * p11;
            yz += z[1] * p01;
            zx += z[1] * p10;
        }
        let h = self.spacing * total;
        let gradient = DVec3::new(gx, gy, gz) / h;
        let hessian = DMat3::from_cols(
            DVec3::new(xx, xy, zx),
            DVec3::new(xy, yy, yz),
            DVec3::new(zx, yz, zz),
        ) * (1.0 / (h * self.spacing));
        (gradient, hessian)
    }
}

/// Principal curvatures of the level set of a function with this gradient and Hessian.
fn principal(gradient: DVec3, hessian: DMat3) -> [f64; 2] {
    let slope = gradient.length();
    if slope < 1e-3 {
        return [0.0; 2];
    }
    let normal = gradient / slope;
    let e = normal.any_orthonormal_vector();
    let f = normal.cross(e);
    let (he, hf) = (hessian * e / slope, hessian * f / slope);
    let (mean, half) = (0.5 * (e.dot(he) + f.dot(hf)), 0.5 * (e.dot(he) - f.dot(hf)));
    let root = half.hypot(e.dot(hf));
    [mean + root, mean - root]
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

    /// The definition applied to a spheroid in closed form: semi-axes `a` along the axis and `b`
    /// across it.
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
            let found = measure(&rounded_cube(radius), -cube, cube, 0.5, Surface::Exact).unwrap();
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
            let exact = if axes.z < 1.0 {
                of_spheroid(axes.z, 1.0)
            } else {
                of_spheroid(axes.x, 1.0)
            };
            let body = |x: DVec3, _: &mut u32| crate::analytic::ellipsoid_distance(axes, x);
            let found = measure(&body, -axes, axes, axes.z, Surface::Exact).unwrap();
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
            let found = measure(&body, -half, half, inscribed, Surface::Exact).unwrap();
            println!("cylinder {length} {rounding}: {found:.4}");
            assert!((found - exact).abs() < 0.08, "{found} for {exact}");
        }
    }
}
