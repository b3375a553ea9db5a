//! Comparison of the kernels with the scalar reference.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3, IVec3};
use grainwake_shape::{Shape, ShapeOptions, analytic};

use super::Reference;
use crate::dem::{Grain, RigidState};
use crate::flow::{Boundaries, Boundary, Flow, FluidParams};
use crate::grid::Mesh;
use crate::immersed::Scheme;
use crate::immersed::advection::find_correction;
use crate::immersed::forcing::{ForcedFaces, ForcingParams};
use crate::immersed::geometry::aperture::forcing_reach;
use crate::immersed::geometry::{LocateScratch, LocatedBody, Locator};
use crate::immersed::links::{LinkPlanes, compute_link_weights};
use crate::immersed::rigid_body::{PreviousStep, RigidBodySystem};
use crate::immersed::rigidity::{add_rigid_gain, sum_impulse};
use crate::immersed::update::locate_and_compute_weights;
use crate::math::{Load, RigidVelocity};

const DT: f64 = 0.004;
const NU: f64 = 0.01;
const DENSITY: f64 = 1.3;
/// Grains with a closed-form distance; the third is a sampled ellipsoid.
const SPHERES: [usize; 2] = [0, 1];
/// Acceleration of a grain in the step before [m/s^2, rad/s^2].
const ACCELERATION: RigidVelocity =
    RigidVelocity { linear: DVec3::new(3.0, -2.0, 1.0), angular: DVec3::new(-1.0, 4.0, 2.0) };

/// Tolerance of the closed fraction of a face with this solid fraction. In a nearly solid face the
/// closed fraction is a quotient of small differences, which the kernel evaluates in singles.
fn closed_tolerance(solid_fraction: f64) -> f64 {
    if solid_fraction < 0.95 { 1e-4 } else { 2e-3 }
}

/// Three rotating grains in a smooth predicted flow with pressure and body acceleration. The first
/// is next to a wall and across a periodic edge, the second touches it, the third is isolated.
struct Case {
    flow: Flow<f64>,
    reference: Reference,
    locator: Locator,
    located: Vec<(LocatedBody, ForcedFaces)>,
}

