//! Messages that the vehicle sends by itself: rates and contents.

use mavlink::dialects::common::{
    ATTITUDE_DATA, ATTITUDE_QUATERNION_DATA, BATTERY_STATUS_DATA, CURRENT_MODE_DATA,
    DEBUG_VECT_DATA, EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA,
    HEARTBEAT_DATA, HOME_POSITION_DATA, LOCAL_POSITION_NED_DATA, MISSION_CURRENT_DATA,
    MavAutopilot, MavLandedState, MavModeFlag, MavState, MavSysStatusSensor, SYS_STATUS_DATA,
    VFR_HUD_DATA,
};

use super::*;

#[test]
fn streams_come_at_their_rates() {
    let mut air = Air::new();
    air.run(1.0);
    air.received.clear();
    air.run(10.0);
    let near = |count: usize, expected: usize| {
        assert!(count.abs_diff(expected) <= 1, "{count} instead of {expected}");
    };
    near(air.take::<HEARTBEAT_DATA>().len(), 10);
    near(air.take::<SYS_STATUS_DATA>().len(), 10);
    near(air.take::<BATTERY_STATUS_DATA>().len(), 10);
    near(air.take::<HOME_POSITION_DATA>().len(), 10);
    near(air.take::<MISSION_CURRENT_DATA>().len(), 10);
    near(air.take::<CURRENT_MODE_DATA>().len(), 10);
    near(air.take::<GPS_RAW_INT_DATA>().len(), 50);
    near(air.take::<EXTENDED_SYS_STATE_DATA>().len(), 50);
    near(air.take::<VFR_HUD_DATA>().len(), 100);
    near(air.take::<ATTITUDE_DATA>().len(), 500);
    near(air.take::<ATTITUDE_QUATERNION_DATA>().len(), 500);
    near(air.take::<LOCAL_POSITION_NED_DATA>().len(), 500);
    near(air.take::<GLOBAL_POSITION_INT_DATA>().len(), 500);
}

#[test]
fn a_battery_is_shown_where_there_is_one_and_unknown_elsewhere() {
    for (battery, voltage, current, remaining) in [
        (None, u16::MAX, -1, -1),
        (Some(Battery { voltage: 14.8, current: 9.5, remaining: 0.42 }), 14_800, 950, 42),
    ] {
        let mut air = Air::new();
        air.vehicle.battery = battery;
        air.run(1.5);
        let status = air.take::<SYS_STATUS_DATA>().pop().unwrap();
        let found = (status.voltage_battery, status.current_battery, status.battery_remaining);
        assert_eq!(found, (voltage, current, remaining));
        let status = air.take::<BATTERY_STATUS_DATA>().pop().unwrap();
        let found = (status.voltages[0], status.current_battery, status.battery_remaining);
        assert_eq!(found, (voltage, current, remaining));
        assert!(status.voltages[1..].iter().all(|cell| *cell == u16::MAX));
    }
}

#[test]
fn estimates_of_the_integral_action_come_in_turn_where_the_law_has_it() {
    let mut air = Air::new();
    air.run(10.0);
    assert_eq!(air.take::<DEBUG_VECT_DATA>(), []);
    air.vehicle.lasting = Some(Lasting {
        acceleration_world: Vec3::new(0.1, 0.2, 0.3),
        torque_body: Vec3::new(4.0, 5.0, 6.0),
    });
    air.run(10.0);
    let sent = air.take::<DEBUG_VECT_DATA>();
    assert!((100..=102).contains(&sent.len()), "{}", sent.len()); // the first two at once
    for pair in sent.chunks_exact(2) {
        let [force, torque] = [&pair[0], &pair[1]];
        assert_eq!(
            (force.name.to_str().unwrap(), torque.name.to_str().unwrap()),
            ("d_hat", "t_hat")
        );
        assert_eq!((force.x, force.y, force.z), (0.2, 0.1, -0.3)); // NED
        assert_eq!((torque.x, torque.y, torque.z), (4.0, -5.0, -6.0)); // FRD
        assert!(force.time_usec <= torque.time_usec);
    }
}

