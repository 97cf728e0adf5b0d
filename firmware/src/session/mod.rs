//! The vehicle's side of the link: messages of a host, and their answers.
//!
//! Pure: messages come in by [`HostSession::handle`]; the inputs of the control group are taken out
//! prepared, and answers wait in a bounded queue. Settings are parsed and checked here, in the
//! state-input group, never in the control group.

mod commands;
mod estimator;
mod parameters;
mod storage;
mod trajectories;

use core::mem::MaybeUninit;

use ctrl_core::controller::{AdaptiveController, AnyController, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::estimator::EstimatorConfig;
use ctrl_core::mode::Command;
use ctrl_core::mode::navigation::NavigationMode;
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::{CheckedTrajectory, TrajectoryConfig};
use glam::Vec3;
use heapless::{Deque, String};
use link::{
    Acknowledgement, Downlink, FaultReport, Guidance, Identity, ParametersInForce, PathUpload,
    Received, Rejection, Uplink,
};

use crate::evidence::append;
use crate::exchange::{ControlStatus, PreparedInputs};
use crate::reference_source::ReferenceSource;
use crate::scenario::Tuning;
use crate::sensor::HostSensors;
use crate::state_sample::{ArrivedState, StateSample, TickOrder};
use crate::tick_source::{LockStepRequest, TickOrigin};
use crate::vehicle::{LinkConfig, VehicleConfig};
pub use storage::SigningChange;
use storage::Storage;

/// Answers that may wait.
const ANSWERS: usize = 8;
/// Commands that may wait; one is carried out per tick.
const COMMANDS: usize = 4;

/// Properties of the vehicle that a session depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionConfig {
    /// Name of the board, at most 24 bytes.
    pub board: &'static str,
    /// A state sample is used for this many ticks.
    pub sample_valid: u32,
    /// Timeout of the reference stream (ticks).
    pub reference_timeout: u32,
    /// Fewest ticks from one telemetry to the next that the link can carry.
    pub telemetry_period_min: u16,
}

impl SessionConfig {
    /// The configuration of a vehicle on a board.
    #[must_use]
    pub fn new(board: &'static str, telemetry_period_min: u16, vehicle: &VehicleConfig) -> Self {
        let LinkConfig { sample_valid, reference_timeout } = vehicle.link;
        Self { board, sample_valid, reference_timeout, telemetry_period_min }
    }
}

/// The large parts of a session, kilobytes, in memory that the caller provides: they are filled in
/// place and never moved.
#[derive(Debug)]
pub struct SessionMemory {
    references: ReferenceSource,
    upload: PathUpload,
    answers: Deque<Downlink, ANSWERS>,
}

impl SessionMemory {
    /// Memory without trajectory, upload and answers.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            references: ReferenceSource::new(0),
            upload: PathUpload::new(),
            answers: Deque::new(),
        }
    }
}

impl SessionMemory {
    /// Follows the trajectory, if the tuning's controller is valid and accepts it; returns the law.
    fn begin(
        &mut self,
        config: &SessionConfig,
        tuning: &Tuning,
        trajectory: &TrajectoryConfig,
    ) -> Result<AnyController, ConfigError> {
        let law = tuning.controller()?;
        let trajectory = trajectory.check(law.step_period())?;
        accept(&law, &trajectory)?;
        self.references.set_timeout(config.reference_timeout);
        self.references.follow(&trajectory);
        Ok(law)
    }
}

impl Default for SessionMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// A session with a host.
#[derive(Debug)]
pub struct HostSession<'a> {
    config: SessionConfig,
    memory: &'a mut SessionMemory,
    tuning: Tuning,
    law: AnyController,
    law_changed: bool,
    arrived: Option<ArrivedState>,
    state_order: TickOrder,
    reference_order: TickOrder,
    commands: Deque<(u16, Command), COMMANDS>,
    /// Sequence number of the command that the control group has taken.
    in_control: Option<u16>,
    dropped: u32,
    telemetry_period: u16,
    fault: Option<FaultReport>,
    greeted: bool,
    in_force: ParametersInForce,
    storage: Option<Storage>,
    lock_step_request: Option<LockStepRequest>,
    /// The estimator's configuration as the host has sent it, and whether it is in use.
    estimator: EstimatorConfig,
    by_sensors: bool,
    estimator_changed: bool,
    sensors: HostSensors,
    /// Tick of the latest inertial sample.
    inertial_tick: u64,
    /// A command of the pilot's is on its way.
    piloted: bool,
    /// Uptime of the latest message.
    heard: u32,
    /// Changes of the law.
    law_changes: u32,
    guidance_asked: bool,
    /// Signatures that have been stored, until the ground station's port takes them.
    signing: Option<SigningChange>,
    /// Their time may be stored again.
    signing_storable: bool,
}

