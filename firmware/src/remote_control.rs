//! Remote control by CRSF (ExpressLRS, Crossfire): sticks and switches to commands, requests and set-points.
//!
//! | channel | control | effect |
//! |---|---|---|
//! | 1 to 4 | roll, pitch, throttle, yaw sticks | velocity right, forward and up, turn rate; centred: hold |
//! | 5 | arm switch | up: arm; down: disarm on the ground, land in the air |
//! | 6 | mode switch | low: sticks; middle: mission; high: return |
//! | 7 | kill switch | rotors stopped while it is on, in every mode |
//!
//! With the vehicle armed, the throttle stick above its middle asks for a take-off. Velocities are scaled to the limits of
//! the navigation, whose shaping keeps the reference inside `M_p`: there is no manual mode. Switches act
//! when they move, so that a ground station may command in between; the kill switch acts by its
//! position. Pure: bytes and ticks come as arguments; the task that reads a serial port (420,000 baud, 8N1)
//! calls [`RemoteControl::receive`].

use crsf::{Packet, PacketParser, RcChannels};
use ctrl_core::mode::navigation::{Airborne, NavigationMode, Request};
use ctrl_core::mode::{Command, Mode};
use ctrl_core::setpoint::Setpoint;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;

use crate::pilot::Pilot;

/// Length of a frame of channels, and of one of link statistics (bytes).
const CHANNELS_FRAME: usize = 26;
const STATISTICS_FRAME: usize = 14;
const CHANNELS_TYPE: u8 = 0x16;
const STATISTICS_TYPE: u8 = 0x14;

/// Deflection of a stick that counts as none (-).
const DEAD_BAND: f32 = 0.06;
/// Deflection from which on a switch is up or down (-).
const SWITCHED: f32 = 0.5;
/// Deflection of the throttle stick that asks for a take-off (-).
const TAKE_OFF: f32 = 0.3;

/// Receiver and state of the switches.
pub struct RemoteControl {
    parser: PacketParser<128>,
    channels: Option<Channels>,
    /// Ticks since the latest good frame of channels.
    age: u32,
    /// The receiver itself has lost its transmitter.
    lost: bool,
    /// Switches as they were last acted upon; none before the first frame.
    before: Option<Switches>,
    /// The sticks command velocities.
    sticks_fly: bool,
    /// The throttle stick has been down since arming.
    throttle_was_low: bool,
}

/// Deflections in [-1, 1]: right, forward, up, and left round are positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Channels {
    /// Sticks: right, forward, up, turn to the left.
    pub right: f32,
    /// Forward.
    pub forward: f32,
    /// Up.
    pub up: f32,
    /// Turn to the left, anticlockwise from above.
    pub turn: f32,
    /// Arm switch.
    pub arm: f32,
    /// Mode switch.
    pub mode: f32,
    /// Kill switch.
    pub kill: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Switches {
    arm: bool,
    mode: Position,
}

/// Position of a switch with three.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Position {
    Low,
    Middle,
    High,
}

