//! Python package of Grainwake. The classes and functions here convert arguments, call the
//! libraries and convert results; `python/grainwake` adds pandas, xarray and PyVista.
//!
//! Layers, downwards: `simulation`, `study`, `validation` -> `case` -> `running`, `case_dict` ->
//! `grain`, `results` -> `arguments`, `arrays`, `threads` -> `error` -> `words`.

mod arguments;
mod arrays;
mod case;
mod case_dict;
mod case_new;
mod case_variant;
mod error;
mod grain;
mod results;
mod running;
mod simulation;
mod study;
mod threads;
mod validation;
mod words;

use pyo3::prelude::*;

#[pymodule]
mod _grainwake {
    #[pymodule_export]
    use super::case::PyCase;
    #[pymodule_export]
    use super::grain::image::scan;
    #[pymodule_export]
    use super::grain::{PyGrain, PyScan};
    #[pymodule_export]
    use super::results::{
        _read_collection, _read_events, _read_grains, _read_image, _read_surface, _read_table,
        _render, _run_notes, _seconds,
    };
    #[pymodule_export]
    use super::simulation::PySimulation;
    #[pymodule_export]
    use super::study::{_read_plan, _read_records, PyStudy};
    #[pymodule_export]
    use super::validation::_validate;

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("commit", grainwake_run::provenance::commit())
    }
}
