//! The bytes of `docs/protocol.md` are those of the code.

use std::format;
use std::string::String;

use super::*;
use ctrl_core::allocation::Limited;
use ctrl_core::controller::{Auxiliary, Estimates, LastingEstimates, StepStatus};
use ctrl_core::mode::{Cause, Command, Mode, Refusal};
use ctrl_core::trajectory::Leg;
use ctrl_core::vehicle::Wrench;

const PROTOCOL: &str = include_str!("../../../docs/protocol.md");

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

const HELLO: &str = "02 01 01 01 05 79 b8 f8 99 00";
const ARM: &str = "03 01 01 02 01 05 89 88 e5 5a 00";
const STATE: &str = "03 01 02 04 02 e8 07 01 03 c4 42 01 01 02 c0 01 01 01 01 01 01 02 3f 01 03 80 3e 01 03 80 bf 01 01 01 01 01 01 01 01 01 01 01 01 01 03 80 3f 01 01 01 01 01 01 02 3e 01 01 01 05 bb e1 82 31 00";
const OBEYED: &str = "02 81 01 03 01 01 05 a8 3d f7 7c 00";
const REFUSED: &str = "02 81 01 04 01 01 01 06 01 59 4e aa 09 00";

const TELEMETRY: &str = "02 81 01 07 02 e8 07 03 01 01 01 03 80 3f 01 01 02 40 01 03 40 40 01 03 80 40 01 03 a0 40 01 03 c0 40 01 06 e0 40 80 03 04 01 01 02 41 01 03 10 41 01 03 20 41 01 03 30 41 01 03 40 41 01 03 50 41 01 03 60 41 01 03 70 41 01 03 80 41 01 03 88 41 01 03 90 41 01 03 98 41 01 03 a0 41 01 03 a8 41 01 03 b0 41 01 03 b8 41 01 03 c0 41 01 03 c8 41 01 03 d0 41 01 03 d8 41 01 09 e0 41 c8 0d 43 ba 3f a9 00";

const LASTING: &str = "02 81 01 04 09 e8 07 01 03 80 3f 01 01 02 40 01 03 40 40 01 03 80 40 01 03 a0 40 01 03 c0 40 01 03 e0 40 01 01 02 41 01 07 10 41 95 5d 21 a1 00";

/// Asserts the bytes, and that the document shows them.
fn assert_documented(bytes: &[u8], expected: &str) {
    assert_eq!(hex(bytes), expected);
    // The document may break the line anywhere.
    let words: Vec<&str> = PROTOCOL.split_whitespace().collect();
    let shown: Vec<&str> = expected.split(' ').collect();
    assert!(words.windows(shown.len()).any(|words| words == shown), "{expected} is not shown");
}

#[test]
fn example_frames() {
    let mut up = Encoder::default();
    let mut frame = [0; MAX_FRAME];
    for (message, expected) in
        [(Uplink::Hello, HELLO), (Uplink::Command(Command::Arm), ARM), (example_state(), STATE)]
    {
        assert_documented(up.encode(&message, &mut frame).unwrap(), expected);
    }
    let obeyed = Acknowledgement { sequence: 1, result: Ok(()) };
    assert_documented(&frame_of(&Downlink::Acknowledgement(obeyed)), OBEYED);
    let stale = Err(Rejection::Mode(Refusal::StateStale));
    let refused = Acknowledgement { sequence: 1, result: stale };
    assert_documented(&frame_of(&Downlink::Acknowledgement(refused)), REFUSED);
}

/// Every number differs, so that exchanged fields are seen.
#[test]
fn example_telemetry() {
    let three = |first: f32| Vec3::new(first, first + 1.0, first + 2.0);
    let telemetry = Telemetry {
        tick: 1000,
        mode: Mode::Failsafe,
        cause: Some(Cause::StepsFaulted),
        wrench: Wrench { thrust: 1.0, torque_body: three(2.0) },
        torque_demand_body: three(5.0),
        status: StepStatus::TORQUE_SATURATED | StepStatus::MASS_PROJECTED,
        limited: Limited::YAW,
        estimates: Estimates {
            inverse_mass: 8.0,
            inertia: three(9.0),
            inverse_inertia: three(12.0),
            gyroscopic_ratio: three(15.0),
        },
        attitude_error: Quat::from_xyzw(18.0, 19.0, 20.0, 21.0),
        auxiliary: Auxiliary {
            attitude: Quat::from_xyzw(22.0, 23.0, 24.0, 25.0),
            rate: three(26.0),
        },
        step_cost: 1736,
    };
    assert_documented(&frame_of(&Downlink::Telemetry(telemetry)), TELEMETRY);
}

#[test]
fn example_lasting() {
    let three = |first: f32| Vec3::new(first, first + 1.0, first + 2.0);
    let estimates = LastingEstimates {
        acceleration_world: three(1.0),
        torque_body: three(4.0),
        angular_acceleration_body: three(7.0),
    };
    let lasting = Downlink::Lasting(Lasting { tick: 1000, estimates });
    assert_documented(&frame_of(&lasting), LASTING);
}

