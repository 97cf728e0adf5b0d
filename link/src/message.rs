//! The messages of both directions.
//!
//! The order of the variants and of the fields is the wire format: append only, and raise
//! [`VERSION`] for anything else. Every message but the samples is answered by an
//! [`Acknowledgement`]; each may be sent again when its answer is lost.

use glam::{Quat, Vec3};
use heapless::String;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::statistics::{GroupHealth, LinkStatistics};
use super::{GROUPS, NAME_MAX, REGISTERS, TEXT_MAX, VERSION};
use ctrl_core::allocation::Limited;
use ctrl_core::controller::{Auxiliary, ControllerConfig, Estimates, LastingEstimates, StepStatus};
use ctrl_core::error::ConfigError;
use ctrl_core::estimator::{
    BarometerBias, FaultLimits, InertialNoise, InertialSample, InitialDeviation, Measurement,
    Source, SourceConfig,
};
use ctrl_core::mode::navigation::NavigationMode;
use ctrl_core::mode::{Cause, Command, Mode, Refusal};
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::{CircleConfig, HoverConfig, Leg, LemniscateConfig, RisingCircleConfig};
use ctrl_core::vehicle::{VehicleState, Wrench};

/// A message of one direction.
pub trait Message: Serialize + DeserializeOwned {
    /// First byte of each frame: the version, and the direction in the top bit.
    const TAG: u8;

    /// Returns `true` if the sender has just begun and numbers its frames from zero.
    fn begins_numbering(&self) -> bool;
}

/// From the host to the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Uplink {
    /// First message of a host; answered by [`Downlink::Identity`].
    Hello,
    /// Arm, disarm, start or stop. Start from Armed resets the controller and sets the trajectory
    /// to tick zero; Start from Failsafe goes on where they were.
    Command(Command),
    /// State of the vehicle at a control tick.
    State {
        /// Control tick since Start.
        tick: u64,
        /// The state then.
        state: VehicleState,
    },
    /// Reference at a control tick; used while [`TrajectorySelection::Stream`] is selected.
    Reference {
        /// Control tick since Start.
        tick: u64,
        /// The reference then.
        reference: Reference,
    },
    /// Selects the trajectory from the next Start.
    SelectTrajectory(TrajectorySelection),
    /// Selects the controller from the next Start.
    SelectController(ControllerKind),
    /// Begins the upload of a waypoint path and forgets the last one.
    PathBegin {
        /// Position at tick zero, at rest (m).
        start_world: Vec3,
        /// Heading of the path (rad).
        yaw: f32,
        /// Number of legs that follow.
        legs: u8,
    },
    /// One leg of the path.
    PathLeg {
        /// From zero, in order; a leg that was sent before is replaced.
        index: u8,
        /// The leg.
        leg: Leg,
    },
    /// Asks for the parameter at an index; answered by [`Downlink::Parameter`].
    ParameterAt {
        /// From zero to the count in the answer.
        index: u16,
    },
    /// Asks for a parameter by name; answered by [`Downlink::Parameter`].
    ParameterRead {
        /// Its name.
        name: String<NAME_MAX>,
    },
    /// Sets a parameter, if the whole configuration is then valid; not while flying.
    ParameterWrite {
        /// Its name.
        name: String<NAME_MAX>,
        /// Its new value, in the unit that the name's documentation states.
        value: f32,
    },
    /// Keeps the parameters in force, of both controllers, and the choice of controller over a
    /// restart; only disarmed.
    ParametersPersist,
    /// Telemetry every so many control ticks; zero for none.
    Subscribe {
        /// Control ticks from one telemetry to the next.
        period: u16,
    },
    /// Asks for the last [`Downlink::Fault`] and, once acknowledged here, forgets it.
    FaultAcknowledge,
    /// Forgets the parameters that were kept: the built-in ones are in force at once and after a
    /// restart; only disarmed.
    ParametersForget,
    /// Enters (true) or leaves lock step: control ticks then begin at [`Uplink::Step`] only, and the
    /// rotor outputs stay off. Only disarmed; leaving disarms.
    LockStep(bool),
    /// Lock-step request: runs one control tick; answered by [`Downlink::Stepped`].
    Step {
        /// Ticks since the start of the program after it. The tick before asks for nothing but the
        /// answer again; any other number is answered alike.
        uptime_ticks: u64,
    },
    /// Configures the estimator aboard, part by part; only on the ground.
    Estimator(EstimatorSetting),
    /// State at which the estimate begins anew, and a sample of the vehicle on the ground; only there, and with the
    /// estimator in use.
    EstimatorStart(VehicleState),
    /// Inertial sample of a control tick, in place of a state.
    Inertial {
        /// Control tick since Start.
        tick: u64,
        /// Means over the tick.
        sample: InertialSample,
    },
    /// Measurement that arrives with the tick of the next inertial sample.
    Measured(Measurement),
    /// Asks for the reference of the next control tick; answered by [`Downlink::Guidance`].
    GuidanceRead,
    /// Puts a key of MAVLink's signatures in force and keeps it over a restart, or, all zeros, removes it; only disarmed.
    /// The line must be one that nobody else reads.
    SigningKey {
        /// The key.
        key: Secret,
        /// Time of the host's clock, which the vehicle's goes on from (10 us since 2015-01-01).
        timestamp: u64,
    },
}

