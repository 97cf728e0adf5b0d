//! The quantities of a flight, by the one table of `sim::quantity`.

use ctrl_core::controller::StepStatus;
use numpy::PyArray1;
use pyo3::prelude::*;
use sim::quantity::table::{AUXILIARY_ANGLE, LYAPUNOV_STATE, TILT_ERROR, TIME};
use sim::quantity::{Quantity, TOPICS, Value, scalar_first};
use sim::tick::Tick;

/// Quantities of the table that no topic has.
const DERIVED: &[Quantity] = &[TIME, TILT_ERROR, AUXILIARY_ANGLE, LYAPUNOV_STATE];

/// Every quantity of a flight, with its topic.
pub fn all() -> impl Iterator<Item = (&'static str, &'static Quantity)> {
    let derived = DERIVED.iter().map(|quantity| ("derived", quantity));
    let topics = TOPICS.iter().flat_map(|topic| topic.quantities.iter().map(|it| (topic.name, it)));
    derived.chain(topics)
}

/// A row of the table of quantities: name, unit, meaning, topic, suffixes.
type TableRow = (&'static str, &'static str, &'static str, &'static str, Vec<&'static str>);

/// The table of quantities: name, unit, meaning, topic, and the endings of the components' names.
#[pyfunction]
pub fn quantities() -> Vec<TableRow> {
    all().map(|(topic, it)| (it.name, it.unit, it.meaning, topic, it.suffixes().to_vec())).collect()
}

/// Bits of a step's status by name.
#[pyfunction]
pub fn status_bits() -> Vec<(&'static str, u16)> {
    StepStatus::all().iter_names().map(|(name, bit)| (name, bit.bits())).collect()
}

/// The value of a quantity at a tick: a number, or an array of three or four.
pub fn value<'py>(
    py: Python<'py>,
    quantity: &Quantity,
    tick: &Tick,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(match quantity.value {
        Value::Single(read) => read(tick).into_pyobject(py)?.into_any(),
        Value::Double(read) | Value::Time(read) => read(tick).into_pyobject(py)?.into_any(),
        Value::Vector(read) => PyArray1::from_slice(py, &read(tick).to_array()).into_any(),
        Value::Quaternion(read) => PyArray1::from_slice(py, &scalar_first(read(tick))).into_any(),
        Value::Count(read) => read(tick).into_pyobject(py)?.into_any(),
        Value::Bits(read) => read(tick).into_pyobject(py)?.into_any(),
    })
}
