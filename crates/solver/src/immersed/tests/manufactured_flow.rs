//! Order of accuracy of the force on a sphere, held or carried over the grid: a manufactured
//! steady flow with stagnation points and a boundary layer.
//!
//! The velocity relative to the sphere is u = curl curl (g e_z), with g a function of the distance
//! r from the centre. With G = g'/r and t = r - R,
//!
//! - u = (z G'/r) x - (2 G + r G') e_z,
//! - G = -(a/2) (t - delta (1 - exp(-t / delta))) C.
//!
//! It is free of divergence and vanishes at the surface, t = 0. Next to the surface the fluid flows
//! from the lower to the upper pole with the speed (a R / 2) sin(theta) (1 - exp(-t / delta)), so
//! that the poles are stagnation points and delta is the thickness of the layer. The viscosity
//! a delta^2 makes advection and diffusion comparable in the layer. C = exp(-(t / w)^2) ends the
//! flow before the sides of the box.
//!
//! The acceleration f = (u . grad) u - nu lap u + grad p, with p = Q z, makes u a steady solution.
//! The function Q of r is such that f vanishes at the surface. The shear and the pressure there
//! give the force on the sphere in closed form. An error of the force would change the flow until
//! the force balances f. Therefore the velocity is prescribed beyond a distance from the surface.
//! The size of the error depends on that distance, so that the tests check its order only.

use super::prescribed::{CentredValues, PrescribedGrain};
use super::*;

/// Radius R of the sphere.
const RADIUS: f64 = 0.5;
/// Rate a of the flow.
const RATE: f64 = 3.0;
/// Width w of the flow around the sphere.
const WIDTH: f64 = 0.4;
/// Edge of the box. At its sides the velocity relative to the sphere is below 1e-3.
const EDGE: f64 = 4.5;
/// Distance from the surface beyond which the velocity is prescribed.
const NEAR: f64 = 0.25;
/// Time in which the velocity relaxes to the prescribed one.
const RELAXATION: f64 = 0.05;
/// Time of a run.
const TIME: f64 = 1.0;

/// The manufactured solution, in the frame of the sphere.
#[derive(Clone, Copy)]
struct Solution {
    /// Thickness of the layer.
    delta: f64,
    /// Kinematic viscosity.
    nu: f64,
}

impl Solution {
    fn new(delta: f64) -> Solution {
        Solution { delta, nu: RATE * delta * delta }
    }

    /// G and its first three derivatives at the distance `t` from the surface, by Leibniz' rule.
    fn profile(&self, t: f64) -> [f64; 4] {
        let (e, y) = ((-t / self.delta).exp(), t / WIDTH);
        let f = [t - self.delta * (1.0 - e), 1.0 - e, e / self.delta, -e / self.delta.powi(2)];
        let c = [
            1.0,
            -2.0 * y / WIDTH,
            (4.0 * y * y - 2.0) / WIDTH.powi(2),
            (12.0 * y - 8.0 * y.powi(3)) / WIDTH.powi(3),
        ];
        let products = [
            f[0],
            f[1] + f[0] * c[1],
            f[2] + 2.0 * f[1] * c[1] + f[0] * c[2],
            f[3] + 3.0 * f[2] * c[1] + 3.0 * f[1] * c[2] + f[0] * c[3],
        ];
        products.map(|product| -0.5 * RATE * (-y * y).exp() * product)
    }

    /// H = 4 G'/r + G'' and its derivative: lap u = (z H'/r) x - (2 H + r H') e_z.
    fn laplacian([_, first, second, third]: [f64; 4], r: f64) -> [f64; 2] {
        [4.0 * first / r + second, 4.0 * second / r + third - 4.0 * first / (r * r)]
    }

    /// Velocity at `x` from the centre.
    fn velocity(&self, x: DVec3) -> DVec3 {
        let r = x.length();
        if r <= RADIUS {
            return DVec3::ZERO;
        }
        let [g, slope, ..] = self.profile(r - RADIUS);
        x.z * slope / r * x - (2.0 * g + r * slope) * DVec3::Z
    }

