//! Controller and plant in closed loop, one control tick after the other.

use ctrl_core::controller::{Intermediates, TrackingController};
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::Wrench;

use crate::plant::actuation::Actuators;
use crate::plant::disturbance::DisturbanceProcess;
use crate::plant::rigid_body::RigidBody;
use crate::plant::{AppliedWrench, PlantState};
use crate::sample::Sample;

/// Sees every tick of a flight.
pub trait Observer {
    /// Whether [`observe`](Self::observe) wants samples at all; without, none is put together.
    const ACTIVE: bool = true;

    /// Called once a tick, in order, before the plant moves on.
    fn observe(&mut self, sample: &Sample);
}

/// Sees nothing: the flight runs at full speed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {
    const ACTIVE: bool = false;

    #[inline]
    fn observe(&mut self, _: &Sample) {}
}

impl<O: Observer> Observer for &mut O {
    const ACTIVE: bool = O::ACTIVE;

    #[inline]
    fn observe(&mut self, sample: &Sample) {
        (**self).observe(sample);
    }
}

impl<A: Observer, B: Observer> Observer for (A, B) {
    const ACTIVE: bool = A::ACTIVE || B::ACTIVE;

    #[inline]
    fn observe(&mut self, sample: &Sample) {
        self.0.observe(sample);
        self.1.observe(sample);
    }
}

/// A flight in progress: a controller, where it flies, and the vehicle that it flies.
#[derive(Clone, Debug)]
pub struct Flight<C: TrackingController, T> {
    controller: C,
    state: C::State,
    trajectory: T,
    body: RigidBody,
    /// None: every command acts at once and exactly.
    actuators: Option<Actuators>,
    disturbance: DisturbanceProcess,
    truth: PlantState,
    tick: u64,
}

impl<C: TrackingController, T: Trajectory> Flight<C, T> {
    /// Puts a vehicle in the state `truth` at tick zero. `body`, `disturbance`, `trajectory` and
    /// `controller` must have the same step period.
    pub fn new(
        controller: C,
        trajectory: T,
        body: RigidBody,
        disturbance: DisturbanceProcess,
        truth: PlantState,
    ) -> Self {
        let state = controller.initial_state();
        let actuators = None;
        Self { controller, state, trajectory, body, actuators, disturbance, truth, tick: 0 }
    }

    /// Puts `actuators` between controller and vehicle; without, every command acts at once and exactly.
    #[must_use]
    pub fn with_actuators(self, actuators: Option<Actuators>) -> Self {
        Self { actuators, ..self }
    }

    /// Flies `ticks` control ticks; `observer` sees each of them.
    pub fn advance<O: Observer>(&mut self, ticks: u64, observer: &mut O) {
        for _ in 0..ticks {
            self.step(observer);
        }
    }

    /// One control tick: the law, then the plant under its held wrench.
    #[inline]
    fn step<O: Observer>(&mut self, observer: &mut O) {
        let reference = self.trajectory.reference(self.tick);
        let measured = self.truth.measured();
        let disturbance = self.disturbance.advance();
        let output = if O::ACTIVE {
            let estimates = self.controller.estimates(&self.state);
            let auxiliary = self.controller.auxiliary(&self.state);
            let mut intermediates = Intermediates::default();
            let output =
                self.controller.step_observed(&mut self.state, &measured, &reference, |seen| {
                    intermediates = *seen;
                });
            let applied = self.take(&output.wrench);
            observer.observe(&Sample {
                tick: self.tick,
                time: self.time(),
                truth: self.truth,
                reference,
                output,
                applied,
                intermediates,
                estimates,
                auxiliary,
                disturbance,
            });
            output
        } else {
            let output = self.controller.step(&mut self.state, &measured, &reference);
            self.take(&output.wrench);
            output
        };
        self.truth = match &mut self.actuators {
            None => self.body.advance(&self.truth, &output.wrench, &disturbance),
            Some(actuators) => actuators.advance(&self.body, &self.truth, &disturbance),
        };
        self.tick += 1;
    }

    /// Gives the command to the actuators; what acts now.
    #[inline]
    fn take(&mut self, command: &Wrench) -> AppliedWrench {
        match &mut self.actuators {
            None => AppliedWrench::from(*command),
            Some(actuators) => actuators.take(command),
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
        &self.truth
    }

    /// The controller.
    #[must_use]
    pub fn controller(&self) -> &C {
        &self.controller
    }
}
