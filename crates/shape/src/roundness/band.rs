//! Samples of the distance around a level set, and curvatures from them.

use crate::distance::{Distance, EVERYWHERE};
use crate::filter::refine;
use crate::grid::{coordinates, index, place};
use crate::surface::{Samples, extract};
use crate::triangles::TriangleMesh;
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Distance from the surface within which mesh distances are exact [cells]; the Gaussians smooth
/// the errors beyond. Greater than 1, so that both neighbours of a sample on the surface are
/// included.
const EXACT: f64 = 1.1;
/// Stride of the samples evaluated far from the level set.
const APART: usize = 4;
/// Maximum number of samples of a grid.
const LARGEST: f64 = 5e7;

/// Distance minus the level on a grid around the level set; away from it only a bound.
pub(super) struct Band {
    pub dims: [usize; 3],
    pub lower: DVec3,
    pub spacing: f64,
    pub values: Vec<f32>,
}

impl Band {
    /// Samples the whole body to `reach` [m] beyond the level set. Farther than `near` [m] outside
    /// of it most samples are interpolated: the distance is nearly linear there, except where a
    /// concave body has two nearest points.
    pub(super) fn whole(
        distance: &dyn Distance,
        lower: DVec3,
        upper: DVec3,
        spacing: f64,
        [level, reach, near]: [f64; 3],
    ) -> Option<Band> {
        let wide = spacing * APART as f64;
        let cells = ((upper - lower + DVec3::splat(2.0 * (level + reach))) / wide).ceil();
        if cells.element_product() * (APART as f64).powi(3) > LARGEST {
            return None;
        }
        let first = 0.5 * (lower + upper) - 0.5 * wide * cells;
        let dims = cells.to_array().map(|n| n as usize + 1);
        let sparse = distance.on_grid(first, wide, dims, EXACT, EVERYWHERE);
        let sparse: Vec<f32> = sparse.iter().map(|v| (v - level) as f32).collect();
        let (mut values, dims) = refine(&sparse, dims, APART);
        let needed = [f64::NEG_INFINITY, level + near];
        // Omit the layers farther away.
        let left_out = ((reach - near) / spacing).max(0.0) as usize;
        let inner = dims.map(|n| n - 2 * left_out);
        let corner = first + DVec3::splat(spacing * left_out as f64);
        let exact = distance.on_grid(corner, spacing, inner, EXACT, needed);
        for (n, exact) in exact.iter().enumerate().filter(|(_, v)| v.is_finite()) {
            let at = place(inner, n).map(|i| i + left_out);
            values[index(dims, at)] = (exact - level) as f32;
        }
        Some(Band { dims, lower: first, spacing, values })
    }

    /// Samples the body to `reach` [samples] around the level set; blocks of samples farther away
    /// have the distance of their centre.
    pub(super) fn around(
        distance: &dyn Distance,
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
        let first = 0.5 * (lower + upper) - 0.5 * spacing * coordinates(dims.map(|n| n - 1));
        let at = |place: [usize; 3]| first + spacing * coordinates(place);
        // Values are needed in the support of a Gaussian about the level set, corners included.
        let needed = 3f64.sqrt() * (reach + 0.5 * BLOCK as f64) * spacing;
        let centre = |n: usize| {
            let half = spacing * DVec3::splat(0.5 * (BLOCK as f64 - 1.0));
            at(place(blocks, n).map(|i| BLOCK * i)) + half
        };
        let near: Vec<f64> = (0..blocks.iter().product())
            .into_par_iter()
            .map_init(|| 0, |hint, n| distance.near(centre(n), hint) - level)
            .collect();
        let mut values = vec![0.0f32; dims.iter().product()];
        values.par_chunks_mut(dims[0]).enumerate().for_each(|(row, line)| {
            let (j, k) = (row % dims[1], row / dims[1]);
            let mut hint = 0;
            for (i, value) in line.iter_mut().enumerate() {
                let centre = near[index(blocks, [i, j, k].map(|i| i / BLOCK))];
                *value = if centre.abs() > needed {
                    centre as f32
                } else {
                    (distance.near(at([i, j, k]), &mut hint) - level) as f32
                };
            }
        });
        Some(Band { dims, lower: first, spacing, values })
    }

    /// Extracts the level set as a closed mesh.
    pub(super) fn surface(&self) -> TriangleMesh {
        extract(&Samples {
            dims: self.dims,
            lower: self.lower,
            spacing: self.spacing,
            values: &self.values,
        })
    }

