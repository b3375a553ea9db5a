//! Arguments from Python: numbers with units, vectors and arrays.

use glam::DVec3;
use grainwake_run::case::quantity::{Kind, parse_quantity, without_unit};
use numpy::{PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFrozenSet, PySet, PyString};

use crate::error::input;

/// Value of an argument that takes a whole number of any size; `at_least` and `number` check it.
pub struct Whole {
    /// The number; none beyond 128 bits.
    number: Option<i128>,
    text: String,
    /// Type of a value that is no whole number.
    other: Option<String>,
}

impl Whole {
    /// Returns the number, none beyond 128 bits, or the exception of a value of another type. The
    /// message names the argument, which that of the conversion does not.
    pub fn number(&self, name: &str) -> PyResult<Option<i128>> {
        let Some(other) = &self.other else { return Ok(self.number) };
        let found = &self.text;
        Err(PyTypeError::new_err(format!(
            "{name}: found {found} of type {other}; expected a whole number"
        )))
    }

    /// Returns the value as Python writes it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the number, or the exception of one below `least` or beyond the type.
    pub fn at_least<T: TryFrom<i128>>(&self, name: &str, least: i128) -> PyResult<T> {
        let (given, found) = (self.number(name)?, &self.text);
        if given.map_or(found.starts_with('-'), |number| number < least) {
            let expected = format!("expected a whole number from {least} on");
            return Err(input(format!("{name}: found {found}; {expected}")));
        }
        let number = given.and_then(|number| T::try_from(number).ok());
        number.ok_or_else(|| input(format!("{name}: {found} is too large")))
    }
}

impl<'py> FromPyObject<'_, 'py> for Whole {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Whole> {
        let (number, mut other) = match value.extract::<i128>() {
            Ok(number) => (Some(number), None),
            Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => (None, None),
            Err(_) => (None, Some(value.get_type().name()?.to_string())),
        };
        // True is an integer of Python, but no count.
        if value.is_instance_of::<PyBool>() {
            other = Some("bool".to_owned());
        }
        Ok(Whole { number, text: value.str()?.to_cow()?.into_owned(), other })
    }
}

/// Returns an optional whole number from `least` on.
pub fn whole<T: TryFrom<i128>>(
    name: &str,
    given: Option<&Whole>,
    least: i128,
) -> PyResult<Option<T>> {
    given.map(|given| given.at_least(name, least)).transpose()
}

/// Returns the argument `seed`.
pub fn seed(value: &Bound<'_, PyAny>) -> PyResult<u64> {
    value.extract::<Whole>()?.at_least("seed", 0)
}

/// Returns the argument `pixels`.
pub fn pixels(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    value.extract::<Whole>()?.at_least("pixels", 16)
}

/// Returns the argument `jobs`.
pub fn jobs(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    value.extract::<Whole>()?.at_least("jobs", 1)
}

/// Returns the argument `threads`.
pub fn threads(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    value.extract::<Whole>()?.at_least("threads", 0)
}

/// Defines conversions of arguments whose exceptions name the argument; those of PyO3 name it in a
/// note only, which Python 3.10 does not show.
macro_rules! named {
    ($convert:path, $type:ty, $($name:ident)*) => {
        $(
            pub fn $name(value: &pyo3::Bound<'_, pyo3::PyAny>) -> pyo3::PyResult<$type> {
                $convert(stringify!($name), value)
            }
        )*
    };
}

/// Arguments that are True or False.
pub mod flags {
    named!(super::flag, bool, flip force from_mask keep_checkpoints labels largest_piece median pad
        report rescue resume retry rotation roundness split translation);
}

/// Arguments that are plain numbers.
pub mod plain {
    named!(super::plain_number, f64, roundness sphericity);
    named!(super::optional_number, Option<f64>, flatness separate smoothing);
}

/// Returns True or False.
fn flag(name: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    value.extract().map_err(|_| wrong_type(name, value, "True or False"))
}

/// Returns a number.
fn plain_number(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    value.extract().map_err(|_| wrong_type(name, value, "a number"))
}

