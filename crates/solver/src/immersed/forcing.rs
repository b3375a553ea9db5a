//! Forcing of the faces in and near a grain: strength of the drag, fraction closed to the pressure
//! gradient, and the weights of all faces that the grain forces.
//!
//! The drag is a smoothed ghost-Dirichlet condition; the pressure weight P is the weight with which
//! a pressure gradient drives the face:
//!
//! drag / nu = D = L m / m, P = L M - D M,
//! with L f = sum_a (f(d + h_a n_a) + f(d - h_a n_a) - 2 f(d)) / h_a^2
//!
//! With this drag and weight two velocity profiles over a plane wall solve the discrete equations
//! exactly, so that the wall acts at d = 0 wherever the grid lies: the linear shear m(d), and the
//! parabola M(d) under a uniform pressure gradient or in an accelerated frame
//! (`docs/decisions/0018-pressure-weight.md`). Next to a curved surface P is taken at the mean
//! distance, which closes the volume of the grain (`docs/decisions/0021-curved-surfaces.md`).
//!
//! The strength of the drag is S = nu dt D, and s = S / (1 + S) is the weight of the rigid
//! velocity.
//!
//! Legend: a axes, nu kinematic viscosity, d signed distance, n unit normal, h spacing, eps
//! half-width of the band, P pressure weight, A aperture, m open depth, M its integral.

use glam::DVec3;

use super::Scheme;
use super::geometry::aperture::{aperture, forcing_reach, open_depth, open_depth_integral};
use super::geometry::{BandFaces, FaceRun, load_all};
use grainwake_simd::{Kernel, MAX_LANES, Vector, dispatch};

/// Forcing of a face by one grain, or by several together. Both fractions stay zero in the paper's
/// scheme, whose `strength` follows from the solid fraction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceForcing {
    /// Drag coefficient times dt; the weight of the rigid velocity is strength / (1 + strength).
    pub strength: f64,
    /// Fraction of the face closed to the pressure gradient, 1 - P.
    pub closed_fraction: f64,
    /// Solid fraction of the face, 1 - A.
    pub solid_fraction: f64,
}

impl FaceForcing {
    /// Weight of one grain's rigid velocity on a face with the total forcing `all`.
    pub fn weight(self, all: FaceForcing) -> f64 {
        if self.strength.is_finite() { self.strength / (1.0 + all.strength) } else { 1.0 }
    }
}

/// Parameters of the forcing in one step.
#[derive(Clone, Copy, Debug)]
pub struct ForcingParams {
    pub scheme: Scheme,
    /// Half-width of the band [m].
    pub eps: f64,
    /// Spacing of the grid [m].
    pub spacing: DVec3,
    /// Kinematic viscosity times the step [m^2].
    pub diffusion: f64,
}

impl ForcingParams {
    /// Parameters for a step of length `dt` [s] in a fluid of kinematic viscosity `nu` [m^2/s].
    pub fn new(scheme: Scheme, eps: f64, spacing: DVec3, nu: f64, dt: f64) -> ForcingParams {
        // Limited so that products with it fit single precision.
        let diffusion = (dt * nu).min(1e20 * eps * eps);
        ForcingParams { scheme, eps, spacing, diffusion }
    }

    /// Strength of the drag as numerator and positive denominator; closed and solid fraction.
    #[inline(always)]
    pub fn aperture_forcing<V: Vector>(&self, [d, mean]: [V; 2], n: [V; 3]) -> [[V; 2]; 2] {
        let (spacing, eps) = (self.spacing.to_array(), self.eps);
        let [drag, depth] = drag(d, n, spacing, eps);
        let open = pressure_weight(mean, n, spacing, eps);
        let one = V::constant(1.0);
        [[self.strength(d, drag), depth], [one - open, one - aperture(d, eps)]]
    }

    /// Strength at the distances `d` [m] from the drag over viscosity; zero beyond the reach of the
    /// forcing, since a run may span such faces between two parts of a concave grain.
    #[inline(always)]
    pub fn strength<V: Vector>(&self, d: V, drag: V) -> V {
        let outside = V::constant(forcing_reach(self.eps));
        d.select_below(outside, V::constant(self.diffusion) * drag, V::constant(0.0))
    }

    /// Forcing of the paper's scheme: the weight of the rigid velocity is the solid fraction of a
    /// cell cut by a plane.
    pub fn blend(&self, d: f64, normal: DVec3) -> FaceForcing {
        let width = normal.abs().dot(self.spacing);
        let solid_fraction = (0.5 - d / width).clamp(0.0, 1.0);
        let strength = solid_fraction / (1.0 - solid_fraction);
        FaceForcing { strength, ..FaceForcing::default() }
    }
}

