//! The longest message of each kind, to the byte.

use super::*;
use ctrl_core::allocation::Limited;
use ctrl_core::controller::{Auxiliary, Estimates, LastingEstimates, StepStatus};
use ctrl_core::estimator::{EstimatorConfig, FaultLimits, InertialSample, Measurement, Source};
use ctrl_core::mode::{Cause, Command, Mode};
use ctrl_core::trajectory::{
    CircleConfig, Heading, HoverConfig, Leg, LemniscateConfig, RisingCircleConfig,
};
use ctrl_core::vehicle::Wrench;

/// Length of the message alone; asserts that the longest frame holds it and that it comes back.
fn length<M: Message + PartialEq + core::fmt::Debug>(message: &M) -> usize {
    let frame = frame_of(message);
    assert!(frame.len() <= MAX_FRAME);
    let received = feed(&mut Decoder::<M>::default(), &frame);
    assert_eq!(received[0].message, *message);
    postcard::to_slice(message, &mut [0; 1000]).unwrap().len()
}

fn text<const N: usize>() -> heapless::String<N> {
    let mut text = heapless::String::new();
    while text.push('x').is_ok() {}
    text
}

#[test]
fn longest_uplink_messages() {
    let (state, reference) = (VehicleState::at_rest(Vec3::ONE), Reference::hover(Vec3::ONE));
    let circle = CircleConfig {
        centre_world: Vec3::ONE,
        radius: 1.0,
        angular_rate: 1.0,
        heading: Heading::Yaw(1.0),
    };
    let select = Uplink::SelectTrajectory;
    let estimator = EstimatorConfig::EXAMPLE;
    let faults = FaultLimits { rejections: u16::MAX, repetitions: u16::MAX, ..estimator.faults };
    let name = text::<NAME_MAX>();
    for (message, bytes) in [
        (Uplink::Hello, 1),
        (Uplink::Command(Command::Stop), 2),
        (Uplink::State { tick: u64::MAX, state }, 63),
        (Uplink::Reference { tick: u64::MAX, reference }, 107),
        (select(TrajectorySelection::Stream), 2),
        (
            select(TrajectorySelection::Hover(HoverConfig { position_world: Vec3::ONE, yaw: 1.0 })),
            18,
        ),
        (
            select(TrajectorySelection::RisingCircle(RisingCircleConfig {
                radius: 1.0,
                angular_rate: 1.0,
                height: 1.0,
                rise_rate: 1.0,
            })),
            18,
        ),
        (select(TrajectorySelection::Circle(circle)), 27),
        (
            select(TrajectorySelection::Lemniscate(LemniscateConfig {
                centre_world: Vec3::ONE,
                amplitude_x: 1.0,
                amplitude_y: 1.0,
                angular_rate: 1.0,
                yaw: 1.0,
            })),
            30,
        ),
        (select(TrajectorySelection::UploadedPath), 2),
        (Uplink::SelectController(ControllerKind::Saturated), 2),
        (Uplink::PathBegin { start_world: Vec3::ONE, yaw: 1.0, legs: u8::MAX }, 18),
        (Uplink::PathLeg { index: u8::MAX, leg: Leg::to(Vec3::ONE, 1.0) }, 42),
        (Uplink::ParameterAt { index: u16::MAX }, 4),
        (Uplink::ParameterRead { name: name.clone() }, 50),
        (Uplink::ParameterWrite { name, value: 1.0 }, 54),
        (Uplink::ParametersPersist, 1),
        (Uplink::Subscribe { period: u16::MAX }, 4),
        (Uplink::FaultAcknowledge, 1),
        (Uplink::ParametersForget, 1),
        (Uplink::LockStep(true), 2),
        (Uplink::Step { uptime_ticks: u64::MAX }, 11),
        (Uplink::Estimator(EstimatorSetting::Inertial(estimator.inertial)), 26),
        (Uplink::Estimator(EstimatorSetting::Initial(estimator.initial)), 26),
        (Uplink::Estimator(EstimatorSetting::MagneticField(Vec3::ONE)), 14),
        (Uplink::Estimator(EstimatorSetting::BarometerBias(estimator.barometer_bias)), 10),
        (Uplink::Estimator(EstimatorSetting::Source(Source::OpticalFlow, estimator.barometer)), 19),
        (Uplink::Estimator(EstimatorSetting::Faults(faults)), 28),
        (Uplink::Estimator(EstimatorSetting::Use), 2),
        (Uplink::EstimatorStart(state), 53),
        (Uplink::Inertial { tick: u64::MAX, sample: InertialSample::default() }, 35),
        (Uplink::Measured(Measurement::CaptureAttitude(Quat::IDENTITY)), 18),
        (Uplink::GuidanceRead, 1),
        (Uplink::SigningKey { key: Secret([u8::MAX; 32]), timestamp: u64::MAX }, 43),
    ] {
        assert_eq!(length(&message), bytes, "{message:?}");
    }
}

