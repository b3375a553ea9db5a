//! Wall shear and pressure at a stagnation point on a plane at any angle and offset to the grid,
//! held or carried over it, against an exact solution.
//!
//! The plane is a face of a disc. With the distances z from the plane and s from the axis of
//! symmetry, the rate a and the thickness delta = sqrt(nu / a) of the layer, Homann's solution of
//! the Navier-Stokes equations is
//!
//! - u = a s phi'(z / delta) away from the axis, w = -2 a delta phi(z / delta) along z,
//! - p = nu dw/dz - (a^2 s^2 + w^2) / 2,
//! - phi''' + 2 phi phi'' - phi'^2 + 1 = 0, phi(0) = phi'(0) = 0, phi'(infinity) = 1.
//!
//! The velocity is the curl of -a delta phi C (e_z x r). The factor C of the distance r from the
//! stagnation point is 1 up to `EXACT` and 0 from `EXACT` + `CUT` on, so that the flow ends before
//! the sides of the box. Beyond `NEAR` the velocity is prescribed, at first in part.
//!
//! The unit of length is the spacing of the grid, that of time 1 / a. The density is 1.

use super::prescribed::{CentredValues, PrescribedGrain};
use super::*;
use crate::grid::FACE_OFFSET;
use crate::immersed::forcing::pressure_weight;
use grainwake_simd::Scalar;
use std::f64::consts::PI;

/// Distance from the stagnation point up to which the flow is free.
const NEAR: f64 = 7.0;
/// Distance over which the prescribed part of the velocity grows to 1. A sudden change would cause
/// waves from cell to cell.
const GROWTH: f64 = 4.0;
/// Distance up to which the prescribed velocity is that of the exact solution.
const EXACT: f64 = NEAR + GROWTH + 1.0;
/// Distance over which the prescribed flow ends.
const CUT: f64 = 4.0;
/// Thickness of the disc.
const HEIGHT: f64 = 6.0;
/// Distance from the axis within which the errors are measured.
const WINDOW: f64 = 5.0;
/// Time of a run, and time from which the errors are averaged. Those of held planes are steady
/// then.
const TIME: f64 = 6.0;
const STEADY: f64 = 3.0;

/// phi''(0): wall shear over density nu a s / delta.
const WALL_SHEAR: f64 = 1.311_937_693_88;
/// Value of z / delta from which phi is linear.
const PROFILE_END: f64 = 5.0;
/// Steps of the solution phi up to there.
const PROFILE_STEPS: usize = 1000;

/// Homann flow towards the end of a disc.
struct Layer {
    /// phi and phi' at equal steps of z / delta.
    profile: Vec<[f64; 2]>,
    delta: f64,
    /// Unit normal of the plane, into the fluid.
    normal: DVec3,
}

impl Layer {
    /// Solves for phi by the Runge-Kutta method of fourth order.
    fn new(delta: f64, normal: DVec3) -> Layer {
        let h = PROFILE_END / PROFILE_STEPS as f64;
        let rate = |[p, q, r]: [f64; 3]| [q, r, q * q - 1.0 - 2.0 * p * r];
        let moved = |y: [f64; 3], by: f64, k: [f64; 3]| [0, 1, 2].map(|n| y[n] + by * k[n]);
        let (mut y, mut profile) = ([0.0, 0.0, WALL_SHEAR], Vec::new());
        for _ in 0..=PROFILE_STEPS {
            profile.push([y[0], y[1]]);
            let k_1 = rate(y);
            let k_2 = rate(moved(y, 0.5 * h, k_1));
            let k_3 = rate(moved(y, 0.5 * h, k_2));
            let k_4 = rate(moved(y, h, k_3));
            y = [0, 1, 2].map(|n| y[n] + h / 6.0 * (k_1[n] + 2.0 * (k_2[n] + k_3[n]) + k_4[n]));
        }
        Layer { profile, delta, normal: normal.normalize() }
    }

    /// phi and phi' at z / delta, zero below the plane.
    fn profile(&self, eta: f64) -> [f64; 2] {
        let x = eta / PROFILE_END * PROFILE_STEPS as f64;
        let n = x.max(0.0) as usize;
        if n >= PROFILE_STEPS {
            return [self.profile[PROFILE_STEPS][0] + eta - PROFILE_END, 1.0];
        }
        let part = (x - n as f64).max(0.0);
        [0, 1].map(|of| {
            let [low, high] = [n, n + 1].map(|n| self.profile[n][of]);
            low + part * (high - low)
        })
    }

