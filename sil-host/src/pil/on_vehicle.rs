//! A controller that is the vehicle, so that SIL's closed loop flies it.

use std::cell::RefCell;
use std::sync::mpsc::Receiver;

use ctrl_core::controller::{
    AdaptiveController, Auxiliary, Estimates, Intermediates, LastingEstimates, StepOutput,
    TrackingController,
};
use ctrl_core::mode::{Command, Mode};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, WrenchBounds};
use glam::Quat;
use link::{Downlink, Telemetry, Uplink};
use sim::sensor::SensorSamples;

use super::PilError;
use super::comparison::{Difference, Step, first_difference, lasting};
use super::cost::StepCost;
use super::flying_ahead::Ahead;
use super::session::{VehicleSession, one_telemetry};

/// A vehicle that is not received for so many ticks in a row is lost.
const UNRECEIVED_MAX: u64 = 100;

/// The vehicle's side of a flight, as the host sees it.
#[derive(Debug)]
pub struct InFlight<'a> {
    session: &'a mut VehicleSession,
    /// Ticks that the vehicle has not answered, if the host flies ahead of it.
    ahead: Option<Ahead>,
    /// Samples of the sensors of each tick, for a vehicle that flies by them.
    samples: Option<Receiver<SensorSamples>>,
    /// Ticks in a row of which no telemetry has arrived.
    unreceived: u64,
    /// Control ticks flown.
    pub ticks: u64,
    /// Reason for an early end of the flight; from then on the law on the host flies.
    pub failure: Option<PilError>,
    /// First difference of the vehicle from the law on the host.
    pub difference: Option<Difference>,
    /// Cost of the control ticks (instructions).
    pub cost: StepCost,
}

impl<'a> InFlight<'a> {
    /// About to start; the vehicle is armed, with the scenario's controller and trajectory.
    pub fn new(session: &'a mut VehicleSession) -> Self {
        let cost = StepCost::default();
        let (ahead, samples, failure, difference) = (None, None, None, None);
        Self { session, ahead, samples, unreceived: 0, ticks: 0, failure, difference, cost }
    }

    /// The vehicle flies by sensors, whose samples of each tick come from `samples`.
    #[must_use]
    pub fn by_sensors(self, samples: Receiver<SensorSamples>) -> Self {
        Self { samples: Some(samples), ..self }
    }

    /// The host flies ahead of the vehicle, and sends `batch` ticks at once.
    #[must_use]
    pub fn ahead(self, batch: usize) -> Self {
        Self { ahead: Some(Ahead::new(batch)), ..self }
    }

    /// The messages of a tick: the state, or what the sensors gave; the first one starts the flight.
    fn messages(&self, tick: u64, vehicle: &VehicleState) -> Vec<Uplink> {
        let mut messages = self.sampled(tick, vehicle);
        if tick == 0 {
            messages.push(Uplink::Command(Command::Start));
        }
        messages
    }

    fn sampled(&self, tick: u64, vehicle: &VehicleState) -> Vec<Uplink> {
        let Some(samples) = &self.samples else {
            return vec![Uplink::State { tick, state: *vehicle }];
        };
        let SensorSamples { start, inertial, measurements } =
            samples.try_recv().unwrap_or_default();
        let start = start.map(Uplink::EstimatorStart);
        let inertial = inertial.map(|sample| Uplink::Inertial { tick, sample });
        let measured = measurements.into_iter().map(Uplink::Measured);
        // The inertial sample last: with it the tick's frame is complete.
        start.into_iter().chain(measured).chain(inertial).collect()
    }

    /// One control tick with the sample `vehicle`. Nothing if its telemetry was lost on a line that damages frames.
    fn step(&mut self, vehicle: &VehicleState, expected: &Step) -> Result<Option<Step>, PilError> {
        let received = self.session.send(&self.messages(self.ticks, vehicle))?;
        self.take(&received, vehicle, expected)
    }

    /// Takes in the messages of the vehicle's tick with the sample `vehicle`, and compares what they tell.
    fn take(
        &mut self,
        received: &[Downlink],
        vehicle: &VehicleState,
        expected: &Step,
    ) -> Result<Option<Step>, PilError> {
        let telemetry = if self.session.is_lossy() {
            self.of_this_tick(received)?
        } else {
            Some(one_telemetry(received)?)
        };
        if let Some(Telemetry { tick, mode, cause, step_cost, .. }) = telemetry {
            if mode != Mode::Flying || tick != self.ticks + 1 {
                return Err(PilError::NotFlying { tick: self.ticks, mode, cause });
            }
            let cost = self.session.cost_unit().cost(step_cost);
            self.cost.observe(self.ticks, cost, vehicle);
        }
        let told = telemetry.map(|telemetry| {
            let lasting = lasting(received, telemetry.tick);
            // Lost alone on a line that damages frames, it cannot be compared.
            let unknown = self.session.is_lossy().then_some(expected.lasting);
            Step::told(&telemetry, lasting.or(unknown))
        });
        if let (Some(told), None) = (&told, self.difference) {
            self.difference = first_difference(self.ticks, told, expected);
        }
        self.ticks += 1;
        Ok(told)
    }

