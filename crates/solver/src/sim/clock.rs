//! Time-step control.

use glam::DVec3;

use super::{Setup, StepRule};

/// Simulated time and time-step control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    /// Simulated time [s].
    pub time: f64,
    /// Steps taken.
    pub steps: u64,
    /// Length of the last step [s]; zero before the first.
    pub last_step: f64,
    /// 1/h of the finest grid [1/m], 0 along axes of one cell.
    pub per_spacing: DVec3,
    rule: StepRule,
    /// nu * sum 1/h_a^2 over the resolved axes [1/s]; zero without fluid.
    viscous_rate: f64,
    /// Longest next step [s]: from rest, gravity, the body acceleration or a load that was set
    /// moves nothing by more than `cfl` cells in it.
    pub longest_next: f64,
    /// `longest_next` of the first step [s].
    pub longest_first: f64,
}

/// Largest ratio of successive steps within limits, since Adams-Bashforth extrapolates over the
/// previous step; with one step fewer to the next output the ratio is up to 2.
const MAX_GROWTH: f64 = 1.2;
/// Largest ratio of successive steps on the way back to a fixed step from a shorter one.
const MAX_RATIO: f64 = 2.0;
/// Fraction of the stability limit up to which one step fewer to the next output is taken; this
/// hysteresis keeps the number of steps from alternating.
const HYSTERESIS: f64 = 0.95;

/// Relative difference up to which two steps differ by rounding only.
const ROUNDING: f64 = 1e-12;

impl Clock {
    /// Clock at t = 0.
    pub fn new(setup: &Setup) -> Clock {
        let spacing = setup.finest_spacing();
        let resolved = setup.mesh.resolved_axes().map(|axis| spacing[axis]);
        let inverse_squares: f64 = resolved.map(|h| h.powi(-2)).sum();
        let fluid_density = setup.fluid.map_or(0.0, |fluid| fluid.density);
        let acceleration = setup
            .grains
            .iter()
            .map(|grain| setup.gravity.length() * (1.0 - fluid_density / grain.density).abs())
            .chain(setup.fluid.map(|fluid| fluid.body_acceleration.length()))
            .chain(setup.prescription.body_acceleration(0.0).map(DVec3::length))
            .fold(0.0, f64::max);
        let longest_first = setup.longest_step_from_rest(acceleration);
        Clock {
            time: 0.0,
            steps: 0,
            last_step: 0.0,
            per_spacing: setup.refined_mesh().unwrap_or(setup.mesh).per_spacing(),
            rule: setup.step,
            viscous_rate: setup
                .fluid
                .map_or(0.0, |fluid| fluid.kinematic_viscosity * inverse_squares),
            longest_next: longest_first,
            longest_first,
        }
    }

    /// Length of the next step [s], such that a whole number of equal steps ends `horizon` [s] from
    /// now; `rate` is max(sum |u_a| / h_a) of the flow [1/s].
    pub fn next_step(&self, rate: f64, horizon: f64) -> f64 {
        let (largest, preferred) = match self.rule {
            StepRule::Fixed(step) if self.steps == 0 => (step, step),
            StepRule::Fixed(step) => (step, step.min(MAX_RATIO * self.last_step)),
            StepRule::Limits { cfl, viscous, max_step } => {
                let limits = [viscous / self.viscous_rate, max_step, self.longest_next];
                let largest = limits.into_iter().fold(cfl / rate, f64::min);
                let next = if self.steps == 0 { largest } else { MAX_GROWTH * self.last_step };
                (largest, next.min(largest))
            }
        };
        if !horizon.is_finite() {
            return preferred;
        }
        let count = (horizon / preferred * (1.0 - 1e-12)).ceil().max(1.0);
        // If the last step was a `count`-th of the horizon, one step fewer is tried: growth by
        // MAX_GROWTH alone never reaches a fourth of an interval from a fifth.
        let fewer = horizon / (count - 1.0);
        let as_before = self.last_step * count >= horizon * (1.0 - 1e-9);
        let step = if count > 1.0 && as_before && fewer <= HYSTERESIS * largest {
            fewer
        } else {
            horizon / count
        };
        // Steps of one length are bitwise identical: what depends on the length can be kept.
        if (step - self.last_step).abs() <= ROUNDING * step { self.last_step } else { step }
    }

