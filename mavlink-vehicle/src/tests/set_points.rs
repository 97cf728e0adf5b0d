//! Set-points: type masks, frames, refusals, silence.

use mavlink::dialects::common::{
    AttitudeTargetTypemask, MavFrame, PositionTargetTypemask, SET_ATTITUDE_TARGET_DATA,
    SET_POSITION_TARGET_GLOBAL_INT_DATA, SET_POSITION_TARGET_LOCAL_NED_DATA,
};

use super::*;

const POSITION: u16 = 0b1101_1111_1000;
const VELOCITY: u16 = 0b1101_1100_0111;
const ACCELERATION: u16 = 0b1100_0011_1111;
const YAW_RATE: u16 = 1 << 11;
const YAW: u16 = 1 << 10;

fn local(mask: u16, frame: MavFrame, numbers: [f32; 9]) -> SET_POSITION_TARGET_LOCAL_NED_DATA {
    let [x, y, z, vx, vy, vz, afx, afy, afz] = numbers;
    SET_POSITION_TARGET_LOCAL_NED_DATA {
        x,
        y,
        z,
        vx,
        vy,
        vz,
        afx,
        afy,
        afz,
        type_mask: PositionTargetTypemask::from_bits_truncate(mask),
        target_system: 1,
        target_component: 1,
        coordinate_frame: frame,
        ..SET_POSITION_TARGET_LOCAL_NED_DATA::default()
    }
}

