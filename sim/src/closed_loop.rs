//! Controller and vehicle in closed loop, one control tick after the other.

use ctrl_core::controller::{AdaptiveController, Intermediates, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::VehicleState;

use crate::guarantee::lyapunov::Evaluator;
use crate::lanes::LANES;
use crate::observer::Observer;
use crate::plant::PlantState;
use crate::plant::disturbance::{DisturbanceProcess, DisturbanceSource};
use crate::plant::vehicle::{Plant, Vehicle};
use crate::sensor::{Navigation, SensorSamples};
use crate::state_source::StateSource;
use crate::tick::Tick;

/// A controller in a flight with observers.
///
/// Controllers of the paper show their estimates and intermediate quantities. For a controller of your
/// own an empty `impl` is enough: its ticks carry none.
pub trait ObservedController: TrackingController {
    /// Performs one step; puts the output into `tick`, and the quantities of the law, if it has any, in place of those of
    /// the tick before.
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
        tick.law = true;
        tick.estimates = self.estimates(state);
        tick.auxiliary = self.auxiliary(state);
        tick.lasting = self.lasting(state);
        let (intermediates, mut evaluated) = (&mut tick.intermediates, false);
        tick.output = self.step_observed(state, vehicle, reference, |seen| {
            *intermediates = *seen;
            evaluated = true;
        });
        if !evaluated {
            tick.intermediates = Intermediates::default();
        }
    }
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

    /// Flies `ticks` control ticks at full speed, without observer.
    pub fn advance(&mut self, ticks: u64) {
        for _ in 0..ticks {
            let reference = self.trajectory.reference(self.tick);
            let measured = self.source.measure(self.plant.truth());
            let shifted = self.source.shifted(&reference);
            let followed = shifted.as_ref().unwrap_or(&reference);
            let mut disturbance = self.disturbance.advance(self.plant.truth());
            let output = self.controller.step(&mut self.state, &measured, followed);
            self.plant.command(&output.wrench);
            self.plant.add_drag(&mut disturbance);
            self.plant.advance(&disturbance);
            self.tick += 1;
        }
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
    /// Flies `ticks` control ticks; `observer` receives each of them before the plant moves on.
    pub fn observe<O: Observer + ?Sized>(&mut self, ticks: u64, observer: &mut O) {
        let mut tick = Tick::none();
        for _ in 0..ticks {
            self.step(&mut tick);
            observer.observe(&tick);
            self.move_on(&tick);
        }
    }

    /// Flies `ticks` control ticks; `observer` receives up to four at once. The flight is the same, and sooner done.
    pub fn observe_in_blocks<O: Observer + ?Sized>(&mut self, ticks: u64, observer: &mut O) {
        let mut block = [Tick::none(); LANES];
        let mut left = ticks;
        while left > 0 {
            let count = left.min(LANES as u64);
            let flown = &mut block[..count as usize];
            for tick in flown.iter_mut() {
                self.step(tick);
                self.move_on(tick);
            }
            observer.observe_ticks(flown);
            left -= count;
        }
    }

    /// The law's step at this tick.
    #[inline]
    fn step(&mut self, tick: &mut Tick) {
        let reference = self.trajectory.reference(self.tick);
        tick.disturbance = self.disturbance.advance(self.plant.truth());
        let measured = self.source.measure(self.plant.truth());
        let shifted = self.source.shifted(&reference);
        let followed = shifted.as_ref().unwrap_or(&reference);
        self.controller.step_into(&mut self.state, &measured, followed, tick);
        // What was written just now is copied late: a processor waits for it otherwise.
        tick.tick = self.tick;
        tick.time = self.time();
        tick.truth = *self.plant.truth();
        tick.reference = reference;
        tick.battery = self.plant.battery();
        tick.applied = self.plant.command(&tick.output.wrench);
        self.plant.add_drag(&mut tick.disturbance);
        match &mut self.evaluator {
            Some(evaluator) => tick.evaluation = evaluator.evaluate(tick),
            None => tick.evaluation.position_error = tick.position_error(),
        }
    }

    /// The plant's motion to the next tick.
    #[inline]
    fn move_on(&mut self, tick: &Tick) {
        self.plant.advance(&tick.disturbance);
        self.tick += 1;
    }
}