    /// Q and its derivative at the surface, where f = 0.
    fn surface_pressure(&self) -> [f64; 2] {
        let [value, slope] = Solution::laplacian(self.profile(0.0), RADIUS);
        [-self.nu * (2.0 * value + RADIUS * slope), self.nu * slope]
    }

    /// Q and its derivative at the distance `t` from the surface: (q + (q / delta + q') t)
    /// exp(-t / delta) C, with the values q and q' at the surface.
    fn pressure(&self, t: f64) -> [f64; 2] {
        let [q, slope] = self.surface_pressure();
        let linear = q / self.delta + slope;
        let decay = (-t / self.delta - (t / WIDTH).powi(2)).exp();
        let value = (q + linear * t) * decay;
        let rate = -1.0 / self.delta - 2.0 * t / WIDTH.powi(2);
        [value, linear * decay + rate * value]
    }

    /// Acceleration f of the fluid at `x` from the centre; none inside the sphere.
    fn driving(&self, x: DVec3) -> DVec3 {
        let (r, z) = (x.length(), x.z);
        if r <= RADIUS {
            return DVec3::ZERO;
        }
        let profile @ [g, first, second, _] = self.profile(r - RADIUS);
        let [h, h_slope] = Solution::laplacian(profile, r);
        let [q, q_slope] = self.pressure(r - RADIUS);
        // u = a z x + b e_z, with the radial velocity z (a r + b / r).
        let (a, b) = (first / r, -(2.0 * g + r * first));
        let (a_slope, b_slope) = (second / r - first / (r * r), -(3.0 * first + r * second));
        let radial = a * r + b / r;
        let along_x = z * z * (a_slope * radial + 2.0 * a * a)
            + a * b
            + z * (q_slope - self.nu * h_slope) / r;
        let along_z = z * (a * b + b_slope * radial) + q + self.nu * (2.0 * h + r * h_slope);
        along_x * x + along_z * DVec3::Z
    }

    /// Forces of shear and of pressure on the sphere along z, over the density of the fluid.
    fn forces(&self) -> [f64; 2] {
        let [_, _, second, _] = self.profile(0.0);
        let volume = 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
        [-2.0 * volume * self.nu * second, -volume * self.surface_pressure()[0]]
    }
}

/// Error of the mean force along z over the second half of a run with `cells` across the diameter,
/// over the force of shear. The layer has the thickness `delta`. The sphere, the fluid far from it
/// and the sides of the box move by `path` in the second half.
fn force_error(delta: f64, cells: usize, path: DVec3) -> f64 {
    let solution = Solution::new(delta);
    let h = 2.0 * RADIUS / cells as f64;
    let mesh = Mesh::cubic([(EDGE / h).round() as usize; 3], h);
    let carried = 2.0 * path / TIME;
    // The path begins before the middle of the box, and off the points of the grid.
    let start = 0.5 * EDGE - path + DVec3::new(0.008, 0.018, 0.026);
    let grain = Grain::new(Shape::sphere(RADIUS, 2000), 1.0).with_position(start);
    let mut run = PrescribedGrain::new(&mesh, solution.nu, grain, carried);
    run.flow.start_from(|axis, x| carried[axis] + solution.velocity(x - start)[axis]);
    let fastest = 1.2 * RATE * RADIUS + carried.length();
    let rate = (fastest / (0.2 * h)).max(solution.nu / (0.05 * h * h));
    let steps = 2 * (0.5 * TIME * rate).ceil() as usize;
    let dt = TIME / steps as f64;
    let (part, mut sum) = (1.0 - (-dt / RELAXATION).exp(), 0.0);
    let mut prescribed = CentredValues::new(|axis, x: DVec3| {
        let part = if x.length() > RADIUS + NEAR { part } else { 0.0 };
        [solution.driving(x)[axis], part, solution.velocity(x)[axis]]
    });
    for n in 0..steps {
        let centre = start + (n as f64 + 0.5) * dt * carried;
        prescribed.move_to(&mesh, centre);
        run.step(dt, |axis, at, _, u| {
            let [driving, part, velocity] = prescribed.on_face(axis, at);
            *u += dt * driving;
            *u += part * (carried[axis] + velocity - *u);
        });
        if n >= steps / 2 {
            sum += run.load().force.z;
        }
    }
    let [shear, pressure] = solution.forces();
    (2.0 * sum / steps as f64 - shear - pressure) / shear
}