/// A key, never shown.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Secret(pub [u8; 32]);

impl core::fmt::Debug for Secret {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        out.write_str("Secret(..)")
    }
}

/// Part of the estimator's configuration. Parts are checked together, when the estimator is put to use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum EstimatorSetting {
    /// Noise of the inertial sensors.
    Inertial(InertialNoise),
    /// Deviations at the start.
    Initial(InitialDeviation),
    /// Direction of the Earth's magnetic field, world axes.
    MagneticField(Vec3),
    /// Bias of the barometer.
    BarometerBias(BarometerBias),
    /// One source of measurements.
    Source(Source, SourceConfig),
    /// Limits of faults.
    Faults(FaultLimits),
    /// Puts the estimator to use, with the controller's step period: from now on the vehicle flies by sensors.
    Use,
    /// Puts it out of use: the vehicle flies by states again.
    Off,
}

/// From the vehicle to the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put a report on")]
pub enum Downlink {
    /// First message after a start, and the answer to [`Uplink::Hello`].
    Identity(Identity),
    /// Acceptance or rejection of a message.
    Acknowledgement(Acknowledgement),
    /// Input and output of the controller at one tick.
    Telemetry(Telemetry),
    /// A parameter.
    Parameter(ParameterValue),
    /// Reason for a restart of the vehicle by itself.
    Fault(FaultReport),
    /// Health of link and rate groups.
    Health(Health),
    /// Origin of the parameters in force: after every [`Identity`], and when that has changed.
    ParametersInForce(ParametersInForce),
    /// In lock step: a control tick and all that it released are done, and all that they sent
    /// was sent before. Also sent when lock step begins.
    Stepped {
        /// Ticks since the start of the program.
        uptime_ticks: u64,
    },
    /// The reference of a control tick, and its source.
    Guidance(Guidance),
    /// Estimates of the integral action, right behind the [`Downlink::Telemetry`] of their tick; only from a law that has
    /// integral action.
    Lasting(Lasting),
}

impl Message for Uplink {
    const TAG: u8 = VERSION;

    fn begins_numbering(&self) -> bool {
        matches!(self, Self::Hello)
    }
}

impl Message for Downlink {
    const TAG: u8 = VERSION | 0x80;

    fn begins_numbering(&self) -> bool {
        matches!(self, Self::Identity(_))
    }
}

/// A trajectory that the vehicle flies without further uplink, or where the references come from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum TrajectorySelection {
    /// The references of [`Uplink::Reference`].
    Stream,
    /// Standing still.
    Hover(HoverConfig),
    /// The paper's trajectory.
    RisingCircle(RisingCircleConfig),
    /// A horizontal circle.
    Circle(CircleConfig),
    /// A horizontal figure of eight.
    Lemniscate(LemniscateConfig),
    /// The path of the last complete upload.
    UploadedPath,
}

/// Kind of control law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControllerKind {
    /// Controller 1 (Theorem 1).
    RobustAdaptive,
    /// Controller 2 (Theorem 2).
    Saturated,
}

impl From<&ControllerConfig> for ControllerKind {
    fn from(config: &ControllerConfig) -> Self {
        match config {
            ControllerConfig::RobustAdaptive(_) => Self::RobustAdaptive,
            ControllerConfig::Saturated(_) => Self::Saturated,
        }
    }
}

/// Identity of the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the firmware.
    pub firmware: String<24>,
    /// The board it runs on.
    pub board: String<24>,
    /// The selected controller.
    pub controller: ControllerKind,
    /// Control period (s).
    pub step_period: f32,
    /// Control ticks since the start of the program.
    pub uptime_ticks: u64,
    /// The vehicle restarted by itself and keeps a [`Downlink::Fault`].
    pub fault_pending: bool,
}

/// The answer to a message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Acknowledgement {
    /// Sequence number of the frame that is answered.
    pub sequence: u16,
    /// Obeyed, or why not.
    pub result: Result<(), Rejection>,
}

