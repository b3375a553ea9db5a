//! One grain on the grid, from one step to the next and through a step.

use glam::DVec3;
use rayon::prelude::*;

use super::Past;
use super::advection::{self, Push, Stand};
use super::forced::Forced;
use super::locate::{Body, Found, Locator};
use super::measure::Scratch;
use super::newton::{self, Motion};
use super::rigidity::{self, Impulse};
use crate::dem::Grain;
use crate::flow::{Known, Prediction};
use crate::math::{Load, Real};

/// One grain on the grid.
#[derive(Default)]
pub struct Site {
    /// Where it was found.
    pub body: Body,
    /// How it moved as the flow was predicted.
    pub stand: Stand,
    /// Whether no other grain shares faces with it in this step, nor touches it.
    pub alone: bool,
    /// Faces under its rigidity, and what its links bring: as long as it is not alone.
    pub forced: Forced,
    pub push: Push,
    impulse: Impulse,
    pub motion: Motion,
    /// Velocity and angular velocity that the fluid has been given already in this step.
    given: Option<[DVec3; 2]>,
    /// Those before the step and now, between which the fluid is still to be given its part.
    pub due: Option<[[DVec3; 2]; 2]>,
}

impl Site {
    /// Keeps how the grain stands and moves.
    pub fn remember(&mut self, grain: &Grain) {
        self.stand = Stand::of(grain);
    }

    /// What [`Locator::locate`] finds.
    pub fn found(&mut self) -> Found<'_> {
        Found {
            body: &mut self.body,
            forced: &mut self.forced,
        }
    }

    /// Gives the grain its new velocities under a mean `contact` load; returns the hydrodynamic load on it.
    pub fn advance(
        &mut self,
        grain: &mut Grain,
        past: &Past,
        contact: Load,
        fluid_density: f64,
        dt: f64,
    ) -> Load {
        let untouched = contact == Load::default();
        let now = match self.given {
            Some(given) if untouched => given,
            _ => newton::velocities(grain, past, &self.motion, contact, dt),
        };
        [grain.velocity, grain.angular_velocity] = now;
        self.due = match self.given.take() {
            None => Some([past.velocity, now]),
            Some(_) if untouched => None,
            Some(given) => Some([
                [DVec3::ZERO; 2],
                [0, 1].map(|which| now[which] - given[which]),
            ]),
        };
        newton::load(grain, past, &self.impulse, &self.motion, fluid_density, dt)
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let pushes: usize = self.push.iter().map(Vec::capacity).sum();
        size_of::<Site>() + self.body.bytes() + self.forced.bytes() + size_of::<f64>() * pushes
    }
}

/// Calls `f(index, site, next, scratch)` for all sites in parallel; `next` is the one that the same thread comes to
/// after it, if any.
pub fn in_turn<S: Default + Send>(
    sites: &mut [Site],
    f: impl Fn(usize, &mut Site, Option<&Site>, &mut S) + Sync,
) {
    // Enough for even shares.
    let chunk = (sites.len() / (8 * rayon::current_num_threads())).clamp(1, 16);
    let chunks = sites.par_chunks_mut(chunk).enumerate();
    chunks.for_each_init(S::default, |scratch, (number, sites)| {
        for n in 0..sites.len() {
            let (this, after) = sites.split_at_mut(n + 1);
            f(number * chunk + n, &mut this[n], after.first(), scratch);
        }
    });
}

/// What one thread needs at a grain.
#[derive(Default)]
pub struct Nearby<R> {
    pub advection: advection::Scratch<R>,
    locate: Scratch,
    push: Push,
    forced: Forced,
}

/// What is done to a grain between prediction and contact.
pub struct Visit<'a, R> {
    pub locator: &'a Locator,
    pub grains: &'a [Grain],
    pub known: Known<'a, R>,
    pub predictions: [Prediction<'a, R>; 3],
    /// Whether advection is corrected.
    pub corrects: bool,
    pub fluid_density: f64,
    pub relief: f64,
    pub dt: f64,
}

