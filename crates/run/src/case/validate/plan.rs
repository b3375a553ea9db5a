//! `[time]`, `[output]` and `[run]` -> step rule and run plan.

use super::check::Checker;
use super::probes::probes;
use super::scales::scales;
use crate::case::located::Located;
use crate::case::quantity::{Quantity, Time};
use crate::case::raw::{RawOutput, RawPlane, RawProbe, RawRun, RawStop, RawTime};
use crate::case::settling::{
    LONGER_UP_TO, default_max_step, floor, is_limited_beside_held_grains, settled_time_step,
};
use crate::number_format::{number_of_grains, quantity};
use crate::{Plane, PlanePosition, RunPlan, Stop};
use grainwake_solver::dem::{Grain, MotionConstraint};
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::events::StopWhen;
use grainwake_solver::sim::{Prescription, Setup, StepRule};

/// Smallest plausible step over the step at the settling speed: velocities 1000 times larger mean
/// instability.
const SMALLEST_STEP: f64 = 1e-3;
/// Largest number of rows or files of one output; more suggest a forgotten unit.
const MOST_OUTPUTS: f64 = 1e7;

/// Returns the step rule and writes its limits; `spacing` [m] is that of the finest grid.
pub(super) fn step(
    check: &mut Checker,
    raw: &mut RawTime,
    spacing: glam::DVec3,
    grains: &[Grain],
    gravity: glam::DVec3,
    prescription: &Prescription,
    dry: bool,
) -> Option<StepRule> {
    let end = check.positive(&raw.end, "the end of the run")?;
    if let Some(step) = &raw.step {
        let fixed = check.positive(step, "the time step")?;
        let limits = [
            ("cfl", raw.cfl.as_ref().map(|limit| &limit.span)),
            ("viscous", raw.viscous.as_ref().map(|limit| &limit.span)),
            ("max_step", raw.max_step.as_ref().map(|limit| &limit.span)),
        ];
        if let Some((name, span)) = limits.into_iter().find_map(|(n, span)| Some((n, span?))) {
            let help = format!("leave out `step` or `{name}`");
            return check.refuse(span, "a fixed step has no limits", help);
        }
        return Some(StepRule::Fixed(fixed));
    }
    let number = |limit: f64| Quantity::new(limit).into();
    let (default_cfl, default_viscous) = StepRule::DEFAULT_LIMITS;
    let cfl = raw.cfl.get_or_insert_with(|| number(default_cfl));
    let cfl = check.within(cfl, 1e-6, 1.0);
    let viscous = raw.viscous.get_or_insert_with(|| number(default_viscous));
    // Above 0.216 the two-step extrapolation of diffusion is unstable at a wall.
    let viscous = check.within(viscous, 1e-6, 0.21);
    let longest = || default_max_step(spacing, grains, gravity, prescription, dry, end);
    let max_step = (raw.max_step).get_or_insert_with(|| Quantity::new(longest()).into());
    let max_step = check.positive(max_step, "the longest step");
    Some(StepRule::Limits { cfl: cfl?, viscous: viscous?, max_step: max_step? })
}

/// Mean step over that which the limits allow at the expected settling speed: the flow beside a
/// grain may be faster.
const EXPECTED_STEP: f64 = 0.8;
/// Number of steps from which a step more or less in an interval of the tables does not matter.
const MANY_STEPS: f64 = 5.0;

/// Returns the default interval of the tables [s] for steps of about `step` [s]; `beside_held` if a
/// flow past held grains limits them, and `given` is the shortest interval in the case file [s].
///
/// An interval slightly longer than a step would halve the steps. Past held grains the speed of the
/// flow depends on shape and Reynolds number, so there an interval has several steps.
///
/// A whole number of intervals fits into the given one, or of given ones into the interval: a short
/// step between their times would be followed by others, since steps grow slowly.
fn default_tables(end: f64, step: f64, beside_held: bool, given: Option<f64>) -> f64 {
    let interval = end / 400.0;
    if interval >= MANY_STEPS * step {
        return interval;
    }
    let least = if beside_held { MANY_STEPS * step } else { step };
    let interval = multiple_of(step, interval).max(least).min(end);
    match given {
        Some(given) if given < interval => multiple_of(given, interval),
        Some(given) => given / (given / interval - 1e-9).ceil(),
        None => interval,
    }
}

