//! `[domain]` -> grid and boundaries.

use glam::DVec3;

use super::check::Checker;
use crate::case::exactly::Exactly;
use crate::case::located::{Located, Span};
use crate::case::quantity::{Length, Triple};
use crate::case::raw::{
    AxisFaces, CellSize, Face, FaceKind, RawBoundaries, RawCoupling, RawDomain,
};
use crate::number_format::{AXES, length, number, quantity, vector};
use grainwake_solver::flow::{Boundaries, Boundary};
use grainwake_solver::grid::Mesh;
use grainwake_solver::immersed::Scheme;
use grainwake_solver::sim::LEAST_REFINEMENT_MARGIN;

/// Largest number of cells along an axis; more suggest a forgotten unit.
const MOST_CELLS: usize = 1 << 20;
/// Largest number of cells in all; more suggest a forgotten unit.
const MOST_CELLS_IN_ALL: usize = 1 << 36;

/// Remedy for too many cells.
const COARSER: &str =
    "make the cells larger; was a unit forgotten? A number without a unit is in metres";

/// Returns the grid and writes size, cells and cell size. The cells of a dry run may be left out.
pub(super) fn mesh(check: &mut Checker, raw: &mut RawDomain, dry: bool) -> Option<Mesh> {
    let positive = |v: DVec3| v.min_element() > 0.0;
    if let Some(size) = raw.size.as_ref().filter(|s| !positive(s.si)) {
        let found = vector(size.si, "m");
        let message = format!("the edges of the box must be longer than zero, found {found}");
        return check.refuse(&size.span, message, "give three positive lengths");
    }
    if let Some(cell) = raw.cell_size.as_ref().filter(|c| !positive(c.0)) {
        let message = "the cell size must be greater than zero";
        let help = "give a positive length such as \"0.25 mm\"";
        return check.refuse(&cell.span, message, help);
    }
    let possible = |cells: &Exactly<usize, 3>| cells.0.iter().all(|n| (1..=MOST_CELLS).contains(n));
    if let Some(cells) = raw.cells.as_ref().filter(|cells| !possible(cells)) {
        let message = format!("found {:?} cells", cells.0);
        let help = format!("each axis needs 1 to {MOST_CELLS} cells");
        return check.refuse(&cells.span, message, help);
    }
    let as_vector = |cells: [usize; 3]| DVec3::from_array(cells.map(|n| n as f64));
    let (cells, spacing) = match (&raw.size, &raw.cells, &raw.cell_size) {
        (size, Some(cells), Some(cell)) => {
            let extent = as_vector(cells.value.0) * cell.0;
            let differs = |size: DVec3| ((size - extent) / extent).abs().max_element() > 1e-9;
            if let Some(size) = size.as_ref().filter(|size| differs(size.si)) {
                let (size, extent) = (vector(size.si, "m"), vector(extent, "m"));
                let message = format!("size {size} is not cells times cell_size, {extent}");
                return check.refuse(&cells.span, message, "give two of size, cells and cell_size");
            }
            (cells.value.0, cell.0)
        }
        (Some(size), Some(cells), None) => (cells.value.0, size.si / as_vector(cells.value.0)),
        (Some(size), None, Some(cell)) => (divide(check, size, cell)?, cell.0),
        (Some(size), None, None) if dry => ([1; 3], size.si),
        _ => {
            let help = "give two of size, cells and cell_size, for example size = [\"25 mm\", \"25 mm\", \"97.5 mm\"] and cell_size = \"0.25 mm\"";
            check.fail_key("domain", "the grid is not known", help);
            return None;
        }
    };
    let count = cells.iter().try_fold(1usize, |n, c| n.checked_mul(*c));
    if count.is_none_or(|n| n > MOST_CELLS_IN_ALL) {
        let cell_size = raw.cell_size.as_ref().map(|cell| &cell.span);
        let span = cell_size.or(raw.cells.as_ref().map(|cells| &cells.span));
        let message = format!("{cells:?} cells are more than any machine holds");
        return check.refuse(span.unwrap_or(&None), message, COARSER);
    }
    if !dry && cells == [1; 3] {
        let span = raw.cells.as_ref().map_or(&None, |cells| &cells.span);
        let help = "make the box larger or the cells smaller; without a fluid leave out [fluid]";
        return check.refuse(span, "a fluid needs more than one cell", help);
    }
    let origin = raw.origin.si;
    let mesh = Mesh { cells, spacing, origin };
    raw.size = Some(Triple::new(mesh.extent()).into());
    raw.cells = Some(Exactly(cells).into());
    raw.cell_size = Some(CellSize(spacing).into());
    Some(mesh)
}

