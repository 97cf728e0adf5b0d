//! Messages about the state of the vehicle, by their number.

use core::f32::consts::TAU;

use ctrl_core::mode::Mode;
use ctrl_core::mode::navigation::{Airborne, NavigationMode};
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use mavlink::dialects::common::{
    ATTITUDE_DATA, ATTITUDE_QUATERNION_DATA, AVAILABLE_MODES_DATA, BATTERY_STATUS_DATA,
    CURRENT_MODE_DATA, DEBUG_VECT_DATA, EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA,
    GPS_RAW_INT_DATA, GpsFixType, HEARTBEAT_DATA, HOME_POSITION_DATA, LOCAL_POSITION_NED_DATA,
    MESSAGE_INTERVAL_DATA, MISSION_CURRENT_DATA, MavAutopilot, MavBatteryFunction, MavBatteryType,
    MavFrame, MavLandedState, MavModeFlag, MavModeProperty, MavState, MavSysStatusSensor, MavType,
    MavVtolState, POSITION_TARGET_LOCAL_NED_DATA, PositionTargetTypemask, SYS_STATUS_DATA,
    SYSTEM_TIME_DATA, VFR_HUD_DATA,
};
use mavlink::types::CharArray;

use crate::coordinates::{attitude_ned, euler, frd, ned};
use crate::flight_mode::{FlightMode, MODES};
use crate::frame::Frame;
use crate::protocol::{Autopilot, Protocol};
use crate::stream::DEBUG_VECT;
use crate::vehicle::{Lasting, Vehicle, View};