/// Returns the multiple of `unit` that is nearest to `value`, at least one; `value` if `unit` is 0.
fn multiple_of(unit: f64, value: f64) -> f64 {
    if unit > 0.0 { unit * (value / unit).round().max(1.0) } else { value }
}

/// Returns the run plan and writes the intervals that are not given.
pub(super) fn plan(
    check: &mut Checker,
    time: &RawTime,
    raw: &mut RawOutput,
    raw_probes: &mut [Located<RawProbe>],
    setup: &Setup,
    vertical: usize,
) -> Option<RunPlan> {
    let before = check.problems.len();
    let end = time.end.si;
    let (grains, dry) = (&setup.grains, setup.fluid.is_none());
    let mut check_interval = |value: &Located<Quantity<Time>>| {
        let interval = check.not_negative(value).unwrap_or(0.0);
        if interval > 0.0 && end / interval > MOST_OUTPUTS {
            let message = format!(
                "an interval of {} gives {:.0} million outputs",
                quantity(interval, "s"),
                1e-6 * end / interval
            );
            let help = "make it longer; was a unit forgotten?";
            check.fail(&value.span, message, help);
        }
        interval
    };
    let mut interval = |value: &mut Option<Located<Quantity<Time>>>, default: f64| {
        check_interval(value.get_or_insert_with(|| Quantity::new(default).into()))
    };
    let settled = settled_time_step(setup);
    let by_limits = matches!(setup.step, StepRule::Limits { .. }) && !dry;
    let smallest_step = if by_limits { SMALLEST_STEP * settled } else { 0.0 };
    let beside_held = by_limits && is_limited_beside_held_grains(setup, settled);
    let part = if beside_held { LONGER_UP_TO } else { EXPECTED_STEP };
    let step = (if by_limits { part * settled } else { settled }).min(end);
    let tables = default_tables(end, step, beside_held, shortest_given(raw, raw_probes));
    let tables = interval(&mut raw.tables, tables);
    let coarse = multiple_of(tables, (end / 40.0).max(step));
    let slices = interval(&mut raw.slices, if dry { 0.0 } else { coarse });
    let surfaces = if slices > 0.0 { slices } else { coarse };
    let surfaces = interval(&mut raw.surfaces, surfaces);
    let fields = check_interval(&raw.fields);
    let [contacts, contact_network] = [&raw.contacts, &raw.contact_network]
        .map(|interval| interval.as_ref().map_or(0.0, &mut check_interval));
    let every: Vec<f64> = (raw_probes.iter_mut())
        .map(|probe| {
            let every = (probe.value.every).get_or_insert_with(|| Quantity::new(tables).into());
            check_interval(every)
        })
        .collect();
    let probes = probes(check, raw_probes, &every, &setup.mesh, dry);
    let checkpoint_interval = check.not_negative(&raw.checkpoint_interval);
    let keep = raw.checkpoint_keep.as_ref();
    if let Some(keep) = keep.filter(|keep| keep.value == 0) {
        let help = "a run keeps at least 1 checkpoint; `rm -r DIR/checkpoint` removes it";
        check.fail(&keep.span, "found 0 checkpoints", help);
    }
    let checkpoint_keep = keep.map(|keep| keep.value);
    let stop = time.stop.as_ref().map(|stop| stop_rule(check, stop, setup));
    let planes = match &raw.planes {
        Some(planes) => {
            (planes.iter()).filter_map(|raw| plane(check, raw, grains.len(), &setup.mesh)).collect()
        }
        None => default_planes(grains.len(), &setup.mesh, vertical),
    };
    let scales = scales(check, &mut raw.scales, setup);
    if check.problems.len() > before {
        return None;
    }
    Some(RunPlan {
        end,
        stop,
        smallest_step,
        tables,
        slices,
        fields,
        surfaces,
        at_events: raw.at_events,
        planes,
        contacts,
        contact_network,
        wall_events: raw.wall_events,
        probes,
        scales,
        checkpoint_interval: checkpoint_interval?,
        checkpoint_steps: raw.checkpoint_steps.value,
        checkpoint_keep,
    })
}

