//! Coupling of one isolated grain in plain scalar loops, beside the equations: aperture scheme, grain
//! away from the sides of the box. The kernels are tested against it.
//!
//! Legend: d signed distance, n normal, m open depth, A aperture, s weight of the rigid velocity,
//! c closed fraction, U rigid velocity, J impulse, h spacing.

use glam::{DVec3, USizeVec3};

use super::geometry::aperture::reference::{aperture, inverse_aperture_excess, open_depth};
use super::kinematics::{GrainKinematics, RigidVelocity};
use crate::dem::Grain;
use crate::flow::Known;
use crate::grid::{FACE_OFFSET, GlobalCell, Mesh};
use crate::math::Vector6;

/// One grain on a grid.
pub struct Reference {
    pub mesh: Mesh,
    pub grain: Grain,
    /// Half-width of the band [m].
    pub eps: f64,
    /// Kinematic viscosity [m^2/s].
    pub kinematic_viscosity: f64,
    /// Length of the step [s].
    pub dt: f64,
}

impl Reference {
    /// Position of a face of `component` [m].
    pub fn position(&self, component: usize, face: USizeVec3) -> DVec3 {
        (self.mesh).position(FACE_OFFSET[component], GlobalCell(face.to_array()))
    }

    /// Signed distance d [m] and unit normal n at `x`.
    pub fn distance(&self, x: DVec3) -> (f64, DVec3) {
        let pose = &self.grain.pose;
        let in_body = pose.orientation.inverse() * (x - pose.position);
        let (d, gradient) = self.grain.shape.distance_and_gradient(in_body);
        (d, pose.orientation * gradient.normalize())
    }

    /// Weight s of the rigid velocity on a face at `x`, and its closed fraction c = 1 - A(d).
    ///
    /// s = strength / (1 + strength), with the strength nu dt times
    /// sum_a (m(d + h_a n_a) + m(d - h_a n_a) - 2 m(d)) / h_a^2 / m(d).
    pub fn weights(&self, x: DVec3) -> [f64; 2] {
        let (eps, h) = (self.eps, self.mesh.spacing);
        let (d, n) = self.distance(x);
        if d <= -eps {
            return [1.0, 1.0];
        }
        if d >= 2.0 * eps {
            return [0.0, 0.0];
        }
        let m = |d| open_depth(d, eps);
        let second =
            |a: usize| (m(d + h[a] * n[a]) + m(d - h[a] * n[a]) - 2.0 * m(d)) / h[a].powi(2);
        let drag = (0..3).map(second).sum::<f64>().max(0.0) / m(d);
        let strength = self.kinematic_viscosity * self.dt * drag;
        [strength / (1.0 + strength), 1.0 - aperture(d, eps)]
    }

    /// Velocity that a face gains by rigidity [m/s] (Eqs 4b, 4c), for a grain that had the velocities
    /// `before` and has the velocities `now`; `predicted` is u* of the face [m/s].
    pub fn gain(
        &self,
        known: &Known<f64>,
        predicted: f64,
        [before, now]: [RigidVelocity; 2],
        component: usize,
        face: USizeVec3,
    ) -> f64 {
        let (h, dt, centroid) = (self.mesh.spacing, self.dt, self.grain.pose.position);
        let x = self.position(component, face);
        let [s, c] = self.weights(x);
        let p = |cell: USizeVec3| known.pressure.at(cell.x, cell.y, cell.z);
        // p~ = p - dt U . grad p
        let moved = |cell: USizeVec3| {
            let centre = self.mesh.position([0.5; 3], GlobalCell(cell.to_array()));
            let velocity = before.at(centre - centroid);
            let along = |a: usize| {
                let e = USizeVec3::AXES[a];
                velocity[a] * (p(cell + e) - p(cell - e)) / (2.0 * h[a])
            };
            p(cell) - dt * (0..3).map(along).sum::<f64>()
        };
        let rise = moved(face) - moved(face - USizeVec3::AXES[component]);
        let back = dt / h[component] * rise - dt * known.body_acceleration[component];
        let free = predicted + c * back;
        let rest_gain = c * back - s * free;
        let at = |velocity: RigidVelocity| velocity.at(x - centroid)[component];
        rest_gain + s * at(now) + (1.0 - s) * c * at(now - before)
    }

