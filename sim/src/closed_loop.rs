//! Controller and vehicle in closed loop, one control tick after the other.

use ctrl_core::controller::{
    AdaptiveController, Auxiliary, Estimates, Intermediates, LastingEstimates, StepOutput,
    StepStatus, TrackingController,
};
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::{VehicleState, Wrench};
use glam::Vec3;

use crate::evaluation::Evaluation;
use crate::guarantee::lyapunov::Evaluator;
use crate::observer::Observer;
use crate::plant::disturbance::{DisturbanceProcess, DisturbanceSource};
use crate::plant::vehicle::{Plant, Vehicle};
use crate::plant::{AppliedWrench, PlantState};
use crate::sensor::{Navigation, SensorSamples};
use crate::state_source::StateSource;
use crate::tick::Tick;

/// Output of a tick before its step.
const NO_OUTPUT: StepOutput = StepOutput {
    wrench: Wrench { thrust: 0.0, torque_body: Vec3::ZERO },
    torque_demand_body: Vec3::ZERO,
    status: StepStatus::empty(),
};

/// A controller in a flight with observers.
///
/// Controllers of the paper show their estimates and intermediate quantities. For a controller of your
/// own an empty `impl` is enough: its ticks carry none.
pub trait ObservedController: TrackingController {
    /// Performs one step; puts the output into `tick`, and the quantities of the law, if it has any.
    #[inline]
    fn step_into(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
        tick: &mut Tick,
    ) {
        tick.output = self.step(state, vehicle, reference);
    }

    /// As [`step_into`](Self::step_into), for rotors that [tell the law](crate::plant::rotors::RotorsConfig::tells_law) what they
    /// make of its command: `made` (N m).
    #[inline]
    fn step_told(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
        made: impl FnOnce(&Wrench) -> Vec3,
        tick: &mut Tick,
    ) {
        let _ = made;
        self.step_into(state, vehicle, reference, tick);
    }
}

impl<C: AdaptiveController> ObservedController for C {
    #[inline]
    fn step_into(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
        tick: &mut Tick,
    ) {
        look_before(self, state, tick);
        let intermediates = &mut tick.intermediates;
        tick.output = self.step_observed(state, vehicle, reference, |seen| *intermediates = *seen);
    }

    fn step_told(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
        made: impl FnOnce(&Wrench) -> Vec3,
        tick: &mut Tick,
    ) {
        look_before(self, state, tick);
        let intermediates = &mut tick.intermediates;
        let observe = |seen: &_| *intermediates = *seen;
        tick.output = self.step_limited(state, vehicle, reference, made, observe);
    }
}

/// What a law knows before a step.
#[inline]
fn look_before<C: AdaptiveController>(law: &C, state: &C::State, tick: &mut Tick) {
    tick.law = true;
    tick.estimates = law.estimates(state);
    tick.auxiliary = law.auxiliary(state);
    tick.lasting = law.lasting(state);
}

/// A flight in progress: a controller, its trajectory, the plant and what disturbs it.
#[derive(Clone, Debug)]
pub struct Flight<C: TrackingController, T, P = Vehicle, D = DisturbanceProcess> {
    controller: C,
    state: C::State,
    trajectory: T,
    plant: P,
    disturbance: D,
    evaluator: Option<Evaluator>,
    source: StateSource,
    tick: u64,
}

impl<C: TrackingController, T: Trajectory, P: Plant, D: DisturbanceSource> Flight<C, T, P, D> {
    /// A flight at tick zero. Controller, trajectory, plant and disturbance must have the same step
    /// period.
    pub fn new(controller: C, trajectory: T, plant: P, disturbance: D) -> Self {
        let state = controller.initial_state();
        let (evaluator, source) = (None, StateSource::default());
        Self { controller, state, trajectory, plant, disturbance, evaluator, source, tick: 0 }
    }

    /// Adds the Lyapunov evaluation of a law of the paper to the observed ticks.
    #[must_use]
    pub fn with_evaluator(self, evaluator: Evaluator) -> Self {
        Self { evaluator: Some(evaluator), ..self }
    }

    /// The same flight without the Lyapunov evaluation in its ticks, for observers that do not read it; the
    /// monitors evaluate V themselves.
    #[must_use]
    pub fn without_evaluator(self) -> Self {
        Self { evaluator: None, ..self }
    }

    /// The same flight with a state in place of the true one for the controller: with noise, or by sensors.
    #[must_use]
    pub fn with_state_source(self, source: StateSource) -> Self {
        Self { source, ..self }
    }

    /// Sends the sensors' samples of every tick from now on; nothing without sensors.
    pub fn send_samples(&mut self, receiver: std::sync::mpsc::Sender<SensorSamples>) {
        self.source.send_samples(receiver);
    }

