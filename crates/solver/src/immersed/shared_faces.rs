//! Forcing of the faces near several surfaces: of other grains, or of periodic images of the same
//! grain.
//!
//! Next to one plane wall the forcing has two exact solutions, shear and parabola ([`forcing`]).
//! In a gap of the width w = d_1 + d_2 between two parallel walls the corresponding solutions are
//!
//! shear:    g = m(d_1) - m(-d_2),
//! parabola: f = w / 2 (m(d_1) + m(d_2)) - M(d_1) - M(d_2) - d_1 d_2 / 2 + 2 M(0),
//!
//! the averages over the band of the linear velocity between two walls of which one moves, and of
//! y (w - y) / 2. They are exact with
//!
//! D_i = L m(d_i) / (m(d_i) - m(-d_j)), P = (D_1 + D_2) f - L f,
//! L f = w / 2 (L m(d_1) + L m(d_2)) - L M(d_1) - L M(d_2) + 1.
//!
//! In wider gaps m(-d_j) vanishes, and D_i and 1 - P = c_1 + c_2 are those of single walls. Between
//! walls at an angle the two corrections count with the factor max(0, -n_1 . n_2): in a corner of
//! 90 degrees the sums over the walls are exact already. Several pairs add up.
//! (`docs/decisions/0025-narrow-gaps.md`)
//!
//! Each grain forces a face with its part of the total, s_i = S_i / (1 + sum S). The forcing by one
//! grain does not depend on the new velocities of the others, so each keeps its own equations.
//!
//! Legend: as in [`forcing`]; i and j surfaces, w width of the gap.
//!
//! [`forcing`]: super::forcing

use glam::DVec3;

use super::Scheme;
use super::forcing::{FaceForcing, ForcedFaces, ForcingParams, drag, parabola, pressure_weight_of};
use super::geometry::aperture::{aperture, open_depth_integral};
use super::geometry::{BandFaces, NarrowBandShapes, NeighbourGrain, SharedFace};
use grainwake_simd::{Kernel, MAX_LANES, Scalar, Vector, dispatch};

/// Least m(d_i) - m(-d_j) in a gap, over m(d_i): the shear of grains in contact remains finite.
const LEAST_DEPTH: f64 = 0.1;

/// Divides the forcing of the faces that `neighbours` force too among the grains. `forced` has the
/// weights without neighbours.
pub fn share_faces(
    params: &ForcingParams,
    band: &BandFaces,
    neighbours: &[NeighbourGrain],
    shapes: &NarrowBandShapes,
    forced: &mut ForcedFaces,
) {
    forced.total_closed_fraction.clear();
    if band.shared.is_empty() {
        return;
    }
    forced.total_closed_fraction.extend_from_slice(&forced.closed_fraction);
    // A face deep inside a grain takes the velocity of this grain alone.
    let is_deep = |entry: usize| f64::from(band.distance[entry]) <= -params.eps;
    let is_shared = |face: &&SharedFace| params.scheme == Scheme::Paper || !is_deep(face.entry);
    let faces = || band.shared.iter().filter(is_shared);
    let mut surfaces = Vec::with_capacity(band.shared.len() + band.near.len());
    for face in faces() {
        let (distances, normal) = band.face(face.entry);
        surfaces.push(NearSurface { distances, normal, ..NearSurface::default() });
        for &(neighbour, d, gradient) in &band.near[face.near.clone()] {
            let other = &neighbours[neighbour];
            let normal = other.pose.orientation * gradient.normalize_or_zero();
            let distances = [d, other.mean_distance(shapes, face.position, d)];
            surfaces.push(NearSurface { distances, normal, ..NearSurface::default() });
        }
    }
    evaluate(params, &mut surfaces);
    let mut rest = &mut surfaces[..];
    for face in faces() {
        let near = rest.split_off_mut(..1 + face.near.len()).expect("each has its surfaces");
        let (weight, [own, all]) = share(params, near);
        forced.weight[face.entry] = weight as f32;
        forced.closed_fraction[face.entry] = own.closed_fraction as f32;
        forced.solid_fraction[face.entry] = own.solid_fraction as f32;
        forced.total_closed_fraction[face.entry] = all.closed_fraction as f32;
    }
}