impl RemoteControl {
    /// Nothing has come yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            parser: PacketParser::new(),
            channels: None,
            age: u32::MAX,
            lost: false,
            before: None,
            sticks_fly: false,
            throttle_was_low: false,
        }
    }

    /// Takes a byte of the receiver; `true` if it ended a good frame of channels.
    pub fn receive(&mut self, byte: u8) -> bool {
        self.parser.push_bytes(&[byte]);
        // After every byte: the parser drops what follows a frame in its buffer.
        let Some(Ok(raw)) = self.parser.next_raw_packet() else { return false };
        // The crate reads payloads of the lengths that they should have: others must not reach it.
        let form = (raw.data().get(2).copied(), raw.data().len());
        let known =
            [(Some(CHANNELS_TYPE), CHANNELS_FRAME), (Some(STATISTICS_TYPE), STATISTICS_FRAME)];
        if !known.contains(&form) {
            return false;
        }
        match Packet::from_raw(&raw) {
            Ok(Packet::RcChannels(RcChannels(channels))) => {
                (self.channels, self.age) = (Some(Channels::from_raw(&channels)), 0);
                true
            }
            Ok(Packet::LinkStatistics(statistics)) => {
                self.lost = statistics.uplink_link_quality == 0;
                false
            }
            _ => false,
        }
    }

    /// Time since the latest good frame (s), of ticks each `step_period` (s); infinite before the first, and while
    /// the receiver reports no link.
    #[must_use]
    pub fn silence(&self, step_period: f32) -> f32 {
        if self.lost || self.age == u32::MAX {
            f32::INFINITY
        } else {
            self.age as f32 * step_period
        }
    }

    /// `true` while the kill switch is on; a lost link leaves it where it was.
    #[must_use]
    pub fn kills(&self) -> bool {
        self.channels.is_some_and(|channels| channels.kill > SWITCHED)
    }

    /// The latest deflections.
    #[must_use]
    pub fn channels(&self) -> Option<&Channels> {
        self.channels.as_ref()
    }

    /// One tick: hands commands, requests and set-points to the pilot, `mode` being the supervisor's.
    ///
    /// What the pilot or the navigation refuses is dropped: the operator sees that nothing happens. Older than
    /// `timeout` (s), the sticks command nothing.
    pub fn step(
        &mut self,
        pilot: &mut Pilot,
        mode: Mode,
        vehicle: Option<&VehicleState>,
        timeout: f32,
    ) {
        self.age = self.age.saturating_add(u32::from(self.age != u32::MAX));
        let period = pilot.navigator().config().shaper.step_period;
        let Some(channels) = self.channels.filter(|_| self.silence(period) <= timeout) else {
            // What comes back finds its switches as they are: nothing moves by itself.
            (self.before, self.sticks_fly) = (None, false);
            return;
        };
        let now = Switches { arm: channels.arm > SWITCHED, mode: Position::of(channels.mode) };
        let before = self.before.replace(now);
        if let Some(before) = before.filter(|before| *before != now) {
            self.switch(pilot, mode, before, now);
        }
        match mode {
            Mode::Armed => self.wait_for_take_off(pilot, mode, &channels, now),
            Mode::Flying if now.mode == Position::Low => {
                self.fly(pilot, mode, &channels, vehicle);
            }
            _ => (self.sticks_fly, self.throttle_was_low) = (false, false),
        }
    }

    fn switch(&mut self, pilot: &mut Pilot, mode: Mode, before: Switches, now: Switches) {
        if before.arm != now.arm {
            match (now.arm, mode) {
                (true, _) => pilot.order(Command::Arm),
                (false, Mode::Flying) if pilot.navigator().airborne() != Airborne::Ground => {
                    let _ = pilot.request(mode, Request::Land(None));
                }
                (false, _) => pilot.order(Command::Disarm),
            }
        }
        if before.mode != now.mode {
            let request = match now.mode {
                Position::Low => Request::Hold,
                Position::Middle => Request::Mission,
                Position::High => Request::Return,
            };
            let _ = pilot.request(mode, request);
        }
    }

    fn wait_for_take_off(
        &mut self,
        pilot: &mut Pilot,
        mode: Mode,
        channels: &Channels,
        now: Switches,
    ) {
        self.throttle_was_low |= channels.up < -SWITCHED;
        if self.throttle_was_low && channels.up > TAKE_OFF && now.mode == Position::Low {
            self.throttle_was_low = false;
            let _ = pilot.request(mode, Request::TakeOff(None));
        }
    }

    /// Velocities by the sticks, once one of them has left its middle; hold when all are back.
    fn fly(
        &mut self,
        pilot: &mut Pilot,
        mode: Mode,
        channels: &Channels,
        vehicle: Option<&VehicleState>,
    ) {
        // The take-off is not broken off by the throttle stick that asked for it.
        let busy =
            matches!(pilot.navigator().mode(), NavigationMode::TakeOff | NavigationMode::Land);
        let Channels { right, forward, up, turn, .. } = *channels;
        let centred = [right, forward, up, turn].iter().all(|stick| *stick == 0.0);
        if centred {
            if core::mem::take(&mut self.sticks_fly) {
                let _ = pilot.request(mode, Request::Hold);
            }
            return;
        }
        let Some(vehicle) = vehicle.filter(|_| !busy) else { return };
        let limits = pilot.navigator().config().shaper;
        let ahead = ctrl_core::rotation::rotate(vehicle.attitude, Vec3::X).with_z(0.0);
        let ahead = ahead.normalize_or(Vec3::X);
        let to_the_right = Vec3::new(ahead.y, -ahead.x, 0.0);
        let level =
            (forward * ahead + right * to_the_right).clamp_length_max(1.0) * limits.speed_max;
        let climb = up * if up > 0.0 { limits.climb_max } else { limits.descent_max };
        let setpoint = Setpoint {
            velocity_world: [Some(level.x), Some(level.y), Some(climb)],
            yaw_rate: Some(turn * limits.yaw_rate_max),
            ..Setpoint::default()
        };
        if pilot.stream(setpoint).is_ok()
            && pilot.navigator().mode() != NavigationMode::Offboard
            && pilot.request(mode, Request::Offboard).is_ok()
        {
            self.sticks_fly = true;
        }
    }
}

impl Default for RemoteControl {
    fn default() -> Self {
        Self::new()
    }
}

impl Channels {
    /// Deflections of raw channels: 992 in the middle, 820 to either side; sticks within the dead band are centred.
    fn from_raw(raw: &[u16; 16]) -> Self {
        let deflection = |channel: u16| {
            let middle = f32::from(RcChannels::CHANNEL_VALUE_MID);
            ((f32::from(channel) - middle) / 820.0).clamp(-1.0, 1.0)
        };
        let stick = |channel: u16| {
            let x = deflection(channel);
            if x.abs() < DEAD_BAND { 0.0 } else { x }
        };
        let [right, forward, up, turn, arm, mode, kill, ..] = *raw;
        Self {
            right: stick(right),
            forward: stick(forward),
            up: stick(up),
            // A yaw stick to the right turns clockwise.
            turn: -stick(turn),
            arm: deflection(arm),
            mode: deflection(mode),
            kill: deflection(kill),
        }
    }
}

impl Position {
    fn of(deflection: f32) -> Self {
        if deflection > SWITCHED {
            Self::High
        } else if deflection < -SWITCHED {
            Self::Low
        } else {
            Self::Middle
        }
    }
}

#[cfg(test)]
#[path = "remote_control_tests.rs"]
mod tests;