impl Case {
    fn new(scheme: Scheme) -> Case {
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
        };
        let mut boundaries = Boundaries([[Boundary::WALL; 2]; 3]);
        boundaries.0[1] = [Boundary::Periodic; 2];
        let mut flow = Flow::new(&mesh, boundaries, &params);
        flow.start_from(|axis, x| (1.5 * x).to_array()[(axis + 1) % 3].sin());
        flow.pressure.fill_with(&mesh, |x| (2.0 * x.x).sin() * (1.5 * x.y).cos() + 0.4 * x.z * x.z);
        flow.predict(DT);
        let sphere = Arc::new(Shape::sphere(0.5, 100));
        let options = ShapeOptions::default();
        let ellipsoid = Arc::new(analytic::ellipsoid(0.5, 0.4, 0.35, &options).unwrap());
        let first = DVec3::new(0.35, 0.37, 1.52);
        let second = first + 0.999 * DVec3::new(0.6, 0.45, 0.7).normalize();
        let third = DVec3::new(2.63, 1.87, 2.62);
        let grains = [(&sphere, first), (&sphere, second), (&ellipsoid, third)];
        let orientation = DQuat::from_scaled_axis(DVec3::new(0.3, 0.8, -0.4));
        let grains = grains.map(|(shape, position)| {
            Grain::new(shape.clone(), 2.0)
                .with_position(position)
                .with_orientation(orientation)
                .with_velocity(DVec3::new(0.3, -0.1, 0.2) * position.x)
                .with_angular_velocity(DVec3::new(0.5, 0.2, -0.7))
        });
        let mut locator = Locator::new(&mesh, &boundaries, &grains);
        locator.find_neighbours(&grains, |_| 0.0);
        let eps = locator.eps;
        let params = ForcingParams::new(scheme, eps, mesh.spacing, NU, DT);
        let scratch = &mut LocateScratch::default();
        let located = grains.iter().enumerate().map(|(index, grain)| {
            let (mut body, mut forced) = Default::default();
            locate_and_compute_weights(
                &locator,
                &params,
                index,
                grain,
                &mut body,
                &mut forced,
                scratch,
            );
            (body, forced)
        });
        let located = located.collect();
        let reference = Reference {
            mesh,
            boundaries,
            grains: grains.to_vec(),
            scheme,
            eps,
            kinematic_viscosity: NU,
            dt: DT,
        };
        Case { flow, reference, locator, located }
    }

    /// Velocity of a grain before the step, its acceleration then, and its velocity after the step.
    fn motion(&self, index: usize) -> [RigidVelocity; 3] {
        let new = RigidVelocity {
            linear: DVec3::new(0.1, 0.25, -0.3),
            angular: DVec3::new(-0.4, 0.6, 0.1),
        };
        [self.reference.grains[index].rigid_velocity(), ACCELERATION, new]
    }

    /// Predicted velocity by component.
    fn predicted(&self) -> [Vec<f64>; 3] {
        [0, 1, 2].map(|axis| self.flow.predicted.component(axis).to_vec())
    }

    /// Values of listed faces by position in memory, `elsewhere` for faces that are not listed. A
    /// list has the position, first entry and number of adjacent faces.
    fn by_position<T: Copy + Into<f64>>(
        &self,
        lists: impl Iterator<Item = (usize, usize, usize)>,
        values: &[T],
        elsewhere: f64,
    ) -> Vec<f64> {
        let mut all = vec![elsewhere; self.reference.mesh.layout().len()];
        for (at, first, count) in lists {
            for n in 0..count {
                all[at + n] = values[first + n].into();
            }
        }
        all
    }

    /// Values of the faces within reach of a grain, by position in memory.
    fn by_row<T: Copy + Into<f64>>(
        &self,
        index: usize,
        component: usize,
        values: &[T],
        elsewhere: f64,
    ) -> Vec<f64> {
        let rows = self.located[index].0.rows[component].iter();
        self.by_position(rows.map(|r| (r.at, r.first, r.count)), values, elsewhere)
    }

    /// Faces all of whose links are open and within reach; walls and other grains are far.
    fn faces_with_open_links(&self, index: usize, component: usize) -> Vec<IVec3> {
        let mut faces = self.reference.faces(component);
        let eps = self.locator.eps;
        faces.retain(|face| {
            let inner = face.x > 3 && face.x < 29 && face.z > 3 && face.z < 27;
            let d = |at: IVec3| self.reference.distance(index, component, *face + at);
            let around = [IVec3::X, IVec3::Y, IVec3::Z].map(|e| d(e).and(d(-e)));
            let own = around.iter().all(Option::is_some);
            inner && own && d(IVec3::ZERO).is_some_and(|d| d > 1.45 * eps && d < 1.55 * eps)
        });
        faces
    }
}

fn assert_close(found: f64, expected: f64, tolerance: f64, quantity: &str) {
    assert!((found - expected).abs() <= tolerance, "{quantity}: {found} instead of {expected}");
}

#[test]
fn distances_to_faces_match_the_reference() {
    let case = Case::new(Scheme::Aperture);
    let reference = &case.reference;
    let mut nearer_to_another = 0;
    for (index, (body, _)) in case.located.iter().enumerate() {
        // The samples of the ellipsoid are interpolated. Below the depth eps, where no weight
        // depends on the distance, the medial axis is near and interpolation is poor; beyond the
        // band the samples end.
        let eps = case.locator.eps;
        let tolerance_at = |d: f64| match SPHERES.contains(&index) {
            true => 1e-6,
            false if d > -eps && d < forcing_reach(eps) => 1e-3,
            false => 1e-2,
        };
        let tolerance = tolerance_at(case.locator.reach);
        for component in 0..3 {
            let distances = &body.distance[component];
            let distances = case.by_row(index, component, distances, f64::INFINITY);
            for face in reference.faces(component) {
                let found = distances[reference.at(face)];
                match reference.distance(index, component, face) {
                    Some(d) if d < case.locator.reach - tolerance => {
                        assert_close(found, d, tolerance_at(d), "distance");
                    }
                    Some(_) => assert!(found > case.locator.reach - tolerance),
                    None => {
                        nearer_to_another += 1;
                        assert_eq!(found, f64::INFINITY);
                    }
                }
            }
        }
    }
    assert!(nearer_to_another > 1000, "{nearer_to_another}");
}

