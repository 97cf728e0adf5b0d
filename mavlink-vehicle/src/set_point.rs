//! Set-points of another computer: type masks and frames.

use ctrl_core::setpoint::Setpoint;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use mavlink::dialects::common::{
    MavFrame, PositionTargetTypemask, SET_POSITION_TARGET_GLOBAL_INT_DATA,
    SET_POSITION_TARGET_LOCAL_NED_DATA,
};

use crate::coordinates::{attitude_ned, euler, ned, yaw_ned};
use crate::protocol::Protocol;
use crate::status_text::{Part, Severity};
use crate::vehicle::Vehicle;

/// A set-point as it came, its vectors in NED.
struct Target {
    mask: u16,
    position: Vec3,
    velocity: Vec3,
    acceleration: Vec3,
    yaw: f32,
    yaw_rate: f32,
}

impl Target {
    /// Returns `true` if field number `field` of the mask is to be used.
    fn uses(&self, field: u16) -> bool {
        self.mask >> field & 1 == 0
    }

    /// Fields `first` to `first + 2` of the mask, in the world frame.
    fn vector(&self, vector: Vec3, first: u16) -> [Option<f32>; 3] {
        let Vec3 { x, y, z } = ned(vector);
        let used = |field: u16, value: f32| self.uses(field).then_some(value);
        // East and north swap places, and the mask with them.
        [used(first + 1, x), used(first, y), used(first + 2, z)]
    }

    /// The set-point in the world frame.
    fn setpoint(&self) -> Setpoint {
        Setpoint {
            position_world: self.vector(self.position, 0),
            velocity_world: self.vector(self.velocity, 3),
            acceleration_world: self.vector(self.acceleration, 6),
            yaw: self
                .uses(10)
                .then(|| if self.yaw.is_finite() { yaw_ned(self.yaw) } else { self.yaw }),
            yaw_rate: self.uses(11).then_some(-self.yaw_rate),
        }
    }
}

/// Relation of a frame to NED.
enum Axes {
    /// Local NED.
    Local,
    /// NED, the position from where the vehicle is.
    Offset,
    /// Forward, right and down, turned with the heading; the position from where the vehicle is.
    Heading,
}

fn axes(frame: MavFrame) -> Option<Axes> {
    match frame {
        MavFrame::MAV_FRAME_LOCAL_NED => Some(Axes::Local),
        MavFrame::MAV_FRAME_LOCAL_OFFSET_NED => Some(Axes::Offset),
        MavFrame::MAV_FRAME_BODY_NED | MavFrame::MAV_FRAME_BODY_OFFSET_NED => Some(Axes::Heading),
        MavFrame::MAV_FRAME_BODY_FRD => Some(Axes::Heading),
        _ => None,
    }
}

impl Protocol<'_> {
    /// Takes a set-point in local coordinates.
    pub(crate) fn local_target<V: Vehicle>(
        &mut self,
        data: &SET_POSITION_TARGET_LOCAL_NED_DATA,
        vehicle: &mut V,
    ) {
        let target = Target {
            mask: data.type_mask.bits(),
            position: Vec3::new(data.x, data.y, data.z),
            velocity: Vec3::new(data.vx, data.vy, data.vz),
            acceleration: Vec3::new(data.afx, data.afy, data.afz),
            yaw: data.yaw,
            yaw_rate: data.yaw_rate,
        };
        let Some(axes) = axes(data.coordinate_frame) else {
            return self.say(Severity::Warning, &[Part::Text("set-point refused: frame")]);
        };
        let target = match (axes, vehicle.view().state) {
            (Axes::Local, _) => target,
            (_, None) => return,
            (Axes::Offset, Some(state)) => from_here(target, &state),
            (Axes::Heading, Some(state)) => from_here(turned(target, &state), &state),
        };
        self.stream_target(&target, vehicle);
    }

    /// Takes a set-point in global coordinates.
    pub(crate) fn global_target<V: Vehicle>(
        &mut self,
        data: &SET_POSITION_TARGET_GLOBAL_INT_DATA,
        vehicle: &mut V,
    ) {
        let height = self.altitude(data.coordinate_frame as u8, data.alt, vehicle);
        let world = self.config.origin.world(data.lat_int, data.lon_int, 0.0);
        let target = Target {
            mask: data.type_mask.bits(),
            position: ned(Vec3::new(world.x, world.y, height)),
            velocity: Vec3::new(data.vx, data.vy, data.vz),
            acceleration: Vec3::new(data.afx, data.afy, data.afz),
            yaw: data.yaw,
            yaw_rate: data.yaw_rate,
        };
        self.stream_target(&target, vehicle);
    }

    /// Refuses a set-point of the attitude: no law tracks one alone, and none of the guarantees covers it.
    pub(crate) fn attitude_target(&mut self) {
        self.say(Severity::Warning, &[Part::Text("set-point refused: attitude alone")]);
    }

    fn stream_target<V: Vehicle>(&mut self, target: &Target, vehicle: &mut V) {
        let force = PositionTargetTypemask::POSITION_TARGET_TYPEMASK_FORCE_SET.bits();
        if target.mask & force != 0 {
            return self.say(Severity::Warning, &[Part::Text("set-point refused: force")]);
        }
        if let Err(error) = vehicle.navigator().stream(target.setpoint()) {
            self.say_invalid("set-point refused: ", &error);
        }
    }
}

/// The target with its vectors turned from the vehicle's heading to north.
fn turned(target: Target, state: &VehicleState) -> Target {
    let yaw = euler(attitude_ned(state.attitude)).z;
    let (sin, cos) = ctrl_core::trigonometry::sin_cos(yaw);
    let turn = |v: Vec3| Vec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
    // Both horizontal axes are needed once they are turned.
    let pair = |mask: u16, first: u16| {
        let either = mask >> first & mask >> (first + 1) & 1;
        mask & !(0b11 << first) | either << first | either << (first + 1)
    };
    Target {
        mask: pair(pair(pair(target.mask, 0), 3), 6),
        position: turn(target.position),
        velocity: turn(target.velocity),
        acceleration: turn(target.acceleration),
        yaw: target.yaw + yaw,
        ..target
    }
}

/// The target with its position from where the vehicle is.
fn from_here(target: Target, state: &VehicleState) -> Target {
    Target { position: target.position + ned(state.position_world), ..target }
}