/// Returns a number or None.
fn optional_number(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<f64>> {
    if value.is_none() { Ok(None) } else { plain_number(name, value).map(Some) }
}

/// Returns the exception of an argument of a wrong type.
fn wrong_type(name: &str, value: &Bound<'_, PyAny>, expected: &str) -> PyErr {
    let shown = value.repr().map_or_else(|_| "a value".into(), |text| text.to_string());
    let kind = value.get_type().name().map_or_else(|_| String::new(), |kind| kind.to_string());
    PyTypeError::new_err(format!("{name}: found {shown} of type {kind}; expected {expected}"))
}

/// Returns a quantity in SI units: a number is SI, a string carries its unit ("2 mm").
pub fn quantity<K: Kind>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    if let Ok(text) = value.cast::<PyString>() {
        let text = text.to_cow()?;
        return parse_quantity::<K>(&text).map_err(|message| input(format!("{name}: {message}")));
    }
    let number = match value.is_instance_of::<PyBool>() {
        true => Err(()),
        false => value.extract::<f64>().map_err(drop),
    };
    match number {
        Ok(number) => {
            without_unit::<K>(number).map_err(|message| input(format!("{name}: {message}")))
        }
        Err(()) => {
            let found = value.get_type().name()?;
            Err(input(format!("{name}: found a value of type {found}; expected {}", K::EXPECTED)))
        }
    }
}

/// Returns a vector in SI units: three quantities.
pub fn vector<K: Kind>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<DVec3> {
    let refused =
        |found: &str| input(format!("{name}: found {found}; expected {}", K::EXPECTED_VECTOR));
    if value.is_instance_of::<PyString>() {
        return Err(refused("a string"));
    }
    if is_unordered(value) {
        return Err(refused("a set or dict, which has no order"));
    }
    let items: Vec<Bound<'_, PyAny>> = match value.try_iter() {
        Ok(items) => items.collect::<PyResult<_>>()?,
        Err(_) => return Err(refused("one value")),
    };
    let [x, y, z] = &items[..] else {
        return Err(refused(&format!("{} components", items.len())));
    };
    let part =
        |axis: &str, item: &Bound<'_, PyAny>| quantity::<K>(&format!("{name}, {axis}"), item);
    Ok(DVec3::new(part("x", x)?, part("y", y)?, part("z", z)?))
}

/// Returns whether a value is a set or a dict, whose items have no order.
pub fn is_unordered(value: &Bound<'_, PyAny>) -> bool {
    value.is_instance_of::<PySet>()
        || value.is_instance_of::<PyFrozenSet>()
        || value.is_instance_of::<PyDict>()
}

/// Returns `N` plain numbers of a sequence or an array.
pub fn plain_numbers<const N: usize>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; N]> {
    let items: PyResult<Vec<f64>> =
        value.try_iter().and_then(|items| items.map(|item| item?.extract()).collect());
    let items = items.ok().filter(|_| !is_unordered(value));
    items.and_then(|items| items.try_into().ok()).ok_or_else(|| {
        let found = value.repr().map_or_else(|_| "a value".into(), |text| text.to_string());
        input(format!("{name}: found {found}; expected {N} numbers"))
    })
}

/// Returns a value as an array of this type, contiguous with the last axis fastest; it is converted
/// if necessary.
pub fn array<'py, T: numpy::Element>(
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let py = value.py();
    let numpy = py.import("numpy")?;
    let plain = numpy.call_method1("asarray", (value,))?;
    let dtype = numpy::dtype::<T>(py);
    let from = plain.getattr("dtype")?;
    let kind: String = from.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "b" | "i" | "u" | "f") {
        return Err(input(format!("{name}: an array of {from} holds no real numbers")));
    }
    let converted = numpy.call_method1("ascontiguousarray", (&plain, &dtype))?;
    let whole = matches!(dtype.kind(), b'i' | b'u') && kind == "f";
    if whole && !numpy.call_method1("array_equal", (&plain, &converted))?.is_truthy()? {
        return Err(input(format!("{name}: found numbers that are not whole")));
    }
    Ok(converted.cast_into::<PyArrayDyn<T>>()?)
}

/// Returns an array of points, of the shape (n, 3) or (3,).
pub fn points(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<DVec3>> {
    let array = array::<f64>(name, value)?;
    if !matches!(array.shape(), [3] | [_, 3]) {
        return Err(wrong_shape(name, array.shape(), "(n, 3)"));
    }
    let readonly = array.readonly();
    let values = readonly.as_slice()?;
    Ok(values.chunks_exact(3).map(DVec3::from_slice).collect())
}

/// Returns the exception of an array of a wrong shape.
pub fn wrong_shape(name: &str, found: &[usize], wanted: &str) -> PyErr {
    let shape: Vec<String> = found.iter().map(usize::to_string).collect();
    let tail = if found.len() == 1 { "," } else { "" };
    input(format!(
        "{name}: found an array of shape ({}{tail}); expected {wanted}",
        shape.join(", ")
    ))
}