/// Weight of the rigid velocity of the first of the `surfaces` near a face, its forcing, and the
/// forcing of all together. The closed and the solid fraction of all are at most one.
fn share(params: &ForcingParams, surfaces: &mut [NearSurface]) -> (f64, [FaceForcing; 2]) {
    let mut open = 0.0;
    // The paper's scheme has no correction for gaps.
    let count = if params.scheme == Scheme::Aperture { surfaces.len() } else { 0 };
    for i in 0..count {
        let [curvature, full_depth] = surfaces[i].shear;
        let mut depth = full_depth;
        for j in (0..count).filter(|&j| j != i) {
            let opposed = (-surfaces[i].normal.dot(surfaces[j].normal)).max(0.0);
            depth -= opposed * surfaces[j].depth_behind();
            if i < j {
                open += opposed * opening(&surfaces[i], &surfaces[j], params.eps);
            }
        }
        let forcing = &mut surfaces[i].forcing;
        if forcing.strength > 0.0 {
            forcing.strength = params.diffusion * curvature / depth.max(LEAST_DEPTH * full_depth);
        }
    }
    let sum = |part: fn(&FaceForcing) -> f64| -> f64 {
        surfaces.iter().map(|one| part(&one.forcing)).sum()
    };
    let own = surfaces[0].forcing;
    let all = FaceForcing {
        strength: sum(|one| one.strength),
        closed_fraction: sum(|one| one.closed_fraction),
        solid_fraction: sum(|one| one.solid_fraction),
    };
    let closed = (all.closed_fraction - open).clamp(0.0, 1.0);
    let solid = all.solid_fraction.min(1.0);
    let part = |own: f64, all: f64, limited: f64| if all > 0.0 { own / all * limited } else { 0.0 };
    let own = FaceForcing {
        closed_fraction: part(own.closed_fraction, all.closed_fraction, closed),
        solid_fraction: part(own.solid_fraction, all.solid_fraction, solid),
        ..own
    };
    let all = FaceForcing { closed_fraction: closed, solid_fraction: solid, ..all };
    (own.weight(all), [own, all])
}

/// Pressure weight of a face in the gap between two parallel walls, less the weight 1 - c_1 - c_2
/// that the sum over single walls would give.
fn opening(one: &NearSurface, other: &NearSurface, eps: f64) -> f64 {
    let ([_, d_1], [_, d_2]) = (one.distances, other.distances);
    let ([lm_1, m_1], [lm_2, m_2]) = (one.mean_shear, other.mean_shear);
    let width = d_1 + d_2;
    let depths = [m_1 - (m_2 - d_2), m_2 - (m_1 - d_1)];
    if width <= 0.0 || depths.iter().any(|depth| *depth < 1e-9 * eps) {
        return 0.0;
    }
    let drag = lm_1 / depths[0] + lm_2 / depths[1];
    let centre = open_depth_integral(Scalar(0.0), eps).0;
    let parabola = 0.5 * width * (m_1 + m_2) - one.driven[1] - other.driven[1] - 0.5 * d_1 * d_2
        + 2.0 * centre;
    let curvature = 0.5 * width * (lm_1 + lm_2) - one.driven[0] - other.driven[0] + 1.0;
    let weight = (drag * parabola - curvature).clamp(0.0, 1.0);
    weight - (1.0 - one.forcing.closed_fraction - other.forcing.closed_fraction)
}

/// A surface near a face. [`evaluate`] fills all but the first two fields.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct NearSurface {
    /// Unit normal, out of the grain.
    normal: DVec3,
    /// Distance d and mean distance [m].
    distances: [f64; 2],
    /// Forcing as if no other surface were near.
    forcing: FaceForcing,
    /// L m [1/m] and m [m] at the distance, for the drag; m(-d) = m(d) - d.
    shear: [f64; 2],
    /// L m and m at the mean distance, for the pressure weight.
    mean_shear: [f64; 2],
    /// L M and M [m^2] at the mean distance.
    driven: [f64; 2],
}