#[test]
fn weights_of_forced_faces_match_the_reference() {
    for scheme in [Scheme::Aperture, Scheme::Paper] {
        let case = Case::new(scheme);
        let reference = &case.reference;
        let (mut forced_faces, mut shared_faces) = (0, 0);
        for index in SPHERES {
            let (_, forced) = &case.located[index];
            for component in 0..3 {
                let runs = forced.runs[component].iter();
                let runs = runs.map(|run| (run.at, run.first, run.count));
                let weights = case.by_position(runs.clone(), &forced.weight, 0.0);
                let closed_fraction = case.by_position(runs.clone(), &forced.closed_fraction, 0.0);
                let solid_fraction = case.by_position(runs.clone(), &forced.solid_fraction, 0.0);
                let by_all = case.by_position(runs, forced.total_closed_fraction(), 0.0);
                for face in reference.faces(component) {
                    let x = reference.position(component, face);
                    let (at, expected) = (reference.at(face), reference.weights(index, x));
                    assert_close(weights[at], expected.weight, 2e-5, "weight");
                    assert_close(
                        closed_fraction[at],
                        expected.closed_fraction,
                        closed_tolerance(expected.solid_fraction),
                        "closed fraction",
                    );
                    let found = solid_fraction[at];
                    assert_close(found, expected.solid_fraction, 2e-5, "solid fraction");
                    if expected.weight > 0.0 {
                        assert_close(
                            by_all[at],
                            expected.total_closed_fraction,
                            closed_tolerance(expected.solid_fraction),
                            "total closed fraction",
                        );
                        forced_faces += 1;
                        let other = reference.weights(1 - index, x).weight;
                        shared_faces += usize::from(other > 0.0);
                    }
                }
            }
        }
        assert!(forced_faces > 2000, "{forced_faces}");
        assert!(shared_faces > 10, "{shared_faces}");
    }
}

#[test]
fn weights_of_links_match_the_reference() {
    let case = Case::new(Scheme::Aperture);
    let (reference, eps) = (&case.reference, case.locator.eps);
    let mut links = [0; 2];
    for index in SPHERES {
        let (body, _) = &case.located[index];
        for component in 0..3 {
            let unknowns = [0, 1, 2].map(|axis| body.index_map.unknown_range(component, axis));
            let mut planes = LinkPlanes::default();
            planes.reset(body);
            for k in -1..body.size.z {
                compute_link_weights(&unknowns, body, component, eps, k, &mut planes);
                let rows = if k < 0 { 0 } else { body.size.y };
                for (j, i) in (0..rows).flat_map(|j| (0..body.size.x).map(move |i| (j, i))) {
                    let face = body.lowest + IVec3::new(i, j, k);
                    for axis in 0..3 {
                        let entry = planes.first_entry(j) + i as usize;
                        let found = f64::from(planes.weight[axis][entry]);
                        let expected = reference.link_weight(index, component, axis, face);
                        assert_close(found, expected.unwrap_or(-1.0), 2e-5, "weight");
                        links[usize::from(expected.is_some())] += 1;
                    }
                }
            }
        }
    }
    assert!(links[0] > 1000 && links[1] > 1000, "{links:?}");
}

#[test]
fn the_advection_correction_matches_the_reference() {
    let mut case = Case::new(Scheme::Aperture);
    let eps = case.locator.eps;
    let mut largest = [0.0_f64; 2];
    // At the smaller viscosity the excess is limited.
    for (nu, largest) in [NU, 1e-4].into_iter().zip(&mut largest) {
        case.reference.kinematic_viscosity = nu;
        for index in SPHERES {
            let kinematics = RigidState::of(&case.reference.grains[index]);
            let (known, _) = case.flow.prediction();
            let (mut scratch, mut correction) = Default::default();
            let body = &case.located[index].0;
            find_correction(eps, nu, &known, &kinematics, body, &mut scratch, &mut correction);
            for (component, correction) in correction.iter().enumerate() {
                let found = case.by_row(index, component, correction, 0.0);
                let (known, _) = case.flow.prediction();
                let reference = &case.reference;
                for face in reference.faces(component) {
                    let expected =
                        reference.correction(index, &known, &kinematics, component, face);
                    // The kernels compute the weights of the links in single precision.
                    let tolerance = 3e-5 * (1.0 + expected.abs());
                    assert_close(found[reference.at(face)], expected, tolerance, "correction");
                    *largest = largest.max(expected.abs());
                }
            }
        }
    }
    assert!(largest[1] > 0.1 && largest[0] > 1.2 * largest[1], "{largest:?}");
}

