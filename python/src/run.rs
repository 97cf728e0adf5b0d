//! One flight before every monitor, its columns kept in memory.

use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::Wrench;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sim::closed_loop::{Flight, ObservedController};
use sim::guarantee::{Guarantees, Requirement, Verdict};
use sim::observer::Observer;
use sim::plant::disturbance::DisturbanceSource;
use sim::plant::vehicle::Plant;
use sim::scenario::flight_with;

use crate::callable::{CallableDisturbance, CallableMonitor, CallablePlant, Failure, Law, Tick};
use crate::errors;
use crate::record::Recorder;
use crate::scenario::Scenario;

/// Control ticks between two looks at signals: some milliseconds of a flight without callables.
const CHUNK: u64 = 5_000;

/// Columns and verdicts of a flight, as `gyrfalcon.run` takes them.
#[pyclass(frozen, module = "gyrfalcon._core")]
pub struct FlightRecord {
    /// Columns by name.
    #[pyo3(get)]
    columns: Py<PyDict>,
    verdicts: Vec<Verdict>,
}

/// A verdict: name, equation, lower and upper bound, observed, margin, unit, time, passed.
type VerdictRow = (
    &'static str,
    &'static str,
    Option<f64>,
    Option<f64>,
    Option<f64>,
    Option<f64>,
    &'static str,
    Option<f64>,
    bool,
);

#[pymethods]
impl FlightRecord {
    /// Verdicts: name, equation, lower and upper bound, observed, margin, unit, time, passed.
    #[getter]
    fn verdicts(&self) -> Vec<VerdictRow> {
        self.verdicts.iter().map(verdict_row).collect()
    }
}

fn verdict_row(verdict: &Verdict) -> VerdictRow {
    let (lower, upper) = match verdict.requirement {
        Requirement::AtLeast(lower) => (Some(lower), None),
        Requirement::AtMost(upper) => (None, Some(upper)),
        Requirement::Inside(lower, upper) => (Some(lower), Some(upper)),
        Requirement::Information => (None, None),
    };
    let Verdict { name, equation, observed, margin, unit, time, pass, .. } = *verdict;
    (name, equation, lower, upper, observed, margin, unit, time, pass)
}

/// Flies a scenario; `gyrfalcon.run` wraps the result.
#[pyfunction]
#[pyo3(signature = (
    scenario, *, every = 1, controller = None, plant = None, disturbance = None, monitors = Vec::new(),
    progress = None, watch = None, watch_every = 10
))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub fn run(
    py: Python<'_>,
    scenario: &Scenario,
    every: u64,
    controller: Option<Py<PyAny>>,
    plant: Option<Py<PyAny>>,
    disturbance: Option<Py<PyAny>>,
    monitors: Vec<Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
    watch: Option<&Bound<'_, PyAny>>,
    watch_every: u64,
) -> PyResult<FlightRecord> {
    for (name, value) in [("every", every), ("watch_every", watch_every)] {
        if value == 0 {
            return Err(PyValueError::new_err(format!("{name} = 0 must be at least 1")));
        }
    }
    let (loaded, flown) = (&scenario.loaded, scenario.loaded.scenario());
    let failure = Failure::default();
    let of_callables = [&controller, &plant, &disturbance].into_iter().any(Option::is_some);
    let mut guarantees = match controller {
        None => flown.monitors(),
        Some(_) => Guarantees::of_any_controller(&flown.guarantees, &flown.effective_actuation()),
    };
    for monitor in &monitors {
        guarantees = guarantees.with(CallableMonitor::new(monitor, &failure)?);
    }
    let step_period = flown.controller.step_period();
    let plant = plant.map(|callable| CallablePlant {
        callable,
        failure: failure.clone(),
        truth: flown.initial.state(),
        command: Wrench::default(),
    });
    let disturbance = disturbance.map(|callable| CallableDisturbance {
        callable,
        failure: failure.clone(),
        step_period: step_period.into(),
        tick: 0,
    });
    let ticks = flown.ticks();
    let session = Session {
        ticks,
        failure: failure.clone(),
        callables: of_callables || !monitors.is_empty(),
        progress,
        watch: watch.map(|callable| (callable, watch_every)),
        guarantees,
        recorder: Recorder::new(ticks, every),
    };
    match controller {
        None => {
            let flight = loaded.flight().map_err(|error| errors::scenario(py, &error))?;
            session.fly_with(py, flight, plant, disturbance)
        }
        Some(callable) => {
            let law = Law { callable, step_period, failure };
            let flight = flight_with(law, flown)
                .map_err(|error| errors::scenario(py, &loaded.refusal(&error)))?;
            session.fly_with(py, flight, plant, disturbance)
        }
    }
}

