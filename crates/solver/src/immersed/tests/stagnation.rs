//! Stagnation-point flow with a boundary layer of given thickness: a manufactured solution around a
//! sphere, held or carried over the grid.
//!
//! The velocity relative to the sphere is u = curl curl (g e_z), with g a function of the distance
//! r from the centre. With G = g'/r,
//!
//! - u = (z G'/r) x - (2 G + r G') e_z,
//! - G = -(a/2) (t - delta (1 - exp(-t / delta))) C, where t = r - R.
//!
//! It is free of divergence and vanishes at the surface, t = 0. Next to the poles it is Homann's
//! flow: an inviscid strain of rate a outside a layer of thickness delta, with the viscosity
//! nu = a delta^2 of Homann's layer. C = exp(-(t / w)^2) ends the flow before the sides of the box.
//!
//! The acceleration f = (u . grad) u - nu lap u + grad p, with p = Q z, makes u a steady solution.
//! The function Q of r is such that f vanishes at the surface. The shear and the pressure there
//! give the force on the sphere in closed form.

use super::*;
use crate::dem::MotionConstraint;
use crate::grid::FaceVector;

/// Radius R of the sphere.
const RADIUS: f64 = 0.5;
/// Strain rate a outside the layer.
const STRAIN: f64 = 3.0;
/// Width w of the flow around the sphere.
const WIDTH: f64 = 0.4;
/// Edge of the periodic box; at its sides the velocity is below 1e-4.
const EDGE: f64 = 4.0;
/// Time of a run: three times 1/a.
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
        Solution { delta, nu: STRAIN * delta * delta }
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
        products.map(|product| -0.5 * STRAIN * (-y * y).exp() * product)
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

    /// Acceleration f of the fluid at `x` from the centre; none inside the sphere.
    fn driving(&self, x: DVec3) -> DVec3 {
        let (r, z) = (x.length(), x.z);
        if r <= RADIUS || r > 0.5 * EDGE {
            return DVec3::ZERO;
        }
        let t = r - RADIUS;
        let profile @ [g, first, second, _] = self.profile(t);
        let [h, h_slope] = Solution::laplacian(profile, r);
        // Q = (q + q' t + q t / delta) exp(-t / delta) C.
        let [q, slope] = self.surface_pressure();
        let linear = q / self.delta + slope;
        let decay = (-t / self.delta - (t / WIDTH).powi(2)).exp();
        let rate = -1.0 / self.delta - 2.0 * t / WIDTH.powi(2);
        let pressure = (q + linear * t) * decay;
        let pressure_slope = linear * decay + rate * pressure;
        // u = a z x + b e_z.
        let (a, b) = (first / r, -(2.0 * g + r * first));
        let (a_slope, b_slope) = (second / r - first / (r * r), -(3.0 * first + r * second));
        // u . x / (z r), the rate at which u changes r, over z.
        let outward = a * r + b / r;
        let along_x = z * z * (a_slope * outward + 2.0 * a * a)
            + a * b
            + z * (pressure_slope - self.nu * h_slope) / r;
        let along_z =
            z * (a * b + b_slope * outward) + pressure + self.nu * (2.0 * h + r * h_slope);
        along_x * x + along_z * DVec3::Z
    }

    /// Forces of shear and of pressure on the sphere along z, over the density of the fluid.
    fn forces(&self) -> [f64; 2] {
        let [_, _, second, _] = self.profile(0.0);
        let volume = 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
        [-2.0 * volume * self.nu * second, -volume * self.surface_pressure()[0]]
    }
}

/// Position `x` in the box relative to the nearest image of `centre`.
fn relative(x: DVec3, centre: DVec3) -> DVec3 {
    let x = x - centre;
    x - EDGE * (x / EDGE).round()
}