/// Streams a set-point at 20 Hz in offboard for a time (s).
fn offboard(air: &mut Air, data: &SET_POSITION_TARGET_LOCAL_NED_DATA, seconds: f32) {
    air.send(data);
    assert_eq!(air.command(176, [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(0));
    for _ in 0..(seconds * 20.0) as u32 {
        air.send(data);
        air.run(0.05);
    }
    assert_eq!(air.vehicle.navigator.mode(), NavigationMode::Offboard);
}

const NED: MavFrame = MavFrame::MAV_FRAME_LOCAL_NED;

#[test]
fn a_position_in_ned_is_flown_to() {
    let mut air = Air::flying();
    let north = local(POSITION, NED, [3.0, -2.0, -4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    offboard(&mut air, &north, 12.0);
    let there = Vec3::new(-2.0, 3.0, 4.0);
    assert!((air.vehicle.state.position_world - there).length() < 0.05);
}

#[test]
fn a_velocity_is_taken_up_in_ned_and_with_the_heading() {
    let mut air = Air::flying();
    let numbers = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    offboard(&mut air, &local(VELOCITY, NED, numbers), 5.0);
    assert!((air.vehicle.state.velocity_world - Vec3::Y).length() < 0.02, "north");
    let forward = local(VELOCITY, MavFrame::MAV_FRAME_BODY_NED, numbers);
    offboard(&mut air, &forward, 6.0);
    assert!((air.vehicle.state.velocity_world - Vec3::X).length() < 0.02, "body x points east");
}

#[test]
fn an_acceleration_and_a_mixture_with_a_height_are_followed() {
    let mut air = Air::flying();
    let push = local(ACCELERATION, NED, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0]);
    offboard(&mut air, &push, 2.0);
    let velocity = air.vehicle.state.velocity_world;
    assert!(velocity.x > 0.7 && velocity.x < 1.1 && velocity.y.abs() < 1e-3, "{velocity}");
    // Velocity north and east, position down.
    let mask = 0b1101_1110_0011;
    let mixed = local(mask, NED, [0.0, 0.0, -5.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0]);
    offboard(&mut air, &mixed, 8.0);
    let state = air.vehicle.state;
    assert!((state.position_world.z - 5.0).abs() < 0.05, "{}", state.position_world);
    assert!((state.velocity_world - Vec3::NEG_X).length() < 0.05, "{}", state.velocity_world);
}

/// Largest distance (m) from a target that moves north at 0.5 m/s, after 8 s, with `mask`.
fn trail(mask: u16) -> f32 {
    let mut air = Air::flying();
    let at = |time: f32| local(mask, NED, [0.5 * time, 0.0, -2.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
    offboard(&mut air, &at(0.0), 0.0);
    let mut behind = 0.0_f32;
    for step in 0..240 {
        let time = step as f32 * 0.05;
        air.send(&at(time));
        air.run(0.05);
        if time > 8.0 {
            let position = air.vehicle.state.position_world;
            behind = behind.max((position - Vec3::new(0.0, 0.5 * time, 2.5)).length());
        }
    }
    behind
}

#[test]
fn a_position_with_its_velocity_is_a_moving_target() {
    let (with, without) = (trail(POSITION & VELOCITY), trail(POSITION));
    // The three lags of the shaping remain, 0.1 s each.
    assert!(with < 0.5 * 0.3, "{with} m");
    assert!(without > 2.0 * with, "{without} m without its velocity, {with} m with");
}

#[test]
fn ten_times_the_usual_rate_is_followed_and_starves_nothing() {
    use mavlink::dialects::common::HEARTBEAT_DATA;
    let mut air = Air::flying();
    let north = local(VELOCITY, NED, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    air.send(&north);
    assert_eq!(air.command(176, [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(0));
    air.received.clear();
    for _ in 0..500 {
        // 500 a second, where 50 are usual.
        (0..5).for_each(|_| air.send(&north));
        air.run(0.01);
    }
    assert!((air.vehicle.state.velocity_world - Vec3::Y).length() < 0.02);
    assert!(air.take::<HEARTBEAT_DATA>().len() >= 4);
    assert_eq!(air.protocol.dropped(), 0);
}

#[test]
fn an_offset_is_from_where_the_vehicle_is() {
    let mut air = Air::flying();
    air.vehicle.navigator.set_home(Vec3::ZERO).unwrap();
    let up = local(
        POSITION,
        MavFrame::MAV_FRAME_LOCAL_OFFSET_NED,
        [0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    );
    air.send(&up);
    assert_eq!(air.command(176, [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(0));
    air.run(0.3);
    assert!(air.vehicle.navigator.reference().acceleration_world.z > 0.1);
}

#[test]
fn yaw_and_its_rate_are_clockwise_from_north() {
    let mut air = Air::flying();
    let mut facing = local(POSITION & !YAW, NED, [0.0, 0.0, -2.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    facing.type_mask |= PositionTargetTypemask::from_bits_truncate(YAW_RATE);
    facing.yaw = 0.0;
    offboard(&mut air, &facing, 5.0);
    let left = air.vehicle.navigator.reference().left_world;
    assert!((left - Vec3::NEG_X).length() < 0.02, "facing north, left is west: {left}");
    let mut turning =
        local(POSITION & !YAW_RATE, NED, [0.0, 0.0, -2.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    turning.type_mask |= PositionTargetTypemask::from_bits_truncate(YAW);
    turning.yaw_rate = 0.5;
    offboard(&mut air, &turning, 3.0);
    let turn = air.vehicle.navigator.reference().left_rate_world;
    let left = air.vehicle.navigator.reference().left_world;
    let rate = left.cross(turn).z;
    assert!((rate + 0.5).abs() < 0.02, "clockwise from above: {rate}");
}

#[test]
fn a_global_place_is_flown_to() {
    let mut air = Air::flying();
    let (lat_int, lon_int, _) = ProtocolConfig::default().origin.global(Vec3::new(4.0, -2.0, 0.0));
    let data = SET_POSITION_TARGET_GLOBAL_INT_DATA {
        lat_int,
        lon_int,
        alt: 3.0,
        type_mask: PositionTargetTypemask::from_bits_truncate(POSITION),
        target_system: 1,
        target_component: 1,
        coordinate_frame: MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        ..SET_POSITION_TARGET_GLOBAL_INT_DATA::default()
    };
    air.send(&data);
    assert_eq!(air.command(176, [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(0));
    for _ in 0..60 {
        air.send(&data);
        air.run(0.2);
    }
    let there = Vec3::new(4.0, -2.0, 3.0);
    assert!((air.vehicle.state.position_world - there).length() < 0.05);
}

#[test]
fn silence_ends_offboard_in_hold() {
    let mut air = Air::flying();
    let numbers = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    offboard(&mut air, &local(VELOCITY, NED, numbers), 4.0);
    air.run(0.6);
    assert_eq!(air.vehicle.navigator.mode(), NavigationMode::Hold);
    assert!(air.texts().contains(&"set-points lost: hold".into()));
    air.run(4.0);
    assert!(air.vehicle.state.velocity_world.length() < 0.01);
}

#[test]
fn what_the_guarantees_cannot_hold_for_is_refused_with_a_sentence() {
    let mut air = Air::flying();
    let zero = [0.0; 9];
    let with = |index: usize, value: f32| {
        let mut numbers = zero;
        numbers[index] = value;
        numbers
    };
    let cases = [
        (local(POSITION, NED, with(0, f32::NAN)), "setpoint.position"),
        (local(POSITION, NED, with(2, f32::INFINITY)), "setpoint.position"),
        (local(VELOCITY, NED, with(3, 99.0)), "setpoint.velocity"),
        (local(ACCELERATION, NED, with(8, 5.0)), "setpoint.acceleration"),
        (local(POSITION | 1 << 9, NED, zero), "force"),
        (local(POSITION, MavFrame::MAV_FRAME_GLOBAL, zero), "frame"),
    ];
    for (data, reason) in cases {
        air.send(&data);
        air.run(0.05);
        let texts = air.texts();
        assert!(
            texts.iter().any(|t| t.starts_with("set-point refused") && t.contains(reason)),
            "{texts:?}"
        );
    }
    air.send(&SET_ATTITUDE_TARGET_DATA {
        q: [1.0, 0.0, 0.0, 0.0],
        thrust: 0.5,
        target_system: 1,
        target_component: 1,
        type_mask: AttitudeTargetTypemask::empty(),
        ..SET_ATTITUDE_TARGET_DATA::default()
    });
    air.run(0.05);
    assert_eq!(air.texts(), ["set-point refused: attitude alone"]);
    let rejected = result(MavResult::MAV_RESULT_TEMPORARILY_REJECTED);
    let offboard = air.command(176, [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(offboard, rejected, "none of them counts as a set-point");
}
