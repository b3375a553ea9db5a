//! Conversion of Python objects to the text of a case file.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyMapping, PyString};
use toml::{Table, Value};

use crate::arguments::is_unordered;
use crate::error::{Raise, input, system};
use crate::grain::PyGrain;
use grainwake_run::case::write_toml;

/// Largest number of tables and lists inside each other.
const DEEPEST: usize = 32;

/// Returns overrides as strings in the syntax of `Case::load`; None removes a key. Grains are
/// written to the folder `store`, and refused without one.
pub fn override_list(
    overrides: Option<&Bound<'_, PyAny>>,
    store: Option<&Path>,
) -> PyResult<Vec<String>> {
    let Some(overrides) = overrides else {
        return Ok(Vec::new());
    };
    if overrides.is_instance_of::<PyString>() {
        return Err(input(
            "overrides: found a string; expected a dict such as {\"time.end\": \"0.5 s\"} or a list \
             of strings such as [\"time.end=0.5\"]",
        ));
    }
    let Ok(mapping) = overrides.cast::<PyMapping>() else {
        return overrides.extract();
    };
    let (mut removed, mut set) = (Vec::new(), Vec::new());
    for item in mapping.items()?.iter() {
        let (key, given): (String, Bound<'_, PyAny>) = item.extract()?;
        match value(&key, &given, store)? {
            Some(value) => set.push(format!("{key}={value}")),
            None => removed.push(format!("-{key}")),
        }
    }
    removed.append(&mut set);
    Ok(removed)
}

/// Returns the tables as TOML. Grains are written to the folder `store`.
pub fn to_toml(tables: &Bound<'_, PyDict>, store: &Path) -> PyResult<String> {
    let table = table("", tables.as_mapping(), Some(store))?;
    write_toml(&table).map_err(|error| input(error.to_string()))
}

fn table(path: &str, mapping: &Bound<'_, PyMapping>, store: Option<&Path>) -> PyResult<Table> {
    let mut table = Table::new();
    for item in mapping.items()?.iter() {
        let (key, given): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let key: String = key.extract().map_err(|_| {
            let place = if path.is_empty() { String::new() } else { format!("{path}: ") };
            input(format!("{place}the key {key} is not a string"))
        })?;
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        if let Some(value) = value(&path, &given, store)? {
            table.insert(key, value);
        }
    }
    Ok(table)
}

/// Returns a value; `None` for Python's None.
fn value(path: &str, given: &Bound<'_, PyAny>, store: Option<&Path>) -> PyResult<Option<Value>> {
    if given.is_none() {
        return Ok(None);
    }
    if path.matches('.').count() > DEEPEST {
        let start: Vec<&str> = path.split('.').take(3).collect();
        let start = start.join(".");
        return Err(input(format!(
            "{start}...: more than {DEEPEST} lists or dicts inside each other"
        )));
    }
    if given.is_instance_of::<PyBool>() {
        return Ok(Some(Value::Boolean(given.extract()?)));
    }
    if given.is_instance_of::<PyInt>() {
        let number = given
            .extract()
            .map_err(|_| input(format!("{path}: the integer {given} is too large")))?;
        return Ok(Some(Value::Integer(number)));
    }
    if given.is_instance_of::<PyFloat>() {
        return Ok(Some(Value::Float(given.extract()?)));
    }
    if let Ok(text) = given.cast::<PyString>() {
        return Ok(Some(Value::String(text.to_cow()?.into_owned())));
    }
    if let Ok(grain) = given.cast::<PyGrain>() {
        return stored(path, grain, store).map(Some);
    }
    if given.hasattr("__fspath__")? {
        let file: PathBuf = given.extract()?;
        return Ok(Some(Value::String(file.display().to_string())));
    }
    if given.hasattr("tolist")? {
        // NumPy numbers and arrays.
        let plain = given.call_method0("tolist")?;
        if !plain.hasattr("tolist")? {
            return value(path, &plain, store);
        }
    }
    if let Ok(mapping) = given.cast::<PyMapping>() {
        return Ok(Some(Value::Table(table(path, mapping, store)?)));
    }
    if is_unordered(given) {
        return Err(input(format!("{path}: found a set, which has no order; expected a list")));
    }
    let Ok(items) = given.try_iter() else {
        let kind = given.get_type().name()?;
        return Err(input(format!(
            "{path}: found a value of type {kind}; expected a number, a string, a list or a dict"
        )));
    };
    let mut list = Vec::new();
    for (index, item) in items.enumerate() {
        let at = format!("{path}.{index}");
        let item = value(&at, &item?, store)?
            .ok_or_else(|| input(format!("{at}: found None in a list")))?;
        list.push(item);
    }
    Ok(Some(Value::Array(list)))
}

/// Writes a grain to the folder, under its digest, and returns its path.
fn stored(path: &str, grain: &Bound<'_, PyGrain>, store: Option<&Path>) -> PyResult<Value> {
    let Some(store) = store else {
        return Err(input(format!("{path}: a Grain cannot override; save it and give its file")));
    };
    let mut keys = path.rsplit('.');
    let is_file = keys.next() == Some("file") || keys.next() == Some("files");
    if !is_file {
        return Err(input(format!(
            "{path}: a Grain stands for the key `file`, or in the list `files`"
        )));
    }
    let shape = &grain.get().shape;
    let name = shape.digest().chars().take(12).collect::<String>();
    let file = store.join(format!("grain-{name}.grain"));
    if !file.exists() {
        shape.save(&file).raise()?;
    }
    let text = file.to_str().ok_or_else(|| {
        system(std::io::ErrorKind::Other, format!("{} is not UTF-8", file.display()))
    })?;
    Ok(Value::String(text.to_owned()))
}
