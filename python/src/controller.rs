//! One controller, stepped by hand.

use ctrl_core::config::Checkpoint;
use ctrl_core::controller::{
    AdaptiveController, AnyController, AnyControllerState, Auxiliary, ControllerConfig, Estimates,
    Intermediates, StepStatus, TrackingController,
};
use ctrl_core::jet::Jet;
use glam::Vec3;
use numpy::PyArray1;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Singles, quaternion, vector};
use crate::errors;
use crate::scenario::Scenario;

/// Output of one step of a controller: wrench, torque demand and status.
#[pyclass(frozen, module = "gyrfalcon")]
pub struct StepOutput {
    pub output: ctrl_core::controller::StepOutput,
}

#[pymethods]
impl StepOutput {
    /// Thrust `f` along body z (N), (21).
    #[getter]
    fn thrust(&self) -> f32 {
        self.output.wrench.thrust
    }

    /// Torque `tau`, shape (3,), float32, body axes (N m), (34), (37).
    #[getter]
    fn torque<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        vector(py, self.output.wrench.torque_body)
    }

    /// Torque before saturation, shape (3,), float32 (N m), (50); controller 1: the torque itself.
    #[getter]
    fn torque_demand<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        vector(py, self.output.torque_demand_body)
    }

    /// Thrust and torque, shape (4,), float32 (N, N m).
    #[getter]
    fn wrench<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        let wrench = &self.output.wrench;
        let [x, y, z] = wrench.torque_body.to_array();
        PyArray1::from_slice(py, &[wrench.thrust, x, y, z])
    }

    /// Status bits; `gyrfalcon.Status` names them.
    #[getter]
    fn status(&self) -> u16 {
        self.output.status.bits()
    }

    fn __repr__(&self) -> String {
        let wrench = &self.output.wrench;
        let [x, y, z] = wrench.torque_body.to_array();
        format!(
            "StepOutput(thrust={} N, torque=[{x}, {y}, {z}] N m, status={})",
            wrench.thrust,
            self.output.status.bits()
        )
    }
}

/// Configuration from a scenario, or from the mapping of a scenario's `[controller]` table.
pub fn configuration(config: &Bound<'_, PyAny>) -> PyResult<ControllerConfig> {
    if let Ok(scenario) = config.cast::<Scenario>() {
        return Ok(scenario.get().loaded.scenario().controller);
    }
    let py = config.py();
    let json = py.import("json")?.call_method1("dumps", (config,)).map_err(|error| {
        let message = "a controller needs a Scenario, or the mapping of its [controller] table";
        let wrong = PyTypeError::new_err(message);
        wrong.set_cause(py, Some(error));
        wrong
    })?;
    serde_json::from_str(json.extract()?)
        .map_err(|error| PyValueError::new_err(format!("controller: {error}")))
}

/// A controller of the paper with its memory, stepped by hand.
///
/// `config` is a Scenario, or the mapping of its `[controller]` table, as `Scenario.controller` gives it.
/// The step is the firmware's: the same bits. Raises ConfigError if a value is outside the set in which the
/// guarantees hold.
#[pyclass(module = "gyrfalcon")]
pub struct Controller {
    law: AnyController,
    state: AnyControllerState,
    /// Committed steps since the first one or the last `resume`.
    steps: u64,
    /// Time before them (s).
    elapsed: f32,
    latest: Option<Intermediates>,
}

#[pymethods]
impl Controller {
    #[new]
    fn new(py: Python<'_>, config: &Bound<'_, PyAny>) -> PyResult<Self> {
        let law = configuration(config)?.build().map_err(|error| errors::config(py, &error))?;
        Ok(Self { law, state: law.initial_state(), steps: 0, elapsed: 0.0, latest: None })
    }