/// Reason for the rejection of a message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Rejection {
    /// The command does not fit the mode or its conditions.
    Mode(Refusal),
    /// A value violates a bound.
    Invalid {
        /// Name of the parameter or expression, cut to [`NAME_MAX`].
        parameter: String<NAME_MAX>,
        /// Its value.
        value: f32,
        /// Lower end of what is allowed, possibly excluded.
        lower: f32,
        /// Upper end of what is allowed, possibly excluded.
        upper: f32,
    },
    /// No parameter has this name or index.
    UnknownParameter,
    /// No complete path has been uploaded.
    NoPath,
    /// The leg is not the next one, or there is no path to add it to.
    LegOrder {
        /// Index of the leg that is expected next.
        expected: u8,
    },
    /// Not while armed or flying.
    NotNow,
    /// The parameters could not be stored.
    StorageFailed,
    /// This vehicle does not do that.
    Unsupported,
    /// There is no room to store the parameters before the next restart, which makes room.
    StorageFull,
}

impl From<ConfigError> for Rejection {
    fn from(error: ConfigError) -> Self {
        let mut parameter = String::new();
        for character in error.parameter.chars() {
            if parameter.push(character).is_err() {
                break;
            }
        }
        let (lower, upper) = error.bound.ends();
        Self::Invalid { parameter, value: error.value, lower, upper }
    }
}

/// One control tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Control tick since Start.
    pub tick: u64,
    /// Mode after the tick.
    pub mode: Mode,
    /// Reason for the last change to a safer mode.
    pub cause: Option<Cause>,
    /// The wrench that went to the rotors, after the mode's gate.
    pub wrench: Wrench,
    /// `tau_d`: the torque before saturation (N m).
    pub torque_demand_body: Vec3,
    /// Status of the step.
    pub status: StepStatus,
    /// Parts of the wrench that the rotors' limits reduced.
    pub limited: Limited,
    /// Estimates after the step.
    pub estimates: Estimates,
    /// `q_e`: attitude error.
    pub attitude_error: Quat,
    /// The auxiliary system of controller 2.
    pub auxiliary: Auxiliary,
    /// Cost of the step, in the unit of the board's counter (cycles, or instructions in the
    /// emulator); zero where there is none.
    pub step_cost: u32,
}

/// Estimates of the integral action at one control tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lasting {
    /// Control tick since Start.
    pub tick: u64,
    /// Estimates after the step.
    pub estimates: LastingEstimates,
}

/// What the law follows at a control tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Guidance {
    /// Changes of the law's parameters since the start of the program.
    pub law_changes: u32,
    /// Mode of the flight under a ground station.
    pub navigation: NavigationMode,
    /// The reference, whoever gives it.
    pub reference: Reference,
}

/// A parameter by name and value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    /// Its place in the list.
    pub index: u16,
    /// Length of the list.
    pub count: u16,
    /// Its name.
    pub name: String<NAME_MAX>,
    /// Its value.
    pub value: f32,
}

/// Origin of the parameters in force at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ParameterOrigin {
    /// From the image: nothing is stored, or what was stored was forgotten.
    #[default]
    BuiltIn,
    /// From the vehicle's memory.
    Stored,
    /// From the image: something is stored, but no whole set of parameters.
    Unreadable,
    /// From the image: a set is stored that this firmware does not accept.
    Refused,
}

/// Origin of the parameters in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParametersInForce {
    /// Origin at the start, or at the last keeping or forgetting.
    pub origin: ParameterOrigin,
    /// Count of keepings and forgettings on this vehicle.
    pub generation: u32,
    /// They have been changed since: a restart would bring other ones.
    pub changed: bool,
}

/// Kind of fault that restarted the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultKind {
    /// The program panicked.
    Panic,
    /// The processor took a hard fault.
    HardFault,
    /// An interrupt or exception without a handler.
    UnexpectedInterrupt,
    /// The watchdog was not fed.
    Watchdog,
}

/// Evidence of a fault, kept over the restart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FaultReport {
    /// Description of the fault.
    pub kind: FaultKind,
    /// Control ticks between start and fault.
    pub uptime_ticks: u32,
    /// r0, r1, r2, r3, r12, lr, pc, xpsr, cfsr, hfsr, mmfar, bfar, msp, icsr; zero where unknown.
    pub registers: [u32; REGISTERS],
    /// Source line of a panic, else zero.
    pub line: u32,
    /// Message and file of a panic.
    pub text: String<TEXT_MAX>,
}

/// Counts since the start of the program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Health {
    /// Control ticks since the start of the program.
    pub uptime_ticks: u64,
    /// Control, state input, telemetry, housekeeping.
    pub groups: [GroupHealth; GROUPS],
    /// Statistics of the vehicle's decoder.
    pub link: LinkStatistics,
    /// Frames that did not fit the vehicle's transmit queue.
    pub transmit_dropped: u32,
}
