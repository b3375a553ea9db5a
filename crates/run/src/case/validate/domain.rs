//! `[domain]` -> grid and boundaries.

use glam::DVec3;

use super::check::Checker;
use crate::case::loc::Loc;
use crate::case::quantity::Triple;
use crate::case::raw::{AxisFaces, CellSize, Face, FaceKind, RawDomain};
use crate::case::readable::{length, number, quantity, vector};
use grainwake_solver::flow::{Boundaries, Boundary};
use grainwake_solver::grid::Mesh;

const AXES: [&str; 3] = ["x", "y", "z"];
/// More cells than this along one axis are taken for a slip of the pen.
const MOST_CELLS: usize = 1 << 20;
/// More cells than this in all are taken for a slip of the pen.
const MOST_CELLS_IN_ALL: usize = 1 << 36;

/// The grid; a dry run may leave the cells out. Fills in all three of size, cells and cell size.
pub(super) fn mesh(check: &mut Checker, raw: &mut RawDomain, dry: bool) -> Option<Mesh> {
    let origin = raw.origin.si;
    let positive = |v: DVec3| v.min_element() > 0.0;
    if let Some(size) = raw.size.as_ref().filter(|s| !positive(s.si)) {
        check.fail(
            size.span.as_ref(),
            "domain.size",
            format!(
                "the edges of the box must be longer than zero, found {}",
                vector(size.si, "m")
            ),
            "give three positive lengths",
        );
        return None;
    }
    if let Some(cell) = raw.cell_size.as_ref().filter(|c| !positive(c.0)) {
        check.fail(
            cell.span.as_ref(),
            "domain.cell_size",
            "the cell size must be greater than zero",
            "give a positive length such as \"0.25 mm\"",
        );
        return None;
    }
    if let Some(cells) = raw
        .cells
        .as_ref()
        .filter(|c| c.iter().any(|n| *n == 0 || *n > MOST_CELLS))
    {
        check.fail(
            cells.span.as_ref(),
            "domain.cells",
            format!("found {:?} cells", cells.value),
            format!("each axis needs 1 to {MOST_CELLS} cells"),
        );
        return None;
    }
    let as_vector = |cells: [usize; 3]| DVec3::from_array(cells.map(|n| n as f64));
    let (cells, spacing) = match (&raw.size, &raw.cells, &raw.cell_size) {
        (size, Some(cells), Some(cell)) => {
            let extent = as_vector(cells.value) * cell.0;
            if let Some(size) = size
                .as_ref()
                .filter(|s| ((s.si - extent) / extent).abs().max_element() > 1e-9)
            {
                check.fail(
                    cells.span.as_ref(),
                    "domain.cells",
                    format!(
                        "size {} is not cells times cell_size, {}",
                        vector(size.si, "m"),
                        vector(extent, "m")
                    ),
                    "give two of size, cells and cell_size",
                );
                return None;
            }
            (cells.value, cell.0)
        }
        (Some(size), Some(cells), None) => (cells.value, size.si / as_vector(cells.value)),
        (Some(size), None, Some(cell)) => (divide(check, size, cell)?, cell.0),
        (Some(size), None, None) if dry => ([1; 3], size.si),
        _ => {
            check.fail(None, "domain", "the grid is not known", "give two of size, cells and cell_size, for example size = [\"25 mm\", \"25 mm\", \"97.5 mm\"] and cell_size = \"0.25 mm\"");
            return None;
        }
    };
    let count = cells.iter().try_fold(1usize, |n, c| n.checked_mul(*c));
    if count.is_none_or(|n| n > MOST_CELLS_IN_ALL) {
        let span = raw.cell_size.as_ref().map_or_else(
            || raw.cells.as_ref().and_then(|c| c.span.clone()),
            |c| c.span.clone(),
        );
        check.fail(
            span.as_ref(),
            "domain",
            format!("{cells:?} cells are more than any machine holds"),
            "make the cells larger; was a unit forgotten?",
        );
        return None;
    }
    let mesh = Mesh {
        cells,
        spacing,
        origin,
    };
    raw.size = Some(Triple::new(mesh.extent()).into());
    raw.cells = Some(cells.into());
    raw.cell_size = Some(CellSize(spacing).into());
    Some(mesh)
}

/// Whole cells in the box, or a problem that says which sizes would do.
fn divide(
    check: &mut Checker,
    size: &Loc<Triple<crate::case::quantity::Length>>,
    cell: &Loc<CellSize>,
) -> Option<[usize; 3]> {
    let mut cells = [0; 3];
    for axis in 0..3 {
        let (edge, h) = (size.si[axis], cell.0[axis]);
        let ratio = edge / h;
        if ratio > MOST_CELLS as f64 {
            check.fail(
                cell.span.as_ref(),
                "domain.cell_size",
                format!("{:.1} million cells along {}", 1e-6 * ratio, AXES[axis]),
                "make the cells larger; was a unit forgotten?",
            );
            return None;
        }
        let whole = ratio.round().max(1.0);
        if (ratio - whole).abs() > 1e-6 * whole {
            let (below, above) = (ratio.floor().max(1.0), ratio.ceil());
            check.fail(
                cell.span.as_ref(),
                "domain.cell_size",
                format!(
                    "{} along {} is not a whole number of cells of {} ({} cells)",
                    length(edge),
                    AXES[axis],
                    length(h),
                    number(ratio)
                ),
                format!(
                    "take {} = {} ({below} cells) or {} ({above} cells), or keep the size with a cell of {}",
                    AXES[axis],
                    length(below * h),
                    length(above * h),
                    length(edge / whole)
                ),
            );
            return None;
        }
        cells[axis] = whole as usize;
    }
    Some(cells)
}