    /// Evaluates the law and moves on by one step period.
    ///
    /// `state`: shape (13,): position (m), velocity (m/s), attitude w x y z (body to world), rate (rad/s, body).
    /// `reference`: shape (24,): position and four derivatives (world), `b2d` and two derivatives; or
    /// shape (18,) without the derivatives of `b2d`. Both are rounded to float32. Total: whatever is not
    /// finite gives the held output, with its bits in `status`.
    fn step(&mut self, state: Singles<'_>, reference: Singles<'_>) -> PyResult<StepOutput> {
        let (vehicle, reference) = (arrays::state(&state)?, arrays::reference(&reference)?);
        let latest = self.latest.insert(Intermediates::default());
        let output =
            self.law.step_observed(&mut self.state, &vehicle, &reference, |seen| *latest = *seen);
        self.steps += u64::from(!output.status.contains(StepStatus::OUTPUT_HELD));
        Ok(StepOutput { output })
    }

    /// Current estimates by name: `inverse_mass` (1/kg), `inertia` (kg m^2), `inverse_inertia`,
    /// `gyroscopic_ratio`; zero where the law has none.
    #[getter]
    fn estimates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Estimates { inverse_mass, inertia, inverse_inertia, gyroscopic_ratio } =
            self.law.estimates(&self.state);
        let named = PyDict::new(py);
        named.set_item("inverse_mass", inverse_mass)?;
        named.set_item("inertia", vector(py, inertia))?;
        named.set_item("inverse_inertia", vector(py, inverse_inertia))?;
        named.set_item("gyroscopic_ratio", vector(py, gyroscopic_ratio))?;
        Ok(named)
    }

    /// Auxiliary system of controller 2 by name: `attitude` (38), w x y z, and `rate` (39) (rad/s).
    #[getter]
    fn auxiliary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Auxiliary { attitude, rate } = self.law.auxiliary(&self.state);
        let named = PyDict::new(py);
        named.set_item("attitude", quaternion(py, attitude))?;
        named.set_item("rate", vector(py, rate))?;
        Ok(named)
    }

    /// Every intermediate quantity of the latest step by name; all zero when the output was held.
    ///
    /// Names, units and equations are those of the core's `Intermediates`. Raises ValueError before the
    /// first step.
    #[getter]
    fn intermediates<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let latest = self.latest.as_ref();
        let latest = latest.ok_or_else(|| PyValueError::new_err("no step has been made"))?;
        named_intermediates(py, latest)
    }

    /// Point of resumption by name: estimates, auxiliary system and time since the first step (s).
    fn checkpoint<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let estimates = self.law.estimates(&self.state);
        let checkpoint = Checkpoint {
            elapsed: self.elapsed + (self.steps as f64 * f64::from(self.law.step_period())) as f32,
            inverse_mass: estimates.inverse_mass,
            inertia: estimates.inertia,
            inverse_inertia: estimates.inverse_inertia,
            gyroscopic_ratio: estimates.gyroscopic_ratio,
            auxiliary: self.law.auxiliary(&self.state),
            lasting: self.law.lasting(&self.state),
        };
        let json = serde_json::to_string(&checkpoint);
        let json = json.map_err(|error| PyValueError::new_err(error.to_string()))?;
        py.import("json")?.call_method1("loads", (json,))
    }

    /// Goes on from a checkpoint: with its estimates, as a vehicle does after a restart.
    ///
    /// Raises ConfigError if a value is outside its set; the memory is then unchanged.
    fn resume(&mut self, py: Python<'_>, checkpoint: &Bound<'_, PyAny>) -> PyResult<()> {
        let json = py.import("json")?.call_method1("dumps", (checkpoint,))?;
        let checkpoint: Checkpoint = serde_json::from_str(json.extract()?)
            .map_err(|error| PyValueError::new_err(format!("checkpoint: {error}")))?;
        let resumed = match &self.law {
            AnyController::RobustAdaptive(law) => {
                law.resume(&checkpoint).map(AnyControllerState::RobustAdaptive)
            }
            AnyController::Saturated(law) => {
                law.resume(&checkpoint).map(AnyControllerState::Saturated)
            }
        };
        self.state = resumed.map_err(|error| errors::config(py, &error))?;
        (self.steps, self.elapsed, self.latest) = (0, checkpoint.elapsed, None);
        Ok(())
    }

    /// Goes back to the memory before the first step.
    fn reset(&mut self) {
        self.state = self.law.initial_state();
        (self.steps, self.elapsed, self.latest) = (0, 0.0, None);
    }

    /// A controller with the same memory, to the bit.
    fn copy(&self) -> Self {
        let Self { law, state, steps, elapsed, latest } = *self;
        Self { law, state, steps, elapsed, latest }
    }

    /// Fixed time between two steps (s).
    #[getter]
    fn step_period(&self) -> f32 {
        self.law.step_period()
    }

    /// The set in which every wrench lies: least and largest thrust (N), largest torque about each body axis
    /// (N m), shape (3,).
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> (f32, f32, Bound<'py, PyArray1<f32>>) {
        let bounds = self.law.bounds();
        let torque = PyArray1::from_slice(py, &bounds.torque_max.to_array());
        (bounds.thrust_min, bounds.thrust_max, torque)
    }
}

