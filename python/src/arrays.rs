//! Vectors, states and references as arrays. Quaternions are scalar first: w, x, y, z.

use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use glam::{DQuat, DVec3, Quat, Vec3};
use numpy::{AllowTypeChange, PyArray1, PyArrayLike1, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sim::plant::PlantState;
use sim::quantity::scalar_first;

/// Length of a state: position, velocity, attitude (w, x, y, z), rate.
pub const STATE: usize = 13;
/// Length of a reference: position and four derivatives, `b2d` and two derivatives.
pub const REFERENCE: usize = 24;
/// Length of a reference whose heading does not turn: position and four derivatives, `b2d`.
pub const STEADY_REFERENCE: usize = 18;
/// Length of a wrench: thrust, torque.
pub const WRENCH: usize = 4;

/// Anything that numpy turns into an array of numbers in single precision.
pub type Singles<'py> = PyArrayLike1<'py, f32, AllowTypeChange>;
/// Anything that numpy turns into an array of numbers in double precision.
pub type Doubles<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;

/// The state of 13 numbers.
pub fn state(array: &Singles<'_>) -> PyResult<VehicleState> {
    Ok(state_from(&fixed::<f32, STATE>(array.as_array().iter(), "state")?))
}

/// The reference of 24 numbers, or of 18 if its heading does not turn.
pub fn reference(array: &Singles<'_>) -> PyResult<Reference> {
    if array.len() == STEADY_REFERENCE {
        return Ok(reference_from(&fixed::<f32, STEADY_REFERENCE>(
            array.as_array().iter(),
            "reference",
        )?));
    }
    fixed::<f32, REFERENCE>(array.as_array().iter(), "reference")
        .map(|numbers| reference_from(&numbers))
        .map_err(|_| {
            wrong_length("reference", "24, or 18 if its heading does not turn", array.len())
        })
}

/// Exactly `N` numbers; an error names the array.
pub fn fixed<'a, T: Copy + Default + 'a, const N: usize>(
    numbers: impl ExactSizeIterator<Item = &'a T>,
    name: &str,
) -> PyResult<[T; N]> {
    let length = numbers.len();
    if length != N {
        return Err(wrong_length(name, &N.to_string(), length));
    }
    let mut fixed = [T::default(); N];
    fixed.iter_mut().zip(numbers).for_each(|(to, from)| *to = *from);
    Ok(fixed)
}

fn wrong_length(name: &str, expected: &str, length: usize) -> PyErr {
    PyValueError::new_err(format!("{name} has {length} numbers; it must have {expected}"))
}

/// State from 13 numbers; `row` has at least as many.
pub fn state_from(row: &[f32]) -> VehicleState {
    VehicleState {
        position_world: vec3(row, 0),
        velocity_world: vec3(row, 3),
        attitude: Quat::from_xyzw(row[7], row[8], row[9], row[6]),
        rate_body: vec3(row, 10),
    }
}

/// Reference from 24 numbers, or 18 if its heading does not turn.
pub fn reference_from(row: &[f32]) -> Reference {
    let turning = row.len() >= REFERENCE;
    Reference {
        position_world: vec3(row, 0),
        velocity_world: vec3(row, 3),
        acceleration_world: vec3(row, 6),
        jerk_world: vec3(row, 9),
        snap_world: vec3(row, 12),
        left_world: vec3(row, 15),
        left_rate_world: if turning { vec3(row, 18) } else { Vec3::ZERO },
        left_acceleration_world: if turning { vec3(row, 21) } else { Vec3::ZERO },
    }
}

/// The 13 numbers of a state.
pub fn state_numbers(state: &VehicleState) -> [f32; STATE] {
    let mut row = [0.0; STATE];
    row[0..3].copy_from_slice(&state.position_world.to_array());
    row[3..6].copy_from_slice(&state.velocity_world.to_array());
    row[6..10].copy_from_slice(&scalar_first(state.attitude));
    row[10..13].copy_from_slice(&state.rate_body.to_array());
    row
}

/// The 24 numbers of a reference.
pub fn reference_numbers(reference: &Reference) -> [f32; REFERENCE] {
    let parts = [
        reference.position_world,
        reference.velocity_world,
        reference.acceleration_world,
        reference.jerk_world,
        reference.snap_world,
        reference.left_world,
        reference.left_rate_world,
        reference.left_acceleration_world,
    ];
    let mut row = [0.0; REFERENCE];
    row.chunks_exact_mut(3).zip(parts).for_each(|(to, from)| to.copy_from_slice(&from.to_array()));
    row
}

/// The 13 numbers of a true state, in double precision.
pub fn truth_numbers(truth: &PlantState) -> [f64; STATE] {
    let mut row = [0.0; STATE];
    row[0..3].copy_from_slice(&truth.position_world.to_array());
    row[3..6].copy_from_slice(&truth.velocity_world.to_array());
    let DQuat { x, y, z, w } = truth.attitude;
    row[6..10].copy_from_slice(&[w, x, y, z]);
    row[10..13].copy_from_slice(&truth.rate_body.to_array());
    row
}

/// True state from 13 numbers.
pub fn truth_from(row: &[f64; STATE]) -> PlantState {
    let vector = |at: usize| DVec3::new(row[at], row[at + 1], row[at + 2]);
    PlantState {
        position_world: vector(0),
        velocity_world: vector(3),
        attitude: DQuat::from_xyzw(row[7], row[8], row[9], row[6]),
        rate_body: vector(10),
    }
}

fn vec3(row: &[f32], at: usize) -> Vec3 {
    Vec3::new(row[at], row[at + 1], row[at + 2])
}

/// A vector as an array of three.
pub fn vector(py: Python<'_>, vector: Vec3) -> Bound<'_, PyArray1<f32>> {
    PyArray1::from_slice(py, &vector.to_array())
}

/// A quaternion as an array of four, scalar first.
pub fn quaternion(py: Python<'_>, quaternion: Quat) -> Bound<'_, PyArray1<f32>> {
    PyArray1::from_slice(py, &scalar_first(quaternion))
}
