//! Grains must stand in the box and clear of each other.

use std::ops::Range;

use super::check::Checker;
use crate::dem::{Enclosure, Grain, Partner, initial_overlaps, outside};

const AXES: [&str; 3] = ["x", "y", "z"];

/// Grains must stand in the box and clear of each other.
pub(super) fn check(
    check: &mut Checker,
    grains: &[Grain],
    spans: &[Option<Range<usize>>],
    enclosure: &Enclosure,
) {
    let millimetres = |x: f64| format!("{:.4} mm", 1e3 * x);
    let finite = |g: &Grain| g.pose.position.is_finite();
    if !grains.iter().all(finite) {
        return;
    }
    let mut out_of_box = vec![false; grains.len()];
    for o in outside(grains, enclosure) {
        if std::mem::replace(&mut out_of_box[o.grain], true) {
            continue;
        }
        let (side, face) = (
            ["lower", "upper"][o.side],
            [enclosure.lower, enclosure.upper][o.side][o.axis],
        );
        let what = if o.centroid {
            "lies outside the box"
        } else {
            "crosses a face of the box"
        };
        check.fail(
            spans[o.grain].as_ref(),
            &format!("grain.{}.position", o.grain),
            format!(
                "grain {} {what}: it reaches {} beyond the {side} {} face (at {face} m)",
                o.grain,
                millimetres(o.by),
                AXES[o.axis]
            ),
            format!(
                "move it by at least {} along {}{}, or make the box larger",
                millimetres(o.by),
                ["", "-"][o.side],
                AXES[o.axis]
            ),
        );
    }
    for (i, grain) in grains.iter().enumerate() {
        for (axis, name) in AXES.into_iter().enumerate() {
            let (x, lower, upper) = (
                grain.pose.position[axis],
                enclosure.lower[axis],
                enclosure.upper[axis],
            );
            if enclosure.periodic[axis] && !(lower..=upper).contains(&x) {
                check.fail(
                    spans[i].as_ref(),
                    &format!("grain.{i}.position"),
                    format!("grain {i} lies outside the box: {name} = {x} m, the box goes from {lower} to {upper} m"),
                    "move it into the box (the axis is periodic)",
                );
            }
        }
    }
    for overlap in initial_overlaps(grains, enclosure) {
        let i = overlap.grain;
        let Partner::Grain(j) = overlap.partner else {
            continue;
        };
        let (at, other) = if j > i { (j, i) } else { (i, j) };
        let (message, help) = if i == j {
            (
                format!(
                    "grain {i} touches its own image across the periodic box (by {})",
                    millimetres(overlap.depth)
                ),
                "make the box larger or the grain smaller".to_string(),
            )
        } else {
            (
                format!(
                    "grains {other} and {at} overlap at the start by {}",
                    millimetres(overlap.depth)
                ),
                "move them apart; contact begins with grains that do not touch".to_string(),
            )
        };
        check.fail(
            spans[at].as_ref(),
            &format!("grain.{at}.position"),
            message,
            help,
        );
    }
}
