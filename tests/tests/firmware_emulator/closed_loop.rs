//! SIL's closed loop with a controller that records what it is given.

use std::cell::RefCell;

use ctrl_core::controller::{StepOutput, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use firmware::replay::ReplaySample;
use sim::closed_loop::ObservedController;
use sim::scenario::{LoadedScenario, flight_with};

/// Flies a scenario's first ticks with another controller in place of its own.
pub fn advance<C: ObservedController>(scenario: &str, ticks: u64, controller: C) {
    let loaded = LoadedScenario::open(scenario, &[]).unwrap();
    flight_with(controller, loaded.scenario()).unwrap().advance(ticks);
}

/// A controller that keeps the samples it is given.
pub struct RecordingController<'a, C> {
    /// The controller.
    pub law: C,
    /// Its inputs.
    pub samples: &'a RefCell<Vec<ReplaySample>>,
}

impl<C: TrackingController> TrackingController for RecordingController<'_, C> {
    type State = C::State;

    fn initial_state(&self) -> C::State {
        self.law.initial_state()
    }

    fn step(
        &self,
        state: &mut C::State,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        self.samples.borrow_mut().push(ReplaySample { vehicle: *vehicle, reference: *reference });
        self.law.step(state, vehicle, reference)
    }

    fn step_period(&self) -> f32 {
        self.law.step_period()
    }
}

impl<C: TrackingController> ObservedController for RecordingController<'_, C> {}
