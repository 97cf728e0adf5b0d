//! The flights: what they start from, and what must happen in them.

use anyhow::{Result, ensure};
use ctrl_core::controller::ControllerConfig;
use ctrl_core::controller::{StepOutput, StepStatus, TrackingController};
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use sim::observer::Observer;
use sim::scenario::LoadedScenario;
use step_record::Sample;

use crate::random;

/// Steps of a simulated flight: 10 s at 1 kHz.
const STEPS: u64 = 10_000;
/// Samples without a flight behind them.
const SINGLES: usize = 4_000;

/// One controller and the scenario that its flights start from.
pub struct Controller {
    /// As its image is named.
    pub name: &'static str,
    scenario: &'static str,
    /// Changes of the scenario, and the status that the flight must have shown.
    changed: &'static [(&'static str, &'static [&'static str], StepStatus)],
}

const TILTED: &[&str] = &[
    "initial.tilt_deg=170",
    "initial.tilt_direction_deg=30",
    "initial.rate_body=[3.0, -2.0, 1.0]",
];

/// Both controllers with all their flights.
pub const CONTROLLERS: [Controller; 2] = [
    Controller {
        name: "robust-adaptive",
        scenario: "paper-robust-adaptive",
        changed: &[
            ("paper", &[], StepStatus::empty()),
            ("large-tilt", TILTED, StepStatus::empty()),
            (
                "projection",
                &[
                    "controller.robust_adaptive.cascade.gamma1=5.0",
                    "controller.robust_adaptive.gamma2=5.0",
                    "initial.tilt_deg=90",
                ],
                StepStatus::MASS_PROJECTED.union(StepStatus::INERTIA_PROJECTED),
            ),
        ],
    },
    Controller {
        name: "saturated",
        scenario: "paper-saturated",
        changed: &[
            ("paper", &[], StepStatus::empty()),
            ("large-tilt", TILTED, StepStatus::TORQUE_SATURATED),
            (
                "projection",
                &[
                    "controller.saturated.cascade.gamma1=5.0",
                    "controller.saturated.gamma2=1000.0",
                    "controller.saturated.gamma3=50.0",
                    "initial.tilt_deg=90",
                ],
                StepStatus::MASS_PROJECTED.union(StepStatus::INERTIA_PROJECTED),
            ),
        ],
    },
];

/// A configuration, the inputs of a flight, and what the host made of them.
pub struct Recording {
    /// The controller's configuration.
    pub config: ControllerConfig,
    /// Input of every step.
    pub samples: Vec<Sample>,
    /// Output of every step.
    pub outputs: Vec<StepOutput>,
}

impl Recording {
    fn empty(config: ControllerConfig) -> Self {
        Self { config, samples: Vec::new(), outputs: Vec::new() }
    }

    fn status(&self) -> StepStatus {
        self.outputs.iter().map(|output| output.status).collect()
    }
}

impl Observer for Recording {
    fn observe(&mut self, seen: &sim::tick::Tick) {
        self.samples.push(Sample { vehicle: seen.truth.measured(), reference: seen.reference });
        self.outputs.push(seen.output);
    }
}

impl Controller {
    /// Flies them all.
    pub fn flights(&self) -> Result<Vec<(&'static str, Recording)>> {
        let mut flights = Vec::new();
        for (name, changes, expected) in self.changed {
            let recording = self.simulated(changes)?;
            let status = recording.status();
            ensure!(status.contains(*expected), "{} {name}: only {status:?}", self.name);
            flights.push((*name, recording));
        }
        let config = LoadedScenario::open(self.scenario, &[])?.scenario().controller;
        flights.push(("tumbling", singles(config, random::tumbling(SINGLES))?));
        let hostile = singles(config, random::hostile(SINGLES))?;
        let refused = StepStatus::STATE_INVALID.union(StepStatus::REFERENCE_INVALID);
        ensure!(hostile.status().contains(refused), "hostile input was not refused");
        flights.push(("hostile", hostile));
        Ok(flights)
    }

    fn simulated(&self, changes: &[&str]) -> Result<Recording> {
        let changes: Vec<_> = changes.iter().map(|change| (*change).to_owned()).collect();
        let loaded = LoadedScenario::open(self.scenario, &changes)?;
        let mut recording = Recording::empty(loaded.scenario().controller);
        loaded.flight()?.observe(STEPS, &mut recording);
        Ok(recording)
    }
}

fn singles(config: ControllerConfig, samples: Vec<Sample>) -> Result<Recording> {
    let outputs = match &config {
        ControllerConfig::RobustAdaptive(config) => {
            answers(&RobustAdaptive::new(config)?, &samples)
        }
        ControllerConfig::Saturated(config) => answers(&Saturated::new(config)?, &samples),
    };
    Ok(Recording { config, samples, outputs })
}

fn answers<C: TrackingController>(controller: &C, samples: &[Sample]) -> Vec<StepOutput> {
    let mut state = controller.initial_state();
    let step = |tick: &Sample| controller.step(&mut state, &tick.vehicle, &tick.reference);
    samples.iter().map(step).collect()
}