#[test]
fn limits_and_version() {
    for (name, value) in [
        ("VERSION", usize::from(VERSION)),
        ("MAX_MESSAGE", MAX_MESSAGE),
        ("MAX_FRAME", MAX_FRAME),
        ("NAME_MAX", NAME_MAX),
        ("TEXT_MAX", TEXT_MAX),
    ] {
        assert!(PROTOCOL.contains(&format!("| `{name}` | {value} |")), "{name} = {value}");
    }
}

/// The number of a variant is its first byte.
fn variant<T: serde::Serialize>(value: &T) -> u8 {
    postcard::to_slice(value, &mut [0; 300]).unwrap()[0]
}

#[test]
fn numbers_of_messages_modes_and_commands() {
    let numbered = |number: u8, name: &str| {
        assert!(PROTOCOL.contains(&format!("| {number} | `{name}`")), "{number} {name}");
    };
    let name = heapless::String::new;
    let (start_world, leg) = (Vec3::ONE, Leg::to(Vec3::ONE, 1.0));
    numbered(variant(&Uplink::Hello), "Hello");
    numbered(variant(&Uplink::Command(Command::Arm)), "Command");
    numbered(variant(&example_state()), "State");
    numbered(variant(&example_reference(0)), "Reference");
    numbered(variant(&Uplink::SelectTrajectory(TrajectorySelection::Stream)), "SelectTrajectory");
    numbered(variant(&Uplink::SelectController(ControllerKind::Saturated)), "SelectController");
    numbered(variant(&Uplink::PathBegin { start_world, yaw: 0.0, legs: 1 }), "PathBegin");
    numbered(variant(&Uplink::PathLeg { index: 0, leg }), "PathLeg");
    numbered(variant(&Uplink::ParameterAt { index: 0 }), "ParameterAt");
    numbered(variant(&Uplink::ParameterRead { name: name() }), "ParameterRead");
    numbered(variant(&Uplink::ParameterWrite { name: name(), value: 0.0 }), "ParameterWrite");
    numbered(variant(&Uplink::ParametersPersist), "ParametersPersist");
    numbered(variant(&Uplink::Subscribe { period: 1 }), "Subscribe");
    numbered(variant(&Uplink::FaultAcknowledge), "FaultAcknowledge");
    numbered(variant(&Uplink::ParametersForget), "ParametersForget");
    numbered(variant(&Uplink::LockStep(true)), "LockStep");
    numbered(variant(&Uplink::Step { uptime_ticks: 0 }), "Step");
    numbered(variant(&Uplink::Estimator(EstimatorSetting::Use)), "Estimator");
    numbered(variant(&Uplink::EstimatorStart(VehicleState::at_rest(Vec3::ONE))), "EstimatorStart");
    let sample = ctrl_core::estimator::InertialSample::default();
    numbered(variant(&Uplink::Inertial { tick: 0, sample }), "Inertial");
    let height = ctrl_core::estimator::Measurement::Barometer(0.0);
    numbered(variant(&Uplink::Measured(height)), "Measured");
    numbered(variant(&Uplink::GuidanceRead), "GuidanceRead");
    let key = Secret([0; 32]);
    numbered(variant(&Uplink::SigningKey { key, timestamp: 0 }), "SigningKey");
    numbered(variant(&Downlink::Guidance(guidance())), "Guidance");
    numbered(variant(&Downlink::Lasting(sizes::longest_lasting())), "Lasting");
    numbered(variant(&Downlink::Stepped { uptime_ticks: 0 }), "Stepped");
    let value = ParameterValue { index: 0, count: 0, name: name(), value: 0.0 };
    let obeyed = Acknowledgement { sequence: 1, result: Ok(()) };
    numbered(variant(&Downlink::Acknowledgement(obeyed)), "Acknowledgement");
    numbered(variant(&Downlink::Parameter(value)), "Parameter");
    numbered(variant(&Downlink::Health(Health::default())), "Health");
    let in_force = ParametersInForce::default();
    numbered(variant(&Downlink::ParametersInForce(in_force)), "ParametersInForce");
    for (number, mode) in
        (0..).zip([Mode::Disarmed, Mode::Armed, Mode::Flying, Mode::Failsafe, Mode::Locked])
    {
        assert_eq!(variant(&mode), number);
        assert!(PROTOCOL.contains(&format!("{number} {mode:?}")), "{number} {mode:?}");
    }
    for (number, command) in
        (0..).zip([Command::Arm, Command::Disarm, Command::Start, Command::Stop])
    {
        assert_eq!(variant(&command), number);
        assert!(PROTOCOL.contains(&format!("{number} {command:?}")), "{number} {command:?}");
    }
}