impl<R: Real> Visit<'_, R> {
    /// Visits grain `index`, which moved as in `past` and is under the `other` loads.
    pub fn run(
        &self,
        index: usize,
        site: &mut Site,
        next: Option<&Site>,
        nearby: &mut Nearby<R>,
        past: &Past,
        other: Load,
    ) {
        site.given = None;
        if !site.alone {
            self.find(index, site.found(), next, &mut nearby.locate);
            (site.impulse, site.motion) =
                self.couple(index, &self.predictions, &mut site.forced, past, other);
            return;
        }
        // SAFETY: no other grain has the faces that this one reads and changes, neither those near where it was
        // nor those near where it is.
        let mut own = self
            .predictions
            .each_ref()
            .map(|one| unsafe { one.again() });
        let Nearby {
            advection: scratch,
            locate,
            push,
            forced,
        } = nearby;
        let Site { body, stand, .. } = site;
        if self.corrects {
            let band = self.locator.band();
            let ahead = |component, share| {
                advection::ask_pushed(&self.known, &own, body, component, share);
            };
            advection::find(band, &self.known, stand, body, scratch, push, ahead);
            for (component, prediction) in own.iter_mut().enumerate() {
                advection::add(body, push, component, prediction);
            }
        }
        self.find(index, Found { body, forced }, next, locate);
        (site.impulse, site.motion) = self.couple(index, &own, forced, past, other);
        let (grain, contact) = (&self.grains[index], Load::default());
        let now = newton::velocities(grain, past, &site.motion, contact, self.dt);
        site.given = Some(now);
        let (motions, spacing) = ([past.velocity, now], self.known.mesh.spacing);
        for (axis, prediction) in own.iter_mut().enumerate() {
            rigidity::impose(axis, spacing, forced, motions, self.relief, prediction);
        }
    }

    /// Finds a grain; asks for what is read about the next one meanwhile.
    fn find(&self, index: usize, found: Found, next: Option<&Site>, scratch: &mut Scratch) {
        let ahead = |component: usize, share: [i32; 2]| {
            if let Some(next) = next {
                advection::ask(&self.known, &next.body, component, share);
            }
        };
        (self.locator).locate(self.grains, index, self.dt, found, scratch, ahead);
    }

    fn couple(
        &self,
        index: usize,
        predictions: &[Prediction<R>; 3],
        forced: &mut Forced,
        past: &Past,
        other: Load,
    ) -> (Impulse, Motion) {
        let (known, density) = (&self.known, self.fluid_density);
        let impulse = rigidity::gather(known, predictions, density, forced, past, self.relief);
        let motion = Motion::new(&self.grains[index], past, &impulse, density, other, self.dt);
        (impulse, motion)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DQuat;
    use grainwake_shape::{ShapeOptions, analytic};

    use super::*;
    use crate::dem::Dof;
    use crate::flow::{Advection, Boundaries, Boundary, Flow, FluidParams};
    use crate::grid::Mesh;
    use crate::immersed::{Coupling, Scheme};
    use crate::math::Pose;

    const DT: f64 = 0.004;

    /// Two grains that stand alone in a shear, one of them across a periodic edge.
    fn grains() -> [Grain; 2] {
        let options = ShapeOptions::default();
        let shape = Arc::new(analytic::ellipsoid(0.5, 0.4, 0.35, &options).unwrap());
        [DVec3::new(1.55, 2.02, 1.97), DVec3::new(5.1, 3.9, 3.1)].map(|position| Grain {
            shape: shape.clone(),
            density: 2.0,
            pose: Pose {
                position,
                orientation: DQuat::from_scaled_axis(position),
            },
            velocity: DVec3::new(0.3, -0.1, 0.2),
            angular_velocity: DVec3::new(0.5, 0.2, -0.7),
            translation: Dof::Free,
            rotation: Dof::Free,
        })
    }

    /// The predicted velocity after a step in which contact was thought to be as `thought` and turned out to be
    /// `known`, with the motion of the grains and whether they were taken to stand alone.
    fn step<R: Real>(
        scheme: Scheme,
        thought: [Load; 2],
        known: [Load; 2],
    ) -> (Vec<f64>, [bool; 2]) {
        let mesh = Mesh {
            cells: [48, 32, 32],
            spacing: DVec3::splat(0.125),
            origin: DVec3::ZERO,
        };
        let params = FluidParams {
            density: 1.0,
            kinematic_viscosity: 0.01,
            body_acceleration: DVec3::new(0.0, 0.3, 0.0),
            initial_velocity: DVec3::ZERO,
            advection: Advection::Central,
        };
        let mut boundaries = Boundaries([[Boundary::WALL; 2]; 3]);
        boundaries.0[1] = [Boundary::Periodic; 2];
        let mut flow = Flow::<R>::new(&mesh, boundaries, &params);
        flow.start_from(|axis, x| (1.5 * x).to_array()[(axis + 1) % 3].sin());
        let mut grains = grains();
        let mut coupling = Coupling::new(&flow, scheme, 1.0, 0.01, &grains);
        coupling.start(&mut flow, &grains);
        let before = grains.each_ref().map(|grain| Past {
            velocity: [grain.velocity, grain.angular_velocity],
            ..Default::default()
        });
        flow.predict(DT);
        coupling.remember(&grains);
        for grain in &mut grains {
            grain.pose.position += DT * grain.velocity;
        }
        let other = [Load {
            force: DVec3::new(0.0, 0.0, -0.4),
            torque: DVec3::ZERO,
        }; 2];
        coupling.couple(&mut flow, &grains, &before, &thought, &other, DT);
        let alone = [0, 1].map(|index| coupling.sites[index].alone);
        let mut loads = [Load::default(); 2];
        coupling.impose_rigidity(&mut flow, &mut grains, &before, &known, DT, &mut loads);
        let mut all: Vec<f64> = Vec::new();
        for axis in 0..3 {
            all.extend(flow.predicted.component(axis).iter().map(|u| u.wide()));
        }
        for (grain, load) in grains.iter().zip(&loads) {
            let vectors = [
                grain.velocity,
                grain.angular_velocity,
                load.force,
                load.torque,
            ];
            all.extend(vectors.iter().flat_map(|v| v.to_array()));
        }
        (all, alone)
    }

    fn push() -> Load {
        Load {
            force: DVec3::new(0.2, -0.1, 0.3),
            torque: DVec3::new(0.02, 0.01, -0.03),
        }
    }

    #[test]
    fn what_a_grain_that_stands_alone_is_given_at_once_is_what_it_would_be_given_later() {
        fn check<R: Real>(scheme: Scheme) {
            // Grains that contact is said to have touched wait; then there was none.
            let none = [Load::default(); 2];
            let (late, alone) = step::<R>(scheme, [push(); 2], none);
            assert_eq!(alone, [false; 2]);
            let (at_once, alone) = step::<R>(scheme, none, none);
            assert_eq!(alone, [true; 2]);
            assert!(at_once == late, "{scheme:?}");
            let (mixed, alone) = step::<R>(scheme, [push(), Load::default()], none);
            assert_eq!(alone, [false, true]);
            assert!(mixed == late, "{scheme:?}");
        }
        check::<f64>(Scheme::Aperture);
        check::<f32>(Scheme::Aperture);
        check::<f64>(Scheme::Paper);
    }

    #[test]
    fn a_grain_that_stood_alone_and_met_something_after_all_gets_the_rest() {
        for scheme in [Scheme::Aperture, Scheme::Paper] {
            let (known, none) = ([push(); 2], [Load::default(); 2]);
            let (expected, _) = step::<f64>(scheme, known, known);
            let (found, alone) = step::<f64>(scheme, none, known);
            let (without, _) = step::<f64>(scheme, none, none);
            assert_eq!(alone, [true; 2]);
            let differs = |other: &[f64]| {
                let pairs = expected.iter().zip(other);
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            assert!(differs(&without) > 1e-4, "{}", differs(&without));
            assert!(differs(&found) < 1e-13, "{}", differs(&found));
        }
    }
}
