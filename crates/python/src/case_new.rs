//! `Case.new`: a case of keywords.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::arguments::{Whole, whole};
use crate::case::PyCase;
use crate::error::input;

#[pymethods]
impl PyCase {
    /// Build a case from the values that are given most often.
    ///
    /// Parameters
    /// ----------
    /// size : sequence of float or str
    ///     Edge lengths of the box [m].
    /// end : float or str
    ///     End of the run [s].
    /// cell_size : float, str or sequence, optional
    ///     Edge of a cell [m], one or one per axis. A dry case needs no cells.
    /// cells : sequence of int, optional
    ///     Number of cells along each axis, instead of `cell_size`.
    /// refinement : int, optional
    ///     2 halves the cells in a box that follows the grains; 1 by default.
    /// refinement_margin : float, str or sequence, optional
    ///     Least distance from the grains to the sides of that box [m], one or one per axis; 0.4
    ///     equivalent diameters by default.
    /// grains : iterable of dict, optional
    ///     Entries of the list ``grain``, such as those of `Grain.at`.
    /// fluid : dict, optional
    ///     Table ``fluid``: density and viscosity or kinematic_viscosity. Without it the run is
    ///     dry.
    /// gravity : sequence of float or str, optional
    ///     Gravity [m/s2]; (0, 0, -9.81) by default.
    /// boundaries : str or dict, optional
    ///     Condition on all sides, such as ``"periodic"``, or table ``domain.boundaries``; walls by
    ///     default.
    /// title : str, optional
    ///     One line that says what the case is.
    /// folder : path-like, default "."
    ///     Folder that grain files are relative to.
    /// **tables
    ///     Further tables: contact, coupling, output, run, expect, and the lists packing, poses
    ///     and probe; a dict ``time`` is joined with `end`. A `Grain` may stand in the list
    ///     ``files`` of a packing.
    ///
    /// Returns
    /// -------
    /// Case
    #[staticmethod]
    #[pyo3(signature = (*, size, end, cell_size = None, cells = None, refinement = None, refinement_margin = None, grains = None, fluid = None, gravity = None, boundaries = None, title = None, folder = PathBuf::from("."), **tables))]
    fn new(
        py: Python<'_>,
        size: &Bound<'_, PyAny>,
        end: &Bound<'_, PyAny>,
        cell_size: Option<&Bound<'_, PyAny>>,
        cells: Option<&Bound<'_, PyAny>>,
        refinement: Option<Whole>,
        refinement_margin: Option<&Bound<'_, PyAny>>,
        grains: Option<&Bound<'_, PyAny>>,
        fluid: Option<&Bound<'_, PyAny>>,
        gravity: Option<&Bound<'_, PyAny>>,
        boundaries: Option<&Bound<'_, PyAny>>,
        title: Option<&str>,
        folder: PathBuf,
        tables: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyCase> {
        let domain = PyDict::new(py);
        domain.set_item("size", size)?;
        domain.set_item("cell_size", cell_size)?;
        domain.set_item("cells", cells)?;
        domain.set_item("refinement", whole::<i64>("refinement", refinement.as_ref(), 1)?)?;
        domain.set_item("refinement_margin", refinement_margin)?;
        domain.set_item("boundaries", boundaries)?;
        let time = PyDict::new(py);
        time.set_item("end", end)?;
        let all = PyDict::new(py);
        all.set_item("title", title)?;
        all.set_item("gravity", gravity)?;
        all.set_item("fluid", fluid)?;
        all.set_item("domain", domain)?;
        all.set_item("grain", grains)?;
        for (name, table) in tables.into_iter().flatten() {
            match name.cast::<PyString>()?.to_str()? {
                "domain" => {
                    let message = "domain: its keys are arguments of their own, such as size; a \
                                   case with other keys is made by from_dict";
                    return Err(input(message));
                }
                "grain" if grains.is_some() => {
                    return Err(input("grain: found beside grains; give one of them"));
                }
                "time" => match table.cast::<PyDict>() {
                    Ok(more) if more.contains("end")? => {
                        return Err(input("time.end: found beside end; give one of them"));
                    }
                    Ok(more) => time.update(more.as_mapping())?,
                    Err(_) => {
                        let found = table.get_type().name()?;
                        return Err(input(format!(
                            "time: found a value of type {found}; expected a dict"
                        )));
                    }
                },
                _ => all.set_item(name, table)?,
            }
        }
        all.set_item("time", time)?;
        PyCase::from_dict(py, &all, folder, None)
    }
}
