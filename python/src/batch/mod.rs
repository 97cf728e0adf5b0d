//! Many controllers, flights or vehicles at once, over arrays that the caller owns; threads without the
//! interpreter's lock. Every lane is what it would be alone, to the bit.

mod controller;
mod lanes;

pub use controller::BatchController;
pub use lanes::{BatchFlight, BatchVehicle};

use numpy::{
    Element, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadwriteArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Lanes that a thread takes at a time.
const GRAIN: usize = 64;
/// Threads of a batch: those of the process, one per core, unless a number is asked for.
fn pool(threads: Option<usize>) -> PyResult<Option<ThreadPool>> {
    let wrong = |message: String| PyValueError::new_err(format!("threads: {message}"));
    match threads {
        None => Ok(None),
        Some(0) => Err(wrong("0 must be at least 1".to_owned())),
        Some(number) => {
            let pool = ThreadPoolBuilder::new().num_threads(number).build();
            pool.map(Some).map_err(|error| wrong(error.to_string()))
        }
    }
}

/// Runs `work` on the batch's threads without the interpreter's lock.
fn on_threads<T: Send>(
    py: Python<'_>,
    pool: Option<&ThreadPool>,
    work: impl FnOnce() -> T + Send,
) -> T {
    py.detach(|| match pool {
        Some(pool) => pool.install(work),
        None => work(),
    })
}

/// An input of `count` rows.
fn input<'py>(
    array: &Bound<'py, PyAny>,
    name: &str,
    count: usize,
    widths: &[usize],
) -> PyResult<PyReadonlyArray2<'py, f32>> {
    let array = shaped::<f32>(array, name, count, widths)?;
    array.try_readonly().map_err(|error| PyValueError::new_err(format!("{name}: {error}")))
}

/// `array` as one in C order of `count` rows of one of the `widths`, never a copy.
fn shaped<'a, 'py, T: Element>(
    array: &'a Bound<'py, PyAny>,
    name: &str,
    count: usize,
    widths: &[usize],
) -> PyResult<&'a Bound<'py, PyArray2<T>>> {
    let kind = T::get_dtype(array.py()).to_string();
    let widths_text: Vec<_> = widths.iter().map(|width| format!("({count}, {width})")).collect();
    let wanted =
        format!("{name} must be a {kind} array in C order of shape {}", widths_text.join(" or "));
    let array = array.cast::<PyArray2<T>>().map_err(|_| {
        PyTypeError::new_err(format!("{wanted}, which numpy.ascontiguousarray makes"))
    })?;
    let shape = array.shape();
    if shape[0] != count || !widths.contains(&shape[1]) || !array.is_c_contiguous() {
        return Err(PyValueError::new_err(format!("{wanted}; it has the shape {shape:?}")));
    }
    Ok(array)
}

/// The caller's array for a result of `count` rows, or a new one.
fn output<'py>(
    py: Python<'py>,
    out: Option<&Bound<'py, PyAny>>,
    count: usize,
    width: usize,
) -> PyResult<(Bound<'py, PyArray2<f32>>, PyReadwriteArray2<'py, f32>)> {
    let array = match out {
        Some(out) => shaped::<f32>(out, "out", count, &[width])?.clone(),
        None => PyArray2::zeros(py, [count, width], false),
    };
    let writable = array.try_readwrite();
    let writable = writable.map_err(|error| PyValueError::new_err(format!("out: {error}")))?;
    Ok((array, writable))
}

fn check_lane(lane: usize, count: usize) -> PyResult<()> {
    if lane < count {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("lane {lane} must be below {count}")))
}