    /// Impulse J on the fluid [N s, N m s]: sum over the faces of their fluid mass times their gain.
    pub fn impulse(
        &self,
        known: &Known<f64>,
        predicted: [&[f64]; 3],
        velocities: [RigidVelocity; 2],
        fluid_density: f64,
    ) -> Vector6 {
        let fluid_mass = fluid_density * self.mesh.cell_volume();
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for component in 0..3 {
            for face in self.faces() {
                let u = predicted[component][self.at(face)];
                let gain = self.gain(known, u, velocities, component, face);
                let impulse = fluid_mass * gain * DVec3::AXES[component];
                let arm = self.position(component, face) - self.grain.pose.position;
                force += impulse;
                torque += arm.cross(impulse);
            }
        }
        let ([a, b, c], [d, e, f]) = (force.to_array(), torque.to_array());
        [a, b, c, d, e, f]
    }

    /// Correction of the advection of a face [m/s^2]: flux in through its lower links less flux out.
    pub fn correction(
        &self,
        known: &Known<f64>,
        kinematics: &GrainKinematics,
        component: usize,
        face: USizeVec3,
    ) -> f64 {
        let along = |axis: usize| {
            let flux = |lower| self.flux(known, kinematics, component, axis, lower);
            flux(face - USizeVec3::AXES[axis]) - flux(face)
        };
        (0..3).map(along).sum()
    }

    /// Change of the flux through the link along `axis` from the face `lower` to the next, over h.
    fn flux(
        &self,
        known: &Known<f64>,
        kinematics: &GrainKinematics,
        component: usize,
        axis: usize,
        lower: USizeVec3,
    ) -> f64 {
        let (eps, h, e) = (self.eps, self.mesh.spacing, USizeVec3::AXES[axis]);
        let [x_0, x_1] = [lower, lower + e].map(|face| self.position(component, face));
        let d = 0.5 * (self.distance(x_0).0 + self.distance(x_1).0);
        if d <= -eps || d >= 2.0 * eps {
            return 0.0;
        }
        let u = |of: usize, face: USizeVec3| known.velocity.component(of)[self.at(face)];
        let q = |face| u(component, face);
        let c = if axis == component {
            0.5 * (u(axis, lower) + u(axis, lower + e))
        } else {
            0.5 * (u(axis, lower + e) + u(axis, lower + e - USizeVec3::AXES[component]))
        };
        let (q_0, q_1) = (q(lower), q(lower + e));
        let sixth = 7.0 * (q_0 + q_1) - 8.0 * (q(lower - e) + q(lower + 2 * e))
            + (q(lower - 2 * e) + q(lower + 3 * e));
        let rigid = kinematics.velocity_at(0.5 * (x_0 + x_1));
        let excess = if d < eps {
            inverse_aperture_excess(d, eps)
        } else {
            0.0
        };
        let relative = (0.5 * (q_0 + q_1) - rigid[component]) * (c - rigid[axis]);
        (excess * relative + c / 60.0 * sixth) / h[axis]
    }

    /// Faces at least four cells from the sides of the box.
    pub fn faces(&self) -> impl Iterator<Item = USizeVec3> + use<> {
        let [nx, ny, nz] = self.mesh.cells.map(|n| 5..n - 3);
        nz.flat_map(move |k| {
            let nx = nx.clone();
            let rows = ny.clone();
            rows.flat_map(move |j| nx.clone().map(move |i| USizeVec3::new(i, j, k)))
        })
    }

    /// Position of a face in memory.
    pub fn at(&self, face: USizeVec3) -> usize {
        self.mesh.layout().index(face.x, face.y, face.z)
    }
}

mod tests {
    use std::sync::Arc;

    use glam::DQuat;
    use grainwake_shape::Shape;

