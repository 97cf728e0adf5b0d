//! One tick of the control group: filters of the rate, supervision, law, allocation.
//!
//! Pure and free of formatting: the inputs are prepared by the state-input group, the outputs are
//! copied to rotors and telemetry.

use ctrl_core::allocation::{
    Allocation, BatteryCompensation, BatteryConfig, Limited, Prepared, RotorGeometry, RotorSet,
    RotorThrusts, RotorWatch, RotorWatchConfig, RotorWatchState, SizedAllocator, slabs,
};
use ctrl_core::controller::{
    AdaptiveController, AnyController, AnyControllerState, Estimates, LastingEstimates, StepOutput,
    StepStatus, TrackingController,
};
use ctrl_core::error::ConfigError;
use ctrl_core::filter::{RateFilter, RateFilterConfig, RateFilterState};
use ctrl_core::mode::safety::{Observations, Safety, SafetyConfig, SafetyReport, SafetyState};
use ctrl_core::mode::{
    Cause, Command, Conditions, Mode, Refusal, SAFE, Supervisor, SupervisorConfig, SupervisorState,
};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench};
use glam::Vec3;
use link::Telemetry;

use crate::state_sample::StateSample;
use crate::vehicle::ROTORS;

/// Inputs of one control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
    /// The latest state sample with its age; none if it is older than a sample is valid, or if no
    /// inputs have been prepared since the last tick.
    pub sample: Option<StateSample>,
    /// Reference of this tick.
    pub reference: Reference,
    /// Command of operator or host.
    pub command: Option<Command>,
    /// The last period was an overrun, or a group has overrun repeatedly.
    pub overrun: bool,
    /// A fault forbids flight.
    pub fault: bool,
    /// The rotors stand still whatever the outputs are: lock step.
    pub outputs_off: bool,
    /// The kill switch is on.
    pub kill: bool,
    /// What the watch for hazards is told beside the state.
    pub health: Health,
}

/// State of the lines and of the battery.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Health {
    /// Time since the latest message of a station (s).
    pub link_silence: f32,
    /// Time since the latest frame of the remote control (s).
    pub rc_silence: f32,
    /// Voltage of the battery (V), if it is measured.
    pub voltage: Option<f32>,
}

/// Outputs of one control period.
#[derive(Clone, Debug, PartialEq)]
pub struct Outputs {
    /// Thrust of each rotor (N); none while the rotors are to stand still.
    pub thrusts: Option<RotorThrusts>,
    /// The wrench that was allocated to the rotors.
    pub wrench: Wrench,
    /// The wrench that the rotors make of it: the same, unless their limits reduced it.
    pub achieved: Wrench,
    /// Output of the law; the safe wrench while it does not run.
    pub step: StepOutput,
    /// Axes limited by the rotors, and whether one has failed.
    pub limited: Limited,
    /// The mode of this tick.
    pub mode: Mode,
    /// Cause of the latest change to a safer mode.
    pub cause: Option<Cause>,
    /// Result of the command.
    pub answer: Option<Result<Mode, Refusal>>,
    /// Hazards and the reaction to them; empty where none is watched for.
    pub safety: SafetyReport,
    /// Ticks since the start of this flight; zero while the law does not run.
    pub flight_tick: u32,
}

/// The law's output while it does not run.
const AT_REST: StepOutput =
    StepOutput { wrench: SAFE, torque_demand_body: Vec3::ZERO, status: StepStatus::empty() };

/// Height above where the vehicle stood from which failed rotors are looked for (m), by the received state: feet on the ground carry torque,
/// too.
const WATCHED_FROM: f32 = 0.3;

/// Detection of failed rotors with its memory.
#[derive(Clone, Debug)]
struct Watched {
    watch: RotorWatch,
    state: RotorWatchState,
    /// Thrusts of the period that ends now (N); none while the rotors stood still.
    thrusts: Option<RotorThrusts>,
    /// Height at which the vehicle stood last (m).
    ground: f32,
}