    fn kinematic_viscosity(&self) -> f64 {
        self.delta * self.delta
    }

    /// Distance from the plane, and position relative to the axis of symmetry, of the point `x`
    /// from the stagnation point.
    fn coordinates(&self, x: DVec3) -> (f64, DVec3) {
        let z = x.dot(self.normal);
        (z, x - z * self.normal)
    }

    /// Factor C at `x` from the stagnation point.
    fn cutoff(x: DVec3) -> f64 {
        let y = ((x.length() - EXACT) / CUT).clamp(0.0, 1.0);
        (1.0 - y * y).powi(3)
    }

    /// Vector potential of the velocity at `x` from the stagnation point.
    fn potential(&self, x: DVec3) -> DVec3 {
        let [phi, _] = self.profile(x.dot(self.normal) / self.delta);
        -self.delta * phi * Layer::cutoff(x) * self.normal.cross(x)
    }

    /// Component `axis` of the velocity on the face at `x` from the stagnation point: the discrete
    /// curl of the potential, which is free of discrete divergence.
    fn velocity(&self, axis: usize, x: DVec3) -> f64 {
        if x.length() > EXACT + CUT + 1.0 {
            return 0.0;
        }
        let change = |along: usize, of: usize| {
            let half = 0.5 * DVec3::AXES[along];
            self.potential(x + half)[of] - self.potential(x - half)[of]
        };
        let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
        change(next, last) - change(last, next)
    }

    /// Pressure at `x` from the stagnation point.
    fn pressure(&self, x: DVec3) -> f64 {
        let (z, flat) = self.coordinates(x);
        let [phi, slope] = self.profile(z / self.delta);
        let w = -2.0 * self.delta * phi;
        -2.0 * self.kinematic_viscosity() * slope - 0.5 * (flat.length_squared() + w * w)
    }

    /// Acceleration of the face at `x` by the exact pressure, which ends like the flow.
    fn pressure_acceleration(&self, axis: usize, x: DVec3) -> f64 {
        if x.length() > EXACT + CUT + 1.0 {
            return 0.0;
        }
        let half = 0.5 * DVec3::AXES[axis];
        let [above, below] = [x + half, x - half].map(|x| Layer::cutoff(x) * self.pressure(x));
        below - above
    }
}

/// A layer of thickness `delta` on a plane that is carried by `path` in a run. The stagnation point
/// is at `offset` from the centre of the cell below the middle of the box at half time.
struct Case {
    delta: f64,
    normal: DVec3,
    offset: DVec3,
    path: DVec3,
}

impl Case {
    /// Relative errors of the wall shear and of the variation of the pressure; force of the
    /// pressure on closed faces outside the plane over the exact shear.
    fn errors(&self) -> [f64; 3] {
        let layer = Layer::new(self.delta, self.normal);
        let (normal, nu) = (layer.normal, layer.kinematic_viscosity());
        let radius = EXACT + CUT + 1.0;
        let edge = 2.0 * radius.hypot(HEIGHT) + self.path.length() + 2.0;
        let mesh = Mesh::cubic([(edge as usize).next_multiple_of(8); 3], 1.0);
        let carried = self.path / TIME;
        let start =
            mesh.position([0.5; 3], mesh.cells.map(|n| n / 2)) + self.offset - 0.5 * self.path;
        let options = ShapeOptions { cells: Some(64), roundness: false, ..Default::default() };
        let disc = Arc::new(analytic::cylinder(radius, HEIGHT, &options).unwrap());
        let grain = Grain::new(disc, 1.0)
            .with_position(start - 0.5 * HEIGHT * normal)
            .with_orientation(DQuat::from_rotation_arc(DVec3::Z, normal));
        let mut run = PrescribedGrain::new(&mesh, nu, grain, carried);
        run.flow.start_from(|axis, x| carried[axis] + layer.velocity(axis, x - start));
        let fastest = 2.0 * EXACT + carried.length();
        let steps = (TIME * fastest / 0.2).ceil() as usize;
        let dt = TIME / steps as f64;
        let (mut sums, mut count) = ([0.0; 3], 0.0);
        let mut prescribed = CentredValues::new(|axis, x: DVec3| {
            let part = ((x.length() - NEAR) / GROWTH).clamp(0.0, 1.0).powi(2);
            if part == 0.0 {
                return [0.0; 3];
            }
            [part, layer.velocity(axis, x), layer.pressure_acceleration(axis, x)]
        });
        for n in 1..=steps {
            let centre = start + n as f64 * dt * carried;
            prescribed.move_to(&mesh, centre);
            run.step(dt, |axis, at, pressure_gain, u| {
                let [part, velocity, acceleration] = prescribed.on_face(axis, at);
                // The pressure tends to the exact one where the velocity is prescribed.
                let missing = pressure_gain - dt * acceleration;
                *u += part * (carried[axis] + velocity + missing - *u);
            });
            if n as f64 * dt > STEADY && n % 5 == 0 {
                let [integral, closed] = shear(&run, &layer, centre, dt);
                let errors = [integral - 1.0, pressure(&run, &layer, centre), closed];
                sums = [0, 1, 2].map(|of| sums[of] + errors[of]);
                count += 1.0;
            }
        }
        sums.map(|sum| sum / count)
    }
}

