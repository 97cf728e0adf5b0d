//! The vehicle's side of the link: what each message of a host means, and what is answered.
//!
//! Pure: messages come in by [`Session::handle`]; what the control group needs is taken out
//! prepared, and answers wait in a bounded queue. Settings are parsed and checked here, in the
//! state-input group, never in the control group.

use ctrl_core::controller::{AdaptiveController, AnyController, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::mode::{Command, Mode, Refusal};
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::{AnyTrajectory, TrajectoryConfig};
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use heapless::{Deque, String};
use link::{
    Acknowledgement, ControllerKind, Downlink, FaultReport, Identity, ParameterOrigin,
    ParameterValue, Parameters, ParametersInForce, PathUpload, Received, Rejection,
    TrajectorySelection, Uplink,
};

use crate::evidence::append;
use crate::parameter_store::StoreError;
use crate::reference_source::{Origin, ReferenceSource};
use crate::scenario::{self, BuiltInMission, Tuning};
use crate::stored_parameters::StoredParameters;
use crate::vehicle::{LinkConfig, VehicleConfig};

/// Answers that may wait.
const ANSWERS: usize = 8;
/// Commands that may wait, one for each tick.
const COMMANDS: usize = 4;

/// What a session needs to know of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SessionConfig {
    /// Name of the board, at most 24 bytes.
    pub board: &'static str,
    /// A state sample stands for this many ticks.
    pub sample_valid: u32,
    /// A host that streams references is silent after this many ticks.
    pub reference_timeout: u32,
    /// Fewest ticks from one telemetry to the next that the link has room for.
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

/// What control did last, as the session sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Mode of the latest tick.
    pub mode: Mode,
    /// Ticks of flight.
    pub flight_tick: u32,
    /// Ticks since the start of the program.
    pub uptime: u32,
    /// Ticks begin when the host says so.
    pub in_step: bool,
}

/// What a host asks of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaceRequest {
    /// To decide itself when a tick begins.
    Enter,
    /// To leave that to the clock again.
    Leave,
    /// The tick after which the uptime is this.
    Step(u64),
}

impl Progress {
    /// Whether settings may change.
    fn on_ground(self) -> bool {
        !matches!(self.mode, Mode::Flying | Mode::Failsafe)
    }
}

/// A conversation with a host.
#[derive(Debug)]
pub struct Session {
    config: SessionConfig,
    tuning: Tuning,
    law: AnyController,
    law_changed: bool,
    references: ReferenceSource,
    upload: PathUpload,
    sample: Option<(VehicleState, u32)>,
    commands: Deque<(u16, Command), COMMANDS>,
    waiting: Option<u16>,
    answers: Deque<Downlink, ANSWERS>,
    dropped: u32,
    telemetry_period: u16,
    fault: Option<FaultReport>,
    greeted: bool,
    in_force: ParametersInForce,
    storage: Option<Storage>,
    pace: Option<PaceRequest>,
    in_step: bool,
}

/// A change of what is stored, until it is done.
#[derive(Clone, Copy, Debug)]
struct Storage {
    sequence: u16,
    parameters: StoredParameters,
    begun: bool,
}

impl Session {
    /// Begins with a controller and a trajectory, where the controller's parameters came from and,
    /// after a restart by itself, the report of its fault.
    ///
    /// # Errors
    /// When the chosen controller refuses its numbers or the trajectory.
    pub fn new(
        config: SessionConfig,
        flown: &BuiltInMission,
        in_force: ParametersInForce,
        fault: Option<FaultReport>,
    ) -> Result<Self, ConfigError> {
        let law = flown.tuning.controller()?;
        let trajectory = flown.trajectory.build(law.step_period())?;
        law.accept(&trajectory)?;
        let origin = Origin::Trajectory(trajectory);
        let mut session = Self {
            tuning: flown.tuning,
            law,
            law_changed: false,
            references: ReferenceSource::new(origin, config.reference_timeout),
            upload: PathUpload::default(),
            sample: None,
            commands: Deque::new(),
            waiting: None,
            answers: Deque::new(),
            dropped: 0,
            telemetry_period: 0,
            greeted: false,
            in_force,
            storage: None,
            pace: None,
            in_step: false,
            fault,
            config,
        };
        session.identify(0);
        if let Some(report) = session.fault.clone() {
            session.answer(Downlink::Fault(report));
        }
        Ok(session)
    }

    /// The law at the start.
    #[must_use]
    pub fn law(&self) -> AnyController {
        self.law
    }

