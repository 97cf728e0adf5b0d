//! Scenarios: everything that a flight depends on.

use ctrl_core::trajectory::{AnyTrajectory, Trajectory};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::{PyOSError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyMapping, PyString};
use sim::scenario::{BUILT_IN, BuiltIn, LoadedScenario};
use toml_edit::Value;

use crate::arrays::{self, REFERENCE};
use crate::errors;

/// Everything that a flight depends on: vehicle, start, disturbance, trajectory, controller, guarantees.
///
/// Immutable: `set` returns another scenario. Read from TOML, whose keys `docs/reference/scenario.md` lists.
#[pyclass(frozen, module = "gyrfalcon", from_py_object)]
#[derive(Clone)]
pub struct Scenario {
    pub loaded: LoadedScenario,
    /// Name in errors: that of a built-in scenario, or a path.
    origin: String,
    text: String,
    changes: Vec<String>,
}

impl Scenario {
    fn read(py: Python<'_>, origin: &str, text: &str, changes: Vec<String>) -> PyResult<Self> {
        let loaded = py
            .detach(|| LoadedScenario::parse(origin, text, &changes))
            .map_err(|error| errors::scenario(py, &error))?;
        Ok(Self { loaded, origin: origin.to_owned(), text: text.to_owned(), changes })
    }

    /// Trajectory of the flight.
    pub fn trajectory(&self, py: Python<'_>) -> PyResult<AnyTrajectory> {
        let scenario = self.loaded.scenario();
        let built = scenario.trajectory.build(scenario.controller.step_period());
        built.map_err(|error| errors::scenario(py, &self.loaded.refusal(&error)))
    }
}

#[pymethods]
impl Scenario {
    /// The built-in scenario of this name; `gyrfalcon.built_in_scenarios()` lists them.
    ///
    /// Raises ScenarioError, which names the nearest one, if there is none.
    #[staticmethod]
    fn builtin(py: Python<'_>, name: &str) -> PyResult<Self> {
        match BuiltIn::named(name) {
            Some(built_in) => Self::read(py, name, built_in.text, Vec::new()),
            None => {
                let known = BUILT_IN.iter().map(|it| it.name);
                let reason = &"no built-in scenario";
                let message = sim::scenario::not_found(name, reason, "scenarios", known);
                let attributes = PyDict::new(py);
                attributes.set_item("file", name)?;
                Err(errors::raise(py, "ScenarioError", &format!("{name}: {message}"), &attributes))
            }
        }
    }

    /// The scenario in a TOML file.
    ///
    /// Raises ScenarioError with file, line, key and bound if it cannot be read or flown.
    #[staticmethod]
    fn load(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Self> {
        let text = std::fs::read_to_string(&path).map_err(|error| {
            // With its number, the name and the class of the error are Python's own.
            PyOSError::new_err((error.raw_os_error(), error.kind().to_string(), path.clone()))
        })?;
        Self::read(py, &path.display().to_string(), &text, Vec::new())
    }

    /// The scenario in a TOML text; errors call it `name`.
    #[staticmethod]
    #[pyo3(signature = (text, name = "text"))]
    fn parse(py: Python<'_>, text: &str, name: &str) -> PyResult<Self> {
        Self::read(py, name, text, Vec::new())
    }

    /// Another scenario with values changed by dotted path, as in `set({"vehicle.mass": 0.95})`.
    ///
    /// Elements of arrays are written `vehicle.inertia[0]`. Values are numbers, strings, booleans, sequences
    /// of them, or mappings. Raises ScenarioError, whose `change` is the one at fault.
    fn set(&self, py: Python<'_>, changes: &Bound<'_, PyMapping>) -> PyResult<Self> {
        let mut all = self.changes.clone();
        for item in changes.items()?.iter() {
            let (path, value): (String, Bound<'_, PyAny>) = item.extract()?;
            all.push(format!("{path}={}", toml(&value)?));
        }
        Self::read(py, &self.origin, &self.text, all)
    }

    /// Its TOML, with all changes made.
    fn to_toml(&self) -> &str {
        self.loaded.text()
    }

    /// Short name, after which results are named.
    #[getter]
    fn name(&self) -> &str {
        &self.loaded.scenario().name
    }

    /// Description in a sentence or two.
    #[getter]
    fn description(&self) -> &str {
        &self.loaded.scenario().description
    }

    /// Duration of the flight (s).
    #[getter]
    fn duration(&self) -> f64 {
        self.loaded.scenario().duration
    }

    /// Seed of every random number.
    #[getter]
    fn seed(&self) -> u64 {
        self.loaded.scenario().seed
    }

    /// Fixed time between two control ticks (s).
    #[getter]
    fn step_period(&self) -> f32 {
        self.loaded.scenario().controller.step_period()
    }

    /// Control ticks of the flight.
    #[getter]
    fn ticks(&self) -> u64 {
        self.loaded.scenario().ticks()
    }

    /// True mass (kg), unknown to the controller.
    #[getter]
    fn mass(&self) -> f64 {
        self.loaded.scenario().vehicle.mass
    }

    /// True principal moments of inertia, shape (3,) (kg m^2), unknown to the controller.
    #[getter]
    fn inertia<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.loaded.scenario().vehicle.inertia.to_array())
    }