/// Integral over the plane of (1 - (s / WINDOW)^2)^3 times s times the shear away from the axis in
/// the last step, around `centre`; and the part of it by the pressure on closed faces outside the
/// plane. Both over the exact integral.
fn shear(run: &PrescribedGrain, layer: &Layer, centre: DVec3, dt: f64) -> [f64; 2] {
    let (mesh, normal) = (run.flow.mesh(), layer.normal.to_array());
    let width = layer.normal.abs().element_sum();
    let (mut integral, mut closed) = (0.0, 0.0);
    for axis in 0..3 {
        for cell in mesh.indices() {
            let (z, flat) = layer.coordinates(mesh.position(FACE_OFFSET[axis], cell) - centre);
            let weight = 1.0 - (flat.length() / WINDOW).powi(2);
            if weight > 0.0 && z > -0.5 * HEIGHT {
                let weight_s = weight.powi(3) * flat[axis] / dt;
                let [gain, pressure_gain] = [run.gain(axis, cell), run.pressure_gain(axis, cell)];
                // The plane takes what the fluid loses, but for the pressure on the ends of the
                // solid part of the face.
                let cut_fraction = (0.5 - z / width).clamp(0.0, 1.0);
                integral -= weight_s * (gain + cut_fraction * pressure_gain);
                let open =
                    pressure_weight(Scalar(z), normal.map(Scalar), [1.0; 3], run.half_width());
                closed += weight_s * (1.0 - open.0 - cut_fraction) * pressure_gain;
            }
        }
    }
    let exact = layer.delta * WALL_SHEAR * PI * WINDOW.powi(4) / 20.0;
    [integral / exact, closed / exact]
}

/// Error of the variation of the pressure, fitted to the cells from 0.5 to 1.5 spacings above the
/// plane.
fn pressure(run: &PrescribedGrain, layer: &Layer, centre: DVec3) -> f64 {
    let mesh = run.flow.mesh();
    let mut pairs = Vec::new();
    for [i, j, k] in mesh.indices() {
        let x = mesh.position([0.5; 3], [i, j, k]) - centre;
        let (z, flat) = layer.coordinates(x);
        if flat.length() < WINDOW && (0.5..1.5).contains(&z) {
            pairs.push([layer.pressure(x), run.flow.pressure[mesh.layout().index(i, j, k)]]);
        }
    }
    let mean = [0, 1].map(|of| pairs.iter().map(|pair| pair[of]).sum::<f64>() / pairs.len() as f64);
    let product = |of: usize| -> f64 {
        pairs.iter().map(|pair| (pair[0] - mean[0]) * (pair[of] - mean[of])).sum()
    };
    product(1) / product(0) - 1.0
}

const TILTED: DVec3 = DVec3::new(1.0, 2.0, 3.0);

/// Planes with a layer of `delta` spacings: along the grid at four offsets, at 45 degrees, tilted;
/// then carried along z, along x and, tilted, along x.
fn cases(delta: f64) -> Vec<Case> {
    let case =
        |normal, offset, path| Case { delta, normal, offset: DVec3::new(0.13, 0.21, offset), path };
    let held = |normal, offset| case(normal, offset, DVec3::ZERO);
    let mut cases: Vec<Case> = [0.0, 0.25, 0.5, 0.75].map(|offset| held(DVec3::Z, offset)).into();
    cases.extend([held(DVec3::new(1.0, 0.0, 1.0), 0.0), held(TILTED, 0.0)]);
    cases.extend(
        [(DVec3::Z, DVec3::Z), (DVec3::Z, DVec3::X), (TILTED, DVec3::X)]
            .map(|(normal, along)| case(normal, 0.0, 4.0 * along)),
    );
    cases
}

