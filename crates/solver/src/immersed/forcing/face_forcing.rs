//! Forcing of a face near a surface: strength of the drag, and fraction closed to the
//! pressure gradient.
//!
//! Legend: d signed distance, eps half-width of the band, P pressure weight, A aperture.

use std::ops::Add;

use glam::DVec3;

use super::drag::{drag, pressure_weight};
use crate::immersed::geometry::aperture::aperture;
use crate::immersed::scheme::Scheme;
use grainwake_simd::{Kernel, Scalar, Vector, dispatch};

/// Forcing of a face by one grain, or by several together.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaceForcing {
    /// Drag coefficient times dt; the weight of the rigid velocity is strength / (1 + strength).
    pub strength: f64,
    /// Fraction of the face closed to the pressure gradient: one less its pressure weight P; zero
    /// in the paper's scheme, which blends by the weight.
    pub closed_fraction: f64,
    /// Solid fraction of the face, 1 - A; zero in the paper's scheme.
    pub solid_fraction: f64,
}

impl FaceForcing {
    /// Weight of one grain's rigid velocity on a face with the total forcing `all`.
    pub fn weight(self, all: FaceForcing) -> f64 {
        if self.strength.is_finite() { self.strength / (1.0 + all.strength) } else { 1.0 }
    }
}

impl Add for FaceForcing {
    type Output = FaceForcing;
    fn add(self, other: FaceForcing) -> FaceForcing {
        FaceForcing {
            strength: self.strength + other.strength,
            closed_fraction: self.closed_fraction + other.closed_fraction,
            solid_fraction: self.solid_fraction + other.solid_fraction,
        }
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
    diffusion: f64,
}

impl ForcingParams {
    /// Parameters for a step of length `dt` [s].
    pub fn new(
        scheme: Scheme,
        eps: f64,
        spacing: DVec3,
        kinematic_viscosity: f64,
        dt: f64,
    ) -> ForcingParams {
        ForcingParams {
            scheme,
            eps,
            spacing,
            // Limited so that products with it fit single precision.
            diffusion: (dt * kinematic_viscosity).min(1e20 * eps * eps),
        }
    }

    /// Forcing of a face at the distance `d` [m] from a surface with the unit `normal`.
    pub fn of(&self, d: f64, normal: DVec3) -> FaceForcing {
        match self.scheme {
            Scheme::Aperture => {
                let mut forcing = FaceForcing::default();
                dispatch(OneFace { params: self, d, normal, forcing: &mut forcing });
                forcing
            }
            Scheme::Paper => self.blend(d, normal),
        }
    }

    /// Strength of the drag as numerator and positive denominator; closed and solid fraction.
    #[inline(always)]
    pub fn aperture_forcing<V: Vector>(&self, d: V, normal: [V; 3]) -> ([V; 2], [V; 2]) {
        let (spacing, eps) = (self.spacing.to_array(), self.eps);
        let [drag, depth] = drag(d, normal, spacing, eps);
        let open = pressure_weight(d, normal, spacing, eps, [drag, depth]);
        let strength = V::constant(self.diffusion) * drag;
        // Zero outside the band: a concave grain may enclose such faces.
        let outside = V::constant(2.0 * eps);
        let strength = d.select_below(outside, strength, V::constant(0.0));
        let one = V::constant(1.0);
        ([strength, depth], [one - open, one - aperture(d, eps)])
    }

    /// Forcing of the paper's scheme: the weight of the rigid velocity is the solid fraction of a
    /// cell cut by a plane.
    fn blend(&self, d: f64, normal: DVec3) -> FaceForcing {
        let width = normal.abs().dot(self.spacing);
        let solid_fraction = (0.5 - d / width).clamp(0.0, 1.0);
        let strength = solid_fraction / (1.0 - solid_fraction);
        FaceForcing { strength, ..FaceForcing::default() }
    }
}

/// Evaluates one face with the instruction set in use, in which fused products are instructions.
struct OneFace<'a> {
    params: &'a ForcingParams,
    d: f64,
    normal: DVec3,
    forcing: &'a mut FaceForcing,
}

impl Kernel for OneFace<'_> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let normal = self.normal.to_array().map(Scalar);
        let ([strength, depth], [closed_fraction, solid_fraction]) =
            self.params.aperture_forcing(Scalar(self.d), normal);
        *self.forcing = FaceForcing {
            strength: strength.0 / depth.0,
            closed_fraction: closed_fraction.0,
            solid_fraction: solid_fraction.0,
        };
    }
}
