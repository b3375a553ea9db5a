//! `[time]`, `[output]` and `[run]` -> step rule and run plan.

use super::check::Checker;
use crate::case::estimate::{default_max_step, settled_time_step};
use crate::case::loc::Loc;
use crate::case::quantity::{Quantity, Time};
use crate::case::raw::{RawOutput, RawRun, RawTime};
use crate::case::readable::{length, quantity};
use crate::{Plane, PlanePosition, RunPlan, Stop};
use grainwake_solver::dem::Grain;
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::events::StopWhen;
use grainwake_solver::sim::{Setup, StepRule};

/// Limits where none are given.
const CFL: f64 = 0.4;
const VISCOUS: f64 = 0.2;
/// Steps this much shorter than those at the settling speed mean velocities as much above it.
const SMALLEST_STEP: f64 = 1e-3;

/// The step rule.
pub(super) fn step(
    check: &mut Checker,
    raw: &mut RawTime,
    mesh: &Mesh,
    grains: &[Grain],
    gravity: glam::DVec3,
    dry: bool,
) -> Option<StepRule> {
    let end = check.positive(&raw.end, "time.end", "the end of the run")?;
    if let Some(step) = &raw.step {
        let fixed = check.positive(step, "time.step", "the time step")?;
        let limits = [
            ("cfl", raw.cfl.as_ref().map(|q| q.span.clone())),
            ("viscous", raw.viscous.as_ref().map(|q| q.span.clone())),
            ("max_step", raw.max_step.as_ref().map(|q| q.span.clone())),
        ];
        for (name, span) in limits {
            if let Some(span) = span {
                check.fail(
                    span.as_ref(),
                    &format!("time.{name}"),
                    "a fixed step has no limits",
                    format!("leave out `step` or `{name}`"),
                );
                return None;
            }
        }
        return Some(StepRule::Fixed(fixed));
    }
    let cfl = raw.cfl.get_or_insert_with(|| Quantity::new(CFL).into());
    let cfl = check.within(cfl, "time.cfl", 1e-6, 1.0);
    let viscous = raw
        .viscous
        .get_or_insert_with(|| Quantity::new(VISCOUS).into());
    // Beyond 0.216 two-step extrapolation of diffusion is unstable at a wall.
    let viscous = check.within(viscous, "time.viscous", 1e-6, 0.21);
    let max_step = raw.max_step.get_or_insert_with(|| {
        Quantity::new(default_max_step(mesh.spacing, grains, gravity, dry, end)).into()
    });
    let max_step = check.positive(max_step, "time.max_step", "the longest step");
    Some(StepRule::Limits {
        cfl: cfl?,
        viscous: viscous?,
        max_step: max_step?,
    })
}

/// The run plan; fills in the intervals that are not given.
pub(super) fn plan(
    check: &mut Checker,
    time: &RawTime,
    raw: &mut RawOutput,
    setup: &Setup,
    vertical: usize,
) -> Option<RunPlan> {
    let before = check.problems.len();
    let end = time.end.si;
    let (grains, mesh, dry) = (&setup.grains, &setup.mesh, setup.fluid.is_none());
    let mut interval = |value: &mut Option<Loc<Quantity<Time>>>, default: f64, name: &str| {
        let value = value.get_or_insert_with(|| Quantity::new(default).into());
        let key = format!("output.{name}");
        let interval = check.within(value, &key, 0.0, f64::INFINITY).unwrap_or(0.0);
        if interval > 0.0 && end / interval > 1e7 {
            check.fail(
                value.span.as_ref(),
                &key,
                format!(
                    "an interval of {} gives {:.0} million outputs",
                    quantity(interval, "s"),
                    1e-6 * end / interval
                ),
                "make it longer; was a unit forgotten?",
            );
        }
        interval
    };
    let by_limits = matches!(setup.step, StepRule::Limits { .. }) && !dry;
    let smallest_step = if by_limits {
        SMALLEST_STEP * settled_time_step(setup)
    } else {
        0.0
    };
    // Outputs that nobody asked for do not shorten the steps.
    let step = settled_time_step(setup).min(end);
    let tables = interval(&mut raw.tables, (end / 400.0).max(step), "tables");
    let slices = interval(
        &mut raw.slices,
        if dry { 0.0 } else { (end / 40.0).max(step) },
        "slices",
    );
    let surfaces = interval(
        &mut raw.surfaces,
        if slices > 0.0 {
            slices
        } else {
            (end / 40.0).max(step)
        },
        "surfaces",
    );
    let mut fields = Some(raw.fields.clone());
    let fields = interval(&mut fields, 0.0, "fields");
    let checkpoint_interval = check.within(
        &raw.checkpoint_interval,
        "output.checkpoint_interval",
        0.0,
        f64::INFINITY,
    );
    let stop = time
        .stop
        .as_ref()
        .and_then(|stop| stop_rule(check, stop, grains));
    let planes = planes(check, raw, grains, mesh, vertical);
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
        checkpoint_interval: checkpoint_interval?,
        checkpoint_steps: raw.checkpoint_steps.value,
    })
}