impl<'a> HostSession<'a> {
    /// Begins with a controller and a trajectory, the origin of the controller's parameters and,
    /// after a restart by itself, the report of its fault.
    ///
    /// # Errors
    /// When the chosen controller refuses its numbers or the trajectory.
    pub fn new(
        memory: &'a mut SessionMemory,
        config: SessionConfig,
        tuning: &Tuning,
        trajectory: &TrajectoryConfig,
        in_force: ParametersInForce,
        fault: Option<FaultReport>,
    ) -> Result<Self, ConfigError> {
        let law = memory.begin(&config, tuning, trajectory)?;
        let mut session = Self::silent(memory, config, tuning, &law, in_force, fault);
        session.greet();
        Ok(session)
    }

    /// As [`new`](Self::new), but in `place`: a session is a kilobyte.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    #[inline(never)]
    pub fn new_in<'p>(
        place: &'p mut MaybeUninit<Self>,
        memory: &'a mut SessionMemory,
        config: SessionConfig,
        tuning: &Tuning,
        trajectory: &TrajectoryConfig,
        in_force: ParametersInForce,
        fault: Option<FaultReport>,
    ) -> Result<&'p mut Self, ConfigError> {
        let law = memory.begin(&config, tuning, trajectory)?;
        let session = place.write(Self::silent(memory, config, tuning, &law, in_force, fault));
        session.greet();
        Ok(session)
    }

    /// A session that has sent nothing.
    #[inline(always)]
    fn silent(
        memory: &'a mut SessionMemory,
        config: SessionConfig,
        tuning: &Tuning,
        law: &AnyController,
        in_force: ParametersInForce,
        fault: Option<FaultReport>,
    ) -> Self {
        Self {
            memory,
            tuning: *tuning,
            law: *law,
            law_changed: false,
            arrived: None,
            state_order: TickOrder::new(),
            reference_order: TickOrder::new(),
            commands: Deque::new(),
            in_control: None,
            dropped: 0,
            telemetry_period: 0,
            greeted: false,
            in_force,
            storage: None,
            lock_step_request: None,
            estimator: EstimatorConfig::EXAMPLE,
            by_sensors: false,
            estimator_changed: false,
            sensors: HostSensors::NONE,
            inertial_tick: 0,
            piloted: false,
            heard: 0,
            law_changes: 0,
            guidance_asked: false,
            signing: None,
            signing_storable: true,
            fault,
            config,
        }
    }

    /// Sends identity and fault before any host asks.
    fn greet(&mut self) {
        self.identify(0);
        if let Some(report) = self.fault.clone() {
            self.answer(Downlink::Fault(report));
        }
    }

    /// The law of the current tuning.
    #[must_use]
    pub fn law(&self) -> &AnyController {
        &self.law
    }

    /// Uptime of the latest message (ticks).
    #[must_use]
    pub fn heard(&self) -> u32 {
        self.heard
    }

    /// Carries out one message; `origin` is that of the next tick.
    #[inline(never)]
    pub fn handle(
        &mut self,
        received: &Received<Uplink>,
        status: ControlStatus,
        origin: TickOrigin,
    ) {
        let Received { sequence, ref message } = *received;
        self.heard = status.uptime;
        let result = match message {
            Uplink::State { .. }
            | Uplink::Reference { .. }
            | Uplink::EstimatorStart(_)
            | Uplink::Inertial { .. }
            | Uplink::Measured(_) => {
                self.receive(message, status);
                return;
            }
            Uplink::Hello => return self.handshake(status),
            Uplink::ParameterAt { .. } | Uplink::ParameterRead { .. } => {
                match self.read_parameter(message) {
                    Ok(parameter) => return self.answer(parameter),
                    Err(rejection) => Err(rejection),
                }
            }
            Uplink::Command(_)
            | Uplink::ParametersPersist
            | Uplink::ParametersForget
            | Uplink::SigningKey { .. } => {
                match self.begin(sequence, message, status) {
                    Ok(()) => return, // answered once it is done
                    Err(rejection) => Err(rejection),
                }
            }
            Uplink::LockStep(enter) => self.lock_step(*enter, status, origin),
            Uplink::Step { uptime_ticks } if origin == TickOrigin::LockStep => {
                self.lock_step_request = Some(LockStepRequest::Step(*uptime_ticks));
                return; // answered once the tick is done
            }
            Uplink::Step { .. } => Err(Rejection::NotNow),
            Uplink::Subscribe { period } => self.subscribe(*period),
            Uplink::FaultAcknowledge => return self.acknowledge_fault(sequence),
            Uplink::GuidanceRead => {
                self.guidance_asked = true;
                return; // answered once the inputs are prepared
            }
            setting if status.on_ground() && self.storage.is_none() => self.set(setting),
            _ => Err(Rejection::NotNow),
        };
        self.acknowledge(sequence, result);
    }

    /// Takes a state sample, samples of the host's sensors or a reference, unless its tick shows that it is late; `false`
    /// for any other message, which [`handle`](Self::handle) has to take.
    pub fn receive(&mut self, message: &Uplink, status: ControlStatus) -> bool {
        let ControlStatus { flight_tick, uptime, .. } = status;
        self.heard = uptime;
        match message {
            // By sensors, a state from outside is no sample.
            Uplink::State { .. } if self.by_sensors => {}
            Uplink::State { tick, state } => {
                if self.state_order.accept(*tick, flight_tick) {
                    self.arrived = Some(ArrivedState { state: *state, uptime });
                }
            }
            Uplink::Reference { tick, reference } => {
                if self.reference_order.accept(*tick, flight_tick) {
                    self.memory.references.receive(*reference, uptime);
                }
            }
            Uplink::EstimatorStart(_) | Uplink::Inertial { .. } | Uplink::Measured(_) => {
                self.sense(message, status);
            }
            _ => return false,
        }
        true
    }

    /// Answers a host's handshake, after which its ticks may begin anew.
    fn handshake(&mut self, status: ControlStatus) {
        self.greeted = true;
        self.state_order.restart();
        self.reference_order.restart();
        self.identify(status.uptime);
    }

    /// Begins an action that is answered when it is done.
    fn begin(
        &mut self,
        sequence: u16,
        message: &Uplink,
        status: ControlStatus,
    ) -> Result<(), Rejection> {
        match message {
            Uplink::Command(command) => self.queue_command(sequence, *command),
            Uplink::ParametersPersist => self.persist(sequence, status),
            Uplink::SigningKey { key, timestamp } => {
                self.keep_key(sequence, key, *timestamp, status)
            }
            _ => self.forget(sequence, status),
        }
    }

    /// Changes a setting of the next flight; only on the ground.
    #[inline(never)]
    fn set(&mut self, setting: &Uplink) -> Result<(), Rejection> {
        match setting {
            Uplink::SelectTrajectory(selection) => self.select_trajectory(selection),
            Uplink::SelectController(kind) => self.select_controller(*kind),
            Uplink::PathBegin { start_world, yaw, legs } => {
                Ok(self.memory.upload.begin(*start_world, *yaw, *legs)?)
            }
            Uplink::PathLeg { index, leg } => Ok(self.memory.upload.leg(*index, *leg)?),
            Uplink::ParameterWrite { name, value } => self.write_parameter(name, *value),
            Uplink::Estimator(setting) => self.set_estimator(setting),
            _ => Err(Rejection::Unsupported),
        }
    }

    fn subscribe(&mut self, period: u16) -> Result<(), Rejection> {
        let lower = self.config.telemetry_period_min;
        if period != 0 && period < lower {
            return Err(Rejection::Invalid {
                parameter: copy("period"),
                value: f32::from(period),
                lower: f32::from(lower),
                upper: f32::from(u16::MAX),
            });
        }
        self.telemetry_period = period;
        Ok(())
    }

    /// Sends the fault report a last time and forgets it.
    fn acknowledge_fault(&mut self, sequence: u16) {
        if let Some(report) = self.fault.take() {
            self.answer(Downlink::Fault(report));
        }
        self.acknowledge(sequence, Ok(()));
    }

    /// Sends identity and origin of the parameters.
    fn identify(&mut self, uptime: u32) {
        self.answer(Downlink::Identity(Identity {
            firmware: copy(env!("CARGO_PKG_VERSION")),
            board: copy(self.config.board),
            controller: self.tuning.kind,
            step_period: self.law.step_period(),
            uptime_ticks: u64::from(uptime),
            fault_pending: self.fault.is_some(),
        }));
        self.answer(Downlink::ParametersInForce(self.in_force));
    }

    fn acknowledge(&mut self, sequence: u16, result: Result<(), Rejection>) {
        self.answer(Downlink::Acknowledgement(Acknowledgement { sequence, result }));
    }

    fn answer(&mut self, message: Downlink) {
        if self.memory.answers.push_back(message).is_err() {
            self.dropped = self.dropped.wrapping_add(1);
        }
    }

    /// `true` if there is a message to send.
    #[must_use]
    pub fn has_answers(&self) -> bool {
        !self.memory.answers.is_empty()
    }

    /// The next message to send.
    pub fn next_answer(&mut self) -> Option<Downlink> {
        self.memory.answers.pop_front()
    }

    /// The inputs of the tick after `status`.
    pub fn prepare(&mut self, status: ControlStatus) -> PreparedInputs {
        PreparedInputs {
            sample: self.sample(status.uptime),
            reference: self.reference(status),
            fault: self.fault_pending(),
        }
    }

    /// Tells the host that has asked for it the reference of the next tick, and the mode that it comes from.
    #[inline(never)]
    pub fn guide(&mut self, navigation: NavigationMode, reference: &Reference) {
        if core::mem::take(&mut self.guidance_asked) {
            let (law_changes, reference) = (self.law_changes, *reference);
            self.answer(Downlink::Guidance(Guidance { law_changes, navigation, reference }));
        }
    }

    /// The latest state sample, unless it is too old at tick `uptime`.
    #[must_use]
    pub fn sample(&self, uptime: u32) -> Option<StateSample> {
        let sample = self.arrived?.at(uptime);
        (sample.age_ticks < self.config.sample_valid).then_some(sample)
    }

    /// The reference for the tick after `status`.
    pub fn reference(&mut self, status: ControlStatus) -> Reference {
        let here = self.arrived.map_or(Vec3::ZERO, |arrived| arrived.state.position_world);
        self.memory.references.next(status.flight_tick, status.uptime, here)
    }

    /// A law that has replaced the one before, once.
    pub fn take_law(&mut self) -> Option<&AnyController> {
        core::mem::take(&mut self.law_changed).then_some(&self.law)
    }

    /// `true` while parameters are being stored.
    #[must_use]
    pub fn is_storing(&self) -> bool {
        self.storage.is_some()
    }

    /// Tells if a command of the [pilot](crate::pilot)'s is on its way, which nothing must be stored beside.
    pub fn set_piloted(&mut self, piloted: bool) {
        self.piloted = piloted;
    }

    /// Ticks from one telemetry to the next; zero for none.
    #[must_use]
    pub fn telemetry_period(&self) -> u16 {
        self.telemetry_period
    }

    /// `true` after the first handshake of a host.
    #[must_use]
    pub fn greeted(&self) -> bool {
        self.greeted
    }

    /// `true` while a fault has not been acknowledged: the vehicle must not fly.
    #[must_use]
    pub fn fault_pending(&self) -> bool {
        self.fault.is_some()
    }

    /// Answers that found no room.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// State samples and references dropped because their tick was older than the newest.
    #[must_use]
    pub fn late(&self) -> u32 {
        self.state_order.late().wrapping_add(self.reference_order.late())
    }
}

/// Refuses a trajectory that a law cannot follow.
fn accept(law: &AnyController, trajectory: &CheckedTrajectory) -> Result<(), ConfigError> {
    law.accept_limits(trajectory.acceleration_bound(), trajectory.step_period())
}

/// As much of `text` as fits.
fn copy<const N: usize>(text: &str) -> String<N> {
    let mut copy = String::new();
    append(&mut copy, text);
    copy
}

#[cfg(test)]
mod tests;
