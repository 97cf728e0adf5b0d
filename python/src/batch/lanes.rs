//! Many closed loops, or many vehicles under the caller's wrenches, at once.

use std::sync::{Mutex, PoisonError};

use ctrl_core::controller::{StepOutput, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::{AnyTrajectory, Trajectory};
use ctrl_core::vehicle::{VehicleState, Wrench};
use glam::Vec3;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use rayon::ThreadPool;
use rayon::prelude::*;
use sim::closed_loop::{Flight, ObservedController};
use sim::scenario::{ScenarioFlight, flight_with};

use super::{GRAIN, check_lane, input, on_threads, output, pool};
use crate::arrays::{self, REFERENCE, STATE, WRENCH};
use crate::errors;
use crate::scenario::Scenario;

/// Control ticks of all lanes together between two looks at signals: some tens of milliseconds.
const CHUNK: u64 = 200_000;

/// A controller that holds the wrench that Python gives.
struct Commanded {
    wrench: Mutex<Wrench>,
    step_period: f32,
}

impl TrackingController for Commanded {
    type State = ();

    fn initial_state(&self) {}

    fn step(&self, (): &mut (), _: &VehicleState, _: &Reference) -> StepOutput {
        StepOutput::from(*self.wrench.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

impl ObservedController for Commanded {}

/// A flight with the trajectory that it flies.
struct Lane<F> {
    flight: F,
    trajectory: AnyTrajectory,
}

/// The flights of a batch, with or without a law of their own.
trait LaneFlight: Sized + Send {
    /// The flight of `flown`, which is that of `scenario` but for the seed.
    fn new(py: Python<'_>, scenario: &Scenario, flown: &sim::scenario::Scenario) -> PyResult<Self>;
    fn advance(&mut self, ticks: u64);
    fn tick(&self) -> u64;
    fn state(&self) -> VehicleState;
}

impl LaneFlight for ScenarioFlight {
    fn new(py: Python<'_>, scenario: &Scenario, flown: &sim::scenario::Scenario) -> PyResult<Self> {
        flown.flight().map_err(|error| errors::scenario(py, &scenario.loaded.refusal(&error)))
    }

    fn advance(&mut self, ticks: u64) {
        self.advance(ticks);
    }

    fn tick(&self) -> u64 {
        self.tick()
    }

    fn state(&self) -> VehicleState {
        self.truth().measured()
    }
}

type CommandedFlight = Flight<Commanded, AnyTrajectory>;

impl LaneFlight for CommandedFlight {
    fn new(py: Python<'_>, scenario: &Scenario, flown: &sim::scenario::Scenario) -> PyResult<Self> {
        let step_period = flown.controller.step_period();
        let held = Commanded { wrench: Mutex::new(Wrench::default()), step_period };
        flight_with(held, flown)
            .map_err(|error| errors::scenario(py, &scenario.loaded.refusal(&error)))
    }

    fn advance(&mut self, ticks: u64) {
        self.advance(ticks);
    }

    fn tick(&self) -> u64 {
        self.tick()
    }

    fn state(&self) -> VehicleState {
        self.truth().measured()
    }
}

/// Lanes and their threads.
struct Lanes<F> {
    lanes: Vec<Lane<F>>,
    pool: Option<ThreadPool>,
}

impl<F: LaneFlight> Lanes<F> {
    fn new(
        py: Python<'_>,
        scenarios: &Bound<'_, PyAny>,
        seeds: Option<Vec<u64>>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let one = scenarios.extract::<Scenario>().ok();
        let lanes: PyResult<_> = match (one, seeds) {
            (Some(scenario), None) => Lane::new(py, &scenario, None).map(|lane| vec![lane]),
            (Some(scenario), Some(seeds)) => {
                seeds.into_iter().map(|seed| Lane::new(py, &scenario, Some(seed))).collect()
            }
            (None, None) => {
                let scenarios: Vec<Scenario> = scenarios.extract()?;
                scenarios.iter().map(|scenario| Lane::new(py, scenario, None)).collect()
            }
            (None, Some(_)) => {
                Err(PyTypeError::new_err("seeds go with one scenario, not with several"))
            }
        };
        Ok(Self { lanes: lanes?, pool: pool(threads)? })
    }

    /// Flies every lane on, and looks for signals now and then.
    fn advance(&mut self, py: Python<'_>, ticks: u64) -> PyResult<()> {
        let Self { lanes, pool } = self;
        let chunk = (CHUNK / lanes.len().max(1) as u64).max(1);
        let mut left = ticks;
        while left > 0 {
            let now = chunk.min(left);
            on_threads(py, pool.as_ref(), || {
                let grain = if now == 1 { GRAIN } else { 1 };
                let lanes = lanes.par_iter_mut().with_min_len(grain);
                lanes.for_each(|lane| lane.flight.advance(now));
            });
            left -= now;
            py.check_signals()?;
        }
        Ok(())
    }

    fn states<'py>(
        &self,
        py: Python<'py>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let (result, mut rows) = output(py, out, self.lanes.len(), STATE)?;
        for (row, lane) in rows.as_slice_mut()?.chunks_exact_mut(STATE).zip(&self.lanes) {
            row.copy_from_slice(&arrays::state_numbers(&lane.flight.state()));
        }
        Ok(result)
    }

    fn references<'py>(
        &self,
        py: Python<'py>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let (result, mut rows) = output(py, out, self.lanes.len(), REFERENCE)?;
        for (row, lane) in rows.as_slice_mut()?.chunks_exact_mut(REFERENCE).zip(&self.lanes) {
            let reference = lane.trajectory.reference(lane.flight.tick());
            row.copy_from_slice(&arrays::reference_numbers(&reference));
        }
        Ok(result)
    }

    fn ticks<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        PyArray1::from_iter(py, self.lanes.iter().map(|lane| lane.flight.tick()))
    }

    fn replace(&mut self, py: Python<'_>, lane: usize, scenario: &Scenario) -> PyResult<()> {
        check_lane(lane, self.lanes.len())?;
        self.lanes[lane] = Lane::new(py, scenario, None)?;
        Ok(())
    }
}

impl<F: LaneFlight> Lane<F> {
    fn new(py: Python<'_>, scenario: &Scenario, seed: Option<u64>) -> PyResult<Self> {
        let mut flown = scenario.loaded.scenario().clone();
        flown.seed = seed.unwrap_or(flown.seed);
        Ok(Self { flight: F::new(py, scenario, &flown)?, trajectory: scenario.trajectory(py)? })
    }
}

/// Many closed loops at once: controller, vehicle and disturbance of a scenario in every lane.
///
/// `scenarios`: one Scenario per lane; or one Scenario with `seeds`, a lane per seed. `threads`: worker
/// threads, one per core unless given. Every lane has the bits of its flight alone.
#[pyclass(module = "gyrfalcon")]
pub struct BatchFlight(Lanes<ScenarioFlight>);

/// Many vehicles at once under the wrenches that the caller gives: the plant for a learner's environment.
///
/// `scenarios`, `seeds`, `threads`: as those of BatchFlight; the scenarios' controllers do not act.
#[pyclass(module = "gyrfalcon")]
pub struct BatchVehicle(Lanes<CommandedFlight>);

macro_rules! lanes_for_python {
    ($class:ident { $($own:tt)* }) => {
        #[pymethods]
        impl $class {
            #[new]
            #[pyo3(signature = (scenarios, *, seeds = None, threads = None))]
            fn new(
                py: Python<'_>,
                scenarios: &Bound<'_, PyAny>,
                seeds: Option<Vec<u64>>,
                threads: Option<usize>,
            ) -> PyResult<Self> {
                Lanes::new(py, scenarios, seeds, threads).map(Self)
            }

            fn __len__(&self) -> usize {
                self.0.lanes.len()
            }

            /// States now, shape (N, 13), float32: position (m), velocity (m/s), attitude w x y z, rate
            /// (rad/s, body); written to `out` if it is given.
            #[pyo3(signature = (*, out = None))]
            fn states<'py>(
                &self,
                py: Python<'py>,
                out: Option<&Bound<'py, PyAny>>,
            ) -> PyResult<Bound<'py, PyArray2<f32>>> {
                self.0.states(py, out)
            }

            /// References now, shape (N, 24), float32, as `Scenario.reference`; written to `out` if it is
            /// given.
            #[pyo3(signature = (*, out = None))]
            fn references<'py>(
                &self,
                py: Python<'py>,
                out: Option<&Bound<'py, PyAny>>,
            ) -> PyResult<Bound<'py, PyArray2<f32>>> {
                self.0.references(py, out)
            }

            /// Control ticks flown, shape (N,), uint64.
            #[getter]
            fn ticks<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
                self.0.ticks(py)
            }

            /// Puts a scenario into a lane, at its first tick.
            fn replace(&mut self, py: Python<'_>, lane: usize, scenario: &Scenario) -> PyResult<()> {
                self.0.replace(py, lane, scenario)
            }

            $($own)*
        }
    };
}