fn stop_rule(
    check: &mut Checker,
    raw: &Loc<crate::case::raw::RawStop>,
    grains: &[Grain],
) -> Option<Stop> {
    let span = raw.span.as_ref();
    if raw.hold.si < 0.0 {
        check.fail(
            raw.hold.span.as_ref(),
            "time.stop.hold",
            format!("a hold of {}", quantity(raw.hold.si, "s")),
            "give zero or a positive time",
        );
    } else if raw.when == StopWhen::Separation && grains.len() != 2 {
        check.fail(
            span,
            "time.stop",
            format!(
                "separation is an event of a pair, but there are {} grains",
                grains.len()
            ),
            "use stop = \"landing\" or \"rest\", or two grains",
        );
    } else if !grains
        .iter()
        .any(|g| g.translation == grainwake_solver::dem::MotionConstraint::Free)
    {
        check.fail(
            span,
            "time.stop",
            "no grain moves freely, so this never happens",
            "leave out `stop`",
        );
    }
    Some(Stop {
        when: raw.when,
        hold: raw.hold.si,
    })
}

fn planes(
    check: &mut Checker,
    raw: &RawOutput,
    grains: &[Grain],
    mesh: &Mesh,
    vertical: usize,
) -> Vec<Plane> {
    let Some(given) = &raw.planes else {
        let axis = if vertical == 1 { 0 } else { 1 };
        let middle = mesh.origin[axis] + 0.5 * mesh.extent()[axis];
        return match grains.len() {
            1 | 2 => (0..grains.len())
                .map(|grain| Plane {
                    axis,
                    position: PlanePosition::Grain(grain),
                })
                .collect(),
            _ => vec![Plane {
                axis,
                position: PlanePosition::At(middle),
            }],
        };
    };
    let mut planes = Vec::new();
    for (index, plane) in given.iter().enumerate() {
        let key = |name: &str| format!("output.planes.{index}.{name}");
        let Some(axis) = ["x", "y", "z"]
            .iter()
            .position(|a| *a == plane.normal.value)
        else {
            check.fail(
                plane.normal.span.as_ref(),
                &key("normal"),
                format!("found \"{}\"", plane.normal.value),
                "accepted: \"x\", \"y\", \"z\"",
            );
            continue;
        };
        let place = match (&plane.at, &plane.grain) {
            (Some(at), None) => {
                let (lower, upper) = (mesh.origin[axis], mesh.upper()[axis]);
                if !(lower..=upper).contains(&at.si) {
                    check.fail(
                        at.span.as_ref(),
                        &key("at"),
                        format!("{} lies outside the box", length(at.si)),
                        format!("between {} and {}", length(lower), length(upper)),
                    );
                }
                PlanePosition::At(at.si)
            }
            (None, Some(grain)) => {
                if grain.value >= grains.len() {
                    check.fail(
                        grain.span.as_ref(),
                        &key("grain"),
                        format!("there is no grain {}", grain.value),
                        format!("there are {} grains, counted from 0", grains.len()),
                    );
                }
                PlanePosition::Grain(grain.value)
            }
            _ => {
                check.fail(
                    plane.span.as_ref(),
                    &format!("output.planes.{index}"),
                    "give either `at` or `grain`",
                    "for example { normal = \"y\", grain = 0 }",
                );
                continue;
            }
        };
        planes.push(Plane {
            axis,
            position: place,
        });
    }
    planes
}

/// Threads.
pub(super) fn run(check: &mut Checker, raw: &RawRun) -> usize {
    if raw.threads.value > 4096 {
        check.fail(
            raw.threads.span.as_ref(),
            "run.threads",
            format!("{} threads", raw.threads.value),
            "0 takes all cores",
        );
    }
    raw.threads.value
}