    /// State at the first tick, shape (13,), float64: position (m), velocity (m/s), attitude w x y z, rate (rad/s).
    #[getter]
    fn initial_state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &arrays::truth_numbers(&self.loaded.scenario().initial.state()))
    }

    /// Violated assumptions of the theorems, a sentence each.
    #[getter]
    fn broken_assumptions(&self) -> Vec<String> {
        self.loaded.scenario().broken_assumptions()
    }

    /// Configuration of the controller: the mapping of its `[controller]` table, as `Controller` takes it.
    #[getter]
    fn controller<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let json = serde_json::to_string(&self.loaded.scenario().controller);
        let json = json.map_err(|error| PyValueError::new_err(error.to_string()))?;
        py.import("json")?.call_method1("loads", (json,))
    }

    /// References at control ticks, shape (N, 24), float32.
    ///
    /// Columns: position, velocity, acceleration, jerk, snap (m/s^n, world), then `b2d` with two derivatives.
    fn reference<'py>(
        &self,
        py: Python<'py>,
        ticks: Vec<u64>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let trajectory = self.trajectory(py)?;
        let rows =
            ticks.iter().flat_map(|&tick| arrays::reference_numbers(&trajectory.reference(tick)));
        PyArray1::from_iter(py, rows).reshape([ticks.len(), REFERENCE])
    }

    fn __repr__(&self) -> String {
        let scenario = self.loaded.scenario();
        format!(
            "Scenario({:?}, duration={} s, seed={})",
            scenario.name, scenario.duration, scenario.seed
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
        let this = slf.get();
        let parse = slf.getattr("parse")?;
        Ok((parse, (this.loaded.text().to_owned(), this.origin.clone())))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.loaded.scenario() == other.loaded.scenario()
    }
}

/// Names of the built-in scenarios.
#[pyfunction]
pub fn built_in_scenarios() -> Vec<&'static str> {
    BUILT_IN.iter().map(|it| it.name).collect()
}

/// A Python value as the text of a TOML value.
#[pyfunction]
pub fn toml_value(value: &Bound<'_, PyAny>) -> PyResult<String> {
    Ok(toml(value)?.to_string())
}

/// A Python value as TOML.
pub fn toml(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_instance_of::<PyBool>() {
        return Ok(value.extract::<bool>()?.into());
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.extract::<i64>()?.into());
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(value.extract::<f64>()?.into());
    }
    if value.is_instance_of::<PyString>() {
        return Ok(value.extract::<String>()?.into());
    }
    if let Ok(mapping) = value.cast::<PyMapping>() {
        let mut table = toml_edit::InlineTable::new();
        for item in mapping.items()?.iter() {
            let (key, value): (String, Bound<'_, PyAny>) = item.extract()?;
            table.insert(key, toml(&value)?);
        }
        return Ok(table.into());
    }
    if let Ok(list) = value.call_method0("tolist") {
        // An array or a number of numpy.
        return toml(&list);
    }
    let items = value.try_iter().map_err(|_| {
        let kind = value.get_type();
        PyTypeError::new_err(format!(
            "no TOML for {kind}: use numbers, strings, booleans, sequences, mappings"
        ))
    })?;
    let array: PyResult<toml_edit::Array> = items.map(|item| toml(&item?)).collect();
    Ok(array?.into())
}