    /// Advances the time by `step` [s], exactly to the `horizon` [s] if the step ends there.
    pub fn advance(&mut self, step: f64, horizon: f64) {
        let ends = (step - horizon).abs() <= ROUNDING * step;
        self.time += if ends { horizon } else { step };
        self.steps += 1;
        self.last_step = step;
        self.longest_next = f64::INFINITY;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::FluidParams;
    use crate::grid::Mesh;
    use crate::math::Formula;
    use crate::sim::Prescription;

    /// Steps over an interval of 1 after a step of length `last`; none exceeds `largest`.
    fn interval(last: f64, largest: f64) -> Vec<f64> {
        let mut clock = Clock {
            time: 0.0,
            steps: 1,
            last_step: last,
            per_spacing: DVec3::ONE,
            rule: StepRule::Limits {
                cfl: largest,
                viscous: f64::INFINITY,
                max_step: f64::INFINITY,
            },
            viscous_rate: 1.0,
            longest_next: f64::INFINITY,
            longest_first: f64::INFINITY,
        };
        let mut steps = Vec::new();
        while clock.time < 1.0 - 1e-9 {
            let horizon = 1.0 - clock.time;
            let step = clock.next_step(1.0, horizon);
            assert!(step <= largest * (1.0 + 1e-9), "{step}");
            clock.advance(step, horizon);
            steps.push(step);
        }
        assert!((clock.time - 1.0).abs() < 1e-12);
        steps
    }

    #[test]
    fn steps_grow_up_to_the_limit_whatever_the_interval() {
        for (largest, count) in [(0.27, 4), (0.36, 3), (0.53, 2), (1.5, 1)] {
            let mut last = 0.05;
            for _ in 0..12 {
                last = interval(last, largest).pop().unwrap();
            }
            assert_eq!(interval(last, largest).len(), count, "{largest}");
        }
    }

    #[test]
    fn steps_grow_gently_from_a_small_one() {
        let steps = interval(0.01, 0.2);
        for pair in steps.windows(2) {
            assert!(pair[1] <= 1.51 * pair[0], "{steps:?}");
        }
    }

    #[test]
    fn steps_shrink_at_once_and_evenly() {
        let steps = interval(0.5, 0.11);
        assert_eq!(steps.len(), 10);
        assert!(steps.iter().all(|s| (s - 0.1).abs() < 1e-9), "{steps:?}");
    }

    /// A body acceleration limits the first step whether it is a constant or a formula.
    #[test]
    fn the_first_step_follows_the_body_acceleration() {
        let first_step = |constant: f64, formula: Option<&str>| {
            let mut fluid = FluidParams::new(1000.0, 1e-6);
            fluid.body_acceleration.x = constant;
            let parse = |x: &str| Formula::parse([x, "0", "0"].map(String::from), &["t"]).unwrap();
            let body_acceleration = formula.map(parse);
            let prescription = Prescription { body_acceleration, ..Prescription::default() };
            let setup = Setup::new(Mesh::cubic([8; 3], 1e-3)).with_fluid(fluid);
            Clock::new(&setup.with_prescription(prescription)).next_step(0.0, f64::INFINITY)
        };
        let constant = first_step(9.81, None);
        assert!((constant - (0.4e-3_f64 / 9.81).sqrt()).abs() < 1e-12, "{constant}");
        assert_eq!(first_step(0.0, Some("9.81 + t")), constant);
        assert!(first_step(0.0, None) > 5.0 * constant);
    }

    #[test]
    fn a_fixed_step_is_reached_again_by_doubling() {
        let mut clock =
            Clock::new(&Setup::new(Mesh::cubic([8; 3], 1e-3)).with_step(StepRule::Fixed(0.1)));
        let steps: Vec<f64> = [0.2, 0.01, f64::INFINITY, f64::INFINITY]
            .map(|horizon| {
                let step = clock.next_step(0.0, horizon);
                clock.advance(step, horizon);
                step
            })
            .into();
        assert_eq!(steps, [0.1, 0.01, 0.02, 0.04]);
    }

    #[test]
    fn steps_near_their_limit_stay() {
        // A third is within 5 % of the limit: four steps stay four, three stay three.
        assert_eq!(interval(0.25, 0.34).len(), 4);
        assert_eq!(interval(1.0 / 3.0, 0.34).len(), 3);
    }
}