/// Next to a grain at rest in u = a x z the average of u u over the band exceeds the square of the
/// average by sigma^2 a^2 (x^2 + z^2).
#[test]
fn the_flux_next_to_a_grain_is_that_of_averaged_products() {
    let mut case = Case::new(Scheme::Aperture);
    let (eps, index, a) = (case.locator.eps, 1, 0.7);
    let mesh = case.reference.mesh;
    case.flow.velocity.fill_with(&mesh, |axis, x| if axis == 0 { a * x.x * x.z } else { 0.0 });
    let grain = case.reference.grains[index].clone();
    let at_rest = grain.with_velocity(DVec3::ZERO).with_angular_velocity(DVec3::ZERO);
    let kinematics = RigidState::of(&at_rest);
    // The profile is steep at the smaller viscosity.
    for nu in [1e6, 0.01] {
        let (known, _) = case.flow.prediction();
        let (mut scratch, mut correction) = Default::default();
        let body = &case.located[index].0;
        find_correction(eps, nu, &known, &kinematics, body, &mut scratch, &mut correction);
        let found = case.by_row(index, 0, &correction[0], 0.0);
        let faces = case.faces_with_open_links(index, 0);
        assert!(faces.len() > 40, "{}", faces.len());
        for face in faces {
            let x = case.reference.position(0, face);
            let added = 0.75 * (1.0 / 3.0 - 2.0 / std::f64::consts::PI.powi(2)) * eps * eps;
            // d/dx of s / (1 + k s), s = a^2 (x^2 + z^2); both gradients have this square.
            let s = a * a * (x.x * x.x + x.z * x.z);
            let k = 2.0 * (eps * eps / (7.0 * nu)).powi(2);
            let expected = -added * 2.0 * a * a * x.x / (1.0 + k * s).powi(2);
            let tolerance = if nu > 1.0 { 1e-12 } else { 0.02 * expected.abs() };
            assert_close(found[case.reference.at(face)], expected, tolerance, "correction");
        }
    }
}

/// Products of two components, u = a x z and w = b x z, count relative to the velocity of a grain
/// that turns about y at the rate s.
#[test]
fn the_flux_of_averaged_products_is_relative_to_the_turning_grain() {
    let mut case = Case::new(Scheme::Aperture);
    let (eps, index, [a, b, s]) = (case.locator.eps, 1, [0.7, -0.4, 0.9]);
    let mesh = case.reference.mesh;
    case.flow.velocity.fill_with(&mesh, |axis, x| [a, 0.0, b][axis] * x.x * x.z);
    let grain = case.reference.grains[index].clone();
    let turning = grain.with_velocity(DVec3::ZERO).with_angular_velocity(s * DVec3::Y);
    let (known, _) = case.flow.prediction();
    let (mut scratch, mut correction) = Default::default();
    let (body, kinematics) = (&case.located[index].0, RigidState::of(&turning));
    find_correction(eps, 1e6, &known, &kinematics, body, &mut scratch, &mut correction);
    let added = 0.75 * (1.0 / 3.0 - 2.0 / std::f64::consts::PI.powi(2)) * eps * eps;
    for component in [0, 2] {
        let found = case.by_row(index, component, &correction[component], 0.0);
        let faces = case.faces_with_open_links(index, component);
        assert!(faces.len() > 40, "{}", faces.len());
        for face in faces {
            // Gradients of u - U and w - U: (a z, 0, a x - s) and (b z + s, 0, b x).
            let x = case.reference.position(component, face);
            let divergence = match component {
                0 => 2.0 * a * (a * x.x - s) + 2.0 * a * b * x.z + a * s,
                _ => 2.0 * a * b * x.x - b * s + 2.0 * b * (b * x.z + s),
            };
            let found = found[case.reference.at(face)];
            assert_close(found, -added * divergence, 1e-12, "correction");
        }
    }
}