pub fn longest_telemetry() -> Telemetry {
    Telemetry {
        tick: u64::MAX,
        mode: Mode::Locked,
        cause: Some(Cause::Fault),
        wrench: Wrench { thrust: 1.0, torque_body: Vec3::ONE },
        torque_demand_body: Vec3::ONE,
        status: StepStatus::all(),
        limited: Limited::all(),
        estimates: Estimates {
            inverse_mass: 1.0,
            inertia: Vec3::ONE,
            inverse_inertia: Vec3::ONE,
            gyroscopic_ratio: Vec3::ONE,
        },
        attitude_error: Quat::IDENTITY,
        auxiliary: Auxiliary::REST,
        step_cost: u32::MAX,
    }
}

pub fn longest_lasting() -> Lasting {
    let estimates = LastingEstimates {
        acceleration_world: Vec3::ONE,
        torque_body: Vec3::ONE,
        angular_acceleration_body: Vec3::ONE,
    };
    Lasting { tick: u64::MAX, estimates }
}

#[test]
fn longest_downlink_messages() {
    let group = GroupHealth { completed: u32::MAX, worst_time: u32::MAX, overruns: u32::MAX };
    let link = LinkStatistics {
        delivered: u32::MAX,
        damaged: u32::MAX,
        foreign: u32::MAX,
        malformed: u32::MAX,
        late: u32::MAX,
        lost: u32::MAX,
    };
    let identity = Identity {
        firmware: text(),
        board: text(),
        controller: ControllerKind::Saturated,
        step_period: 1e-3,
        uptime_ticks: u64::MAX,
        fault_pending: true,
    };
    let invalid =
        Rejection::Invalid { parameter: text(), value: f32::MAX, lower: f32::MIN, upper: 1.0 };
    let fault = FaultReport {
        kind: FaultKind::Watchdog,
        uptime_ticks: u32::MAX,
        registers: [u32::MAX; REGISTERS],
        line: u32::MAX,
        text: text(),
    };
    let parameter =
        ParameterValue { index: u16::MAX, count: u16::MAX, name: text(), value: f32::MAX };
    let health = Health {
        uptime_ticks: u64::MAX,
        groups: [group; GROUPS],
        link,
        transmit_dropped: u32::MAX,
    };
    let origin = ParameterOrigin::Refused;
    let in_force = ParametersInForce { origin, generation: u32::MAX, changed: true };
    for (message, bytes) in [
        (Downlink::Identity(identity), 67),
        (
            Downlink::Acknowledgement(Acknowledgement { sequence: u16::MAX, result: Err(invalid) }),
            67,
        ),
        (Downlink::Telemetry(longest_telemetry()), 134),
        (Downlink::Parameter(parameter), 60),
        (Downlink::Fault(fault), 179),
        (Downlink::Health(health), 106),
        (Downlink::ParametersInForce(in_force), 8),
        (Downlink::Stepped { uptime_ticks: u64::MAX }, 11),
        (Downlink::Guidance(guidance()), 103),
        (Downlink::Lasting(longest_lasting()), 47),
    ] {
        assert_eq!(length(&message), bytes, "{message:?}");
    }
}

#[test]
fn a_message_that_is_too_long_is_refused_and_spends_no_number() {
    #[derive(serde::Serialize, serde::Deserialize)]
    struct Long(#[serde(with = "long")] [u8; MAX_MESSAGE + 1]);
    impl Message for Long {
        const TAG: u8 = 1;
        fn begins_numbering(&self) -> bool {
            false
        }
    }
    mod long {
        use super::MAX_MESSAGE;
        pub fn serialize<S: serde::Serializer>(
            bytes: &[u8; MAX_MESSAGE + 1],
            serializer: S,
        ) -> Result<S::Ok, S::Error> {
            serde::Serialize::serialize(bytes.as_slice(), serializer)
        }
        pub fn deserialize<'de, D: serde::Deserializer<'de>>(
            _: D,
        ) -> Result<[u8; MAX_MESSAGE + 1], D::Error> {
            Err(serde::de::Error::custom("never received"))
        }
    }
    let mut encoder = Encoder::default();
    let message = Long([0; MAX_MESSAGE + 1]);
    assert_eq!(encoder.encode(&message, &mut [0; MAX_FRAME]), Err(EncodeError));
    assert_eq!(encoder.next_sequence(), 0);
}