    /// Obeys one message.
    pub fn handle(&mut self, received: Received<Uplink>, progress: Progress) {
        let Received { sequence, message } = received;
        let result = match message {
            Uplink::State { state, .. } => {
                self.sample = Some((state, progress.uptime));
                return;
            }
            Uplink::Reference { reference, .. } => {
                self.references.receive(reference, progress.uptime);
                return;
            }
            Uplink::Command(command) => match self.command(sequence, command) {
                Ok(()) => return, // answered once the control group has heard it
                Err(rejection) => Err(rejection),
            },
            Uplink::Hello => {
                self.greeted = true;
                return self.identify(progress.uptime);
            }
            Uplink::ParameterAt { index } => match self.parameter(Some(index)) {
                Ok(parameter) => return self.answer(parameter),
                Err(rejection) => Err(rejection),
            },
            Uplink::ParameterRead { name } => match self.parameter(self.parameter_index(&name)) {
                Ok(parameter) => return self.answer(parameter),
                Err(rejection) => Err(rejection),
            },
            Uplink::ParametersPersist => match self.keep(sequence, progress) {
                Ok(()) => return, // answered once it is done
                Err(rejection) => Err(rejection),
            },
            Uplink::ParametersForget => match self.forget(sequence, progress) {
                Ok(()) => return, // as above
                Err(rejection) => Err(rejection),
            },
            Uplink::LockStep(enter) => self.lock_step(enter, progress),
            Uplink::Step { uptime_ticks } if progress.in_step => {
                self.pace = Some(PaceRequest::Step(uptime_ticks));
                return; // answered once the tick is done
            }
            Uplink::Step { .. } => Err(Rejection::NotNow),
            Uplink::Subscribe { period } => self.subscribe(period),
            Uplink::FaultAcknowledge => return self.acknowledge_fault(sequence),
            setting if progress.on_ground() && self.storage.is_none() => self.set(setting),
            _ => Err(Rejection::NotNow),
        };
        self.acknowledge(sequence, result);
    }

    /// Obeys a message that changes how the vehicle flies; only on the ground.
    fn set(&mut self, setting: Uplink) -> Result<(), Rejection> {
        match setting {
            Uplink::SelectTrajectory(selection) => self.select_trajectory(selection),
            Uplink::SelectController(kind) => self.tune(Tuning { kind, ..self.tuning }, true),
            Uplink::PathBegin { start_world, yaw, legs } => {
                Ok(self.upload.begin(start_world, yaw, legs)?)
            }
            Uplink::PathLeg { index, leg } => Ok(self.upload.leg(index, leg)?),
            Uplink::ParameterWrite { name, value } => {
                let tuning = self.with_parameter(&name, value);
                self.tune(tuning.ok_or(Rejection::UnknownParameter)?, true)
            }
            _ => Err(Rejection::Unsupported),
        }
    }

    fn select_trajectory(&mut self, selection: TrajectorySelection) -> Result<(), Rejection> {
        use TrajectorySelection as S;
        let config = match selection {
            S::Stream => {
                self.references.select(Origin::Stream);
                return Ok(());
            }
            S::UploadedPath => return self.select_path(),
            S::Hover(config) => TrajectoryConfig::Hover(config),
            S::RisingCircle(config) => TrajectoryConfig::RisingCircle(config),
            S::Circle(config) => TrajectoryConfig::Circle(config),
            S::Lemniscate(config) => TrajectoryConfig::Lemniscate(config),
        };
        self.select_shape(&config)
    }

    /// Selects a trajectory of a few numbers. It and [`select_path`](Self::select_path) stand
    /// apart because each takes kilobytes of stack.
    #[inline(never)]
    fn select_shape(&mut self, config: &TrajectoryConfig) -> Result<(), Rejection> {
        self.follow(config.build(self.law.step_period())?)
    }

    /// Selects the uploaded path.
    #[inline(never)]
    fn select_path(&mut self) -> Result<(), Rejection> {
        let path = self.upload.finish(self.law.step_period())?;
        self.follow(AnyTrajectory::WaypointPath(path))
    }

    /// Follows a trajectory that the controller accepts.
    fn follow(&mut self, trajectory: AnyTrajectory) -> Result<(), Rejection> {
        self.law.accept(&trajectory)?;
        self.references.select(Origin::Trajectory(trajectory));
        Ok(())
    }