    /// Sensors and estimator, if the flight is by them.
    #[must_use]
    pub fn navigation(&self) -> Option<&Navigation> {
        self.source.navigation()
    }

    /// The same flight along another trajectory, which the caller has the controller
    /// [`accept`](AdaptiveController::accept).
    #[must_use]
    pub fn with_trajectory<U: Trajectory>(self, trajectory: U) -> Flight<C, U, P, D> {
        let Self { controller, state, plant, disturbance, evaluator, source, tick, .. } = self;
        Flight { controller, state, trajectory, plant, disturbance, evaluator, source, tick }
    }

    /// The same flight of another plant, with the same step period.
    #[must_use]
    pub fn with_plant<Q: Plant>(self, plant: Q) -> Flight<C, T, Q, D> {
        let Self { controller, state, trajectory, disturbance, evaluator, source, tick, .. } = self;
        Flight { controller, state, trajectory, plant, disturbance, evaluator, source, tick }
    }

    /// The same flight under another disturbance.
    #[must_use]
    pub fn with_disturbance<E: DisturbanceSource>(self, disturbance: E) -> Flight<C, T, P, E> {
        let Self { controller, state, trajectory, plant, evaluator, source, tick, .. } = self;
        Flight { controller, state, trajectory, plant, disturbance, evaluator, source, tick }
    }

    /// Control ticks flown.
    #[must_use]
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Time since the start (s).
    #[must_use]
    pub fn time(&self) -> f64 {
        self.tick as f64 * f64::from(self.controller.step_period())
    }

    /// The plant's state now.
    #[must_use]
    pub fn truth(&self) -> &PlantState {
        self.plant.truth()
    }

    /// The controller.
    #[must_use]
    pub fn controller(&self) -> &C {
        &self.controller
    }
}

impl<C: ObservedController, T: Trajectory, P: Plant, D: DisturbanceSource> Flight<C, T, P, D> {
    /// Flies `ticks` control ticks at full speed, without observer.
    pub fn advance(&mut self, ticks: u64) {
        if self.plant.tells_law() {
            // The law is told in an observed step only.
            return self.without_evaluation(ticks);
        }
        for _ in 0..ticks {
            let reference = self.trajectory.reference(self.tick);
            let measured = self.source.measure(self.plant.truth());
            let mut reference = reference;
            self.source.shift(&mut reference);
            let mut disturbance = self.disturbance.advance(self.plant.truth());
            let output = self.controller.step(&mut self.state, &measured, &reference);
            self.plant.command(&output.wrench);
            self.plant.add_drag(&mut disturbance);
            self.plant.advance(&disturbance);
            self.tick += 1;
        }
    }

    #[cold]
    fn without_evaluation(&mut self, ticks: u64) {
        let evaluator = self.evaluator.take();
        self.observe(ticks, &mut ());
        self.evaluator = evaluator;
    }

    /// Flies `ticks` control ticks; `observer` receives each of them.
    pub fn observe<O: Observer + ?Sized>(&mut self, ticks: u64, observer: &mut O) {
        for _ in 0..ticks {
            self.observed_step(observer);
        }
    }

    /// One control tick: the law, then the plant under its held wrench.
    #[inline]
    fn observed_step<O: Observer + ?Sized>(&mut self, observer: &mut O) {
        let reference = self.trajectory.reference(self.tick);
        let truth = *self.plant.truth();
        let disturbance = self.disturbance.advance(&truth);
        let measured = self.source.measure(&truth);
        let mut followed = reference;
        self.source.shift(&mut followed);
        let mut tick = Tick {
            tick: self.tick,
            time: self.time(),
            truth,
            reference,
            output: NO_OUTPUT,
            applied: AppliedWrench::default(),
            law: false,
            intermediates: Intermediates::default(),
            estimates: Estimates::NONE,
            auxiliary: Auxiliary::REST,
            lasting: LastingEstimates::default(),
            battery: self.plant.battery(),
            disturbance,
            evaluation: Evaluation::default(),
        };
        let (law, state, plant) = (&self.controller, &mut self.state, &self.plant);
        if plant.tells_law() {
            law.step_told(state, &measured, &followed, |wrench| plant.made(wrench), &mut tick);
        } else {
            law.step_into(state, &measured, &followed, &mut tick);
        }
        tick.applied = self.plant.command(&tick.output.wrench);
        self.plant.add_drag(&mut tick.disturbance);
        match &mut self.evaluator {
            Some(evaluator) => tick.evaluation = evaluator.evaluate(&tick),
            None => tick.evaluation.position_error = tick.position_error(),
        }
        observer.observe(&tick);
        self.plant.advance(&tick.disturbance);
        self.tick += 1;
    }
}