#[test]
fn a_slow_link_stretches_everything_but_the_heartbeat() {
    let mut air = Air::new();
    air.protocol = protocol(&ProtocolConfig { stretch: 10, ..ProtocolConfig::default() });
    air.run(0.1);
    air.received.clear();
    air.run(10.0);
    assert!(air.take::<HEARTBEAT_DATA>().len().abs_diff(10) <= 1);
    assert!(air.take::<ATTITUDE_DATA>().len().abs_diff(50) <= 1);
}

#[test]
fn the_heartbeat_shows_mode_arming_and_a_generic_autopilot() {
    let mut air = Air::new();
    air.run(1.0);
    let armed = MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
    let heartbeat = air.take::<HEARTBEAT_DATA>().pop().unwrap();
    assert_eq!(heartbeat.autopilot, MavAutopilot::MAV_AUTOPILOT_GENERIC);
    assert_eq!(heartbeat.system_status, MavState::MAV_STATE_STANDBY);
    assert!(!heartbeat.base_mode.contains(armed));
    let mut air = Air::flying();
    air.run(1.0);
    let heartbeat = air.take::<HEARTBEAT_DATA>().pop().unwrap();
    assert!(heartbeat.base_mode.contains(armed));
    assert_eq!(heartbeat.custom_mode, 4 << 16 | 3 << 24);
    assert_eq!(heartbeat.system_status, MavState::MAV_STATE_ACTIVE);
    for (mode, status) in [
        (Mode::Failsafe, MavState::MAV_STATE_CRITICAL),
        (Mode::Locked, MavState::MAV_STATE_EMERGENCY),
    ] {
        air.vehicle.mode = mode;
        air.run(1.1);
        assert_eq!(air.take::<HEARTBEAT_DATA>().pop().unwrap().system_status, status);
    }
    let px4 = ProtocolConfig { autopilot: Autopilot::Px4, ..ProtocolConfig::default() };
    air.protocol = protocol(&px4);
    air.run(0.1);
    let heartbeat = air.take::<HEARTBEAT_DATA>().pop().unwrap();
    assert_eq!(heartbeat.autopilot, MavAutopilot::MAV_AUTOPILOT_PX4);
}

#[test]
fn the_landed_state_follows_the_flight() {
    let mut air = Air::flying();
    let now = |air: &mut Air| {
        air.received.clear();
        air.run(0.3);
        air.take::<EXTENDED_SYS_STATE_DATA>().pop().unwrap().landed_state
    };
    assert_eq!(now(&mut air), MavLandedState::MAV_LANDED_STATE_IN_AIR);
    air.command(21, [f32::NAN; 7]);
    air.run(2.0);
    assert_eq!(now(&mut air), MavLandedState::MAV_LANDED_STATE_LANDING);
    air.run(10.0);
    assert_eq!(now(&mut air), MavLandedState::MAV_LANDED_STATE_ON_GROUND);
}

#[test]
fn positions_are_ned_above_home_and_on_the_globe() {
    let mut air = Air::flying();
    air.vehicle.state.position_world = Vec3::new(1.0, 2.0, 3.0);
    air.received.clear();
    let frame = air.protocol.telemetry(32, &mut air.vehicle).unwrap();
    air.received.push(sent(&frame));
    let local = air.take::<LOCAL_POSITION_NED_DATA>().pop().unwrap();
    assert_eq!((local.x, local.y, local.z), (2.0, 1.0, -3.0));
    let frame = air.protocol.telemetry(33, &mut air.vehicle).unwrap();
    air.received.push(sent(&frame));
    let global = air.take::<GLOBAL_POSITION_INT_DATA>().pop().unwrap();
    let origin = ProtocolConfig::default().origin;
    assert_eq!(global.lat, origin.latitude + 180);
    assert_eq!((global.alt, global.relative_alt, global.hdg), (3000, 3000, 9000));
}

#[test]
fn health_says_whether_an_arm_would_be_accepted() {
    let mut air = Air::new();
    air.run(1.0);
    let status = air.take::<SYS_STATUS_DATA>().pop().unwrap();
    let check = MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
    assert!(status.onboard_control_sensors_health.contains(check));
    assert!(status.onboard_control_sensors_enabled.contains(check));
    assert_eq!((status.load, status.battery_remaining), (250, -1));
}
