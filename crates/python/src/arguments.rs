//! Arguments from Python: numbers with units, vectors and arrays.

use glam::DVec3;
use grainwake_run::case::quantity::{Kind, parse_quantity, without_unit};
use numpy::{PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyString};

use crate::error::input;

/// Whole number of any size; `at_least` checks it.
pub struct Whole {
    /// The number; none beyond 128 bits.
    number: Option<i128>,
    text: String,
}

impl Whole {
    /// Returns the number, or the exception of one below `least` or beyond the type.
    pub fn at_least<T: TryFrom<i128>>(&self, name: &str, least: i128) -> PyResult<T> {
        let found = &self.text;
        if self.number.map_or(found.starts_with('-'), |number| number < least) {
            let expected = format!("expected a whole number from {least} on");
            return Err(input(format!("{name}: found {found}; {expected}")));
        }
        let number = self.number.and_then(|number| T::try_from(number).ok());
        number.ok_or_else(|| input(format!("{name}: {found} is too large")))
    }
}

impl<'py> FromPyObject<'_, 'py> for Whole {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Whole> {
        match value.extract::<i128>() {
            Ok(number) => Ok(Whole { number: Some(number), text: number.to_string() }),
            Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => {
                Ok(Whole { number: None, text: value.str()?.to_cow()?.into_owned() })
            }
            Err(error) => Err(error),
        }
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

/// Returns `N` plain numbers of a sequence or an array.
pub fn plain_numbers<const N: usize>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; N]> {
    let items: PyResult<Vec<f64>> =
        value.try_iter().and_then(|items| items.map(|item| item?.extract()).collect());
    items.ok().and_then(|items| items.try_into().ok()).ok_or_else(|| {
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
