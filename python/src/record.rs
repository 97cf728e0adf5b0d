//! Columns of a flight in memory.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sim::observer::Observer;
use sim::quantity::{Quantity, Value, scalar_first};
use sim::tick::Tick;

use crate::quantities;

/// Numbers of a column, row by row.
#[derive(Debug)]
enum Numbers {
    Singles(Vec<f32>),
    Doubles(Vec<f64>),
    Counts(Vec<u64>),
    Bits(Vec<u16>),
}

/// Keeps every `every`-th tick of a flight, a column per quantity.
#[derive(Debug)]
pub struct Recorder {
    every: u64,
    columns: Vec<(&'static Quantity, Numbers)>,
}

impl Recorder {
    /// All quantities, with room for the rows of `ticks` ticks; `every` is at least 1.
    pub fn new(ticks: u64, every: u64) -> Self {
        let rows = ticks.div_ceil(every) as usize;
        let columns = quantities::all().map(|(_, quantity)| {
            let room = rows * quantity.width();
            let numbers = match quantity.value {
                Value::Single(_) | Value::Vector(_) | Value::Quaternion(_) => {
                    Numbers::Singles(Vec::with_capacity(room))
                }
                Value::Double(_) | Value::Time(_) => Numbers::Doubles(Vec::with_capacity(room)),
                Value::Count(_) => Numbers::Counts(Vec::with_capacity(room)),
                Value::Bits(_) => Numbers::Bits(Vec::with_capacity(room)),
            };
            (quantity, numbers)
        });
        Self { every, columns: columns.collect() }
    }

    /// The columns as arrays by name: shape (rows,), or (rows, 3), (rows, 4).
    pub fn into_arrays(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let arrays = PyDict::new(py);
        for (quantity, numbers) in self.columns {
            let width = quantity.width();
            let array = match numbers {
                Numbers::Singles(numbers) if width > 1 => {
                    let rows = numbers.len() / width;
                    PyArray1::from_vec(py, numbers).reshape([rows, width])?.into_any()
                }
                Numbers::Singles(numbers) => PyArray1::from_vec(py, numbers).into_any(),
                Numbers::Doubles(numbers) => PyArray1::from_vec(py, numbers).into_any(),
                Numbers::Counts(numbers) => PyArray1::from_vec(py, numbers).into_any(),
                Numbers::Bits(numbers) => PyArray1::from_vec(py, numbers).into_any(),
            };
            arrays.set_item(quantity.name, array)?;
        }
        Ok(arrays)
    }
}

impl Observer for Recorder {
    fn observe(&mut self, tick: &Tick) {
        if !tick.tick.is_multiple_of(self.every) {
            return;
        }
        for (quantity, numbers) in &mut self.columns {
            match (quantity.value, numbers) {
                (Value::Single(read), Numbers::Singles(to)) => to.push(read(tick)),
                (Value::Vector(read), Numbers::Singles(to)) => {
                    to.extend_from_slice(&read(tick).to_array());
                }
                (Value::Quaternion(read), Numbers::Singles(to)) => {
                    to.extend_from_slice(&scalar_first(read(tick)));
                }
                (Value::Double(read) | Value::Time(read), Numbers::Doubles(to)) => {
                    to.push(read(tick));
                }
                (Value::Count(read), Numbers::Counts(to)) => to.push(read(tick)),
                (Value::Bits(read), Numbers::Bits(to)) => to.push(read(tick)),
                // `new` made the column for the type.
                _ => {}
            }
        }
    }
}