    use super::super::advection::find_correction;
    use super::super::forcing::{ForcedFaces, ForcingParams, impose_rigidity, sum_impulse};
    use super::super::geometry::{LocateScratch, LocatedBody, Locator};
    use super::super::scheme::Scheme;
    use super::super::update::locate_and_weigh;
    use super::*;
    use crate::dem::Dof;
    use crate::flow::{Advection, Boundaries, Boundary, Flow, FluidParams};
    use crate::math::Pose;

    const DT: f64 = 0.004;
    const NU: f64 = 0.01;
    const DENSITY: f64 = 1.3;

    /// A rotating sphere in a smooth flow with pressure and body acceleration, after the prediction.
    struct Case {
        flow: Flow<f64>,
        grain: Grain,
        locator: Locator,
        body: LocatedBody,
        forced: ForcedFaces,
    }

    impl Case {
        fn new() -> Case {
            let mesh = Mesh {
                cells: [32, 28, 30],
                spacing: DVec3::new(0.125, 0.12, 0.13),
                origin: DVec3::new(-0.3, 0.2, 0.1),
            };
            let params = FluidParams {
                density: DENSITY,
                kinematic_viscosity: NU,
                body_acceleration: DVec3::new(0.2, 0.3, -0.1),
                initial_velocity: DVec3::ZERO,
                advection: Advection::Central,
            };
            let boundaries = Boundaries([[Boundary::WALL; 2]; 3]);
            let mut flow = Flow::new(&mesh, boundaries, &params);
            flow.start_from(|axis, x| (1.5 * x).to_array()[(axis + 1) % 3].sin());
            flow.pressure.fill_with(&mesh.whole(), |x| {
                (2.0 * x.x).sin() * (1.5 * x.y).cos() + 0.4 * x.z * x.z
            });
            flow.predict(DT);
            let grain = Grain {
                shape: Arc::new(Shape::sphere(0.5, 100)),
                density: 2.0,
                pose: Pose {
                    position: DVec3::new(1.63, 1.87, 2.02),
                    orientation: DQuat::from_scaled_axis(DVec3::new(0.3, 0.8, -0.4)),
                },
                velocity: DVec3::new(0.3, -0.1, 0.2),
                angular_velocity: DVec3::new(0.5, 0.2, -0.7),
                translation: Dof::Free,
                rotation: Dof::Free,
            };
            let grains = std::slice::from_ref(&grain);
            let mut locator = Locator::new(&mesh, &boundaries, grains);
            locator.find_neighbours(grains, |_| 0.0);
            let params = ForcingParams::new(Scheme::Aperture, locator.eps(), mesh.spacing, NU, DT);
            let (mut body, mut forced) = (LocatedBody::default(), ForcedFaces::default());
            let scratch = &mut LocateScratch::default();
            locate_and_weigh(
                &locator,
                &params,
                0,
                &grain,
                &mut body,
                &mut forced,
                scratch,
            );
            Case {
                flow,
                grain,
                locator,
                body,
                forced,
            }
        }

        fn reference(&self) -> Reference {
            Reference {
                mesh: *self.flow.mesh(),
                grain: self.grain.clone(),
                eps: self.locator.eps(),
                kinematic_viscosity: NU,
                dt: DT,
            }
        }
    }

    /// Values of a component by position in memory, zero where no run lists them.
    fn spread<T: Copy + Into<f64>>(
        case: &Case,
        runs: impl Iterator<Item = (usize, usize, usize)>,
        values: &[T],
        elsewhere: f64,
    ) -> Vec<f64> {
        let mut all = vec![elsewhere; case.flow.mesh().layout().len()];
        for (at, first, count) in runs {
            for n in 0..count {
                all[at + n] = values[first + n].into();
            }
        }
        all
    }

    fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
        assert!(
            (found - expected).abs() <= tolerance,
            "{what}: {found} instead of {expected}"
        );
    }

    #[test]
    fn located_faces_have_the_distances_and_weights_of_the_reference() {
        let case = Case::new();
        let reference = case.reference();
        let mut forced_faces = 0;
        for component in 0..3 {
            let rows = case.body.rows[component].iter();
            let rows = rows.map(|row| (row.at, row.first, row.count));
            let distances = spread(&case, rows, &case.body.distance[component], f64::INFINITY);
            let runs = case.forced.runs[component].iter();
            let runs = runs.map(|run| (run.at, run.first, run.count));
            let weights = spread(&case, runs.clone(), &case.forced.weight, 0.0);
            let closed = spread(&case, runs, &case.forced.closed, 0.0);
            for face in reference.faces() {
                let x = reference.position(component, face);
                let (d, _) = reference.distance(x);
                let at = reference.at(face);
                if d < case.locator.reach() - 1e-6 {
                    assert_close(distances[at], d, 1e-6, "distance");
                }
                let [s, c] = reference.weights(x);
                assert_close(weights[at], s, 2e-5, "weight");
                assert_close(closed[at], c, 2e-5, "closed fraction");
                forced_faces += usize::from(s > 0.0);
            }
        }
        assert!(forced_faces > 1000, "{forced_faces}");
    }

    #[test]
    fn the_advection_correction_is_that_of_the_reference() {
        let mut case = Case::new();
        let (reference, kinematics) = (case.reference(), GrainKinematics::of(&case.grain));
        let (known, _) = case.flow.prediction();
        let (mut scratch, mut correction) = Default::default();
        let eps = case.locator.eps();
        find_correction(
            eps,
            &known,
            &kinematics,
            &case.body,
            &mut scratch,
            &mut correction,
        );
        let mut largest = 0.0_f64;
        for component in 0..3 {
            let rows = case.body.rows[component].iter();
            let rows = rows.map(|row| (row.at, row.first, row.count));
            let found = spread(&case, rows, &correction[component], 0.0);
            let (known, _) = case.flow.prediction();
            for face in reference.faces() {
                let expected = reference.correction(&known, &kinematics, component, face);
                assert_close(found[reference.at(face)], expected, 2e-5, "correction");
                largest = largest.max(expected.abs());
            }
        }
        assert!(largest > 0.1, "{largest}");
    }

    #[test]
    fn impulse_and_rigidity_are_those_of_the_reference() {
        let mut case = Case::new();
        let (reference, before) = (case.reference(), RigidVelocity::of(&case.grain));
        let now = RigidVelocity {
            linear: DVec3::new(0.1, 0.25, -0.3),
            angular: DVec3::new(-0.4, 0.6, 0.1),
        };
        let predicted = [0, 1, 2].map(|axis| case.flow.predicted.component(axis).to_vec());
        let u = predicted.each_ref().map(|list| &list[..]);
        let (known, predictions) = case.flow.prediction();
        let expected = reference.impulse(&known, u, [before, now], DENSITY);
        let impulse = sum_impulse(&known, &predictions, DENSITY, &mut case.forced, before, DT);
        let x = now.to_vector();
        for (row, expected) in expected.into_iter().enumerate() {
            let slope = impulse.slope[row].iter().zip(x).map(|(m, x)| m * x);
            let found = impulse.constant[row] + slope.sum::<f64>();
            assert_close(found, expected, 2e-6 * DENSITY, "impulse");
        }
        assert!(expected.iter().all(|j| j.abs() > 1e-3), "{expected:?}");
        let (forced, spacing) = (&case.forced, reference.mesh.spacing);
        case.flow.for_predictions(|axis, mut prediction| {
            let change = now - before;
            impose_rigidity(axis, spacing, forced, now, change, DT, &mut prediction);
        });
        let imposed = [0, 1, 2].map(|axis| case.flow.predicted.component(axis).to_vec());
        let (known, _) = case.flow.prediction();
        let mut largest = 0.0_f64;
        for component in 0..3 {
            for face in reference.faces() {
                let at = reference.at(face);
                let before_step = predicted[component][at];
                let gain = reference.gain(&known, before_step, [before, now], component, face);
                assert_close(imposed[component][at] - before_step, gain, 2e-5, "gain");
                largest = largest.max(gain.abs());
            }
        }
        assert!(largest > 0.1, "{largest}");
    }
}
