//! The whole image: arming, closed-loop flight, failsafe, faults, over the link in lock step.

use std::io::{BufReader, Read, Write};
use std::net::TcpListener;

use ctrl_core::controller::StepStatus;
use ctrl_core::mode::{Cause, Command, Mode, Refusal, SAFE};
use ctrl_core::trajectory::{Leg, MAX_LEGS, TrajectoryConfig};
use ctrl_core::vehicle::VehicleState;
use firmware::scenario::Scenario;
use firmware::vehicle::VEHICLE;
use glam::Vec3;
use link::{
    ControllerKind, Decoder, Downlink, Encoder, FaultKind, MAX_FRAME, Rejection,
    TrajectorySelection, Uplink,
};
use sil_host::pil::lockstep::PATIENCE;
use sim::scenario::LoadedScenario;

use crate::emulator::{emulator, run, text};
use crate::serial_link::Vehicle;

/// A vehicle that stands where a scenario begins, with its controller and trajectory selected.
fn on_the_ground(scenario: &str, directives: &[&str]) -> (Vehicle, VehicleState) {
    let loaded = LoadedScenario::open(scenario, &[]).unwrap();
    let state = loaded.scenario().initial.state().measured();
    let document = Scenario::named(scenario).unwrap().load().unwrap();
    let kind = ControllerKind::from(&document.controller);
    let TrajectoryConfig::RisingCircle(circle) = document.trajectory else {
        panic!("the paper's trajectory");
    };
    let (mut vehicle, first) = Vehicle::boot(directives);
    let greeted = matches!(first[..], [Downlink::Identity(_), Downlink::ParametersInForce(_)]);
    assert!(greeted, "{first:?}");
    vehicle.subscribe(state);
    vehicle.ask(Uplink::SelectController(kind), state).unwrap();
    let trajectory = TrajectorySelection::RisingCircle(circle);
    vehicle.ask(Uplink::SelectTrajectory(trajectory), state).unwrap();
    (vehicle, state)
}

/// Waits until the state is fresh, and arms.
fn arm(vehicle: &mut Vehicle, state: VehicleState) {
    let sample = Uplink::State { tick: 0, state };
    for _ in 0..60 {
        let telemetry = vehicle.tick(std::slice::from_ref(&sample));
        assert_eq!((telemetry.mode, telemetry.wrench), (Mode::Disarmed, SAFE));
    }
    vehicle.ask(Uplink::Command(Command::Arm), state).unwrap();
    let telemetry = vehicle.tick(std::slice::from_ref(&sample));
    assert_eq!((telemetry.mode, telemetry.wrench), (Mode::Armed, SAFE));
}

/// Starts; the tick was the first of flight.
fn take_off(vehicle: &mut Vehicle, state: VehicleState) {
    arm(vehicle, state);
    let start = [Uplink::State { tick: 0, state }, Uplink::Command(Command::Start)];
    let telemetry = vehicle.tick(&start);
    assert_eq!((telemetry.mode, telemetry.tick), (Mode::Flying, 1));
    assert!(telemetry.wrench.thrust > 1.0);
}

#[test]
fn when_samples_stop_the_vehicle_descends_and_then_stops_its_rotors() {
    let config = &VEHICLE;
    let (mut vehicle, state) = on_the_ground("paper-saturated", &[]);
    take_off(&mut vehicle, state);
    let flown_on = config.link.sample_valid + u32::from(config.supervisor.missed_samples_max);
    let mut telemetry = vehicle.tick(&[]);
    for _ in 0..flown_on {
        assert!(matches!(telemetry.mode, Mode::Flying | Mode::Failsafe));
        telemetry = vehicle.tick(&[]);
    }
    assert_eq!((telemetry.mode, telemetry.cause), (Mode::Failsafe, Some(Cause::SamplesMissed)));
    assert!(telemetry.wrench.thrust > 0.0 && telemetry.wrench.torque_body == Vec3::ZERO);
    let refused = vehicle.ask(Uplink::Command(Command::Arm), state);
    assert_eq!(refused, Err(Rejection::Mode(Refusal::InFailsafe)));
    let mut ticks = 0;
    while telemetry.mode == Mode::Failsafe {
        telemetry = vehicle.tick(&[]);
        ticks += 1;
        assert!(ticks < 5000, "the descent does not end");
    }
    assert_eq!((telemetry.mode, telemetry.wrench), (Mode::Locked, SAFE));
}

#[test]
fn overruns_of_control_in_a_row_lead_to_the_failsafe() {
    let (mut vehicle, state) = on_the_ground("paper-saturated", &["provoke=overrun"]);
    take_off(&mut vehicle, state);
    let sample = [Uplink::State { tick: 0, state }];
    let mut telemetry = vehicle.tick(&sample);
    while telemetry.mode == Mode::Flying {
        telemetry = vehicle.tick(&sample);
        assert!(telemetry.tick < 1000, "no failsafe");
    }
    assert_eq!((telemetry.mode, telemetry.cause), (Mode::Failsafe, Some(Cause::Overruns)));
    let control = vehicle.health(state).groups[0];
    assert!(control.overruns >= 3 && control.worst_time > 500, "{control:?}");
}