/// Checks that the order of the error from `coarse` to `fine` cells across is at least `least`, for
/// a sphere that is held and for one that is carried by 2 cells along x and 3 along z (at 8 cells
/// across). Their errors on the coarse grid differ by at most 3 % of the force of shear.
fn check_order(coarse: usize, fine: usize, least: f64) {
    for delta in [0.125, 0.0625] {
        let mut coarse_errors = Vec::new();
        for path in [DVec3::ZERO, DVec3::new(0.25, 0.0, 0.375)] {
            let errors = [coarse, fine].map(|cells| force_error(delta, cells, path));
            let order = (errors[0] / errors[1]).ln() / (fine as f64 / coarse as f64).ln();
            println!("delta {delta}, path {path}: errors {errors:.3?}, order {order:.2}");
            assert!(order > least, "{delta}, {path}: {errors:?}");
            coarse_errors.push(errors[0]);
        }
        assert!((coarse_errors[0] - coarse_errors[1]).abs() < 0.03, "{coarse_errors:?}");
    }
}

#[test]
fn the_acceleration_is_that_of_the_velocity_and_the_pressure() {
    let solution = Solution::new(0.1);
    let pressure = |x: DVec3| solution.pressure(x.length() - RADIUS)[0] * x.z;
    let step = 1e-4;
    for x in [DVec3::new(0.4, 0.2, 0.3), DVec3::new(-0.1, 0.5, -0.6), DVec3::new(0.3, -0.3, 0.8)] {
        let u = solution.velocity(x);
        let (mut f, mut divergence) = (DVec3::ZERO, 0.0);
        for axis in 0..3 {
            let [below, above] = [-step, step].map(|s| x + s * DVec3::AXES[axis]);
            let [under, over] = [below, above].map(|x| solution.velocity(x));
            f += u[axis] * (over - under) / (2.0 * step);
            f -= solution.nu * (over + under - 2.0 * u) / (step * step);
            f[axis] += (pressure(above) - pressure(below)) / (2.0 * step);
            divergence += (over - under)[axis] / (2.0 * step);
        }
        let found = solution.driving(x);
        assert!((found - f).length() < 1e-4 * f.length(), "{x}: {found} {f}");
        assert!(divergence.abs() < 1e-4, "{x}: {divergence}");
        // At the surface both the velocity and the acceleration vanish.
        let x = (RADIUS + 1e-9) * x.normalize();
        assert!(solution.velocity(x).length() < 1e-7 && solution.driving(x).length() < 1e-5);
    }
}

#[test]
fn the_acceleration_balances_the_force_on_the_sphere() {
    for delta in [0.125, 0.0625] {
        let solution = Solution::new(delta);
        let (shells, rings) = (3000, 100);
        let (thickness, step) = ((0.5 * EDGE - RADIUS) / shells as f64, 2.0 / rings as f64);
        let mut sum = 0.0;
        for shell in 0..shells {
            let r = RADIUS + (shell as f64 + 0.5) * thickness;
            for ring in 0..rings {
                let cosine = (ring as f64 + 0.5) * step - 1.0;
                let x = r * DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                let area = 2.0 * std::f64::consts::PI * r * r * step;
                sum += solution.driving(x).z * area * thickness;
            }
        }
        let [shear, pressure] = solution.forces();
        let error = (sum - shear - pressure) / shear;
        assert!(error.abs() < 2e-3, "{delta}: {error}");
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow without optimisation")]
fn the_force_is_of_second_order() {
    check_order(8, 12, 1.75);
}

#[test]
#[ignore = "several minutes"]
fn the_force_is_of_second_order_on_finer_grids() {
    // 1.87 for the layer of d/16 carried across the cells (decision 0028; 1.9 before it).
    check_order(16, 24, 1.85);
}