#[test]
fn impulse_and_imposed_rigidity_match_the_reference() {
    for scheme in [Scheme::Aperture, Scheme::Paper] {
        let mut case = Case::new(scheme);
        for index in SPHERES {
            let [old, acceleration, new] = case.motion(index);
            let predicted = case.predicted();
            let u = predicted.each_ref().map(|list| &list[..]);
            let (known, predictions) = case.flow.prediction();
            let forced = &mut case.located[index].1;
            let before = [old, acceleration];
            let impulse = sum_impulse(&known, &predictions, DENSITY, forced, before, DT);
            let motion = [old, acceleration, new];
            let expected = (case.reference).impulse(index, &known, u, motion, DENSITY);
            let expected = [expected[0].to_array(), expected[1].to_array()].concat();
            for (row, expected) in expected.into_iter().enumerate() {
                let derivative = impulse.matrix[row].iter().zip(new.to_vector());
                let derivative: f64 = derivative.map(|(m, x)| m * x).sum();
                let found = impulse.constant[row] + derivative;
                assert_close(found, expected, 5e-6 * DENSITY, "impulse");
                assert!(expected.abs() > 1e-3, "{expected}");
            }
            let (forced, h) = (&case.located[index].1, case.reference.mesh.spacing);
            case.flow.for_predictions(|axis, mut prediction| {
                add_rigid_gain(axis, h, forced, new, new - old, &mut prediction);
            });
            let imposed = case.predicted();
            let (known, _) = case.flow.prediction();
            let reference = &case.reference;
            for component in 0..3 {
                for face in reference.faces(component) {
                    let (at, x) = (reference.at(face), reference.position(component, face));
                    let u = predicted[component][at];
                    let gain = match reference.weights(index, x).weight > 0.0 {
                        true => reference.gain(index, &known, u, motion, component, face),
                        false => 0.0,
                    };
                    assert_close(imposed[component][at] - u, gain, 3e-5, "gain");
                }
            }
            for (component, list) in predicted.iter().enumerate() {
                (case.flow.predicted.component_mut(component)).copy_from_slice(list);
            }
        }
    }
}

#[test]
fn new_velocities_satisfy_the_equations_of_motion() {
    for density in [2.0, 1.3, 0.7] {
        let mut case = Case::new(Scheme::Aperture);
        for index in SPHERES {
            case.reference.grains[index].density = density;
            let mut grain = case.reference.grains[index].clone();
            let previous = PreviousStep {
                // That of the grain at another orientation.
                inertia: grain.inertia() * 0.9 + DMat3::from_diagonal(DVec3::new(0.01, 0.0, 0.02)),
                velocity: grain.rigid_velocity(),
                acceleration: ACCELERATION,
                change: DVec3::new(0.02, -0.01, 0.03),
                ..Default::default()
            };
            let [applied, contact] = [1.0, -0.3].map(|factor| Load {
                force: factor * DVec3::new(0.2, 0.5, -0.8),
                torque: factor * DVec3::new(-0.1, 0.03, 0.07),
            });
            let predicted = case.predicted();
            let u = predicted.each_ref().map(|list| &list[..]);
            let (known, predictions) = case.flow.prediction();
            let forced = &mut case.located[index].1;
            let before = [previous.velocity, previous.acceleration];
            let impulse = sum_impulse(&known, &predictions, DENSITY, forced, before, DT);
            let system =
                RigidBodySystem::new(&grain, &previous, impulse, DENSITY, applied, None, DT);
            let new = system.velocities(&grain, &previous, contact, DT);
            let (reference, load) = (&case.reference, applied + contact);
            let j = reference.impulse(index, &known, u, [before[0], before[1], new], DENSITY);
            let residual = reference.momentum_residual(index, &previous, new, j, DENSITY, load);
            assert!(residual[0].length() < 1e-5, "{residual:?}");
            assert!(residual[1].length() < 1e-5, "{residual:?}");
            (grain.velocity, grain.angular_velocity) = (new.linear, new.angular);
            let found = system.hydrodynamic_load(&grain, &previous, DENSITY, DT);
            let expected = reference.hydrodynamic_load(index, &previous, new, load);
            assert!((found.force - expected.force).length() < 1e-9, "{found:?}");
            assert!((found.torque - expected.torque).length() < 1e-9, "{found:?}");
        }
    }
}