/// Returns the number of cells along each axis; a problem names the sizes that would fit.
fn divide(
    check: &mut Checker,
    size: &Located<Triple<Length>>,
    cell: &Located<CellSize>,
) -> Option<[usize; 3]> {
    let mut cells = [0; 3];
    for axis in 0..3 {
        let (edge, h, name) = (size.si[axis], cell.0[axis], AXES[axis]);
        let ratio = edge / h;
        if ratio > MOST_CELLS as f64 {
            let message = format!("{:.1} million cells along {name}", 1e-6 * ratio);
            return check.refuse(&cell.span, message, COARSER);
        }
        if ratio < 1.0 - 1e-6 {
            let message = format!(
                "a cell of {} is larger than the box, {} along {name}",
                length(h),
                length(edge)
            );
            let help = format!(
                "a number without a unit is in metres; write a string with a unit, for example \"{}\"",
                length(1e-3 * h)
            );
            return check.refuse(&cell.span, message, help);
        }
        let whole = ratio.round().max(1.0);
        if (ratio - whole).abs() > 1e-6 * whole {
            let (below, above) = (ratio.floor().max(1.0), ratio.ceil());
            let message = format!(
                "{} along {name} is not a whole number of cells of {} ({} cells)",
                length(edge),
                length(h),
                number(ratio)
            );
            let help = format!(
                "take {name} = {} ({}) or {} ({above} cells), or keep the size with a cell of {}",
                length(below * h),
                if below == 1.0 { "1 cell".into() } else { format!("{below} cells") },
                length(above * h),
                length(edge / whole)
            );
            return check.refuse(&cell.span, message, help);
        }
        cells[axis] = whole as usize;
    }
    Some(cells)
}

/// Returns the refinement around the grains of a case, which may be `dry` and `empty` of grains.
pub(super) fn refinement(
    check: &mut Checker,
    raw: &RawDomain,
    coupling: &RawCoupling,
    mesh: &Mesh,
    [dry, empty]: [bool; 2],
) -> usize {
    let Some(refinement) = &raw.refinement else { return 1 };
    let mut fail = |message: String, help: &str| check.fail(&refinement.span, message, help);
    match refinement.value {
        1 => {}
        2 if dry => {
            let help = "leave out refinement, or add [fluid]";
            fail("a case without a fluid has no grid to refine".into(), help);
        }
        2 if empty => {
            let help = "leave out refinement, or add [[grain]]";
            fail("there is no grain around which the grid could be refined".into(), help);
        }
        2 if coupling.scheme.value == Scheme::Paper => {
            let help = "leave out refinement, or the scheme";
            fail("the paper's scheme works on one grid".into(), help);
        }
        2 => {
            if let Some(axis) = (0..3).find(|axis| !mesh.is_resolved(*axis)) {
                let help = "give the axis more cells, or leave out refinement";
                fail(format!("{} is flat, and a flat axis cannot be refined", AXES[axis]), help);
            }
        }
        found => {
            let help = "2 halves the cells in a box around the grains, 1 does not";
            fail(format!("found {found}"), help);
        }
    }
    refinement.value
}

/// Returns the margin [m] of the refined box of a case, whose refinement is given.
pub(super) fn refinement_margin(
    check: &mut Checker,
    raw: &RawDomain,
    refinement: usize,
    mesh: &Mesh,
) -> Option<DVec3> {
    let margin = raw.refinement_margin.as_ref()?;
    if refinement == 1 {
        let help = "leave out refinement_margin, or set refinement = 2";
        return check.refuse(&margin.span, "without a refinement there is no margin", help);
    }
    let least = LEAST_REFINEMENT_MARGIN * mesh.spacing;
    if margin.0.cmplt(least).any() {
        let message = format!("found {}", vector(margin.0, "m"));
        let help = format!(
            "the refined box needs at least {LEAST_REFINEMENT_MARGIN} cells beside the grains: {}",
            vector(least, "m")
        );
        return check.refuse(&margin.span, message, &help);
    }
    Some(margin.0)
}

/// Positions in the source of the conditions on the six faces: of the face, else of its axis, else
/// of all conditions.
fn face_spans(raw: &Located<RawBoundaries>) -> [[&Span; 2]; 3] {
    [&raw.x, &raw.y, &raw.z].map(|axis| {
        let axis_span = axis.span.as_ref().map_or(&raw.span, |_| &axis.span);
        [&axis.lower, &axis.upper].map(|face| face.span.as_ref().map_or(axis_span, |_| &face.span))
    })
}

/// Returns the boundary conditions of the six faces.
pub(super) fn boundaries(
    check: &mut Checker,
    raw: &RawDomain,
    mesh: &Mesh,
    dry: bool,
) -> Option<Boundaries> {
    let before = check.problems.len();
    let spans = face_spans(&raw.boundaries);
    let axes = [&raw.boundaries.x, &raw.boundaries.y, &raw.boundaries.z];
    let mut result = Boundaries([[Boundary::WALL; 2]; 3]);
    for (axis, faces) in axes.into_iter().enumerate() {
        let mut refused = None;
        for (side, face) in [&faces.lower, &faces.upper].into_iter().enumerate() {
            match boundary(face, axis, side) {
                Ok(boundary) => result.0[axis][side] = boundary,
                Err((message, help)) => {
                    // One value may give the condition on both sides.
                    let refusal = Some((spans[axis][side], message.clone()));
                    if refused != refusal {
                        check.fail(spans[axis][side], message, help);
                    }
                    refused = refusal;
                }
            }
        }
        check_axis(check, faces, &raw.boundaries.span, axis, mesh.cells[axis], dry);
    }
    mass_balance(check, spans, &result, mesh);
    one_free_surface(check, spans, &result);
    (check.problems.len() == before).then_some(result)
}