    /// A control tick with the sample `vehicle`, in which the law did `expected`. The vehicle flies it later: while
    /// it is at one batch, the host is at the next.
    fn step_ahead(&mut self, vehicle: &VehicleState, expected: Step) -> Result<(), PilError> {
        let unanswered = self.ahead.as_ref().map_or(0, Ahead::unanswered) as u64;
        let messages = self.messages(self.ticks + unanswered, vehicle);
        let packet = self.session.packet(&messages, unanswered);
        let Some(ahead) = &mut self.ahead else { return Ok(()) };
        let (whole, batch) = (ahead.push(packet, *vehicle, expected), ahead.batch());
        if whole { self.exchange_until(batch) } else { Ok(()) }
    }

    /// Sends what waits, and takes in the answers of all ticks.
    ///
    /// # Errors
    /// When the vehicle is silent or has left flight.
    pub fn finish(&mut self) -> Result<(), PilError> {
        self.exchange_until(0)
    }

    /// Sends what waits, and takes in answers until only `left` are missing.
    fn exchange_until(&mut self, left: usize) -> Result<(), PilError> {
        let Some(ahead) = &mut self.ahead else { return Ok(()) };
        self.session.send_ahead(&ahead.take_packets())?;
        while let Some((vehicle, expected)) =
            self.ahead.as_mut().and_then(|ahead| ahead.next_unanswered(left))
        {
            let received = self.session.receive()?;
            self.take(&received, &vehicle, &expected)?;
        }
        Ok(())
    }

    /// The telemetry of this tick among the received messages; older telemetry is ignored.
    fn of_this_tick(&mut self, received: &[Downlink]) -> Result<Option<Telemetry>, PilError> {
        let telemetry = received.iter().find_map(|message| match message {
            Downlink::Telemetry(telemetry) if telemetry.tick > self.ticks => Some(*telemetry),
            Downlink::Telemetry(telemetry) if telemetry.mode != Mode::Flying => Some(*telemetry),
            _ => None,
        });
        self.unreceived = if telemetry.is_some() { 0 } else { self.unreceived + 1 };
        if self.unreceived > UNRECEIVED_MAX {
            let asked = format!("telemetry for {UNRECEIVED_MAX} ticks");
            return Err(PilError::Answer(asked, "nothing that arrived".to_owned()));
        }
        Ok(telemetry)
    }
}

/// The vehicle in place of a law; the law itself steps along for its intermediate quantities.
#[derive(Clone, Debug)]
pub struct OnVehicle<'a, 's, C> {
    /// The law on the host.
    pub law: C,
    /// The vehicle.
    pub flight: &'a RefCell<InFlight<'s>>,
}

/// State of the law on the host, and the vehicle's latest step.
#[derive(Clone, Debug)]
pub struct Memory<S> {
    law: S,
    received: Option<Step>,
}

impl<C: AdaptiveController> TrackingController for OnVehicle<'_, '_, C> {
    type State = Memory<C::State>;

    fn initial_state(&self) -> Self::State {
        Memory { law: self.law.initial_state(), received: None }
    }

    fn step(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        self.step_observed(state, vehicle, reference, |_| {})
    }

    fn step_period(&self) -> f32 {
        self.law.step_period()
    }
}

impl<C: AdaptiveController> AdaptiveController for OnVehicle<'_, '_, C> {
    fn step_observed(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        let output = self.law.step_observed(&mut state.law, vehicle, reference, observe);
        let expected = Step::made(&self.law, output, &state.law);
        let flight = &mut *self.flight.borrow_mut();
        if flight.failure.is_some() {
            return output;
        }
        if flight.ahead.is_some() {
            flight.failure = flight.step_ahead(vehicle, expected).err();
            return output;
        }
        match flight.step(vehicle, &expected) {
            // The rotors hold what was received last.
            Ok(None) => state.received.map_or(output, |received| received.output),
            Ok(Some(received)) => {
                state.received = Some(received);
                received.output
            }
            Err(failure) => {
                flight.failure = Some(failure);
                output
            }
        }
    }

    fn reference_acceleration_max(&self) -> f32 {
        self.law.reference_acceleration_max()
    }

    fn bounds(&self) -> WrenchBounds {
        self.law.bounds()
    }

    fn estimates(&self, state: &Self::State) -> Estimates {
        state.received.map_or_else(|| self.law.estimates(&state.law), |received| received.estimates)
    }

    fn attitude_error(&self, state: &Self::State) -> Quat {
        state
            .received
            .map_or_else(|| self.law.attitude_error(&state.law), |received| received.attitude_error)
    }

    fn auxiliary(&self, state: &Self::State) -> Auxiliary {
        state.received.map_or_else(|| self.law.auxiliary(&state.law), |received| received.auxiliary)
    }

    fn lasting(&self, state: &Self::State) -> LastingEstimates {
        state.received.map_or_else(|| self.law.lasting(&state.law), |received| received.lasting)
    }

    fn has_integral_action(&self) -> bool {
        self.law.has_integral_action()
    }
}
