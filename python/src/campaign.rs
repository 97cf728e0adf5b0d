//! Campaigns, shares of them, and gains.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sil_host::campaign::report::failure_probability::FailureProbability;
use sil_host::campaign::{
    BuiltInCampaign, Campaign as Definition, CampaignError, CampaignOptions, CampaignOverrides,
    CampaignProgress, Shard, Summary, fly, merge,
};
use sil_host::tune::check::check_watched;
use sil_host::tune::request::WantedOptions;
use sil_host::tune::{TuneError, propose, report};

use crate::errors;

/// Time between two looks at signals and at the progress.
const LOOK: Duration = Duration::from_millis(50);

/// Campaign of a name, file or text, checked before the first flight; `gyrfalcon.campaign` flies it.
#[pyclass(frozen, module = "gyrfalcon._core")]
pub struct Campaign(Arc<Definition>);

#[pymethods]
impl Campaign {
    /// The built-in campaign, or that of the file, called `name`.
    #[staticmethod]
    #[pyo3(signature = (name, changes, runs = None, first_seed = None))]
    fn open(
        py: Python<'_>,
        name: &str,
        changes: Vec<String>,
        runs: Option<u32>,
        first_seed: Option<u32>,
    ) -> PyResult<Self> {
        let overrides = CampaignOverrides { runs, first_seed };
        let opened = Definition::open(name, &overrides, &changes);
        opened.map(|it| Self(Arc::new(it))).map_err(|error| raise(py, &error))
    }

    /// The campaign of a TOML text, which is complete in itself.
    #[staticmethod]
    #[pyo3(signature = (text, changes, runs = None, first_seed = None))]
    fn parse(
        py: Python<'_>,
        text: &str,
        changes: Vec<String>,
        runs: Option<u32>,
        first_seed: Option<u32>,
    ) -> PyResult<Self> {
        let overrides = CampaignOverrides { runs, first_seed };
        let parsed = Definition::parse("text", text, Path::new(""), &overrides, &changes);
        parsed.map(|it| Self(Arc::new(it))).map_err(|error| raise(py, &error))
    }

    /// Its name, after which its directory of results is called.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// Number of runs.
    #[getter]
    fn runs(&self) -> u32 {
        self.0.runs()
    }

    /// True if each run decides on the next: with `[stop]` or `[splitting]` it cannot be shared.
    #[getter]
    fn is_adaptive(&self) -> bool {
        let definition = self.0.definition();
        definition.stop.is_some() || definition.splitting.is_some()
    }

    /// Its definition as TOML, complete in itself: with the texts of all scenarios.
    fn to_toml(&self) -> String {
        self.0.text()
    }

    /// Flies the missing runs of a share below `out` and returns its summary as JSON.
    ///
    /// `progress` is called with the runs that are flown, the runs in all, and how many violated a guarantee
    /// since the call began. KeyboardInterrupt ends it after
    /// the runs that are in the air; what is written is continued by the next call.
    #[pyo3(signature = (out, *, shard = "1/1", threads = None, restart = false, progress = None))]
    fn fly(
        &self,
        py: Python<'_>,
        out: PathBuf,
        shard: &str,
        threads: Option<u32>,
        restart: bool,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<String> {
        let shard: Shard = shard.parse().map_err(PyValueError::new_err)?;
        if threads == Some(0) {
            return Err(PyValueError::new_err("threads: 0 must be at least 1"));
        }
        let options = CampaignOptions { out, restart, shard, threads };
        let (campaign, counter) = (Arc::clone(&self.0), Arc::new(Counter::default()));
        let flying = Arc::clone(&counter);
        let flown = watched(
            py,
            move || fly(&campaign, &options, &*flying),
            || progress.map_or(Ok(()), |progress| counter.show(progress)),
            || counter.cancelled.store(true, Ordering::Relaxed),
        )?;
        match flown {
            Ok(summary) => {
                progress.map_or(Ok(()), |progress| counter.show(progress))?;
                Ok(summary.json())
            }
            Err(error) => Err(raise(py, &error)),
        }
    }
}

/// Number of runs flown, and the wish to stop.
#[derive(Debug, Default)]
struct Counter {
    /// Runs in all; zero before the campaign has begun.
    total: AtomicU32,
    /// Runs flown earlier.
    before: AtomicU32,
    done: AtomicU32,
    violated: AtomicU32,
    cancelled: AtomicBool,
    shown: AtomicBool,
}

impl Counter {
    /// Calls `progress` once the campaign has begun, first with what was flown earlier.
    fn show(&self, progress: &Bound<'_, PyAny>) -> PyResult<()> {
        // Stored last, with all before it.
        let total = self.total.load(Ordering::Acquire);
        if total == 0 {
            return Ok(());
        }
        if !self.shown.swap(true, Ordering::Relaxed) {
            progress.call1((self.before.load(Ordering::Relaxed), total, 0))?;
        }
        let [done, violated] =
            [&self.done, &self.violated].map(|count| count.load(Ordering::Relaxed));
        progress.call1((done, total, violated)).map(drop)
    }
}

impl CampaignProgress for Counter {
    fn begin(&self, total: u32, before: u32) {
        self.before.store(before, Ordering::Relaxed);
        self.done.store(before, Ordering::Relaxed);
        self.total.store(total, Ordering::Release);
    }