/// Supervision, law and allocation with their memory, for as many rotors as the boards have outputs, or another number of them.
#[derive(Clone, Debug)]
pub struct FlightControl<const SLABS: usize = { slabs(ROTORS) }> {
    law: AnyController,
    law_state: AnyControllerState,
    supervisor: Supervisor,
    supervisor_state: SupervisorState,
    /// The watch for hazards, and how the tick before went for it; none watches for none.
    safety: Option<Safety>,
    safety_state: SafetyState,
    safety_report: SafetyReport,
    limited: bool,
    battery: Option<BatteryCompensation>,
    allocator: SizedAllocator<SLABS>,
    watched: Option<Watched>,
    rate_filter: RateFilter,
    rate_filter_state: RateFilterState,
    /// The latest good sample, its rate filtered: held when one is missed, as the fixed step needs an input.
    vehicle: Option<VehicleState>,
    status: StepStatus,
    tick: u64,
    flight_tick: u32,
}

impl<const SLABS: usize> FlightControl<SLABS>
where
    SizedAllocator<SLABS>: Prepared,
{
    /// Vehicles that may fly without one of their rotors.
    const REDUNDANT: bool = SLABS > slabs(4);

    /// Puts a law under supervision, disarmed, without filters of the rate.
    ///
    /// # Errors
    /// The parameter that supervisor or allocator refuses.
    pub fn new(
        law: &AnyController,
        supervisor: &SupervisorConfig,
        geometry: &RotorGeometry,
    ) -> Result<Self, ConfigError> {
        let rate_filter = RateFilter::new(&RateFilterConfig::default(), law.step_period())?;
        Ok(Self {
            law_state: law.initial_state(),
            law: *law,
            rate_filter_state: rate_filter.initial_state(),
            rate_filter,
            supervisor: Supervisor::new(supervisor)?,
            supervisor_state: SupervisorState::default(),
            safety: None,
            safety_state: SafetyState::default(),
            safety_report: SafetyReport::default(),
            limited: false,
            battery: None,
            allocator: SizedAllocator::new(geometry)?,
            watched: None,
            vehicle: None,
            status: StepStatus::empty(),
            tick: 0,
            flight_tick: 0,
        })
    }

    /// Puts filters of the body rate before the law, from the next sample on.
    ///
    /// # Errors
    /// The parameter that the filter refuses; the filters are then as they were.
    pub fn set_rate_filter(&mut self, config: &RateFilterConfig) -> Result<(), ConfigError> {
        self.rate_filter = RateFilter::new(config, self.law.step_period())?;
        self.rate_filter_state = self.rate_filter.initial_state();
        Ok(())
    }

    /// One control period.
    pub fn tick(&mut self, inputs: &Inputs) -> Outputs {
        let answer = self.supervise(inputs);
        let mode = self.supervisor_state.mode();
        let step = match (mode, self.vehicle) {
            (Mode::Flying, Some(vehicle)) => self.step(&vehicle, &inputs.reference),
            _ => AT_REST,
        };
        self.status = step.status;
        self.tick = self.tick.wrapping_add(1);
        let supply = match (&mut self.battery, inputs.health.voltage) {
            (Some(battery), Some(voltage)) => battery.measure(voltage),
            (Some(battery), None) => battery.supply(),
            (None, _) => 1.0,
        };
        let outputs = self.outputs(step, mode, answer, supply);
        self.limited = !(outputs.limited - Limited::ROTOR_FAILED).is_empty();
        if let (Some(watched), true) = (&mut self.watched, Self::REDUNDANT) {
            watched.thrusts = outputs.thrusts;
        }
        outputs
    }

    /// Looks for failed rotors of `geometry`, and allocates to the others, from the next tick on.
    ///
    /// # Errors
    /// Names a number that is out of its range, or the number of rotors: none of four can be done without, and an image for four has no
    /// code for it. Nothing is then changed.
    pub fn set_rotor_watch(
        &mut self,
        config: &RotorWatchConfig,
        geometry: &RotorGeometry,
    ) -> Result<(), ConfigError> {
        let watch = RotorWatch::new(config, geometry, self.law.step_period())?;
        let state = RotorWatchState::default();
        self.watched = Some(Watched { watch, state, thrusts: None, ground: 0.0 });
        Ok(())
    }

    /// Rotors that were found to have failed; empty where none is looked for.
    #[must_use]
    pub fn failed_rotors(&self) -> RotorSet {
        let watched = self.watched.as_ref().filter(|_| Self::REDUNDANT);
        watched.map_or(RotorSet::empty(), |watched| watched.state.failed())
    }

    /// Watches for hazards from the next tick on.
    ///
    /// # Errors
    /// Names a number that is out of its range; nothing is then changed.
    pub fn set_safety(&mut self, config: &SafetyConfig) -> Result<(), ConfigError> {
        self.safety = Some(Safety::new(config, self.law.step_period())?);
        Ok(())
    }

    /// Scales the rotors' limits by the measured voltage from the next tick on.
    ///
    /// # Errors
    /// Names a number that is out of its range; nothing is then changed.
    pub fn set_battery(&mut self, config: &BatteryConfig) -> Result<(), ConfigError> {
        self.battery = Some(BatteryCompensation::new(config, self.law.step_period())?);
        Ok(())
    }

    /// Allocates to the other rotors from the next tick on: the one at `index` has failed.
    ///
    /// # Errors
    /// When the vehicle cannot fly without it, as no quadrotor can; nothing is then changed.
    #[inline(never)]
    pub fn lose_rotor(&mut self, index: usize) -> Result<(), ConfigError> {
        self.allocator.lose(index)
    }

    /// Replaces the law from the next start; in flight it is ignored.
    #[inline(never)]
    pub fn replace_law(&mut self, law: &AnyController) {
        if !matches!(self.supervisor_state.mode(), Mode::Flying | Mode::Failsafe) {
            self.law = *law;
            self.law_state = law.initial_state();
        }
    }

    /// Readiness: `Ok` if an Arm would be accepted now.
    ///
    /// # Errors
    /// The reason why not.
    pub fn readiness(&self) -> Result<(), Refusal> {
        self.supervisor.readiness(&self.supervisor_state)
    }

    /// Reason for the latest change to a safer mode.
    #[must_use]
    pub fn cause(&self) -> Option<Cause> {
        self.supervisor_state.cause()
    }

    /// Disarms, unless a fault keeps the vehicle locked.
    pub fn disarm(&mut self) {
        let state = &mut self.supervisor_state;
        // Refused only while a fault is present, when the mode is no other than Locked.
        let _ = self.supervisor.command(state, self.tick, Command::Disarm);
    }

    /// Telemetry of the tick that gave `outputs`; `step_cost` in the unit of the message.
    #[must_use]
    pub fn telemetry(&self, outputs: &Outputs, step_cost: u32) -> Telemetry {
        Telemetry {
            tick: u64::from(outputs.flight_tick),
            mode: outputs.mode,
            cause: outputs.cause,
            wrench: outputs.wrench,
            torque_demand_body: outputs.step.torque_demand_body,
            status: outputs.step.status,
            limited: outputs.limited,
            estimates: self.estimates(),
            attitude_error: self.law.attitude_error(&self.law_state),
            auxiliary: self.law.auxiliary(&self.law_state),
            step_cost,
        }
    }

    /// Estimates of the law after the latest step.
    #[must_use]
    pub fn estimates(&self) -> Estimates {
        self.law.estimates(&self.law_state)
    }

    /// Estimates of the integral action, if the law has any.
    #[must_use]
    pub fn lasting(&self) -> Option<LastingEstimates> {
        self.law.has_integral_action().then(|| self.law.lasting(&self.law_state))
    }

    /// Counts the period, carries out the command, and resets the law at the start of a flight.
    fn supervise(&mut self, inputs: &Inputs) -> Option<Result<Mode, Refusal>> {
        let mut sample = inputs.sample.map(|sample| sample.state).filter(is_good);
        if let Some(sample) = &mut sample {
            let rate_body = self.rate_filter.step(&mut self.rate_filter_state, sample.rate_body);
            sample.rate_body = rate_body;
        }
        self.vehicle = sample.or(self.vehicle);
        self.look_for_failed_rotors(inputs);
        if let Some(safety) = &self.safety {
            let mode = self.supervisor_state.mode();
            let seen = Observations {
                vehicle: sample,
                link_silence: inputs.health.link_silence,
                rc_silence: inputs.health.rc_silence,
                voltage: inputs.health.voltage,
                saturated: self.limited,
            };
            self.safety_report = safety.step(&mut self.safety_state, mode, &seen);
        }
        let conditions = Conditions {
            attitude: sample.map(|vehicle| vehicle.attitude),
            step: self.status,
            overrun: inputs.overrun,
            fault: inputs.fault,
            outputs_off: inputs.outputs_off,
            kill: inputs.kill,
            safety: self.safety_report,
        };
        let (supervisor, state) = (&self.supervisor, &mut self.supervisor_state);
        supervisor.step(state, self.tick, &conditions);
        let before = state.mode();
        let answer = inputs.command.map(|command| supervisor.command(state, self.tick, command));
        match (before, state.mode()) {
            (Mode::Flying | Mode::Failsafe, Mode::Flying | Mode::Failsafe) => {}
            _ => {
                self.law_state = self.law.initial_state();
                self.flight_tick = 0;
            }
        }
        answer
    }

    /// Follows the rotors over the period that has ended, and leaves out one that is found to have failed.
    fn look_for_failed_rotors(&mut self, inputs: &Inputs) {
        let Some(Watched { watch, state, thrusts, ground }) =
            self.watched.as_mut().filter(|_| Self::REDUNDANT)
        else {
            return;
        };
        let flying = self.supervisor_state.mode() == Mode::Flying;
        // Before the filters of the rate; only a new sample tells of the period.
        let sample = inputs.sample.filter(|sample| sample.age_ticks == 0).map(|it| it.state);
        let height = sample.map(|vehicle| vehicle.position_world.z);
        let (Some(thrusts), true) = (thrusts, flying) else {
            *ground = height.unwrap_or(*ground);
            return state.reset();
        };
        let rate = sample.map(|vehicle| vehicle.rate_body);
        let in_air = height.is_some_and(|height| height > *ground + WATCHED_FROM);
        let found = watch.step(state, rate.filter(|_| in_air), thrusts);
        if let Some(rotor) = found {
            // Refused where the others cannot fly the vehicle: the watch for hazards will end that.
            let _ = self.lose_rotor(rotor);
        }
    }

    fn step(&mut self, vehicle: &VehicleState, reference: &Reference) -> StepOutput {
        self.flight_tick = self.flight_tick.saturating_add(1);
        self.law.step(&mut self.law_state, vehicle, reference)
    }

    /// Gates the wrench and allocates it, if the rotors may turn.
    fn outputs(
        &self,
        step: StepOutput,
        mode: Mode,
        answer: Option<Result<Mode, Refusal>>,
        supply: f32,
    ) -> Outputs {
        let wrench = self.supervisor.gate(&self.supervisor_state, step.wrench);
        let (thrusts, achieved, mut limited) = match mode {
            Mode::Flying | Mode::Failsafe => {
                let allocation = self.allocator.allocate_prepared(&wrench, supply);
                let Allocation { thrusts, achieved, limited } = allocation;
                (Some(thrusts), achieved, limited)
            }
            Mode::Disarmed | Mode::Armed | Mode::Locked => (None, SAFE, Limited::empty()),
        };
        limited.set(Limited::ROTOR_FAILED, !self.failed_rotors().is_empty());
        let cause = self.supervisor_state.cause();
        let flight_tick = self.flight_tick;
        let safety = self.safety_report;
        Outputs {
            thrusts,
            wrench,
            achieved,
            step,
            limited,
            mode,
            cause,
            answer,
            safety,
            flight_tick,
        }
    }
}

/// `true` if a sample can be flown with: finite, and an attitude with a direction.
fn is_good(vehicle: &VehicleState) -> bool {
    let VehicleState { position_world, velocity_world, attitude, rate_body } = vehicle;
    let vectors = [position_world, velocity_world, rate_body];
    vectors.into_iter().all(|vector| vector.is_finite())
        && attitude.is_finite()
        && attitude.length_squared() > 0.25
}

#[cfg(test)]
#[path = "flight_control_tests.rs"]
mod tests;
