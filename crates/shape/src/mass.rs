//! Volume, centroid and second moments of a mesh (exact) and of a sampled field (sub-cell).

use crate::field::SampledField;
use crate::triangles::TriangleMesh;
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Mass properties at unit density.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mass {
    /// Volume [m^3].
    pub volume: f64,
    /// Centroid [m].
    pub centroid: DVec3,
    /// Second moments about the centroid, the integral of x xᵀ [m^5].
    pub second: DMat3,
}

/// Integrals of 1, x and x xᵀ (xx, yy, zz, xy, yz, zx) about a reference point.
#[derive(Clone, Copy, Default)]
struct Raw {
    one: f64,
    first: DVec3,
    square: DVec3,
    mixed: DVec3,
}

impl std::ops::Add for Raw {
    type Output = Raw;
    fn add(self, o: Raw) -> Raw {
        Raw {
            one: self.one + o.one,
            first: self.first + o.first,
            square: self.square + o.square,
            mixed: self.mixed + o.mixed,
        }
    }
}

impl Raw {
    /// Translates the second moments to the centroid and scales lengths by `unit`.
    fn finish(self, reference: DVec3, unit: f64) -> Mass {
        let c = self.first / self.one;
        let d = self.square - self.one * c * c;
        let o = self.mixed - self.one * DVec3::new(c.x * c.y, c.y * c.z, c.z * c.x);
        let second = DMat3::from_cols(
            DVec3::new(d.x, o.x, o.z),
            DVec3::new(o.x, d.y, o.y),
            DVec3::new(o.z, o.y, d.z),
        );
        Mass {
            volume: self.one * unit.powi(3),
            centroid: reference + unit * c,
            second: second * unit.powi(5),
        }
    }
}

/// Returns the exact mass properties of a closed mesh: a signed sum over the tetrahedra between a
/// reference point and the faces.
pub(crate) fn of_mesh(mesh: &TriangleMesh) -> Mass {
    let (lower, upper) = mesh.bounds();
    let reference = 0.5 * (lower + upper);
    let mut raw = Raw::default();
    for face in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(face).map(|p| p - reference);
        let volume = a.dot(b.cross(c)) / 6.0;
        let sum = a + b + c;
        let twisted = |p: DVec3| DVec3::new(p.y, p.z, p.x);
        let squares = a * a + b * b + c * c;
        let products = a * twisted(a) + b * twisted(b) + c * twisted(c);
        raw = raw
            + Raw {
                one: volume,
                first: volume / 4.0 * sum,
                square: volume / 20.0 * (sum * sum + squares),
                mixed: volume / 20.0 * (sum * twisted(sum) + products),
            };
    }
    raw.finish(reference, 1.0)
}

/// Returns the third moments about `origin`, the integrals of (x . axis)^3 [m^6], which distinguish
/// the two ends of an axis.
pub(crate) fn third_moments(mesh: &TriangleMesh, origin: DVec3, axes: DMat3) -> DVec3 {
    let to_frame = axes.transpose();
    let mut sum = DVec3::ZERO;
    for face in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(face).map(|p| to_frame * (p - origin));
        let volume = a.dot(b.cross(c)) / 6.0;
        // Complete homogeneous symmetric polynomial of degree 3 in the coordinates of the corners.
        let h3 =
            a * a * (a + b + c) + b * b * (b + c) + c * c * c + a * b * (b + c) + (a + b) * c * c;
        sum += volume / 20.0 * h3;
    }
    sum
}

/// Abscissas and weights of four-point Gauss quadrature on [0, 1].
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_9),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_1),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_9),
];

/// Returns the mass properties of the interior of a field. Interior cells are exact. In a cut cell
/// the trilinear interpolant is linear along any grid direction: lines along the steepest one are
/// cut exactly and summed by Gauss quadrature.
pub(crate) fn of_field(field: &SampledField) -> Mass {
    let [nx, ny, nz] = field.dims();
    let middle = 0.5 * DVec3::new((nx - 1) as f64, (ny - 1) as f64, (nz - 1) as f64);
    let layers: Vec<Raw> = (0..nz - 1)
        .into_par_iter()
        .map(|k| {
            let mut raw = Raw::default();
            for j in 0..ny - 1 {
                for i in 0..nx - 1 {
                    let corner = DVec3::new(i as f64, j as f64, k as f64) - middle;
                    raw = raw + cell(&corner_values(field, i, j, k), corner);
                }
            }
            raw
        })
        .collect();
    let raw = layers.into_iter().fold(Raw::default(), |sum, layer| sum + layer);
    raw.finish(field.lower() + field.spacing() * middle, field.spacing())
}

/// Returns the levels at the corners of a cell; bits 0, 1 and 2 of the corner index are x, y and z.
fn corner_values(field: &SampledField, i: usize, j: usize, k: usize) -> [f64; 8] {
    std::array::from_fn(|c| {
        let at = field.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1));
        f64::from(field.levels()[at])
    })
}