#[test]
fn the_serial_line_carries_the_link() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let serial = format!("tcp:{}", listener.local_addr().unwrap());
    let mut emulator = emulator("firmware").start(&[], &serial).unwrap();
    let (mut line, _) = listener.accept().unwrap();
    line.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut received = BufReader::new(line.try_clone().unwrap()).bytes();
    let mut decoder = Decoder::<Downlink>::default();
    let mut listen = || {
        loop {
            let byte = received.next().expect("the vehicle is silent").unwrap();
            if let Some(received) = decoder.push(byte) {
                break received.message;
            }
        }
    };
    // Bytes that come before the receiver is on are lost: the vehicle speaks first.
    assert!(matches!(listen(), Downlink::Identity(_)));
    assert!(matches!(listen(), Downlink::ParametersInForce(_)));
    let mut encoder = Encoder::default();
    let mut ask = |message| {
        line.write_all(encoder.encode(&message, &mut [0; MAX_FRAME]).unwrap()).unwrap();
    };
    ask(Uplink::Hello);
    assert!(matches!(listen(), Downlink::Identity(_)));
    assert!(matches!(listen(), Downlink::ParametersInForce(_)));
    for index in 0..20 {
        ask(Uplink::ParameterAt { index });
        loop {
            match listen() {
                Downlink::Parameter(parameter) => break assert_eq!(parameter.index, index),
                Downlink::Health(_) => {}
                other => panic!("{other:?}"),
            }
        }
    }
    emulator.kill().unwrap();
    emulator.wait().unwrap();
}

#[test]
fn the_longest_path_is_uploaded_checked_and_flown() {
    let (mut vehicle, state) = on_the_ground("paper-saturated", &[]);
    let start_world = state.position_world;
    let legs = MAX_LEGS as u8;
    vehicle.ask(Uplink::PathBegin { start_world, yaw: 0.0, legs }, state).unwrap();
    for index in 0..legs {
        let leg = Leg::to(start_world + f32::from(index % 2) * Vec3::X, 20.0);
        vehicle.ask(Uplink::PathLeg { index, leg }, state).unwrap();
    }
    vehicle.ask(Uplink::SelectTrajectory(TrajectorySelection::UploadedPath), state).unwrap();
    take_off(&mut vehicle, state);
    for _ in 0..500 {
        let telemetry = vehicle.tick(&[Uplink::State { tick: 0, state }]);
        assert_eq!(telemetry.mode, Mode::Flying);
        assert!(!telemetry.status.intersects(StepStatus::FAULT));
    }
    // Checking a path is long work, done on the ground below control, which keeps its time.
    let [control, state_input, _, housekeeping] = vehicle.health(state).groups;
    assert_eq!((control.overruns, housekeeping.overruns), (0, 0));
    assert!(control.worst_time < 100, "{control:?}");
    assert!(state_input.worst_time < 20_000, "{state_input:?}");
}

#[test]
fn rotors_turn_in_flight_only() {
    let duty = |directive: &str, fly: bool| {
        let (mut vehicle, state) = on_the_ground("paper-saturated", &[directive]);
        if fly {
            take_off(&mut vehicle, state);
        } else {
            arm(&mut vehicle, state);
        }
        // Whatever is said after the end of the run stays in the FIFO.
        let sample = Uplink::State { tick: 0, state };
        vehicle.send_until_the_end(&[sample])
    };
    let report = duty("ticks=400", false);
    assert!(report.contains("rotor duty [10000, 10000, 10000, 10000]"), "{report}");
    let report = duty("ticks=400", true);
    let (_, duty) = report.split_once("rotor duty [").expect(&report);
    let (duty, _) = duty.split_once(']').expect(&report);
    let duty: Vec<u32> = duty.split(", ").map(|n| n.parse().unwrap()).collect();
    assert_eq!(duty.len(), 4);
    assert!(duty.iter().all(|duty| (12_000..20_000).contains(duty)), "{duty:?}");
}

#[test]
fn a_fault_stops_the_vehicle_and_is_reported_over_the_link_after_the_restart() {
    let (mut vehicle, state) = on_the_ground("paper-saturated", &["provoke=panic"]);
    take_off(&mut vehicle, state);
    let sample = [Uplink::State { tick: 0, state }];
    let identity = (0..1000).find_map(|_| {
        vehicle.send(&sample).into_iter().find_map(|message| match message {
            Downlink::Identity(identity) => Some(identity),
            _ => None,
        })
    });
    assert!(identity.expect("a second first").fault_pending);
    vehicle.subscribe(state);
    for _ in 0..60 {
        let telemetry = vehicle.tick(&sample);
        assert_eq!((telemetry.mode, telemetry.wrench), (Mode::Locked, SAFE));
    }
    let refused = vehicle.ask(Uplink::Command(Command::Arm), state);
    assert_eq!(refused, Err(Rejection::Mode(Refusal::Locked)));
    let report = vehicle.send(&[Uplink::FaultAcknowledge]).into_iter().find_map(|m| match m {
        Downlink::Fault(report) => Some(report),
        _ => None,
    });
    let report = report.expect("a report");
    assert_eq!((report.kind, report.uptime_ticks), (FaultKind::Panic, 500));
    assert_eq!(report.text, "provoked at firmware/src/board/emulator/mod.rs");
    vehicle.ask(Uplink::Command(Command::Disarm), state).unwrap();
    vehicle.ask(Uplink::Command(Command::Arm), state).unwrap();
}

#[test]
fn a_fault_leaves_evidence_for_the_next_boot() {
    for (fault, cause) in [("panic", "panic"), ("hard-fault", "hard fault")] {
        let run = run("firmware", &[format!("provoke={fault}")]);
        let report = text(&run.stderr);
        assert!(run.status.success(), "{report}");
        let has = |line: &str| report.lines().any(|found| found == line);
        assert!(has(&format!("fault before this boot: {cause}")), "{report}");
        assert!(has("uptime: 500 ticks"), "{report}");
        if fault == "panic" {
            assert!(has("text: provoked at firmware/src/board/emulator/mod.rs"), "{report}");
        } else {
            assert!(has("r0: 0x60000000") && has("bfar: 0x60000000"), "{report}");
            assert!(has("hfsr: 0x40000000"), "{report}");
        }
    }
}
