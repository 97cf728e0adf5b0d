//! SIL's closed loop with a controller that records what it is given.

use std::cell::RefCell;

use ctrl_core::controller::{Auxiliary, Estimates, Intermediates, StepOutput, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, WrenchBounds};
use firmware::replay::Sample;
use firmware::scenario::Scenario;
use glam::Quat;
use sim::closed_loop::{Flight, Unobserved};
use sim::plant::disturbance::DisturbanceProcess;
use sim::plant::rigid_body::RigidBody;
use sim::scenario::LoadedScenario;

/// Flies a scenario's first ticks with another controller in place of its own.
pub fn fly<C: TrackingController>(scenario: &str, ticks: u64, controller: C) {
    let loaded = LoadedScenario::open(scenario, &[]).unwrap();
    let document = Scenario::named(scenario).unwrap().load().unwrap();
    let trajectory = document.trajectory.build(controller.step_period()).unwrap();
    let scenario = loaded.scenario();
    let period = f64::from(controller.step_period());
    let steps = scenario.plant_steps_per_tick;
    let body = RigidBody::new(&scenario.vehicle.into(), period, steps);
    let disturbance = DisturbanceProcess::new(&scenario.disturbance, scenario.seed, period);
    let truth = scenario.initial.state();
    Flight::new(controller, trajectory, body, disturbance, truth).advance(ticks, &mut Unobserved);
}

/// A controller that keeps the samples it is given.
pub struct Recording<'a, C> {
    /// Who flies.
    pub law: C,
    /// What it was given.
    pub samples: &'a RefCell<Vec<Sample>>,
}

impl<C: TrackingController> TrackingController for Recording<'_, C> {
    type State = C::State;

    fn initial_state(&self) -> C::State {
        self.law.initial_state()
    }
    fn step_period(&self) -> f32 {
        self.law.step_period()
    }
    fn reference_acceleration_max(&self) -> f32 {
        self.law.reference_acceleration_max()
    }
    fn bounds(&self) -> WrenchBounds {
        self.law.bounds()
    }
    fn estimates(&self, state: &C::State) -> Estimates {
        self.law.estimates(state)
    }
    fn attitude_error(&self, state: &C::State) -> Quat {
        self.law.attitude_error(state)
    }
    fn auxiliary(&self, state: &C::State) -> Auxiliary {
        self.law.auxiliary(state)
    }

    fn step_observed(
        &self,
        state: &mut C::State,
        vehicle: &VehicleState,
        reference: &Reference,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        self.samples.borrow_mut().push(Sample { vehicle: *vehicle, reference: *reference });
        self.law.step_observed(state, vehicle, reference, observe)
    }
}
