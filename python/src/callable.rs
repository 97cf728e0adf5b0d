//! Controller, plant, disturbance and monitor that are callables of Python.
//!
//! The traits of the simulator cannot fail. The first exception of a callable is kept in a [`Failure`], the
//! flight goes on with a harmless value until the end of the tick, and the exception is raised then.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use ctrl_core::controller::{StepOutput, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench};
use glam::{DVec3, Vec3};
use numpy::PyArray1;
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use sim::closed_loop::ObservedController;
use sim::guarantee::verdict::Extreme;
use sim::guarantee::{Monitor, Requirement, Verdict};
use sim::observer::Observer;
use sim::plant::disturbance::DisturbanceSource;
use sim::plant::vehicle::Plant;
use sim::plant::{AppliedWrench, Disturbance, PlantState};

use crate::arrays::{self, Doubles, STATE, Singles, WRENCH, fixed};
use crate::controller::StepOutput as PyStepOutput;
use crate::quantities;

/// The first exception of the callables of a flight.
#[derive(Clone, Debug, Default)]
pub struct Failure(Arc<Mutex<Option<PyErr>>>);

impl Failure {
    /// Raises it, if there is one.
    pub fn check(&self) -> PyResult<()> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
    }

    /// The result, or `otherwise` after keeping the exception.
    fn or<T>(&self, result: PyResult<T>, otherwise: T) -> T {
        result.unwrap_or_else(|error| {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            otherwise
        })
    }
}

/// A control law: `controller(time, state, reference)` returns thrust and torque.
pub struct Law {
    pub callable: Py<PyAny>,
    pub step_period: f32,
    pub failure: Failure,
}

