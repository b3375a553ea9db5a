//! `[[probe]]` -> probes.

use glam::DVec3;

use super::check::{Checker, point_into_box};
use crate::case::located::{Located, Span};
use crate::case::quantity::{Length, Triple};
use crate::case::raw::{RawLine, RawProbe};
use crate::number_format::vector;
use crate::{Probe, ProbePlace};
use grainwake_solver::grid::Mesh;

/// Largest number of points of a probe; more suggest a mistake.
const MOST_POINTS: usize = 1_000_000;
/// Longest name of a probe [characters].
const LONGEST_NAME: usize = 60;

/// Returns the probes and writes their names; `intervals` are those of their tables [s].
pub(super) fn probes(
    check: &mut Checker,
    raw: &mut [Located<RawProbe>],
    intervals: &[f64],
    mesh: &Mesh,
    dry: bool,
) -> Vec<Probe> {
    let mut probes: Vec<Probe> = Vec::new();
    for (index, (raw, every)) in raw.iter_mut().zip(intervals).enumerate() {
        if dry {
            let message = "there is no fluid to probe";
            check.fail(&raw.span, message, "add [fluid], or leave out [[probe]]");
            continue;
        }
        let name = raw.value.name.get_or_insert_with(|| format!("probe{index}").into()).clone();
        check_name(check, &name, &raw.span, &probes);
        if let Some(place) = place(check, raw, mesh) {
            probes.push(Probe { name: name.value, every: *every, place });
        }
    }
    probes
}

fn check_name(check: &mut Checker, name: &Located<String>, probe: &Span, others: &[Probe]) {
    let span = if name.span.is_some() { &name.span } else { probe };
    let accepted = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    if name.is_empty() || name.len() > LONGEST_NAME || !name.chars().all(accepted) {
        let message = format!("\"{}\" is no name of a probe", name.value);
        let help = format!("1 to {LONGEST_NAME} letters, digits, `-` and `_`: it names a file");
        check.fail(span, message, help);
    } else if let Some(other) = others.iter().find(|p| p.name.eq_ignore_ascii_case(name)) {
        // Some file systems do not distinguish upper and lower case.
        let message = format!("there is a probe \"{}\" already", other.name);
        check.fail(span, message, "give each probe its own `name`");
    }
}

/// Returns the points or the plane of a probe; `None` after a problem.
fn place(check: &mut Checker, raw: &Located<RawProbe>, mesh: &Mesh) -> Option<ProbePlace> {
    match (&raw.point, &raw.points, &raw.line, &raw.plane) {
        (Some(point), None, None, None) => {
            inside(check, point, mesh).map(|point| ProbePlace::Points(vec![point]))
        }
        (None, Some(points), None, None) => {
            if !admitted(check, points.len(), 1, &points.span) {
                return None;
            }
            let points: Vec<_> = points.iter().map(|point| inside(check, point, mesh)).collect();
            points.into_iter().collect::<Option<_>>().map(ProbePlace::Points)
        }
        (None, None, Some(line), None) => points_of_line(check, line, mesh).map(ProbePlace::Points),
        (None, None, None, Some(plane)) => {
            let axis = check.axis(&plane.normal)?;
            Some(ProbePlace::Plane { axis, at: check.coordinate(&plane.at, axis, mesh)? })
        }
        _ => {
            let help = "for example point = [\"5 mm\", \"5 mm\", \"20 mm\"] or plane = { normal = \"z\", at = \"20 mm\" }";
            check.refuse(&raw.span, "give one of `point`, `points`, `line` and `plane`", help)
        }
    }
}

/// Returns a point of the box.
fn inside(check: &mut Checker, point: &Located<Triple<Length>>, mesh: &Mesh) -> Option<DVec3> {
    let (lower, upper) = (mesh.origin, mesh.upper());
    point_into_box(point.si, lower, upper).or_else(|| {
        let message = format!("{} lies outside the box", vector(point.si, "m"));
        let help = format!("between {} and {}", vector(lower, "m"), vector(upper, "m"));
        check.refuse(&point.span, message, help)
    })
}

/// Returns whether a probe may have so many points.
fn admitted(check: &mut Checker, count: usize, least: usize, span: &Span) -> bool {
    let accepted = (least..=MOST_POINTS).contains(&count);
    if !accepted {
        check.fail(span, format!("found {count} points"), format!("{least} to {MOST_POINTS}"));
    }
    accepted
}

fn points_of_line(check: &mut Checker, line: &Located<RawLine>, mesh: &Mesh) -> Option<Vec<DVec3>> {
    let (from, to) = (inside(check, &line.from, mesh), inside(check, &line.to, mesh));
    let count = line.points.value;
    if !admitted(check, count, 2, &line.points.span) {
        return None;
    }
    let (from, to) = (from?, to?);
    if from == to {
        let message = "the line has no length: both ends are at one point";
        return check.refuse(&line.to.span, message, "move one end, or give `point` instead");
    }
    // The last point is exact.
    let part = |n: usize| n as f64 / (count - 1) as f64;
    Some((0..count).map(|n| from * (1.0 - part(n)) + to * part(n)).collect())
}