/// Returns the condition on a face; the error is a message and a help.
fn boundary(face: &Face, axis: usize, side: usize) -> Result<Boundary, (String, String)> {
    let takes_velocity = matches!(face.kind, FaceKind::Wall | FaceKind::Inflow);
    if face.velocity.is_some() && !takes_velocity {
        return Err((
            format!("a side of the kind \"{}\" has no velocity of its own", face.kind),
            "only wall and inflow take a velocity".into(),
        ));
    }
    if face.velocity.is_none() && face.kind == FaceKind::Inflow {
        return Err((
            "an inflow needs its velocity".into(),
            "write { kind = \"inflow\", velocity = [...] }".into(),
        ));
    }
    let velocity = face.velocity.unwrap_or_default().si;
    let (normal, name) = (quantity(velocity[axis], "m/s"), AXES[axis]);
    match face.kind {
        FaceKind::Wall if velocity[axis] != 0.0 => Err((
            format!("a wall moves in its own plane, but this one has {normal} along {name}"),
            format!("set the {name} component of its velocity to zero"),
        )),
        FaceKind::Inflow if velocity[axis] * INWARD[side] < 0.0 => Err((
            format!("this inflow leaves the box ({normal} along {name})"),
            "turn the sign of its velocity, or make it an outflow".into(),
        )),
        FaceKind::Wall => Ok(Boundary::Wall { velocity }),
        FaceKind::Inflow => Ok(Boundary::Inflow { velocity }),
        FaceKind::Slip => Ok(Boundary::Slip),
        FaceKind::Periodic => Ok(Boundary::Periodic),
        FaceKind::Outflow => Ok(Boundary::Outflow),
        FaceKind::FreeSurface => Ok(Boundary::FreeSurface),
    }
}

/// Sign of a velocity that enters the box through the lower and the upper face.
const INWARD: [f64; 2] = [1.0, -1.0];

/// Refuses combinations of the two faces of an axis; `whole` is the position of all conditions.
fn check_axis(
    check: &mut Checker,
    faces: &Located<AxisFaces>,
    whole: &Span,
    axis: usize,
    cells: usize,
    dry: bool,
) {
    let name = AXES[axis];
    let (lower, upper) = (faces.lower.kind, faces.upper.kind);
    if (lower == FaceKind::Periodic) != (upper == FaceKind::Periodic) {
        let message = format!("periodic on one side only: lower is {lower}, upper is {upper}");
        let help = format!("make both sides periodic: {name} = \"periodic\"");
        check.fail(&faces.span, message, help);
    } else if cells == 1 && lower != FaceKind::Periodic && !dry {
        let message = format!("{name} has one cell, so it is flat, and a flat axis has no walls");
        let key = format!("domain.boundaries.{name}");
        let help = format!("set {key} to \"periodic\", or give the axis more cells");
        match faces.span.as_ref().or(whole.as_ref()) {
            Some(span) => check.fail(&Some(span.clone()), message, help),
            None => check.fail_key(&key, message, help),
        }
    }
}

/// Refuses inflows without an outflow.
fn mass_balance(check: &mut Checker, spans: [[&Span; 2]; 3], boundaries: &Boundaries, mesh: &Mesh) {
    let extent = mesh.extent();
    let (mut entering, mut largest) = (0.0, 0.0_f64);
    let mut inflow = None;
    for (axis, sides) in boundaries.0.iter().enumerate() {
        let area = extent.element_product() / extent[axis];
        for (side, boundary) in sides.iter().enumerate() {
            match boundary {
                Boundary::Outflow => return,
                Boundary::Inflow { velocity } => {
                    let flux = velocity[axis] * INWARD[side] * area;
                    entering += flux;
                    largest = largest.max(flux.abs());
                    inflow = inflow.or(Some(spans[axis][side]));
                }
                _ => {}
            }
        }
    }
    if let Some(span) = inflow.filter(|_| largest > 0.0) {
        let flux = quantity(1e3 * entering, "L/s");
        let message = format!("{flux} enter the box and nothing leaves it: no side is an outflow");
        check.fail(span, message, "make the opposite side an outflow");
    }
}

/// Refuses a second free surface.
fn one_free_surface(check: &mut Checker, spans: [[&Span; 2]; 3], boundaries: &Boundaries) {
    let sides = boundaries.0.iter().flatten().zip(spans.into_iter().flatten());
    let mut surfaces = sides.filter(|(boundary, _)| **boundary == Boundary::FreeSurface);
    if let Some((_, second)) = surfaces.nth(1) {
        let message = "a second free surface; the box can have one";
        check.fail(second, message, "make this side a \"slip\" wall, or another of the conditions");
    }
}