/// Forced faces of one grain. All lists but `runs` are empty or have one entry per face, in the
/// order of the runs, and `MAX_LANES` unused entries at the end.
#[derive(Clone, Debug, Default)]
pub struct ForcedFaces {
    /// Positions of the faces, by component.
    pub runs: [Vec<FaceRun>; 3],
    /// Weight of the rigid velocity, 0 to 1.
    pub weight: Vec<f32>,
    /// Fraction of a face that the grain closes to the pressure gradient, 0 to 1.
    pub closed_fraction: Vec<f32>,
    /// Fraction of a face that all grains together close; empty if the grain shares no face.
    pub total_closed_fraction: Vec<f32>,
    /// Solid fraction of a face, with which it takes a change of the rigid velocity, 0 to 1.
    pub solid_fraction: Vec<f32>,
    /// Velocity that a face gains next to a grain at rest [m/s]; filled by
    /// [`super::rigidity::sum_impulse`].
    pub rest_gain: Vec<f64>,
}

impl ForcedFaces {
    /// Computes the weights of the faces in `band` as if no other grain were near.
    pub fn compute_weights(&mut self, params: &ForcingParams, band: &mut BandFaces) {
        let count = band.count();
        band.pad(params.eps);
        for list in [&mut self.weight, &mut self.closed_fraction, &mut self.solid_fraction] {
            list.resize(count + MAX_LANES, 0.0);
        }
        match params.scheme {
            Scheme::Aperture => dispatch(ComputeFaceWeights { params, band, forced: self }),
            Scheme::Paper => {
                for entry in 0..count {
                    let (distances, normal) = band.face(entry);
                    let forcing = params.blend(distances[0], normal);
                    self.weight[entry] = forcing.weight(forcing) as f32;
                    self.closed_fraction[entry] = forcing.closed_fraction as f32;
                    self.solid_fraction[entry] = forcing.solid_fraction as f32;
                }
            }
        }
    }

    /// Fraction of each face that all grains together close, 0 to 1.
    pub fn total_closed_fraction(&self) -> &[f32] {
        if self.total_closed_fraction.is_empty() {
            &self.closed_fraction
        } else {
            &self.total_closed_fraction
        }
    }
}

/// Weights of the faces as if the grain had no neighbours, aperture scheme.
struct ComputeFaceWeights<'a> {
    params: &'a ForcingParams,
    band: &'a BandFaces,
    forced: &'a mut ForcedFaces,
}

impl Kernel for ComputeFaceWeights<'_> {
    type Number = f32;
    #[inline(always)]
    fn run<V: Vector<Number = f32>>(self) {
        let BandFaces { distance, mean_distance, normal, .. } = self.band;
        let ForcedFaces { weight, closed_fraction, solid_fraction, .. } = self.forced;
        let one = V::constant(1.0);
        let inside = V::constant(-self.params.eps);
        for at in (0..self.band.count()).step_by(V::WIDTH) {
            let d = V::load(&distance[at..]);
            let distances = [d, V::load(&mean_distance[at..])];
            let [[strength, depth], [c, solid]] =
                self.params.aperture_forcing(distances, load_all(normal, at));
            // strength / (1 + strength) with a single division.
            let s = strength.div(depth + strength);
            // Faces deep inside take the rigid velocity.
            inside.select_below(d, s, one).store(&mut weight[at..]);
            inside.select_below(d, c, one).store(&mut closed_fraction[at..]);
            solid.store(&mut solid_fraction[at..]);
        }
    }
}

/// Drag coefficient over kinematic viscosity [1/m^2] of faces at distances `d` [m] with unit
/// normals `n`, as numerator L m and positive denominator m; very large where a face is closed.
#[inline(always)]
pub fn drag<V: Vector>(d: V, n: [V; 3], spacing: [f64; 3], eps: f64) -> [V; 2] {
    let [numerator, depth] = laplacian::<V, false>(d, n, spacing, eps);
    let least = V::constant(1e-12 * eps);
    [numerator.max(V::constant(0.0)), depth.max(least)]
}

/// Pressure weight P, 0 to 1, of faces at distances `d` [m] with unit normals `n`.
#[inline(always)]
pub fn pressure_weight<V: Vector>(d: V, n: [V; 3], spacing: [f64; 3], eps: f64) -> V {
    let driven = parabola(d, n, spacing, eps);
    pressure_weight_of(d, eps, drag(d, n, spacing, eps), driven)
}