/// A flight about to be flown: its observers, and those that wait for it.
struct Session<'a, 'py> {
    ticks: u64,
    failure: Failure,
    /// Python takes part in every tick.
    callables: bool,
    progress: Option<&'a Bound<'py, PyAny>>,
    /// Receives every so many ticks.
    watch: Option<(&'a Bound<'py, PyAny>, u64)>,
    guarantees: Guarantees,
    recorder: Recorder,
}

/// The latest tick.
#[derive(Debug, Default)]
struct Latest(Option<sim::tick::Tick>);

impl Observer for Latest {
    fn observe(&mut self, tick: &sim::tick::Tick) {
        self.0 = Some(*tick);
    }
}

impl Session<'_, '_> {
    /// Flies with what is given in place of the scenario's plant and disturbance.
    fn fly_with<C, T>(
        self,
        py: Python<'_>,
        flight: Flight<C, T>,
        plant: Option<CallablePlant>,
        disturbance: Option<CallableDisturbance>,
    ) -> PyResult<FlightRecord>
    where
        C: ObservedController + Send,
        C::State: Send,
        T: Trajectory + Send,
    {
        match (plant, disturbance) {
            (None, None) => self.fly(py, flight),
            (Some(plant), None) => self.fly(py, flight.with_plant(plant)),
            (None, Some(disturbance)) => self.fly(py, flight.with_disturbance(disturbance)),
            (Some(plant), Some(disturbance)) => {
                self.fly(py, flight.with_plant(plant).with_disturbance(disturbance))
            }
        }
    }

    /// Flies to the end. Without callables in chunks without the interpreter's lock, and a signal ends the
    /// flight between two; with callables tick by tick, and their first exception ends it. A chunk ends at
    /// each tick that is watched, of which the first is one.
    fn fly<C, T, P, D>(
        self,
        py: Python<'_>,
        mut flight: Flight<C, T, P, D>,
    ) -> PyResult<FlightRecord>
    where
        C: ObservedController + Send,
        C::State: Send,
        T: Trajectory + Send,
        P: Plant + Send,
        D: DisturbanceSource + Send,
    {
        let Self { ticks, failure, callables, progress, watch, guarantees, recorder } = self;
        let mut observers = ((guarantees, recorder), watch.map(|_| Latest::default()));
        while flight.tick() < ticks {
            let chunk = match (watch, flight.tick()) {
                (None, _) => CHUNK,
                (Some(_), 0) => 1,
                (Some((_, every)), _) => every,
            };
            let end = ticks.min(flight.tick() + chunk);
            if callables {
                while flight.tick() < end {
                    flight.observe(1, &mut observers);
                    failure.check()?;
                }
            } else {
                py.detach(|| flight.observe_in_blocks(end - flight.tick(), &mut observers));
            }
            py.check_signals()?;
            if let Some(progress) = progress
                && (flight.tick() % CHUNK < chunk || flight.tick() == ticks)
            {
                progress.call1((flight.tick(), ticks))?;
            }
            if let (Some((watch, _)), Some(Latest(Some(tick)))) = (watch, &observers.1) {
                watch.call1((Tick { tick: *tick },))?;
            }
        }
        let ((guarantees, recorder), _) = observers;
        let columns = recorder.into_arrays(py)?.unbind();
        Ok(FlightRecord { columns, verdicts: guarantees.verdicts() })
    }
}