    /// Returns the principal curvatures at `x`, larger first, of the level set through `x` of the
    /// field smoothed by a Gaussian of this width [samples] and this support [widths].
    pub(super) fn curvatures(&self, x: DVec3, width: f64, reach: f64) -> [f64; 2] {
        let (gradient, hessian) = self.derivatives(x, width, reach);
        principal(gradient, hessian)
    }

    /// Returns gradient and Hessian at `x` of the field smoothed by a Gaussian of this width
    /// [samples] and this support [widths].
    pub(super) fn derivatives(&self, x: DVec3, width: f64, reach: f64) -> (DVec3, DMat3) {
        let s = (x - self.lower) / self.spacing;
        let reach = (reach * width).ceil() as i64;
        let taps: [Vec<[f64; 3]>; 3] = std::array::from_fn(|axis| {
            let centre = s[axis].round() as i64;
            (centre - reach..=centre + reach)
                .map(|n| {
                    // Derivatives of the Gaussian with respect to the position of its centre.
                    let d = (n as f64 - s[axis]) / width;
                    let g = (-0.5 * d * d).exp();
                    [g, g * d / width, g * (d * d - 1.0) / (width * width)]
                })
                .collect()
        });
        let total: f64 = (0..3).map(|axis| taps[axis].iter().map(|t| t[0]).sum::<f64>()).product();
        let start: [usize; 3] =
            std::array::from_fn(|axis| (s[axis].round() as i64 - reach).max(0) as usize);
        let [mut gx, mut gy, mut gz] = [0.0; 3];
        let [mut xx, mut yy, mut zz, mut xy, mut yz, mut zx] = [0.0; 6];
        for (k, z) in taps[2].iter().enumerate() {
            // Sums over x and y; the digits are the orders of the derivatives in x and in y.
            let [mut p00, mut p10, mut p20, mut p01, mut p11, mut p02] = [0.0; 6];
            for (j, y) in taps[1].iter().enumerate() {
                let row = index(self.dims, [start[0], start[1] + j, start[2] + k]);
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

/// Returns the principal curvatures of the level set of a function with this gradient and Hessian.
pub(super) fn principal(gradient: DVec3, hessian: DMat3) -> [f64; 2] {
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
    use crate::mesh::MeshDistance;
    use crate::triangles::cube_sphere;

    /// A lumpy body, a cube and a waisted body, at the resolution used for scans.
    #[test]
    fn what_is_interpolated_is_nearly_the_distance() {
        let lump =
            |u: DVec3| u * (1.0 + 0.1 * (4.0 * u.x + 1.0).sin() * u.y) * DVec3::new(1.3, 1.0, 1.0);
        let cube = |u: DVec3| u / u.abs().max_element();
        let waisted = |u: DVec3| u * (0.8 + u.z * u.z);
        let bounds = [(1e-3, 0.1), (1e-3, 0.1), (5e-3, 0.4)];
        let bodies = [&lump as &dyn Fn(DVec3) -> DVec3, &cube, &waisted];
        for (body, (close, off)) in bodies.into_iter().zip(bounds) {
            let mesh = cube_sphere(40, body);
            let distance = MeshDistance::new(&mesh).unwrap();
            let (lower, upper) = mesh.bounds();
            let (spacing, level, near) = (1.0 / 12.0, 0.4, 0.84);
            let band = Band::whole(&distance, lower, upper, spacing, [level, 1.9, near]).unwrap();
            let all = distance.on_grid(band.lower, spacing, band.dims, EXACT, EVERYWHERE);
            // Errors [samples] near the level set and beyond, and the number of samples beyond.
            let (mut worst, mut beyond) = ([0.0f64; 2], 0);
            for (n, (value, all)) in band.values.iter().zip(all).enumerate() {
                // The interpolation is one-sided in the outermost cells.
                let mut inside = place(band.dims, n).into_iter().zip(band.dims);
                if !inside.all(|(i, count)| (APART..count - APART).contains(&i)) {
                    continue;
                }
                let far = usize::from(all - level > near);
                let error = (f64::from(*value) - (all - level)).abs() / spacing;
                worst[far] = worst[far].max(error);
                beyond += far;
            }
            println!("{worst:?}, {beyond} of {} beyond", band.values.len());
            assert!(worst[0] < close && worst[1] < off, "{worst:?}");
            assert!(beyond > band.values.len() / 3);
        }
    }
}