lanes_for_python!(BatchFlight {
    /// Flies every lane `ticks` control ticks on; returns the states, shape (N, 13), float32, in `out` if it
    /// is given.
    #[pyo3(signature = (ticks = 1, *, out = None))]
    fn advance<'py>(
        &mut self,
        py: Python<'py>,
        ticks: u64,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.0.advance(py, ticks)?;
        self.0.states(py, out)
    }
});

lanes_for_python!(BatchVehicle {
    /// Flies every vehicle `ticks` control ticks on under a held wrench; returns the states, shape (N, 13),
    /// float32, in `out` if it is given.
    ///
    /// `wrenches`: shape (N, 4), float32, C order: thrust (N), torque (N m, body). Raises ValueError, with
    /// nothing flown, if a number is not finite.
    #[pyo3(signature = (wrenches, ticks = 1, *, out = None))]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        wrenches: &Bound<'py, PyAny>,
        ticks: u64,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let wrenches = input(wrenches, "wrenches", self.0.lanes.len(), &[WRENCH])?;
        let numbers = wrenches.as_slice()?;
        if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
            let (lane, value) = (index / WRENCH, numbers[index]);
            let message = format!("wrenches: lane {lane} has {value}, it must be finite");
            return Err(PyValueError::new_err(message));
        }
        for (lane, row) in self.0.lanes.iter().zip(numbers.chunks_exact(WRENCH)) {
            let torque_body = Vec3::new(row[1], row[2], row[3]);
            let held = &lane.flight.controller().wrench;
            *held.lock().unwrap_or_else(PoisonError::into_inner) =
                Wrench { thrust: row[0], torque_body };
        }
        drop(wrenches);
        self.0.advance(py, ticks)?;
        self.0.states(py, out)
    }
});