impl NearSurface {
    /// Open depth m(-d) on the other side of the wall [m].
    fn depth_behind(&self) -> f64 {
        self.shear[1] - self.distances[0]
    }
}

/// Evaluates each of the `surfaces` alone.
fn evaluate(params: &ForcingParams, surfaces: &mut [NearSurface]) {
    match params.scheme {
        Scheme::Aperture => dispatch(Evaluate { params, surfaces }),
        Scheme::Paper => surfaces.iter_mut().for_each(|surface| {
            surface.forcing = params.blend(surface.distances[0], surface.normal);
        }),
    }
}

/// Evaluates surfaces in full registers.
struct Evaluate<'a> {
    params: &'a ForcingParams,
    surfaces: &'a mut [NearSurface],
}

impl Kernel for Evaluate<'_> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let Evaluate { params, surfaces } = self;
        let (eps, spacing) = (params.eps, params.spacing.to_array());
        for surfaces in surfaces.chunks_mut(V::WIDTH) {
            let [mut distances, mut means, mut x, mut y, mut z] = [[0.0; MAX_LANES]; 5];
            for (n, surface) in surfaces.iter().enumerate() {
                [x[n], y[n], z[n]] = surface.normal.to_array();
                [distances[n], means[n]] = surface.distances;
            }
            let (d, mean) = (V::load(&distances), V::load(&means));
            let normal = [V::load(&x), V::load(&y), V::load(&z)];
            let shear = drag(d, normal, spacing, eps);
            let mean_shear = drag(mean, normal, spacing, eps);
            let driven = parabola(mean, normal, spacing, eps);
            let strength = params.strength(d, shear[0]).div(shear[1]);
            let closed = V::constant(1.0) - pressure_weight_of(mean, eps, mean_shear, driven);
            let solid = V::constant(1.0) - aperture(d, eps);
            let (forcing, shear) = (lanes_of([strength, closed, solid]), lanes_of(shear));
            let (mean_shear, driven) = (lanes_of(mean_shear), lanes_of(driven));
            for (n, surface) in surfaces.iter_mut().enumerate() {
                let [strength, closed_fraction, solid_fraction] = forcing.map(|lanes| lanes[n]);
                surface.forcing = FaceForcing { strength, closed_fraction, solid_fraction };
                surface.shear = shear.map(|lanes| lanes[n]);
                surface.mean_shear = mean_shear.map(|lanes| lanes[n]);
                surface.driven = driven.map(|lanes| lanes[n]);
            }
        }
    }
}

