//! One flight before every monitor, its columns kept in memory.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sim::guarantee::{Guarantees, Requirement, Verdict};

use crate::errors;
use crate::record::Recorder;
use crate::scenario::Scenario;

/// Control ticks between two looks at signals: some milliseconds.
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

/// Flies `ticks` ticks in chunks without the interpreter's lock; a signal ends the flight between two.
fn in_chunks(
    py: Python<'_>,
    ticks: u64,
    progress: Option<&Bound<'_, PyAny>>,
    mut fly: impl FnMut(u64) + Send,
) -> PyResult<()> {
    let mut flown = 0;
    while flown < ticks {
        let now = CHUNK.min(ticks - flown);
        py.detach(|| fly(now));
        flown += now;
        py.check_signals()?;
        if let Some(progress) = progress {
            progress.call1((flown, ticks))?;
        }
    }
    Ok(())
}

/// Flies a scenario; `gyrfalcon.run` wraps the result.
#[pyfunction]
#[pyo3(signature = (scenario, *, every = 1, progress = None))]
pub fn run(
    py: Python<'_>,
    scenario: &Scenario,
    every: u64,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<FlightRecord> {
    if every == 0 {
        return Err(PyValueError::new_err("every = 0 must be at least 1"));
    }
    let loaded = &scenario.loaded;
    let ticks = loaded.scenario().ticks();
    let mut flight = loaded.flight().map_err(|error| errors::scenario(py, &error))?;
    let mut observers = (loaded.scenario().monitors(), Recorder::new(ticks, every));
    in_chunks(py, ticks, progress, |now| flight.observe(now, &mut observers))?;
    record(py, observers)
}

fn record(
    py: Python<'_>,
    (guarantees, recorder): (Guarantees, Recorder),
) -> PyResult<FlightRecord> {
    let columns = recorder.into_arrays(py)?.unbind();
    Ok(FlightRecord { columns, verdicts: guarantees.verdicts() })
}
