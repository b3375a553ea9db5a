//! A grain with prescribed motion in a flow that a test acts on, coupled step by step.

use super::*;
use crate::dem::MotionConstraint;
use crate::grid::{FACE_OFFSET, FaceVector};
use rayon::prelude::*;

/// Values on the faces that depend on the axis of a face and its position relative to a centre.
/// They are evaluated when the centre moves.
pub struct CentredValues<const N: usize, F> {
    function: F,
    centre: Option<DVec3>,
    values: [Vec<[f64; N]>; 3],
}

impl<const N: usize, F: Fn(usize, DVec3) -> [f64; N] + Sync> CentredValues<N, F> {
    pub fn new(function: F) -> CentredValues<N, F> {
        CentredValues { function, centre: None, values: [const { Vec::new() }; 3] }
    }

    /// Moves the centre to the position `centre` in the grid.
    pub fn move_to(&mut self, mesh: &Mesh, centre: DVec3) {
        if self.centre.replace(centre) == Some(centre) {
            return;
        }
        let (layout, function) = (mesh.layout(), &self.function);
        let [nx, ny, nz] = mesh.cells;
        for (axis, values) in self.values.iter_mut().enumerate() {
            values.resize(layout.len(), [0.0; N]);
            let planes = values.par_chunks_exact_mut(layout.plane()).enumerate().skip(1).take(nz);
            planes.for_each(|(k, plane)| {
                for j in 1..=ny {
                    for i in 1..=nx {
                        let x = mesh.position(FACE_OFFSET[axis], [i, j, k]) - centre;
                        plane[layout.index(i, j, 0)] = function(axis, x);
                    }
                }
            });
        }
    }

    /// Values on the face `at` in memory.
    pub fn on_face(&self, axis: usize, at: usize) -> [f64; N] {
        self.values[axis][at]
    }
}

/// A grain that is held or carried over the grid without spin, in a fluid of density 1. At the
/// sides of the box the fluid moves with the grain.
pub struct PrescribedGrain {
    pub flow: Flow<f64>,
    immersed: ImmersedGrains<f64>,
    grains: [Grain; 1],
    loads: [Load; 1],
    /// Prediction of the last step before the grain forced it [m/s].
    unforced: FaceVector<f64>,
    /// Pressure at the start of the last step [m^2/s^2].
    last_pressure: Vec<f64>,
    /// Length of the last step [s].
    dt: f64,
}

impl PrescribedGrain {
    /// Moves `grain`, and the fluid at the sides of the box, with the velocity `carried` [m/s].
    pub fn new(mesh: &Mesh, nu: f64, grain: Grain, carried: DVec3) -> PrescribedGrain {
        let sides = Boundaries([[Boundary::Inflow { velocity: carried }; 2]; 3]);
        let flow = Flow::new(mesh, sides, &FluidParams::new(1.0, nu));
        let mut grain = grain.with_velocity(carried);
        grain.translation = MotionConstraint::Prescribed(carried);
        grain.rotation = MotionConstraint::Prescribed(DVec3::ZERO);
        let grains = [grain];
        let immersed = ImmersedGrains::new(&flow, Scheme::Aperture, 1.0, nu, &grains);
        let last_pressure = vec![0.0; flow.pressure.len()];
        let (loads, unforced) = ([Load::default()], FaceVector::zeros(mesh));
        PrescribedGrain { flow, immersed, grains, loads, unforced, last_pressure, dt: 0.0 }
    }

    /// Makes a step of `dt` [s] in which `act` changes the prediction. Its arguments are the axis
    /// of a face, its place in memory, the velocity that it gains by the pressure at the start of
    /// the step [m/s], and its velocity [m/s].
    pub fn step(&mut self, dt: f64, act: impl Fn(usize, usize, f64, &mut f64)) {
        let (kinematics, last_loads) = (self.grains.each_ref().map(RigidState::of), self.loads);
        let previous = self.grains.each_ref().map(PreviousStep::of);
        let mesh = *self.flow.mesh();
        self.flow.predict(dt);
        self.last_pressure.copy_from_slice(&self.flow.pressure);
        self.dt = dt;
        for axis in 0..3 {
            for cell in mesh.indices() {
                let pressure_gain = self.pressure_gain(axis, cell);
                let [i, j, k] = cell;
                let at = mesh.layout().index(i, j, k);
                let u = &mut self.flow.predicted.component_mut(axis)[at];
                act(axis, at, pressure_gain, u);
            }
        }
        self.grains[0].pose.position += dt * self.grains[0].velocity;
        // A contact load that vanishes later keeps the grain from being updated at once, so that
        // the prediction can be read before it is forced.
        let (contact, none) = ([impact()], [Load::default()]);
        let input = CouplingInput {
            grains: &self.grains,
            kinematics: &kinematics,
            previous: &previous,
            contact: &contact,
            applied: &none,
            last_loads: &last_loads,
            crossings: &[],
            surface_loads: &[],
            dt,
        };
        let coupled = self.immersed.couple(&mut self.flow, input);
        self.unforced.copy_from(&self.flow.predicted);
        let rigid = RigidityInput {
            grains: &mut self.grains,
            previous: &previous,
            contact: &none,
            dt,
            loads: &mut self.loads,
            fluid_impulses: &mut [],
        };
        self.immersed.impose_rigidity(&mut self.flow, coupled, rigid);
        self.flow.project(dt);
    }

    /// Load on the grain by the fluid in the last step.
    pub fn load(&self) -> Load {
        self.loads[0]
    }

    /// Velocity that a face gained by the pressure at the start of the last step [m/s].
    pub fn pressure_gain(&self, axis: usize, [i, j, k]: [usize; 3]) -> f64 {
        let mesh = self.flow.mesh();
        let above = mesh.layout().index(i, j, k);
        let below = above - mesh.layout().strides()[axis];
        self.dt / mesh.spacing[axis] * (self.last_pressure[below] - self.last_pressure[above])
    }

    /// Half-width of the band around the surface [m].
    pub fn half_width(&self) -> f64 {
        self.immersed.locator.eps
    }

    /// Velocity that a face gained by the grain in the last step [m/s].
    pub fn gain(&self, axis: usize, [i, j, k]: [usize; 3]) -> f64 {
        let at = self.flow.mesh().layout().index(i, j, k);
        self.flow.predicted.component(axis)[at] - self.unforced.component(axis)[at]
    }
}