/// Pressure weight from L m, m, L M and M.
#[inline(always)]
pub fn pressure_weight_of<V: Vector>(
    d: V,
    eps: f64,
    [numerator, depth]: [V; 2],
    [driven, integral]: [V; 2],
) -> V {
    // M / m grows from 0.2 to 0.283 times d + eps; the bound holds where rounding is larger than M.
    let bound = V::constant(0.3) * (d + V::constant(eps)).max(V::constant(0.0));
    let mean_depth = integral.div(depth);
    let outside = V::constant(forcing_reach(eps));
    let mean_depth = d.select_below(V::constant(eps), mean_depth.min(bound), mean_depth);
    let weight = driven - numerator * mean_depth;
    let weight = weight.max(V::constant(0.0)).min(V::constant(1.0));
    d.select_below(outside, weight, V::constant(1.0))
}

/// L M and M [m^2] at distances `d` [m] from walls with unit normals `n`.
#[inline(always)]
pub fn parabola<V: Vector>(d: V, n: [V; 3], spacing: [f64; 3], eps: f64) -> [V; 2] {
    laplacian::<V, true>(d, n, spacing, eps)
}

/// L f and f of a velocity profile f over plane walls: the parabola M(d) or the shear m(d).
#[inline(always)]
fn laplacian<V: Vector, const PARABOLA: bool>(
    d: V,
    n: [V; 3],
    spacing: [f64; 3],
    eps: f64,
) -> [V; 2] {
    let here = profile::<V, PARABOLA>(d, eps);
    let twice = here + here;
    let mut sum = V::constant(0.0);
    for axis in 0..3 {
        let h = spacing[axis];
        let step = V::constant(h) * n[axis];
        let above = profile::<V, PARABOLA>(d + step, eps);
        let rise = above + profile::<V, PARABOLA>(d - step, eps) - twice;
        sum = rise.mul_add(V::constant(1.0 / (h * h)), sum);
    }
    [sum, here]
}

/// M(d) or m(d), chosen by a constant: a closure would not be inlined in a kernel.
#[inline(always)]
fn profile<V: Vector, const PARABOLA: bool>(d: V, eps: f64) -> V {
    if PARABOLA { open_depth_integral(d, eps) } else { open_depth(d, eps) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::immersed::geometry::aperture::reference;
    use grainwake_simd::Scalar;

    /// Laplacian of `f(d)` at a plane's distance `d` by explicit differences of the positions.
    fn laplacian(f: impl Fn(f64) -> f64, d: f64, n: DVec3, h: f64) -> f64 {
        let f = |x: DVec3| f(d + n.dot(x));
        let second = |e: DVec3| (f(h * e) + f(-h * e) - 2.0 * f(DVec3::ZERO)) / (h * h);
        DVec3::AXES.map(second).iter().sum()
    }

    #[test]
    fn shear_and_parabola_over_a_plane_wall_are_exact_solutions() {
        let h = 0.5;
        for eps in [0.5, 0.625] {
            let shear = |d| reference::open_depth(d, eps);
            let parabola = |d| reference::open_depth_integral(d, eps);
            for n in [DVec3::X, DVec3::new(1.0, 2.0, -2.0) / 3.0] {
                for d in [-0.3, -0.05, 0.0, 0.2, 0.45, 0.7, 2.0] {
                    let normal = n.to_array().map(Scalar);
                    let drag = drag(Scalar(d), normal, [h; 3], eps);
                    let weight = pressure_weight(Scalar(d), normal, [h; 3], eps).0;
                    let drag = drag[0].0 / drag[1].0;
                    let residual = laplacian(shear, d, n, h) - drag * shear(d);
                    assert!(residual.abs() < 1e-12, "shear at {d}: {residual:e}");
                    let residual = laplacian(parabola, d, n, h) - drag * parabola(d) - weight;
                    assert!(residual.abs() < 1e-12, "parabola at {d}: {residual:e}");
                }
            }
        }
    }

    #[test]
    fn pressure_weight_rises_from_closed_to_open() {
        let (h, eps) = (0.5, 0.625);
        let normal = (DVec3::new(1.0, 2.0, -2.0) / 3.0).to_array();
        let weight = |d: f64| {
            let normal = normal.map(Scalar);
            pressure_weight(Scalar(d), normal, [h; 3], eps).0
        };
        let single = |d: f64| {
            let (normal, d) = (normal.map(|n| Scalar(n as f32)), Scalar(d as f32));
            pressure_weight(d, normal, [h; 3], eps).0
        };
        let mut last = 0.0;
        for n in -240..=500 {
            let d = f64::from(n) / 400.0;
            let here = weight(d);
            assert!(here >= last - 1e-12 && here <= 1.0, "{d}: {here} after {last}");
            let error = (f64::from(single(d)) - here).abs();
            // Near d = -eps, where a face takes the rigid velocity, M and m are differences of
            // nearly equal numbers.
            assert!(error < if d < -0.8 * eps { 0.05 } else { 2e-4 }, "{d}: {error:e}");
            last = here;
        }
        assert_eq!([weight(1.3), weight(f64::INFINITY)], [1.0; 2]);
    }
}
