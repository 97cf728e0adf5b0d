//! Commands and their acknowledgements.

use mavlink::dialects::common::{
    AUTOPILOT_VERSION_DATA, AVAILABLE_MODES_DATA, COMMAND_ACK_DATA, COMMAND_INT_DATA,
    FILE_TRANSFER_PROTOCOL_DATA, HOME_POSITION_DATA, MESSAGE_INTERVAL_DATA, MavCmd, MavFrame,
    MavModeFlag, MavResult, PING_DATA, PROTOCOL_VERSION_DATA, SET_MODE_DATA, TIMESYNC_DATA,
};

use ctrl_core::mode::navigation::NavigationEvent;
use ctrl_core::mode::safety::{Hazards, Reaction};

use super::*;

const ACCEPTED: Option<u8> = Some(MavResult::MAV_RESULT_ACCEPTED as u8);
const NONE: [f32; 7] = [0.0; 7];
const UNSTATED: [f32; 7] = [f32::NAN; 7];

fn first(value: f32) -> [f32; 7] {
    [value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

#[test]
fn arming_is_acknowledged_with_the_supervisors_answer() {
    let mut air = Air::new();
    assert_eq!(air.command(400, first(1.0)), ACCEPTED);
    assert_eq!(air.vehicle.mode, Mode::Armed);
    assert_eq!(air.texts(), ["armed"]);
    assert_eq!(air.command(400, first(0.0)), ACCEPTED);
    assert_eq!(air.vehicle.mode, Mode::Disarmed);
    air.vehicle.refuses = Some(Refusal::Tilted);
    let rejected = result(MavResult::MAV_RESULT_TEMPORARILY_REJECTED);
    assert_eq!(air.command(400, first(1.0)), rejected);
    assert!(air.texts().contains(&"command 400 refused: tilted beyond the arming limit".into()));
}

#[test]
fn a_command_that_nobody_answers_fails_and_a_second_one_waits_its_turn() {
    let mut air = Air::new();
    // The vehicle takes no command: its ticks stop.
    air.send(&arming());
    air.send(&arming());
    for _ in 0..64 {
        let Some(frame) = air.protocol.next_frame(&mut air.vehicle) else { break };
        air.received.push(sent(&frame));
    }
    let results: Vec<_> = air.take::<COMMAND_ACK_DATA>().iter().map(|ack| ack.result).collect();
    assert_eq!(results, [MavResult::MAV_RESULT_TEMPORARILY_REJECTED]);
    air.vehicle.command = None; // lost
    air.run(1.2);
    let results: Vec<_> = air.take::<COMMAND_ACK_DATA>().iter().map(|ack| ack.result).collect();
    assert_eq!(results, [MavResult::MAV_RESULT_FAILED]);
}

fn arming() -> COMMAND_LONG_DATA {
    COMMAND_LONG_DATA {
        param1: 1.0,
        command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
        target_system: 1,
        target_component: 1,
        ..COMMAND_LONG_DATA::default()
    }
}

#[test]
fn disarming_in_flight_is_denied_unless_it_is_forced() {
    let mut air = Air::flying();
    assert_eq!(air.command(400, first(0.0)), result(MavResult::MAV_RESULT_DENIED));
    assert_eq!(air.vehicle.mode, Mode::Flying);
    assert_eq!(air.texts(), ["command 400 refused: in flight: land first"]);
    let forced = [0.0, 21196.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(air.command(400, forced), ACCEPTED);
    assert_eq!(air.vehicle.mode, Mode::Disarmed);
    let mut air = Air::flying();
    assert_eq!(air.command(185, first(1.0)), ACCEPTED, "flight termination");
    assert_eq!(air.vehicle.mode, Mode::Locked);
    assert_eq!(air.texts(), ["rotors stopped and locked, disarm first: kill switch"]);
}

#[test]
fn flight_termination_waits_for_no_other_command() {
    let mut air = Air::flying();
    air.send(&arming());
    let mut kill = arming();
    kill.command = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
    air.send(&kill);
    air.run(0.1);
    let acks = air.take::<COMMAND_ACK_DATA>();
    let results: Vec<_> = acks.iter().map(|ack| (ack.command as u32, ack.result)).collect();
    let (cancelled, accepted) = (MavResult::MAV_RESULT_CANCELLED, MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(results, [(400, cancelled), (185, accepted)]);
    assert_eq!(air.vehicle.mode, Mode::Locked);
}

#[test]
fn a_message_keeps_the_link_alive_and_one_for_another_system_does_not() {
    let mut air = Air::new();
    let heartbeat = mavlink::dialects::common::HEARTBEAT_DATA::DEFAULT;
    air.send(&heartbeat);
    assert_eq!(air.vehicle.heard, 1);
    air.send(&COMMAND_LONG_DATA { target_system: 7, ..arming() });
    air.bytes(b"noise");
    assert_eq!(air.vehicle.heard, 1);
}

#[test]
fn take_off_needs_arming_and_takes_its_height_from_command_or_parameter() {
    let mut air = Air::new();
    let rejected = result(MavResult::MAV_RESULT_TEMPORARILY_REJECTED);
    assert_eq!(air.command(22, UNSTATED), rejected);
    assert_eq!(air.texts(), ["command 22 refused: not armed"]);
    assert_eq!(air.command(400, first(1.0)), ACCEPTED);
    let to = |height| [0.0, 0.0, 0.0, f32::NAN, f32::NAN, f32::NAN, height];
    assert_eq!(air.command(22, to(-5.0)), result(MavResult::MAV_RESULT_DENIED));
    assert_eq!(air.command(22, to(6.0)), ACCEPTED);
    air.run(15.0);
    assert!((air.vehicle.state.position_world.z - 6.0).abs() < 0.1);
}

#[test]
fn land_and_return_end_on_the_ground() {
    for command in [21, 20] {
        let mut air = Air::flying();
        assert_eq!(air.command(command, UNSTATED), ACCEPTED);
        air.run(40.0);
        assert_eq!(air.vehicle.mode, Mode::Disarmed, "{command}");
        assert!(air.texts().contains(&"landed".into()));
    }
}

fn reposition(air: &mut Air, east: f32, north: f32, height: f32, frame: MavFrame) -> Option<u8> {
    let origin = ProtocolConfig::default().origin;
    let (x, y, z) = origin.global(Vec3::new(east, north, height));
    air.received.clear();
    air.send(&COMMAND_INT_DATA {
        param1: 1.0,
        param4: core::f32::consts::PI,
        x,
        y,
        z,
        command: MavCmd::MAV_CMD_DO_REPOSITION,
        target_system: 1,
        target_component: 1,
        frame,
        ..COMMAND_INT_DATA::default()
    });
    air.run(0.05);
    air.take::<COMMAND_ACK_DATA>().first().map(|ack| ack.result as u8)
}

#[test]
fn reposition_flies_to_a_global_place_and_turns() {
    let mut air = Air::flying();
    let relative = MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT;
    assert_eq!(reposition(&mut air, 8.0, -3.0, 4.0, relative), ACCEPTED);
    air.run(30.0);
    let there = Vec3::new(8.0, -3.0, 4.0);
    assert!((air.vehicle.state.position_world - there).length() < 0.1);
    let reference = air.vehicle.navigator.reference();
    assert!((reference.left_world - Vec3::X).length() < 0.02, "facing south, left is east");
}

#[test]
fn a_place_out_of_reach_or_in_an_unknown_frame_is_denied() {
    let mut air = Air::flying();
    let denied = result(MavResult::MAV_RESULT_DENIED);
    let far = reposition(&mut air, 0.0, 2e6, 4.0, MavFrame::MAV_FRAME_GLOBAL);
    assert_eq!(far, denied);
    assert!(air.texts().iter().any(|text| text.contains("setpoint.position")));
    let camera = MavFrame::MAV_FRAME_MISSION;
    assert_eq!(reposition(&mut air, 0.0, 0.0, 4.0, camera), denied);
    let nan = reposition(&mut air, 1.0, 1.0, f32::NAN, MavFrame::MAV_FRAME_GLOBAL);
    assert_eq!(nan, ACCEPTED, "no height: the one that is flown");
    air.run(10.0);
    assert!((air.vehicle.state.position_world - Vec3::new(1.0, 1.0, 2.5)).length() < 0.1);
}

#[test]
fn modes_are_entered_by_number_by_standard_mode_and_by_the_old_message() {
    let mut air = Air::flying();
    let mode = |main, sub| [1.0, main, sub, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(air.command(176, mode(4.0, 5.0)), ACCEPTED);
    assert_eq!(air.vehicle.navigator.mode(), NavigationMode::Return);
    assert_eq!(air.command(176, mode(4.0, 3.0)), ACCEPTED);
    assert_eq!(air.vehicle.navigator.mode(), NavigationMode::Hold);
    assert_eq!(air.command(262, first(7.0)), ACCEPTED);
    assert_eq!(air.vehicle.navigator.mode(), NavigationMode::Land);
    let custom_mode = FlightMode::of(NavigationMode::Hold).custom_mode();
    let base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
    air.send(&SET_MODE_DATA { custom_mode, target_system: 1, base_mode });
    assert_eq!(air.vehicle.navigator.mode(), NavigationMode::Hold);
    // Manual is absent, and says so.
    assert_eq!(air.command(176, mode(1.0, 0.0)), result(MavResult::MAV_RESULT_UNSUPPORTED));
    assert!(air.texts().iter().any(|text| text.contains("there is no manual mode")));
    let rejected = result(MavResult::MAV_RESULT_TEMPORARILY_REJECTED);
    assert_eq!(air.command(176, mode(6.0, 0.0)), rejected, "offboard without set-points");
}

#[test]
fn speed_home_and_hold_are_commands_too() {
    let mut air = Air::flying();
    let speed = |speed| [1.0, speed, -1.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(air.command(178, speed(1.0)), ACCEPTED);
    assert_eq!(air.command(178, speed(50.0)), result(MavResult::MAV_RESULT_DENIED));
    assert_eq!(air.command(179, first(1.0)), ACCEPTED);
    let up = air.vehicle.navigator.home_world().z - air.vehicle.state.position_world.z;
    assert!(up.abs() < 1e-3, "{up}");
    assert_eq!(air.command(17, NONE), ACCEPTED);
    assert_eq!(air.command(193, first(0.0)), ACCEPTED);
}

#[test]
fn what_is_not_understood_is_unsupported() {
    let mut air = Air::new();
    let unsupported = result(MavResult::MAV_RESULT_UNSUPPORTED);
    for command in [1, 246, 31_000, u16::MAX] {
        assert_eq!(air.command(command, NONE), unsupported, "{command}");
    }
    assert_eq!(air.command(400, first(7.0)), unsupported, "neither arm nor disarm");
    assert_eq!(air.command(512, first(9_999.0)), unsupported, "no such message");
}

#[test]
fn facts_are_sent_on_request() {
    let mut air = Air::new();
    assert_eq!(air.command(512, first(148.0)), ACCEPTED);
    assert_eq!(air.take::<AUTOPILOT_VERSION_DATA>().len(), 1);
    assert_eq!(air.command(520, first(1.0)), ACCEPTED);
    assert_eq!(air.take::<AUTOPILOT_VERSION_DATA>().len(), 1);
    for command in [(512, 300.0), (519, 1.0)] {
        assert_eq!(air.command(command.0, first(command.1)), ACCEPTED);
        let version = air.take::<PROTOCOL_VERSION_DATA>();
        assert_eq!((version.len(), version[0].max_version), (1, 200));
    }
    air.take::<HOME_POSITION_DATA>();
    assert_eq!(air.command(512, first(242.0)), ACCEPTED);
    assert_eq!(air.take::<HOME_POSITION_DATA>().len(), 1);
}

#[test]
fn available_modes_come_one_by_one_or_all() {
    let mut air = Air::new();
    assert_eq!(air.command(512, first(435.0)), ACCEPTED);
    let modes = air.take::<AVAILABLE_MODES_DATA>();
    let indices: Vec<_> = modes.iter().map(|mode| mode.mode_index).collect();
    assert_eq!(indices, [1, 2, 3, 4, 5, 6]);
    assert!(modes.iter().all(|mode| mode.number_modes == 6));
    assert_eq!(air.command(512, [435.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]), ACCEPTED);
    let one = air.take::<AVAILABLE_MODES_DATA>();
    assert_eq!((one.len(), one[0].mode_name.to_str().unwrap()), (1, "Mission"));
}

#[test]
fn a_rate_is_set_read_and_limited() {
    let mut air = Air::new();
    let rate = |id, interval| [id, interval, 0.0, 0.0, 0.0, 0.0, 0.0];
    let denied = result(MavResult::MAV_RESULT_DENIED);
    assert_eq!(air.command(511, rate(30.0, 100_000.0)), ACCEPTED);
    assert_eq!(air.command(510, first(30.0)), ACCEPTED);
    assert_eq!(air.take::<MESSAGE_INTERVAL_DATA>()[0].interval_us, 100_000);
    for interval in [100.0, f32::NAN] {
        assert_eq!(air.command(511, rate(30.0, interval)), denied, "{interval}");
    }
    assert_eq!(air.command(511, rate(77.0, 0.0)), denied);
    assert_eq!(air.command(511, rate(30.0, -1.0)), ACCEPTED);
    assert_eq!(air.command(510, first(30.0)), ACCEPTED);
    assert_eq!(air.take::<MESSAGE_INTERVAL_DATA>()[0].interval_us, -1);
}

#[test]
fn time_and_round_trips_are_answered() {
    let mut air = Air::new();
    air.send(&TIMESYNC_DATA { tc1: 0, ts1: 1234 });
    air.send(&TIMESYNC_DATA { tc1: 5, ts1: 1235 }); // an answer, not a question
    air.run(0.05);
    let answers = air.take::<TIMESYNC_DATA>();
    assert_eq!((answers.len(), answers[0].ts1), (1, 1234));
    assert!(answers[0].tc1 > 0);
    air.send(&PING_DATA { time_usec: 9, seq: 3, target_system: 0, target_component: 0 });
    air.run(0.05);
    let answer = air.take::<PING_DATA>();
    assert_eq!((answer[0].seq, answer[0].target_system), (3, STATION.0));
}

#[test]
fn a_request_for_files_is_refused_at_once() {
    let mut air = Air::new();
    let mut payload = [0; 251];
    payload[..4].copy_from_slice(&[0xff, 0x00, 2, 4]); // sequence, session, open for reading
    air.send(&FILE_TRANSFER_PROTOCOL_DATA {
        target_network: 0,
        target_system: 1,
        target_component: 1,
        payload,
    });
    air.run(0.05);
    let answer = air.take::<FILE_TRANSFER_PROTOCOL_DATA>();
    assert_eq!(answer[0].payload[..6], [0x00, 0x01, 2, 129, 1, 4]);
    assert_eq!(answer[0].payload[12], 10, "file not found");
}

#[test]
fn a_hazard_is_told_with_what_is_done_about_it() {
    let mut air = Air::new();
    let hazards = Hazards::LINK_LOST | Hazards::BATTERY_LOW;
    air.vehicle.events.push(NavigationEvent::HazardRaised(hazards, Some(Reaction::Return)));
    air.run(0.1);
    assert_eq!(air.texts(), ["link lost, battery low: returning"]);
    air.vehicle.refuses = Some(Refusal::Hazard(Hazards::RC_LOST));
    let rejected = result(MavResult::MAV_RESULT_TEMPORARILY_REJECTED);
    assert_eq!(air.command(400, first(1.0)), rejected);
    assert!(air.texts().contains(&"command 400 refused: remote control lost".into()));
}