/// Integrates over the interior of one unit cell with lower corner `corner`.
fn cell(v: &[f64; 8], corner: DVec3) -> Raw {
    let inside = v.iter().filter(|v| **v < 0.0).count();
    if inside == 0 {
        return Raw::default();
    }
    if inside == 8 {
        let c = corner + DVec3::splat(0.5);
        return Raw {
            one: 1.0,
            first: c,
            square: c * c + DVec3::splat(1.0 / 12.0),
            mixed: DVec3::new(c.x * c.y, c.y * c.z, c.z * c.x),
        };
    }
    let slope: [f64; 3] = std::array::from_fn(|axis| {
        (0..8).map(|c| if c >> axis & 1 == 1 { v[c] } else { -v[c] }).sum::<f64>().abs()
    });
    let along = if slope[0] >= slope[1] && slope[0] >= slope[2] {
        0
    } else if slope[1] >= slope[2] {
        1
    } else {
        2
    };
    let (p, q) = ((along + 1) % 3, (along + 2) % 3);
    let mut raw = Raw::default();
    for (fp, wp) in GAUSS {
        for (fq, wq) in GAUSS {
            let end = |side: usize| {
                let at = |bp: usize, bq: usize| v[side << along | bp << p | bq << q];
                let low = at(0, 0) + fp * (at(1, 0) - at(0, 0));
                let high = at(0, 1) + fp * (at(1, 1) - at(0, 1));
                low + fq * (high - low)
            };
            let (a, b) = (end(0), end(1));
            let (from, to) = match (a < 0.0, b < 0.0) {
                (true, true) => (0.0, 1.0),
                (true, false) => (0.0, a / (a - b)),
                (false, true) => (a / (a - b), 1.0),
                (false, false) => continue,
            };
            let weight = wp * wq;
            let (s, t) = (corner[along] + from, corner[along] + to);
            let (m0, m1, m2) = (t - s, 0.5 * (t * t - s * s), (t * t * t - s * s * s) / 3.0);
            let mut at = DVec3::ZERO;
            at[p] = corner[p] + fp;
            at[q] = corner[q] + fq;
            let mut first = m0 * at;
            first[along] = m1;
            let mut square = m0 * at * at;
            square[along] = m2;
            // Only the coordinate along the line varies.
            let product = |i: usize, j: usize| {
                if i == along {
                    m1 * at[j]
                } else if j == along {
                    m1 * at[i]
                } else {
                    m0 * at[i] * at[j]
                }
            };
            let mixed = DVec3::new(product(0, 1), product(1, 2), product(2, 0));
            raw = raw
                + Raw {
                    one: weight * m0,
                    first: weight * first,
                    square: weight * square,
                    mixed: weight * mixed,
                };
        }
    }
    raw
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_mesh_has_the_textbook_moments() {
        let size = DVec3::new(3.0, 2.0, 1.0);
        let place = DVec3::new(10.0, -4.0, 7.0);
        let mut mesh = crate::triangles::unit_cube();
        mesh.vertices.iter_mut().for_each(|v| *v = place + *v * size);
        let mass = of_mesh(&mesh);
        assert!((mass.volume - 6.0).abs() < 1e-12);
        assert!((mass.centroid - (place + 0.5 * size)).length() < 1e-12);
        let expected = DMat3::from_diagonal(6.0 * size * size / 12.0);
        assert!(mass.second.abs_diff_eq(expected, 1e-11));
        assert!(third_moments(&mesh, mass.centroid, DMat3::IDENTITY).length() < 1e-11);
    }

    #[test]
    fn third_moment_of_a_corner_tetrahedron() {
        // Integral of x^3 over the tetrahedron (0,0,0) (1,0,0) (0,1,0) (0,0,1) is 3!/6! = 1/120.
        let mesh = TriangleMesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        };
        let third = third_moments(&mesh, DVec3::ZERO, DMat3::IDENTITY);
        assert!((third - DVec3::splat(1.0 / 120.0)).length() < 1e-15);
    }

    /// An oblique plane bisects a box: exact for a linear field.
    #[test]
    fn a_linear_field_is_integrated_exactly() {
        let normal = DVec3::new(0.2, 0.3, 0.9).normalize();
        let field = SampledField::sample(
            &|x: DVec3, _: &mut u32| normal.dot(x),
            DVec3::splat(-1.0),
            DVec3::splat(1.0),
            0.125,
            0.0,
        )
        .unwrap();
        let mass = of_field(&field);
        assert!((mass.volume - 4.0).abs() < 1e-6, "{}", mass.volume);
    }

    #[test]
    fn field_moments_converge_at_second_order() {
        let (a, b, c) = (1.0, 0.8, 0.6);
        let exact_volume = 4.0 / 3.0 * std::f64::consts::PI * a * b * c;
        let error = |cells: f64| {
            let field = SampledField::sample(
                &|x: DVec3, _: &mut u32| ((x / DVec3::new(a, b, c)).length() - 1.0) * c,
                DVec3::new(-a, -b, -c),
                DVec3::new(a, b, c),
                2.0 / cells,
                0.2,
            )
            .unwrap();
            let mass = of_field(&field);
            assert!(
                (mass.second.x_axis.x / (exact_volume * a * a / 5.0) - 1.0).abs()
                    < 30.0 / (cells * cells)
            );
            (mass.volume / exact_volume - 1.0).abs()
        };
        let (coarse, fine) = (error(16.0), error(32.0));
        assert!(coarse / fine > 3.5, "{coarse} {fine}");
    }
}
