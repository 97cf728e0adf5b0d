//! A controller that is the vehicle, so that SIL's closed loop flies it.

use std::cell::RefCell;

use ctrl_core::controller::{
    AdaptiveController, Auxiliary, Estimates, Intermediates, StepOutput, TrackingController,
};
use ctrl_core::mode::{Command, Mode};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, WrenchBounds};
use glam::Quat;
use link::{Downlink, Telemetry, Uplink};

use super::PilError;
use super::comparison::{Difference, Step, first_difference};
use super::cost::StepCost;
use super::session::{Session, one_telemetry};

/// A vehicle that is not heard for so many ticks in a row is lost.
const UNHEARD_MAX: u64 = 100;

/// The vehicle's side of a flight, as the host sees it.
#[derive(Debug)]
pub struct InFlight<'a> {
    session: &'a mut Session,
    /// Ticks in a row of which no telemetry has arrived.
    unheard: u64,
    /// Control ticks flown.
    pub ticks: u64,
    /// Why the flight ended early; from then on the law on the host flies.
    pub failure: Option<PilError>,
    /// Where the vehicle first differed from the law on the host.
    pub difference: Option<Difference>,
    /// What the control ticks cost (instructions).
    pub cost: StepCost,
}

impl<'a> InFlight<'a> {
    /// About to start; the vehicle is armed, with the scenario's controller and trajectory.
    pub fn new(session: &'a mut Session) -> Self {
        let cost = StepCost::default();
        Self { session, unheard: 0, ticks: 0, failure: None, difference: None, cost }
    }

    /// One control tick with the sample `vehicle`; the first one starts the flight. Nothing if its
    /// telemetry was lost on a line that damages frames.
    fn step(&mut self, vehicle: &VehicleState) -> Result<Option<Telemetry>, PilError> {
        let sample = Uplink::State { tick: self.ticks, state: *vehicle };
        let heard = if self.ticks == 0 {
            self.session.say(&[sample, Uplink::Command(Command::Start)])?
        } else {
            self.session.say(&[sample])?
        };
        let telemetry = if self.session.hears_badly() {
            self.of_this_tick(&heard)?
        } else {
            Some(one_telemetry(&heard)?)
        };
        if let Some(Telemetry { tick, mode, cause, step_cost, .. }) = telemetry {
            if mode != Mode::Flying || tick != self.ticks + 1 {
                return Err(PilError::NotFlying { tick: self.ticks, mode, cause });
            }
            let cost = self.session.cost_unit().cost(step_cost);
            self.cost.observe(self.ticks, cost, vehicle);
        }
        self.ticks += 1;
        Ok(telemetry)
    }

    /// The telemetry of this tick among what was heard; what is older says nothing new.
    fn of_this_tick(&mut self, heard: &[Downlink]) -> Result<Option<Telemetry>, PilError> {
        let telemetry = heard.iter().find_map(|message| match message {
            Downlink::Telemetry(telemetry) if telemetry.tick > self.ticks => Some(*telemetry),
            Downlink::Telemetry(telemetry) if telemetry.mode != Mode::Flying => Some(*telemetry),
            _ => None,
        });
        self.unheard = if telemetry.is_some() { 0 } else { self.unheard + 1 };
        if self.unheard > UNHEARD_MAX {
            let asked = format!("telemetry for {UNHEARD_MAX} ticks");
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

/// Memory of the law on the host, and what the vehicle last said of its own.
#[derive(Clone, Debug)]
pub struct Memory<S> {
    law: S,
    heard: Option<Step>,
}

impl<C: AdaptiveController> OnVehicle<'_, '_, C> {
    fn step_of(&self, output: StepOutput, state: &C::State) -> Step {
        Step {
            output,
            estimates: self.law.estimates(state),
            attitude_error: self.law.attitude_error(state),
            auxiliary: self.law.auxiliary(state),
        }
    }
}

impl<C: AdaptiveController> TrackingController for OnVehicle<'_, '_, C> {
    type State = Memory<C::State>;

    fn initial_state(&self) -> Self::State {
        Memory { law: self.law.initial_state(), heard: None }
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
        let expected = self.step_of(output, &state.law);
        let flight = &mut *self.flight.borrow_mut();
        if flight.failure.is_some() {
            return output;
        }
        let tick = flight.ticks;
        match flight.step(vehicle) {
            // The rotors hold what was heard last.
            Ok(None) => state.heard.map_or(output, |heard| heard.output),
            Ok(Some(telemetry)) => {
                let heard = Step::from(&telemetry);
                if flight.difference.is_none() {
                    flight.difference = first_difference(tick, &heard, &expected);
                }
                state.heard = Some(heard);
                heard.output
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
        state.heard.map_or_else(|| self.law.estimates(&state.law), |heard| heard.estimates)
    }

    fn attitude_error(&self, state: &Self::State) -> Quat {
        state
            .heard
            .map_or_else(|| self.law.attitude_error(&state.law), |heard| heard.attitude_error)
    }

    fn auxiliary(&self, state: &Self::State) -> Auxiliary {
        state.heard.map_or_else(|| self.law.auxiliary(&state.law), |heard| heard.auxiliary)
    }
}