impl Protocol<'_> {
    /// The frame of the telemetry message `id`; none if there is no such message, or no state for it.
    pub(crate) fn telemetry<V: Vehicle>(&mut self, id: u32, vehicle: &mut V) -> Option<Frame> {
        let view = vehicle.view();
        let boot = (view.time / 1000) as u32;
        match id {
            0 => Some(self.heartbeat(&view, vehicle)),
            1 => Some(self.sys_status(&view)),
            2 => Some(self.frame(&SYSTEM_TIME_DATA { time_unix_usec: 0, time_boot_ms: boot }, &[])),
            24 => Some(self.gps(&view)),
            30 => Some(self.attitude(boot, &view.state?)),
            31 => Some(self.attitude_quaternion(boot, &view.state?)),
            32 => Some(self.local_position(boot, &view.state?)),
            33 => Some(self.global_position(boot, &view.state?, vehicle)),
            42 => {
                let seq = self.current_sequence(vehicle);
                Some(self.frame(&MISSION_CURRENT_DATA { seq }, &[]))
            }
            74 => Some(self.hud(&view)),
            85 => Some(self.position_target(boot, vehicle)),
            147 => Some(self.battery(&view)),
            242 => Some(self.home(vehicle)),
            245 => Some(self.landed_state(vehicle)),
            DEBUG_VECT => Some(self.lasting(view.time, &view.lasting?)),
            436 => Some(self.current_mode(vehicle)),
            _ => None,
        }
    }

    fn heartbeat<V: Vehicle>(&mut self, view: &View, vehicle: &mut V) -> Frame {
        let mode = vehicle.navigator().mode();
        let armed = matches!(view.mode, Mode::Armed | Mode::Flying | Mode::Failsafe);
        let mut base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            | MavModeFlag::MAV_MODE_FLAG_STABILIZE_ENABLED
            | MavModeFlag::MAV_MODE_FLAG_GUIDED_ENABLED;
        if mode != NavigationMode::Offboard {
            base_mode |= MavModeFlag::MAV_MODE_FLAG_AUTO_ENABLED;
        }
        if armed {
            base_mode |= MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
        }
        let system_status = match view.mode {
            Mode::Flying => MavState::MAV_STATE_ACTIVE,
            Mode::Failsafe => MavState::MAV_STATE_CRITICAL,
            Mode::Locked => MavState::MAV_STATE_EMERGENCY,
            Mode::Disarmed | Mode::Armed => MavState::MAV_STATE_STANDBY,
        };
        let autopilot = match self.config.autopilot {
            Autopilot::Generic => MavAutopilot::MAV_AUTOPILOT_GENERIC,
            Autopilot::Px4 => MavAutopilot::MAV_AUTOPILOT_PX4,
        };
        let data = HEARTBEAT_DATA {
            custom_mode: FlightMode::of(mode).custom_mode(),
            mavtype: MavType::MAV_TYPE_QUADROTOR,
            autopilot,
            base_mode,
            system_status,
            mavlink_version: 3,
        };
        self.frame(&data, &[])
    }

    fn sys_status(&mut self, view: &View) -> Frame {
        use MavSysStatusSensor as Sensor;
        let flight = Sensor::MAV_SYS_STATUS_SENSOR_3D_GYRO
            | Sensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL
            | Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG
            | Sensor::MAV_SYS_STATUS_SENSOR_GPS
            | Sensor::MAV_SYS_STATUS_AHRS
            | Sensor::MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL
            | Sensor::MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
            | Sensor::MAV_SYS_STATUS_SENSOR_YAW_POSITION
            | Sensor::MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL
            | Sensor::MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
            | Sensor::MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS;
        let arming = Sensor::MAV_SYS_STATUS_PREARM_CHECK;
        let (mut health, in_use) = (Sensor::empty(), flight | arming);
        if view.state.is_some() {
            health |= flight;
        }
        if view.ready.is_ok() || matches!(view.mode, Mode::Armed | Mode::Flying) {
            health |= arming;
        }
        let battery = view.battery;
        let data = SYS_STATUS_DATA {
            onboard_control_sensors_present: in_use,
            onboard_control_sensors_enabled: in_use,
            onboard_control_sensors_health: health,
            load: (view.load * 1000.0) as u16,
            voltage_battery: battery.map_or(u16::MAX, |battery| (battery.voltage * 1e3) as u16),
            current_battery: battery.map_or(-1, |battery| (battery.current * 1e2) as i16),
            battery_remaining: battery.map_or(-1, |battery| (battery.remaining * 1e2) as i8),
            ..SYS_STATUS_DATA::DEFAULT
        };
        self.frame(&data, &[])
    }

    fn battery(&mut self, view: &View) -> Frame {
        let mut voltages = [u16::MAX; 10];
        if let (Some(battery), [first, ..]) = (view.battery, &mut voltages) {
            *first = (battery.voltage * 1e3) as u16;
        }
        let data = BATTERY_STATUS_DATA {
            current_consumed: -1,
            energy_consumed: -1,
            temperature: i16::MAX,
            voltages,
            current_battery: view.battery.map_or(-1, |battery| (battery.current * 1e2) as i16),
            id: 0,
            battery_function: MavBatteryFunction::MAV_BATTERY_FUNCTION_ALL,
            mavtype: MavBatteryType::MAV_BATTERY_TYPE_UNKNOWN,
            battery_remaining: view.battery.map_or(-1, |battery| (battery.remaining * 1e2) as i8),
        };
        self.frame(&data, &[])
    }

    fn gps(&mut self, view: &View) -> Frame {
        let mut data = GPS_RAW_INT_DATA {
            time_usec: view.time,
            eph: u16::MAX,
            epv: u16::MAX,
            vel: u16::MAX,
            cog: u16::MAX,
            fix_type: GpsFixType::GPS_FIX_TYPE_NO_FIX,
            satellites_visible: u8::MAX,
            ..GPS_RAW_INT_DATA::DEFAULT
        };
        if let Some(state) = view.state {
            let (lat, lon, alt) = self.config.origin.global(state.position_world);
            // Stations know no fix that needs no receiver.
            data.fix_type = GpsFixType::GPS_FIX_TYPE_3D_FIX;
            data = GPS_RAW_INT_DATA { lat, lon, alt: (alt * 1e3) as i32, ..data };
        }
        self.frame(&data, &[])
    }

    fn attitude(&mut self, time_boot_ms: u32, state: &VehicleState) -> Frame {
        let angles = euler(attitude_ned(state.attitude));
        let rate = frd(state.rate_body);
        let data = ATTITUDE_DATA {
            time_boot_ms,
            roll: angles.x,
            pitch: angles.y,
            yaw: angles.z,
            rollspeed: rate.x,
            pitchspeed: rate.y,
            yawspeed: rate.z,
        };
        self.frame(&data, &[])
    }

    fn attitude_quaternion(&mut self, time_boot_ms: u32, state: &VehicleState) -> Frame {
        let (q, rate) = (attitude_ned(state.attitude), frd(state.rate_body));
        let data = ATTITUDE_QUATERNION_DATA {
            time_boot_ms,
            q1: q.w,
            q2: q.x,
            q3: q.y,
            q4: q.z,
            rollspeed: rate.x,
            pitchspeed: rate.y,
            yawspeed: rate.z,
        };
        self.frame(&data, &[])
    }

    fn local_position(&mut self, time_boot_ms: u32, state: &VehicleState) -> Frame {
        let (Vec3 { x, y, z }, velocity) = (ned(state.position_world), ned(state.velocity_world));
        let (vx, vy, vz) = velocity.into();
        self.frame(&LOCAL_POSITION_NED_DATA { time_boot_ms, x, y, z, vx, vy, vz }, &[])
    }

    fn global_position<V: Vehicle>(
        &mut self,
        time_boot_ms: u32,
        state: &VehicleState,
        vehicle: &mut V,
    ) -> Frame {
        let (lat, lon, alt) = self.config.origin.global(state.position_world);
        let above = state.position_world.z - vehicle.navigator().home_world().z;
        let [vx, vy, vz] = ned(state.velocity_world).to_array().map(|v| (v * 100.0) as i16);
        let data = GLOBAL_POSITION_INT_DATA {
            time_boot_ms,
            lat,
            lon,
            alt: (alt * 1e3) as i32,
            relative_alt: (above * 1e3) as i32,
            vx,
            vy,
            vz,
            hdg: libm::roundf(compass(state) * 100.0) as u16 % 36_000,
        };
        self.frame(&data, &[])
    }

    fn hud(&mut self, view: &View) -> Frame {
        let state = view.state.unwrap_or(VehicleState::at_rest(Vec3::ZERO));
        let velocity = state.velocity_world;
        let (_, _, alt) = self.config.origin.global(state.position_world);
        let data = VFR_HUD_DATA {
            airspeed: velocity.length(),
            groundspeed: velocity.truncate().length(),
            alt,
            climb: velocity.z,
            heading: compass(&state) as i16,
            throttle: (view.thrust * 100.0) as u16,
        };
        self.frame(&data, &[])
    }

    fn position_target<V: Vehicle>(&mut self, time_boot_ms: u32, vehicle: &mut V) -> Frame {
        let reference = vehicle.navigator().reference();
        let (Vec3 { x, y, z }, velocity) =
            (ned(reference.position_world), ned(reference.velocity_world));
        let (afx, afy, afz) = ned(reference.acceleration_world).into();
        let (vx, vy, vz) = velocity.into();
        let data = POSITION_TARGET_LOCAL_NED_DATA {
            time_boot_ms,
            x,
            y,
            z,
            vx,
            vy,
            vz,
            afx,
            afy,
            afz,
            yaw: 0.0,
            yaw_rate: 0.0,
            type_mask: PositionTargetTypemask::POSITION_TARGET_TYPEMASK_YAW_IGNORE
                | PositionTargetTypemask::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE,
            coordinate_frame: MavFrame::MAV_FRAME_LOCAL_NED,
        };
        self.frame(&data, &[])
    }

    fn home<V: Vehicle>(&mut self, vehicle: &mut V) -> Frame {
        let home = vehicle.navigator().home_world();
        let (latitude, longitude, altitude) = self.config.origin.global(home);
        let Vec3 { x, y, z } = ned(home);
        let data = HOME_POSITION_DATA {
            latitude,
            longitude,
            altitude: (altitude * 1e3) as i32,
            x,
            y,
            z,
            q: [1.0, 0.0, 0.0, 0.0],
            approach_x: 0.0,
            approach_y: 0.0,
            approach_z: 0.0,
        };
        self.frame(&data, &[])
    }

    fn landed_state<V: Vehicle>(&mut self, vehicle: &mut V) -> Frame {
        let landed_state = match vehicle.navigator().airborne() {
            Airborne::Ground => MavLandedState::MAV_LANDED_STATE_ON_GROUND,
            Airborne::TakingOff => MavLandedState::MAV_LANDED_STATE_TAKEOFF,
            Airborne::Air => MavLandedState::MAV_LANDED_STATE_IN_AIR,
            Airborne::Landing => MavLandedState::MAV_LANDED_STATE_LANDING,
        };
        let vtol_state = MavVtolState::MAV_VTOL_STATE_UNDEFINED;
        self.frame(&EXTENDED_SYS_STATE_DATA { vtol_state, landed_state }, &[])
    }

    fn current_mode<V: Vehicle>(&mut self, vehicle: &mut V) -> Frame {
        let mode = FlightMode::of(vehicle.navigator().mode());
        let data = CURRENT_MODE_DATA {
            custom_mode: mode.custom_mode(),
            intended_custom_mode: mode.custom_mode(),
            standard_mode: mode.standard(),
        };
        self.frame(&data, &[])
    }

    /// One of both estimates, in turn.
    fn lasting(&mut self, time_usec: u64, lasting: &Lasting) -> Frame {
        self.torque_turn ^= true;
        let (name, Vec3 { x, y, z }) = if self.torque_turn {
            (*b"t_hat\0\0\0\0\0", frd(lasting.torque_body))
        } else {
            (*b"d_hat\0\0\0\0\0", ned(lasting.acceleration_world))
        };
        self.frame(&DEBUG_VECT_DATA { time_usec, x, y, z, name: CharArray::new(name) }, &[])
    }

    /// The next mode of a list that was asked for.
    pub(crate) fn next_available_mode(&mut self) -> Option<Frame> {
        let (index, single) = (self.next_mode & 0x7f, self.next_mode & 0x80 != 0);
        let mode = MODES.get(usize::from(index.checked_sub(1)?));
        self.next_mode = if single || mode.is_none() { 0 } else { index + 1 };
        let mode = mode?;
        let mut name = [0; 35];
        // wcet: at most 35 iterations
        // wcet: at most 35 bytes
        name.iter_mut().zip(mode.name.bytes()).for_each(|(place, byte)| *place = byte);
        let data = AVAILABLE_MODES_DATA {
            custom_mode: mode.custom_mode(),
            properties: MavModeProperty::MAV_MODE_PROPERTY_AUTO_MODE,
            number_modes: MODES.len() as u8,
            mode_index: index,
            standard_mode: mode.standard(),
            mode_name: CharArray::new(name),
        };
        Some(self.frame(&data, &[]))
    }

    /// Answers with the interval of a stream; zero: there is no such message.
    pub(crate) fn send_interval(&mut self, id: f32) {
        let message_id = id.max(0.0) as u16;
        let interval_us = self.streams.interval(message_id.into()).unwrap_or(0);
        self.answer(&MESSAGE_INTERVAL_DATA { interval_us, message_id }, &[]);
    }
}

/// Heading from north towards east, in [0, 360) (deg).
fn compass(state: &VehicleState) -> f32 {
    let yaw = euler(attitude_ned(state.attitude)).z;
    let turned = if yaw < 0.0 { yaw + TAU } else { yaw };
    turned * (360.0 / TAU)
}