/// Error of the mean force along z over the second half of a run with `cells` across the diameter,
/// relative to the sum of the magnitudes of shear and pressure. The layer has the thickness
/// `delta`; sphere and flow move at `carried`.
fn force_error(delta: f64, cells: usize, carried: DVec3) -> f64 {
    let solution = Solution::new(delta);
    let h = 2.0 * RADIUS / cells as f64;
    let mesh = Mesh::cubic([(EDGE / h).round() as usize; 3], h);
    let params = FluidParams::new(1.0, solution.nu);
    let mut flow = Flow::<f64>::new(&mesh, Boundaries([[Boundary::Periodic; 2]; 3]), &params);
    let start = DVec3::new(2.008, 2.018, 2.026);
    flow.start_from(|axis, x| carried[axis] + solution.velocity(relative(x, start))[axis]);
    let mut grain =
        Grain::new(Shape::sphere(RADIUS, 2000), 1.0).with_position(start).with_velocity(carried);
    grain.translation = MotionConstraint::Prescribed(carried);
    grain.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
    let mut grains = [grain];
    let mut immersed = ImmersedGrains::new(&flow, Scheme::Aperture, 1.0, solution.nu, &grains);
    let fastest = 1.2 * STRAIN * RADIUS + carried.length();
    let rate = (fastest / (0.2 * h)).max(solution.nu / (0.05 * h * h));
    let steps = 2 * (0.5 * TIME * rate).ceil() as usize;
    let dt = TIME / steps as f64;
    let (none, mut loads, mut sum) = ([Load::default()], [Load::default()], 0.0);
    for n in 0..steps {
        let at = |step: f64| start + (n as f64 + step) * dt * carried;
        let (kinematics, last_loads) = (grains.each_ref().map(RigidState::of), loads);
        let velocity = grains[0].rigid_velocity();
        let previous = [PreviousStep { velocity, ..Default::default() }];
        flow.predict(dt);
        drive(&mut flow, &solution, at(0.5), dt);
        grains[0].pose.position = at(1.0);
        let input = CouplingInput {
            grains: &grains,
            kinematics: &kinematics,
            previous: &previous,
            contact: &none,
            applied: &none,
            last_loads: &last_loads,
            crossings: &[],
            surface_loads: &[],
            dt,
        };
        let coupled = immersed.couple(&mut flow, input);
        let rigid = RigidityInput {
            grains: &mut grains,
            previous: &previous,
            contact: &none,
            dt,
            loads: &mut loads,
            fluid_impulses: &mut [],
        };
        immersed.impose_rigidity(&mut flow, coupled, rigid);
        flow.project(dt);
        if n >= steps / 2 {
            sum += loads[0].force.z;
        }
    }
    let [shear, pressure] = solution.forces();
    (2.0 * sum / steps as f64 - shear - pressure) / (shear.abs() + pressure.abs())
}

/// Adds the acceleration of the fluid over `dt` to the prediction.
fn drive(flow: &mut Flow<f64>, solution: &Solution, centre: DVec3, dt: f64) {
    let mesh = *flow.mesh();
    let mut accelerations = FaceVector::<f64>::zeros(&mesh);
    accelerations.fill_with(&mesh, |axis, x| solution.driving(relative(x, centre))[axis]);
    for axis in 0..3 {
        let predicted = flow.predicted.component_mut(axis);
        for (u, f) in predicted.iter_mut().zip(accelerations.component(axis).iter()) {
            *u += dt * f;
        }
    }
}

/// Checks the largest errors [%] with layers of the given thicknesses, of a sphere that is held and
/// of one that is carried over the grid at an angle.
fn check(cells: usize, bounds: [(f64, f64); 3]) {
    for (delta, bound) in bounds {
        for carried in [DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8)] {
            let error = 100.0 * force_error(delta, cells, carried);
            let layer = delta * cells as f64;
            println!("{cells} cells, layer of {layer} cells, carried at {carried}: {error:+.2} %");
            assert!(error.abs() < bound, "{layer} cells, {carried}: {error}");
        }
    }
}

#[test]
fn the_acceleration_balances_the_force_on_the_sphere() {
    for delta in [0.25, 0.125, 0.0625] {
        let solution = Solution::new(delta);
        let (shells, rings) = (3000, 40);
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
        let error = (sum - shear - pressure) / (shear.abs() + pressure.abs());
        assert!(error.abs() < 2e-3, "{delta}: {error}");
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow without optimisation")]
fn forces_of_layers_of_half_a_cell_to_two_cells() {
    check(8, [(0.25, 4.0), (0.125, 6.0), (0.0625, 6.5)]);
}

#[test]
#[ignore = "two minutes"]
fn forces_of_layers_of_one_cell_to_four() {
    check(16, [(0.25, 1.2), (0.125, 1.8), (0.0625, 1.2)]);
}