/// Boundaries of the six faces.
pub(super) fn boundaries(
    check: &mut Checker,
    raw: &RawDomain,
    mesh: &Mesh,
    dry: bool,
) -> Option<Boundaries> {
    let before = check.problems.len();
    let axes = [&raw.boundaries.x, &raw.boundaries.y, &raw.boundaries.z];
    let mut result = Boundaries([[Boundary::WALL; 2]; 3]);
    for (axis, faces) in axes.iter().enumerate() {
        let sides = [(&faces.lower, "lower"), (&faces.upper, "upper")];
        for (side, (face, name)) in sides.iter().enumerate() {
            let span = face.span.as_ref().or(faces.span.as_ref());
            let key = format!("domain.boundaries.{}.{name}", AXES[axis]);
            match boundary(&face.value, axis, side) {
                Ok(boundary) => result.0[axis][side] = boundary,
                Err((message, help)) => check.fail(span, &key, message, help),
            }
        }
        axis_rules(check, faces, axis, mesh.cells[axis], dry);
    }
    mass_balance(check, raw, &result, mesh);
    (check.problems.len() == before).then_some(result)
}

fn boundary(face: &Face, axis: usize, side: usize) -> Result<Boundary, (String, String)> {
    let velocity = match (face.kind, face.velocity) {
        (FaceKind::Inflow, None) => {
            return Err((
                "an inflow needs its velocity".into(),
                "write { kind = \"inflow\", velocity = [...] }".into(),
            ));
        }
        (FaceKind::Wall | FaceKind::Inflow, velocity) => velocity.unwrap_or(DVec3::ZERO),
        (kind, Some(_)) => {
            return Err((
                format!("a {} face has no velocity of its own", kind.name()),
                "only wall and inflow take a velocity".into(),
            ));
        }
        (_, None) => DVec3::ZERO,
    };
    match face.kind {
        FaceKind::Wall if velocity[axis] != 0.0 => Err((
            format!(
                "a wall moves in its own plane, but this one has {} along {}",
                quantity(velocity[axis], "m/s"),
                AXES[axis]
            ),
            format!("set the {} component of its velocity to zero", AXES[axis]),
        )),
        FaceKind::Inflow if velocity[axis] * [1.0, -1.0][side] < 0.0 => Err((
            format!(
                "this inflow leaves the box ({} along {})",
                quantity(velocity[axis], "m/s"),
                AXES[axis]
            ),
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

fn axis_rules(check: &mut Checker, faces: &Loc<AxisFaces>, axis: usize, cells: usize, dry: bool) {
    let key = format!("domain.boundaries.{}", AXES[axis]);
    let (lower, upper) = (faces.lower.kind, faces.upper.kind);
    let span = faces.span.as_ref();
    if (lower == FaceKind::Periodic) != (upper == FaceKind::Periodic) {
        check.fail(
            span,
            &key,
            format!(
                "periodic on one side only: lower is {}, upper is {}",
                lower.name(),
                upper.name()
            ),
            format!("make both sides periodic: {} = \"periodic\"", AXES[axis]),
        );
    } else if cells == 1 && lower != FaceKind::Periodic && !dry {
        check.fail(
            span,
            &key,
            format!(
                "{} has one cell, so it is flat, and a flat axis has no walls",
                AXES[axis]
            ),
            format!(
                "write {} = \"periodic\", or give the axis more cells",
                AXES[axis]
            ),
        );
    }
}

fn mass_balance(check: &mut Checker, raw: &RawDomain, boundaries: &Boundaries, mesh: &Mesh) {
    let extent = mesh.extent();
    let (mut entering, mut largest, mut open) = (0.0, 0.0_f64, false);
    let mut where_from = None;
    for (axis, sides) in boundaries.0.iter().enumerate() {
        let area = extent.element_product() / extent[axis];
        for (side, boundary) in sides.iter().enumerate() {
            match boundary {
                Boundary::Outflow => open = true,
                Boundary::Inflow { velocity } => {
                    let flux = velocity[axis] * [1.0, -1.0][side] * area;
                    entering += flux;
                    largest = largest.max(flux.abs());
                    let faces = [&raw.boundaries.x, &raw.boundaries.y, &raw.boundaries.z][axis];
                    let face = [&faces.lower, &faces.upper][side];
                    where_from =
                        where_from.or(Some((axis, face.span.clone().or(faces.span.clone()))));
                }
                _ => {}
            }
        }
    }
    if let Some((axis, span)) = where_from.filter(|_| !open && largest > 0.0) {
        check.fail(
            span.as_ref(),
            &format!("domain.boundaries.{}", AXES[axis]),
            format!(
                "{} enter the box and nothing leaves it: no face is an outflow",
                quantity(1e3 * entering, "L/s")
            ),
            "make the opposite face an outflow",
        );
    }
}
