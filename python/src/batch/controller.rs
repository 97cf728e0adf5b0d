//! Many controllers at once.

use ctrl_core::controller::{AnyController, AnyControllerState, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::{GRAIN, check_lane, input, on_threads, output, pool};
use crate::arrays::{self, REFERENCE, STATE, STEADY_REFERENCE, WRENCH};
use crate::controller::configuration;
use crate::errors;

/// Many controllers of one configuration, stepped at once over arrays that the caller owns.
///
/// `config`: as that of Controller. `count`: number of controllers, each with a memory of its own.
/// `threads`: worker threads, one per core unless given.
#[pyclass(module = "gyrfalcon")]
pub struct BatchController {
    law: AnyController,
    memories: Vec<AnyControllerState>,
    status: Vec<u16>,
    pool: Option<ThreadPool>,
}

#[pymethods]
impl BatchController {
    #[new]
    #[pyo3(signature = (config, count, *, threads = None))]
    fn new(
        py: Python<'_>,
        config: &Bound<'_, PyAny>,
        count: usize,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let law = configuration(config)?.build().map_err(|error| errors::config(py, &error))?;
        let (memories, status) = (vec![law.initial_state(); count], vec![0; count]);
        Ok(Self { law, memories, status, pool: pool(threads)? })
    }

    fn __len__(&self) -> usize {
        self.memories.len()
    }

    /// Steps every controller; returns the wrenches, shape (N, 4), float32: thrust (N), torque (N m, body).
    ///
    /// `states`: shape (N, 13), float32. `references`: shape (N, 24), or (N, 18) without the derivatives of
    /// `b2d`, float32. All in C order, never copied; `out` receives the result. Rows are as those of
    /// `Controller.step`, with its bits.
    #[pyo3(signature = (states, references, *, out = None))]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        states: &Bound<'py, PyAny>,
        references: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let count = self.memories.len();
        let states = input(states, "states", count, &[STATE])?;
        let references = input(references, "references", count, &[REFERENCE, STEADY_REFERENCE])?;
        let width = references.shape()[1];
        let (result, mut wrenches) = output(py, out, count, WRENCH)?;
        let (states, references) = (states.as_slice()?, references.as_slice()?);
        let wrenches = wrenches.as_slice_mut()?;
        let Self { law, memories, status, pool } = self;
        let lanes = memories
            .par_chunks_mut(GRAIN)
            .zip(status.par_chunks_mut(GRAIN))
            .zip(states.par_chunks(GRAIN * STATE))
            .zip(references.par_chunks(GRAIN * width))
            .zip(wrenches.par_chunks_mut(GRAIN * WRENCH));
        on_threads(py, pool.as_ref(), || {
            lanes.for_each(|((((memories, status), states), references), wrenches)| {
                let inputs = inputs(states, references, width);
                let lanes = memories.iter_mut().zip(status).zip(&inputs);
                for (lane, wrench) in lanes.zip(wrenches.chunks_exact_mut(WRENCH)) {
                    let ((memory, status), (state, reference)) = lane;
                    let output = law.step(memory, state, reference);
                    *status = output.status.bits();
                    wrench[0] = output.wrench.thrust;
                    wrench[1..].copy_from_slice(&output.wrench.torque_body.to_array());
                }
            });
        });
        Ok(result)
    }

    /// Status bits of the latest step, shape (N,), uint16; `gyrfalcon.Status` names them.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u16>> {
        PyArray1::from_slice(py, &self.status)
    }

    /// Goes back to the memory before the first step, in every controller or in those of these numbers.
    #[pyo3(signature = (lanes = None))]
    fn reset(&mut self, lanes: Option<Vec<usize>>) -> PyResult<()> {
        let initial = self.law.initial_state();
        for lane in lanes.unwrap_or_else(|| (0..self.memories.len()).collect()) {
            check_lane(lane, self.memories.len())?;
            (self.memories[lane], self.status[lane]) = (initial, 0);
        }
        Ok(())
    }
}

/// The states and references of up to [`GRAIN`] controllers, ahead of their steps: a step that reads what was written
/// just before it waits for it.
fn inputs(states: &[f32], references: &[f32], width: usize) -> [(VehicleState, Reference); GRAIN] {
    let at_rest = (VehicleState::at_rest(Vec3::ZERO), Reference::hover(Vec3::ZERO));
    let mut inputs = [at_rest; GRAIN];
    let rows = states.chunks_exact(STATE).zip(references.chunks_exact(width));
    for (input, (state, reference)) in inputs.iter_mut().zip(rows) {
        *input = (arrays::state_from(state), arrays::reference_from(reference));
    }
    inputs
}