/// Lanes of each vector.
#[inline(always)]
fn lanes_of<V: Vector, const N: usize>(vectors: [V; N]) -> [[V::Number; MAX_LANES]; N] {
    let mut lanes = [[V::Number::default(); MAX_LANES]; N];
    vectors.iter().zip(&mut lanes).for_each(|(vector, lanes)| vector.store(lanes));
    lanes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::immersed::geometry::aperture::reference;

    const H: f64 = 0.5;
    const EPS: f64 = 0.625;

    /// A plane wall with the unit `normal` at the distance `d`, evaluated.
    fn alone(params: &ForcingParams, d: f64, normal: DVec3) -> NearSurface {
        let mut surface = NearSurface { distances: [d; 2], normal, ..NearSurface::default() };
        evaluate(params, std::slice::from_mut(&mut surface));
        surface
    }

    /// Forcing of a face by two parallel walls at the distances `d` and `width - d`: drag over
    /// viscosity by either, pressure weight.
    fn between_walls(d: f64, width: f64, normal: DVec3) -> ([f64; 2], f64) {
        let params = ForcingParams::new(Scheme::Aperture, EPS, DVec3::splat(H), 1.0, 1.0);
        let [one, other] = [alone(&params, d, normal), alone(&params, width - d, -normal)];
        let [(_, [first, all]), (_, [second, _])] =
            [[one, other], [other, one]].map(|mut both| share(&params, &mut both));
        ([first.strength, second.strength], 1.0 - all.closed_fraction)
    }

    /// Laplacian of `f(y)` at the distance `y` from a plane by differences of the positions.
    fn laplacian(f: impl Fn(f64) -> f64, y: f64, n: DVec3) -> f64 {
        let f = |x: DVec3| f(y + n.dot(x));
        let second = |e: DVec3| (f(H * e) + f(-H * e) - 2.0 * f(DVec3::ZERO)) / (H * H);
        DVec3::AXES.map(second).iter().sum()
    }

    #[test]
    fn shear_and_parabola_between_two_plane_walls_are_exact_solutions() {
        let m = |y| reference::open_depth(y, EPS);
        let big_m = |y| reference::open_depth_integral(y, EPS);
        for width in [0.1, 0.3, 0.5, 0.8, 1.3] {
            // Velocities averaged over the band, between walls at 0 and at `width`.
            let shear = |y: f64| m(y) - m(y - width);
            let parabola =
                |y: f64| 0.5 * width * (m(y) + m(y - width)) - big_m(y) + big_m(y - width);
            for n in [DVec3::X, DVec3::new(1.0, 2.0, -2.0) / 3.0] {
                for part in [-0.1, 0.0, 0.2, 0.5, 0.9, 1.1] {
                    let y = part * width;
                    let ([one, other], weight) = between_walls(y, width, n);
                    let force = one * shear(y) - other * (width - shear(y));
                    let residual = laplacian(shear, y, n) - force;
                    assert!(residual.abs() < 1e-10, "shear {width} {y}: {residual:e}");
                    let residual = laplacian(parabola, y, n) - (one + other) * parabola(y) + weight;
                    assert!(residual.abs() < 1e-10, "parabola {width} {y}: {residual:e}");
                }
            }
        }
    }

    #[test]
    fn surfaces_evaluated_together_are_bitwise_those_evaluated_alone() {
        let params = ForcingParams::new(Scheme::Aperture, EPS, DVec3::splat(H), 1.0, 1.0);
        // Distances from deep inside to beyond the reach; 37 surfaces leave a part of a register.
        let mut together: Vec<_> = (0..37)
            .map(|n| {
                let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(n);
                let d = EPS * (f64::from(n) / 9.0 - 1.2);
                let (distances, normal) = ([d, d + 0.1], (u.fract() - 0.5).normalize());
                NearSurface { distances, normal, ..NearSurface::default() }
            })
            .collect();
        let mut apart = together.clone();
        evaluate(&params, &mut together);
        apart.iter_mut().for_each(|one| evaluate(&params, std::slice::from_mut(one)));
        assert_eq!(together, apart);
        Evaluate { params: &params, surfaces: &mut apart }.run::<Scalar<f64>>();
        assert_eq!(together, apart);
    }

    #[test]
    fn far_walls_and_walls_at_right_angles_add_up() {
        let params = ForcingParams::new(Scheme::Aperture, EPS, DVec3::splat(H), 1.0, 1.0);
        let alone = |d, normal| alone(&params, d, normal);
        for (one, other) in [
            (alone(0.2, DVec3::X), alone(1.2, DVec3::NEG_X)),
            (alone(0.2, DVec3::X), alone(0.3, DVec3::Y)),
            (alone(0.2, DVec3::X), alone(0.3, DVec3::X)),
        ] {
            let forcing = [one, other].map(|surface| surface.forcing);
            let (weight, [first, all]) = share(&params, &mut [one, other]);
            let strength = forcing[0].strength + forcing[1].strength;
            let closed = forcing[0].closed_fraction + forcing[1].closed_fraction;
            assert!((all.strength - strength).abs() < 1e-12 * strength);
            assert!((all.closed_fraction - closed.min(1.0)).abs() < 1e-12);
            assert!((weight - first.strength / (1.0 + strength)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_forcing_of_touching_walls_is_finite() {
        for width in [-0.05, 0.0, 1e-9, 1e-3] {
            for part in [-1.0, 0.0, 0.3, 1.0] {
                let (drag, weight) = between_walls(0.1 * part, width, DVec3::Z);
                assert!(
                    drag.iter().all(|d| d.is_finite()) && (0.0..=0.1).contains(&weight),
                    "{width} {part}: {drag:?} {weight}"
                );
            }
        }
    }
}