/// The quantities by name. Every field is taken apart here: a new one does not compile until it is named.
fn named_intermediates<'py>(
    py: Python<'py>,
    intermediates: &Intermediates,
) -> PyResult<Bound<'py, PyDict>> {
    let Intermediates {
        position_error_world,
        velocity_error_world,
        g,
        alpha,
        alpha_dot,
        alpha_ddot,
        thrust,
        desired_rate,
        desired_rate_dot,
        attitude_error,
        mu,
        mu_dot,
        rate_error,
        torque_demand_body,
        torque_body,
        acting_torque_body,
        inverse_mass_rate,
        inertia_rate,
        inverse_inertia_rate,
        gyroscopic_ratio_rate,
        auxiliary_attitude_rate,
        auxiliary_rate_dot,
        lasting_acceleration_rate,
        lasting_torque_rate,
    } = *intermediates;
    let named = PyDict::new(py);
    macro_rules! vectors {
        ($($name:ident),*) => { $(named.set_item(stringify!($name), vector(py, $name))?;)* };
    }
    vectors!(position_error_world, velocity_error_world, g, alpha, alpha_dot, alpha_ddot);
    named.set_item("thrust", thrust)?;
    vectors!(desired_rate, desired_rate_dot);
    named.set_item("attitude_error", quaternion(py, attitude_error))?;
    vectors!(mu, mu_dot, rate_error, torque_demand_body, torque_body, acting_torque_body);
    named.set_item("inverse_mass_rate", inverse_mass_rate)?;
    vectors!(inertia_rate, inverse_inertia_rate, gyroscopic_ratio_rate);
    vectors!(auxiliary_attitude_rate, auxiliary_rate_dot);
    vectors!(lasting_acceleration_rate, lasting_torque_rate);
    Ok(named)
}

/// Reference, shape (24,), along a motion (15 numbers) with a heading; `gyrfalcon.rotorpy.facing` explains it.
#[pyfunction]
pub fn facing<'py>(
    py: Python<'py>,
    motion: Singles<'py>,
    yaw: f32,
    yaw_rate: f32,
    yaw_acceleration: f32,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let motion = arrays::fixed::<f32, 15>(motion.as_array().iter(), "derivatives")?;
    let mut row = [0.0; arrays::STEADY_REFERENCE];
    row[..15].copy_from_slice(&motion);
    let (sine, cosine) = libm::sincosf(yaw);
    let (forward, left) = (Vec3::new(cosine, sine, 0.0), Vec3::new(-sine, cosine, 0.0));
    let forward =
        Jet::new(forward, yaw_rate * left, yaw_acceleration * left - yaw_rate * yaw_rate * forward);
    let reference = arrays::reference_from(&row).facing(forward);
    Ok(PyArray1::from_slice(py, &arrays::reference_numbers(&reference)))
}