    /// Takes a tuning if its controller is valid and accepts the selected trajectory.
    fn tune(&mut self, tuning: Tuning, changed: bool) -> Result<(), Rejection> {
        let law = tuning.controller()?;
        if let Origin::Trajectory(trajectory) = self.references.origin() {
            law.accept(trajectory)?;
        }
        (self.tuning, self.law, self.law_changed) = (tuning, law, true);
        self.in_force.changed |= changed;
        Ok(())
    }

    /// Lets a command wait for the control group; none that could lead to flight while parameters
    /// are being stored.
    fn command(&mut self, sequence: u16, command: Command) -> Result<(), Rejection> {
        if self.storage.is_some() && command != Command::Disarm {
            return Err(Rejection::NotNow);
        }
        self.commands.push_back((sequence, command)).map_err(|_| Rejection::NotNow)
    }

    /// Asks for the parameters in force to be kept, if the next start could fly with them.
    fn keep(&mut self, sequence: u16, progress: Progress) -> Result<(), Rejection> {
        self.is_idle(progress)?;
        self.accept_built_in_trajectory()?;
        let parameters = StoredParameters::of(&self.tuning);
        self.storage = Some(Storage { sequence, parameters, begun: false });
        Ok(())
    }

    /// Goes back to the built-in parameters and asks for those that were kept to be forgotten.
    #[inline(never)]
    fn forget(&mut self, sequence: u16, progress: Progress) -> Result<(), Rejection> {
        self.is_idle(progress)?;
        self.tune(built_in()?.tuning, true)?;
        let parameters = StoredParameters::Forgotten;
        self.storage = Some(Storage { sequence, parameters, begun: false });
        Ok(())
    }

    /// Whether the vehicle is disarmed, with no command on its way and nothing being stored.
    fn is_idle(&self, progress: Progress) -> Result<(), Rejection> {
        let quiet = self.storage.is_none() && self.commands.is_empty() && self.waiting.is_none();
        let disarmed = progress.mode == Mode::Disarmed;
        (quiet && disarmed).then_some(()).ok_or(Rejection::NotNow)
    }

    /// Every start begins with it.
    #[inline(never)]
    fn accept_built_in_trajectory(&self) -> Result<(), Rejection> {
        let trajectory = built_in()?.trajectory.build(self.law.step_period())?;
        Ok(self.law.accept(&trajectory)?)
    }

    /// Enters lock step, disarmed and with nothing on its way, or leaves it.
    fn lock_step(&mut self, enter: bool, progress: Progress) -> Result<(), Rejection> {
        self.pace = match (enter, progress.in_step) {
            (false, false) => None,
            (false, true) => Some(PaceRequest::Leave),
            (true, true) => Some(PaceRequest::Step(u64::from(progress.uptime))), // answered again
            (true, false) => {
                self.is_idle(progress)?;
                Some(PaceRequest::Enter)
            }
        };
        Ok(())
    }

    /// Takes note of who decides when a tick begins. Commands that wait at the end of lock step were
    /// meant for rotors that are off: they are refused.
    pub fn keep_pace(&mut self, in_step: bool) {
        let ended = core::mem::replace(&mut self.in_step, in_step) && !in_step;
        while let Some((sequence, _)) = ended.then(|| self.commands.pop_front()).flatten() {
            self.acknowledge(sequence, Err(Rejection::NotNow));
        }
    }

    /// What the host asks of time, once.
    pub fn take_pace_request(&mut self) -> Option<PaceRequest> {
        self.pace.take()
    }

    /// What is to be stored, once; it has to be followed by [`stored`](Self::stored).
    pub fn next_to_store(&mut self) -> Option<StoredParameters> {
        let storage = self.storage.as_mut().filter(|storage| !storage.begun)?;
        storage.begun = true;
        Some(storage.parameters)
    }

    /// Answers a message that asked to store: with the generation, if that succeeded.
    pub fn stored(&mut self, result: Result<u32, StoreError>) {
        let Some(Storage { sequence, parameters, .. }) = self.storage.take() else { return };
        let result = match result {
            Ok(generation) => {
                let origin = match parameters {
                    StoredParameters::Kept(_) => ParameterOrigin::Stored,
                    StoredParameters::Forgotten => ParameterOrigin::BuiltIn,
                };
                self.in_force = ParametersInForce { origin, generation, changed: false };
                Ok(())
            }
            Err(StoreError::Full) => Err(Rejection::StorageFull),
            Err(StoreError::Failed) => Err(Rejection::StorageFailed),
        };
        self.answer(Downlink::ParametersInForce(self.in_force));
        self.acknowledge(sequence, result);
    }

