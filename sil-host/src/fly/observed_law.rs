//! The law beside the vehicle that flies it: its intermediate quantities for trace and log, and its output, which the
//! vehicle's must equal.

use ctrl_core::controller::{
    AdaptiveController, AnyController, AnyControllerState, ControllerConfig, Intermediates,
    StepOutput, TrackingController,
};
use ctrl_core::error::ConfigError;
use ctrl_core::mode::Mode;
use ctrl_core::vehicle::VehicleState;
use sim::guarantee::lyapunov::Evaluator;
use sim::plant::PlantParameters;
use sim::scenario::Scenario;
use sim::tick::Tick;

use crate::pil::comparison::Step;

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct ObservedLaw {
    law: AnyController,
    state: AnyControllerState,
    evaluator: Evaluator,
    plant: PlantParameters,
}

impl ObservedLaw {
    /// The law of `scenario`, on its true vehicle.
    ///
    /// # Errors
    /// Names the parameter that the law refuses.
    pub fn new(scenario: &Scenario) -> Result<Self, ConfigError> {
        let law = scenario.controller.build()?;
        let (state, evaluator) = (law.initial_state(), scenario.evaluator());
        Ok(Self { law, state, evaluator, plant: PlantParameters::from(scenario.vehicle) })
    }

    /// Follows other parameters of the law, from rest.
    ///
    /// # Errors
    /// Names the parameter that the law refuses; nothing is then changed.
    pub fn follow(&mut self, config: &ControllerConfig) -> Result<(), ConfigError> {
        self.law = config.build()?;
        self.state = self.law.initial_state();
        self.evaluator = Evaluator::new(config, &self.plant);
        Ok(())
    }

    /// Steps the law at a tick of `mode` with the state that the vehicle received, and fills in what it has to tell;
    /// what it came to, if the law flies.
    pub fn observe(
        &mut self,
        tick: &mut Tick,
        mode: Mode,
        measured: &VehicleState,
    ) -> Option<Step> {
        let Self { law, state, evaluator, .. } = self;
        if !matches!(mode, Mode::Flying | Mode::Failsafe) {
            *state = law.initial_state();
        }
        tick.estimates = law.estimates(state);
        if mode != Mode::Flying {
            tick.evaluation.position_error = tick.position_error();
            return None;
        }
        tick.auxiliary = law.auxiliary(state);
        tick.lasting = law.lasting(state);
        let mut seen = Intermediates::default();
        let output: StepOutput =
            law.step_observed(state, measured, &tick.reference, |inner| seen = *inner);
        tick.intermediates = seen;
        tick.evaluation = evaluator.evaluate(tick);
        Some(Step::made(&*law, output, state))
    }
}
