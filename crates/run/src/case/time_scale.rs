//! Longest time step that follows the formulas of time of a set-up.

use grainwake_solver::math::Formula;
use grainwake_solver::sim::Prescription;

/// Accepted distance of a formula, within a step, from the straight line between its ends, over its
/// range in the run; 20 steps in the period of a sine.
const DEVIATION: f64 = 0.0062;
/// Fraction of the steps that may exceed it. A jump is never followed.
const EXCEPTIONS: f64 = 0.01;
/// Steps that are tried of one length.
const TRIES: usize = 2000;
/// Factor from one length to the next.
const SHORTER: f64 = 0.8;
/// Shortest length over the run.
const SHORTEST: f64 = 1e-9;
/// Places within a step at which the deviation is taken. Irrational ones do not alias a formula
/// whose period divides the step.
const PLACES: [f64; 3] = [0.236_067_977_5, 0.414_213_562_4, 0.732_050_807_6];

/// Returns the longest step [s], at most `longest`, that follows the body acceleration and the
/// prescribed motions until `end` [s]; `longest` without formulas.
pub(super) fn resolved_step(prescription: &Prescription, end: f64, longest: f64) -> f64 {
    let motions = prescription.motions.iter();
    let of_motions = motions.flat_map(|motion| [&motion.velocity, &motion.angular_velocity]);
    let formulas = of_motions.chain([&prescription.body_acceleration]).flatten();
    formulas.fold(longest, |step, formula| step_of(formula, end, step))
}

/// Times spread over the run until `end` [s]: one in each of equal parts, at a place that changes
/// from part to part. Equal intervals would alias a periodic formula.
pub(super) fn spread_times(count: usize, end: f64) -> impl DoubleEndedIterator<Item = f64> {
    const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;
    (0..count).map(move |n| {
        let place = ((n * n) as f64 * GOLDEN_RATIO).fract();
        (n as f64 + place) / count as f64 * end
    })
}

/// Returns the longest step [s], at most `longest`, that follows one formula.
fn step_of(formula: &Formula, end: f64, longest: f64) -> f64 {
    let at = |time: f64| formula.at(&[time]);
    let (low, high) = spread_times(TRIES, end)
        .map(at)
        .fold((at(0.0), at(0.0)), |(low, high), value| (low.min(value), high.max(value)));
    let accepted = DEVIATION * (high - low).max_element();
    if accepted <= 0.0 {
        return longest;
    }
    let deviates = |start: f64, step: f64| {
        let (first, last) = (at(start), at(start + step));
        PLACES.iter().any(|place| {
            let apart = at(start + place * step) - first.lerp(last, *place);
            apart.abs().max_element() > accepted
        })
    };
    let mut step = longest.min(end);
    while step > SHORTEST * end {
        let count = ((end / step).ceil() as usize).min(TRIES);
        let most = (EXCEPTIONS * count as f64) as usize;
        let starts = spread_times(count, end - step);
        if starts.filter(|start| deviates(*start, step)).nth(most).is_none() {
            break;
        }
        step *= SHORTER;
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(x: &str, end: f64, longest: f64) -> f64 {
        let text = [x.into(), "0".into(), "0".into()];
        let prescription = Prescription {
            body_acceleration: Some(Formula::parse(text, &["t"]).unwrap()),
            ..Prescription::default()
        };
        resolved_step(&prescription, end, longest)
    }

    #[test]
    fn a_sine_has_twenty_steps_in_a_period_at_any_frequency() {
        for frequency in [0.1, 1.0, 7.0, 200.0, 12345.0] {
            let found = step(&format!("3*sin(2*PI*{frequency}*t)"), 10.0, 10.0) * frequency;
            assert!((0.04..=0.0505).contains(&found), "{frequency}: {found}");
        }
    }

    #[test]
    fn slow_formulas_and_given_limits_leave_the_step() {
        assert_eq!(step("3", 10.0, 0.5), 0.5);
        assert_eq!(step("2*t", 10.0, 10.0), 10.0);
        assert_eq!(step("sin(t)", 10.0, 0.01), 0.01);
        let none = Prescription::default();
        assert_eq!(resolved_step(&none, 10.0, 0.3), 0.3);
    }

    #[test]
    fn ramps_and_jumps_do_not_stop_the_run() {
        // The first ramp takes a thousandth of the run.
        assert!(step("(1+tanh(1000*(t-5)))/2", 10.0, 0.1) > 0.05);
        assert!(step("abs(t-5)-abs(t-5.5)", 10.0, 10.0) > 0.05);
        assert!(step("signum(t-5)", 10.0, 10.0) > 0.05);
    }
}