/// Returns the shortest interval of an output in the case file [s].
fn shortest_given(raw: &RawOutput, probes: &[Located<RawProbe>]) -> Option<f64> {
    let outputs = [&raw.slices, &raw.surfaces, &raw.contacts, &raw.contact_network];
    let given = outputs.into_iter().chain(probes.iter().map(|probe| &probe.value.every));
    given
        .flatten()
        .chain([&raw.fields])
        .map(|value| value.si)
        .filter(|interval| *interval > 0.0)
        .reduce(f64::min)
}

fn stop_rule(check: &mut Checker, raw: &Located<RawStop>, setup: &Setup) -> Stop {
    let grains = &setup.grains;
    if raw.hold.si < 0.0 {
        let message = format!("a hold of {}", quantity(raw.hold.si, "s"));
        check.fail(&raw.hold.span, message, "give zero or a positive time");
    } else if raw.when == StopWhen::Separation && grains.len() != 2 {
        let count = number_of_grains(grains.len());
        let message = format!("separation is an event of a pair, but the case has {count}");
        let help = "use stop = \"landing\" or \"rest\", or two grains";
        check.fail(&raw.span, message, help);
    } else if grains.iter().all(|grain| grain.translation != MotionConstraint::Free) {
        let message = "no grain moves freely, so this never happens";
        check.fail(&raw.span, message, "leave out `stop`");
    } else if raw.when == StopWhen::Landing && setup.gravity == glam::DVec3::ZERO {
        let message = "gravity is zero, so no side of the box is the floor";
        check.fail(&raw.span, message, "leave out `stop`: the run ends at `end`");
    } else if raw.when == StopWhen::Landing && floor(setup).is_none() {
        let message = "the side to which the grains fall or rise is no wall, so none lands on it";
        check.fail(&raw.span, message, "leave out `stop`, or close the side with \"wall\"");
    } else if raw.when == StopWhen::Rest && setup.gravity == glam::DVec3::ZERO {
        let message = "a grain is at rest below a fraction of sqrt(g d), and gravity is zero";
        check.fail(&raw.span, message, "leave out `stop`: the run ends at `end`");
    }
    Stop { when: raw.when, hold: raw.hold.si }
}

/// Returns a plane through each of one or two grains, else one through the middle of the box.
fn default_planes(grains: usize, mesh: &Mesh, vertical: usize) -> Vec<Plane> {
    let axis = if vertical == 1 { 0 } else { 1 };
    let middle = mesh.origin[axis] + 0.5 * mesh.extent()[axis];
    let positions = match grains {
        1 | 2 => (0..grains).map(PlanePosition::Grain).collect(),
        _ => vec![PlanePosition::At(middle)],
    };
    let plane = |position| Plane { axis, position };
    positions.into_iter().map(plane).collect()
}

fn plane(
    check: &mut Checker,
    raw: &Located<RawPlane>,
    grains: usize,
    mesh: &Mesh,
) -> Option<Plane> {
    let axis = check.axis(&raw.normal)?;
    let position = match (&raw.at, &raw.grain) {
        (Some(at), None) => PlanePosition::At(check.coordinate(at, axis, mesh)?),
        (None, Some(grain)) => {
            if grain.value >= grains {
                let message = format!("there is no grain {}", grain.value);
                let count = number_of_grains(grains);
                let help = format!("the case has {count}, counted from 0");
                check.fail(&grain.span, message, help);
            }
            PlanePosition::Grain(grain.value)
        }
        _ => {
            let help = "for example { normal = \"y\", grain = 0 }";
            return check.refuse(&raw.span, "give either `at` or `grain`", help);
        }
    };
    Some(Plane { axis, position })
}

/// Most threads of a case.
const MOST_THREADS: usize = 4096;

/// Refuses absurd numbers of threads.
pub(super) fn check_threads(check: &mut Checker, raw: &RawRun) {
    let threads = &raw.threads;
    if threads.value > MOST_THREADS {
        let message = format!("{} threads: accepted are 0 to {MOST_THREADS}", threads.value);
        let help = "0 takes all cores; more than 4 per core are reduced to that with a warning";
        check.fail(&threads.span, message, help);
    }
}