    fn with_parameter(&self, name: &str, value: f32) -> Option<Tuning> {
        let Tuning { kind, robust_adaptive, saturated } = self.tuning;
        Some(match kind {
            ControllerKind::RobustAdaptive => Tuning {
                robust_adaptive: robust_adaptive.with_parameter(name, value)?,
                ..self.tuning
            },
            ControllerKind::Saturated => {
                Tuning { saturated: saturated.with_parameter(name, value)?, ..self.tuning }
            }
        })
    }

    fn parameter_index(&self, name: &str) -> Option<u16> {
        match self.tuning.kind {
            ControllerKind::RobustAdaptive => {
                parameter_index_in(&self.tuning.robust_adaptive, name)
            }
            ControllerKind::Saturated => parameter_index_in(&self.tuning.saturated, name),
        }
    }

    fn parameter(&self, index: Option<u16>) -> Result<Downlink, Rejection> {
        let index = index.ok_or(Rejection::UnknownParameter)?;
        let value = match self.tuning.kind {
            ControllerKind::RobustAdaptive => parameter_in(self.tuning.robust_adaptive, index),
            ControllerKind::Saturated => parameter_in(self.tuning.saturated, index),
        };
        value.map(Downlink::Parameter).ok_or(Rejection::UnknownParameter)
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

    /// Says who is there, with which parameters.
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
        if self.answers.push_back(message).is_err() {
            self.dropped = self.dropped.wrapping_add(1);
        }
    }

    /// Whether there is a message to send.
    #[must_use]
    pub fn has_answers(&self) -> bool {
        !self.answers.is_empty()
    }

    /// The next message to send.
    pub fn next_answer(&mut self) -> Option<Downlink> {
        self.answers.pop_front()
    }

    /// The latest state sample, unless it is too old at tick `uptime`.
    #[must_use]
    pub fn sample(&self, uptime: u32) -> Option<VehicleState> {
        let (sample, since) = self.sample?;
        (uptime.wrapping_sub(since) < self.config.sample_valid).then_some(sample)
    }

    /// The reference for the tick after `progress`.
    pub fn reference(&mut self, progress: Progress) -> Reference {
        let here = self.sample.map_or(Vec3::ZERO, |(sample, _)| sample.position_world);
        self.references.next(progress.flight_tick, progress.uptime, here)
    }

    /// The next command for the control group, once the one before is [answered](Self::answered).
    pub fn next_command(&mut self) -> Option<Command> {
        if self.waiting.is_some() {
            return None;
        }
        let (sequence, command) = self.commands.pop_front()?;
        self.waiting = Some(sequence);
        Some(command)
    }

    /// Passes on what the control group said to the command that it was given.
    pub fn answered(&mut self, answer: Result<Mode, Refusal>) {
        if let Some(sequence) = self.waiting.take() {
            self.acknowledge(sequence, answer.map(|_| ()).map_err(Rejection::Mode));
        }
    }

    /// A law that has replaced the one before, once.
    pub fn take_law(&mut self) -> Option<AnyController> {
        core::mem::take(&mut self.law_changed).then_some(self.law)
    }

    /// Ticks from one telemetry to the next; zero for none.
    #[must_use]
    pub fn telemetry_period(&self) -> u16 {
        self.telemetry_period
    }

    /// Whether a host has said hello since the start.
    #[must_use]
    pub fn greeted(&self) -> bool {
        self.greeted
    }

    /// Whether a fault has not been acknowledged: the vehicle must not fly.
    #[must_use]
    pub fn fault_pending(&self) -> bool {
        self.fault.is_some()
    }

    /// Answers that found no room.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}

/// What the image carries. An error means a damaged image, which did not start.
fn built_in() -> Result<BuiltInMission, Rejection> {
    scenario::built_in_mission().map_err(|_| Rejection::StorageFailed)
}

fn parameter_index_in<C: Parameters>(_: &C, name: &str) -> Option<u16> {
    C::parameter_index(name)
}

fn parameter_in<C: Parameters>(config: C, index: u16) -> Option<ParameterValue> {
    let (name, value) = config.parameter_at(index)?;
    Some(ParameterValue { index, count: C::TABLE.len() as u16, name: copy(name), value })
}

/// As much of `text` as fits.
fn copy<const N: usize>(text: &str) -> String<N> {
    let mut copy = String::new();
    append(&mut copy, text);
    copy
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