    fn run_completed(&self, _: f64, violated: bool) {
        self.violated.fetch_add(u32::from(violated), Ordering::Relaxed);
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Does `work` on a thread of its own, and looks for signals meanwhile. A signal or an error of `look` cancels
/// it; it is raised when the work has ended.
fn watched<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
    look: impl Fn() -> PyResult<()>,
    cancel: impl Fn(),
) -> PyResult<T> {
    let thread = std::thread::Builder::new().name("campaign".to_owned()).spawn(work)?;
    let thread = Mutex::new(Some(thread));
    let mut raised = None;
    loop {
        let ended = py.detach(|| {
            let guard = thread.lock().unwrap_or_else(PoisonError::into_inner);
            let ended = guard.as_ref().is_none_or(std::thread::JoinHandle::is_finished);
            if !ended {
                std::thread::park_timeout(LOOK);
            }
            ended
        });
        if ended {
            break;
        }
        if let Err(error) = py.check_signals().and_then(|()| look()) {
            cancel();
            raised.get_or_insert(error);
        }
    }
    let thread = thread.into_inner().unwrap_or_else(PoisonError::into_inner);
    let result = thread.map(|thread| py.detach(|| thread.join()));
    match (raised, result) {
        (Some(error), _) => Err(error),
        (None, Some(Ok(result))) => Ok(result),
        _ => Err(PyRuntimeError::new_err("a worker thread panicked")),
    }
}

/// Joins the results of shares, in any order, to the bytes of the campaign in one go, below `out`; the
/// summary as JSON.
#[pyfunction]
pub fn merge_shards(py: Python<'_>, directories: Vec<PathBuf>, out: PathBuf) -> PyResult<String> {
    let merged = py.detach(|| merge(&directories, &out));
    merged.map(|summary: Summary| summary.json()).map_err(|error| raise(py, &error))
}

/// Bounds of Clopper and Pearson on a probability from a count of independent draws: the two-sided interval at 95 %, and the
/// one-sided upper bound; none without draws.
#[pyfunction]
pub fn failure_probability(violated: u64, runs: u64) -> Option<(f64, f64, f64)> {
    let bounds = FailureProbability::observed(violated, runs)?;
    Some((bounds.lower, bounds.upper, bounds.below))
}

/// Names of the built-in campaigns.
#[pyfunction]
pub fn built_in_campaigns() -> Vec<&'static str> {
    BuiltInCampaign::ALL.iter().map(|it| it.name).collect()
}

/// Proposes gains; the proposed scenario as TOML, the report as text, the report as JSON.
#[pyfunction]
#[pyo3(signature = (
    vehicle, *, position_bandwidth = None, attitude_bandwidth = None, heading_bandwidth = None,
    damping = None, margin = None, position_range = None, attitude_range = None, phase_margin = None,
    rate_noise = None, noise_torque_max = None, rotation_slope = None, return_speed = None,
    rotor_lead = None, steady_acceleration = None, steady_torque = None, fly_check = true, progress = None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub fn tune_gains(
    py: Python<'_>,
    vehicle: String,
    position_bandwidth: Option<f64>,
    attitude_bandwidth: Option<f64>,
    heading_bandwidth: Option<f64>,
    damping: Option<f64>,
    margin: Option<f64>,
    position_range: Option<f64>,
    attitude_range: Option<f64>,
    phase_margin: Option<f64>,
    rate_noise: Option<f64>,
    noise_torque_max: Option<f64>,
    rotation_slope: Option<f64>,
    return_speed: Option<f64>,
    rotor_lead: Option<f64>,
    steady_acceleration: Option<f64>,
    steady_torque: Option<f64>,
    fly_check: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, String, String)> {
    let wanted = WantedOptions {
        position_bandwidth,
        attitude_bandwidth,
        heading_bandwidth,
        damping,
        margin,
        position_range,
        attitude_range,
        phase_margin_deg: phase_margin,
        rotation_slope,
        noise_torque_max,
        rate_noise,
        return_speed,
        rotor_lead,
        steady_acceleration,
        steady_torque,
    };
    let counter = Arc::new(Counter::default());
    let flying = Arc::clone(&counter);
    let tuned = watched(
        py,
        move || {
            let proposal = propose(&vehicle, wanted)?;
            let checked = fly_check.then(|| check_watched(&proposal, &*flying));
            let checked = checked.transpose().map_err(TuneError::Check)?;
            let passed = checked.as_ref().is_none_or(|check| check.passed());
            let table = report::table(&proposal, checked.as_ref());
            let json = report::json(&proposal, checked.as_ref(), passed);
            Ok((proposal.scenario(), table, json))
        },
        || progress.map_or(Ok(()), |progress| counter.show(progress)),
        || counter.cancelled.store(true, Ordering::Relaxed),
    )?;
    tuned.map_err(|error: TuneError| match &error {
        TuneError::Request(error) => errors::scenario(py, error),
        TuneError::Check(error) => raise(py, error),
        TuneError::Output(..) => PyOSError::new_err(error.to_string()),
        TuneError::Infeasible(_) => {
            errors::raise(py, "InfeasibleError", &error.to_string(), &PyDict::new(py))
        }
    })
}

/// The exception of an error of a campaign.
fn raise(py: Python<'_>, error: &CampaignError) -> PyErr {
    match error {
        CampaignError::Definition(error) => errors::scenario(py, error),
        CampaignError::Interrupted => PyKeyboardInterrupt::new_err(error.to_string()),
        CampaignError::Output(..) => PyOSError::new_err(error.to_string()),
        CampaignError::Usage(_) | CampaignError::Results(..) => {
            errors::raise(py, "CampaignError", &error.to_string(), &PyDict::new(py))
        }
    }
}