impl Law {
    fn evaluate(
        &self,
        tick: u64,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> PyResult<StepOutput> {
        Python::attach(|py| {
            let time = tick as f64 * f64::from(self.step_period);
            let state = PyArray1::from_slice(py, &arrays::state_numbers(vehicle));
            let reference = PyArray1::from_slice(py, &arrays::reference_numbers(reference));
            let output = self.callable.bind(py).call1((time, state, reference))?;
            if let Ok(output) = output.cast::<PyStepOutput>() {
                return Ok(output.get().output);
            }
            let wrench = numbers::<f32, WRENCH>(&output.extract::<Singles<'_>>()?, "controller")?;
            let [thrust, x, y, z] = wrench;
            Ok(StepOutput::from(Wrench { thrust, torque_body: Vec3::new(x, y, z) }))
        })
    }
}

impl TrackingController for Law {
    /// Control ticks since the start.
    type State = u64;

    fn initial_state(&self) -> u64 {
        0
    }

    fn step(&self, tick: &mut u64, vehicle: &VehicleState, reference: &Reference) -> StepOutput {
        let output = self.evaluate(*tick, vehicle, reference);
        *tick += 1;
        self.failure.or(output, StepOutput::from(Wrench::default()))
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

impl ObservedController for Law {}

/// A plant: `plant(state, wrench, disturbance)` returns the state one step period later.
pub struct CallablePlant {
    pub callable: Py<PyAny>,
    pub failure: Failure,
    pub truth: PlantState,
    pub command: Wrench,
}

impl Plant for CallablePlant {
    fn truth(&self) -> &PlantState {
        &self.truth
    }

    fn command(&mut self, wrench: &Wrench) -> AppliedWrench {
        self.command = *wrench;
        AppliedWrench::from(*wrench)
    }

    fn advance(&mut self, disturbance: &Disturbance) {
        let next = Python::attach(|py| {
            let AppliedWrench { thrust, torque_body: torque } = AppliedWrench::from(self.command);
            let state = PyArray1::from_slice(py, &arrays::truth_numbers(&self.truth));
            let wrench = PyArray1::from_slice(py, &[thrust, torque.x, torque.y, torque.z]);
            let [d1, d2] = [disturbance.acceleration_world, disturbance.torque_body];
            let disturbance = PyArray1::from_slice(py, &[d1.x, d1.y, d1.z, d2.x, d2.y, d2.z]);
            let next = self.callable.bind(py).call1((state, wrench, disturbance))?;
            numbers::<f64, STATE>(&next.extract::<Doubles<'_>>()?, "plant")
        });
        self.truth = self.failure.or(next.map(|row| arrays::truth_from(&row)), self.truth);
    }
}

/// A disturbance: `disturbance(time, state)` returns acceleration and torque.
pub struct CallableDisturbance {
    pub callable: Py<PyAny>,
    pub failure: Failure,
    pub step_period: f64,
    pub tick: u64,
}

impl DisturbanceSource for CallableDisturbance {
    fn advance(&mut self, truth: &PlantState) -> Disturbance {
        let time = self.tick as f64 * self.step_period;
        self.tick += 1;
        let acting = Python::attach(|py| {
            let state = PyArray1::from_slice(py, &arrays::truth_numbers(truth));
            let acting = self.callable.bind(py).call1((time, state))?;
            numbers::<f64, 6>(&acting.extract::<Doubles<'_>>()?, "disturbance")
        });
        let [ax, ay, az, x, y, z] = self.failure.or(acting, [0.0; 6]);
        let acceleration_world = DVec3::new(ax, ay, az);
        let torque_body = DVec3::new(x, y, z);
        Disturbance { acceleration_world, torque_body, ..Disturbance::NONE }
    }
}

/// A monitor: a number of every tick, and its bound.
#[derive(Debug)]
pub struct CallableMonitor {
    value: Py<PyAny>,
    failure: Failure,
    row: (&'static str, &'static str, &'static str),
    requirement: Requirement,
    since: f64,
    extreme: Extreme,
}

impl CallableMonitor {
    /// From a `gyrfalcon.Monitor`.
    pub fn new(monitor: &Bound<'_, PyAny>, failure: &Failure) -> PyResult<Self> {
        let text = |name: &str| -> PyResult<&'static str> {
            Ok(interned(monitor.getattr(name)?.extract()?))
        };
        let bound = |name: &str| -> PyResult<Option<f64>> { monitor.getattr(name)?.extract() };
        Ok(Self {
            value: monitor.getattr("value")?.unbind(),
            failure: failure.clone(),
            row: (text("name")?, text("source")?, text("unit")?),
            requirement: match (bound("at_least")?, bound("at_most")?) {
                (Some(lower), Some(upper)) => Requirement::Inside(lower, upper),
                (Some(lower), None) => Requirement::AtLeast(lower),
                (None, Some(upper)) => Requirement::AtMost(upper),
                (None, None) => Requirement::Information,
            },
            since: monitor.getattr("since")?.extract()?,
            extreme: Extreme::default(),
        })
    }
}

impl Observer for CallableMonitor {
    fn observe(&mut self, tick: &sim::tick::Tick) {
        if tick.time < self.since {
            return;
        }
        let value = Python::attach(|py| {
            self.value.bind(py).call1((Tick { tick: *tick },))?.extract::<f64>()
        });
        let value = self.failure.or(value, f64::NAN);
        match self.requirement {
            Requirement::Information => {
                self.extreme.highest(value, tick.time);
            }
            bounded => {
                self.extreme.tightest(value, tick.time, bounded);
            }
        }
    }
}

impl Monitor for CallableMonitor {
    fn verdicts(&self) -> Vec<Verdict> {
        vec![Verdict::new(self.row, self.requirement, self.extreme)]
    }
}

/// One control tick of a flight: `tick[name]` is the value of a quantity of `QUANTITIES`.
#[pyclass(frozen, module = "gyrfalcon")]
pub struct Tick {
    pub tick: sim::tick::Tick,
}

#[pymethods]
impl Tick {
    /// Time since the start (s).
    #[getter]
    fn time(&self) -> f64 {
        self.tick.time
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = quantities::all().find(|(_, quantity)| quantity.name == name);
        let (_, quantity) =
            found.ok_or_else(|| PyKeyError::new_err(format!("no quantity {name:?}")))?;
        quantities::value(py, quantity, &self.tick)
    }
}

/// Exactly `N` finite numbers; an error names `role`, the callable that returned them.
fn numbers<T: numpy::Element + Copy + Default + Into<f64>, const N: usize>(
    array: &numpy::PyArrayLike1<'_, T, numpy::AllowTypeChange>,
    role: &str,
) -> PyResult<[T; N]>
where
    Vec<T>: for<'a> FromPyObject<'a, 'a>,
{
    let fixed = fixed::<T, N>(array.as_array().iter(), &format!("result of {role}"))?;
    if let Some(index) = fixed.iter().position(|&number| !number.into().is_finite()) {
        let value: f64 = fixed[index].into();
        let message = format!("result of {role}: number {index} is {value}, it must be finite");
        return Err(PyValueError::new_err(message));
    }
    Ok(fixed)
}

/// The text for as long as the process lives, kept once: names of verdicts are static.
fn interned(text: &str) -> &'static str {
    static KNOWN: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(kept) = known.get(text) {
        return kept;
    }
    let kept: &'static str = Box::leak(text.to_owned().into_boxed_str());
    known.insert(kept);
    kept
}