#[test]
fn the_profile_has_the_displacement_thickness_of_homann_flow() {
    let layer = Layer::new(1.0, DVec3::Z);
    let [phi, slope] = layer.profile[PROFILE_STEPS];
    // Thickness 0.5689 delta: F. M. White, Viscous Fluid Flow.
    assert!((PROFILE_END - phi - 0.5689).abs() < 1e-4, "{phi}");
    assert!((slope - 1.0).abs() < 1e-5, "{slope}");
}

#[test]
fn velocity_and_pressure_solve_the_equation_of_momentum() {
    let layer = Layer::new(0.8, TILTED);
    // The velocity is a difference of the potential over a spacing; this is the limit.
    let velocity = |x: DVec3| {
        let (step, potential) = (1e-2, |x: DVec3| layer.potential(x));
        let [dx, dy, dz] = DVec3::AXES
            .map(|axis| (potential(x + step * axis) - potential(x - step * axis)) / (2.0 * step));
        DVec3::new(dy.z - dz.y, dz.x - dx.z, dx.y - dy.x)
    };
    let (step, nu) = (0.05, layer.kinematic_viscosity());
    for (z, along) in [(0.4, DVec3::X), (0.9, DVec3::Y), (2.0, DVec3::Z)] {
        let x = z * layer.normal + 2.0 * layer.normal.cross(along);
        let (u, mut residual) = (velocity(x), DVec3::ZERO);
        for axis in 0..3 {
            let [below, above] = [-step, step].map(|s| x + s * DVec3::AXES[axis]);
            let [under, over] = [below, above].map(velocity);
            residual += u[axis] * (over - under) / (2.0 * step);
            residual -= nu * (over + under - 2.0 * u) / (step * step);
            residual[axis] += (layer.pressure(above) - layer.pressure(below)) / (2.0 * step);
        }
        assert!(residual.length() < 2e-2 * x.length(), "{x}: {residual}");
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow without optimisation")]
fn the_wall_shear_converges_and_is_that_of_a_carried_plane() {
    let shear = |delta: f64, normal, height, path| {
        let errors = Case { delta, normal, offset: DVec3::new(0.13, 0.21, height), path }.errors();
        println!("delta {delta}, normal {normal}, path {path}: {errors:.3?}");
        let [shear, pressure, closed] = errors;
        assert!(pressure.abs() < 0.08, "{errors:?}");
        // The closed faces outside a plane are worth 0.29 spacings of fluid.
        let expected = 0.29 / (WALL_SHEAR * delta);
        assert!((closed / expected - 1.0).abs() < 0.1, "{errors:?}");
        shear
    };
    let [thin, thick] = [0.5, 1.0].map(|delta| shear(delta, TILTED, 0.0, DVec3::ZERO));
    assert!(thin.abs() < 0.1 && thick.abs() < 0.5 * thin.abs() + 0.01, "{thin} {thick}");
    let carried = shear(0.5, TILTED, 0.0, 4.0 * DVec3::X);
    assert!((carried - thin).abs() < 0.02, "{carried} {thin}");
    let aligned = shear(0.5, DVec3::Z, 0.25, DVec3::ZERO);
    assert!(aligned.abs() < 0.18, "{aligned}");
}

#[test]
#[ignore = "several minutes"]
fn table_of_the_wall_shear_and_the_pressure() {
    for (delta, largest) in [(0.25, 0.56), (0.5, 0.18), (1.0, 0.054), (2.0, 0.014)] {
        for case in cases(delta) {
            let [shear, pressure, closed] = case.errors().map(|error| 100.0 * error);
            let Case { normal, offset, path, .. } = case;
            println!(
                "delta {delta}, normal {normal}, offset {:.2}, path {path}: shear {shear:+.1} %, \
                 pressure {pressure:+.1} %, closed faces {closed:.1} %",
                offset.z
            );
            assert!(shear.abs() < 100.0 * largest && pressure.abs() < 8.0);
        }
    }
}
