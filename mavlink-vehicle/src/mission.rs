//! Missions: upload, download, and their items as the core flies them.

use ctrl_core::list::List;
use ctrl_core::mode::navigation::{MISSION_MAX, MissionItem, MissionKind, Navigator};
use glam::Vec3;
use mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_COUNT_DATA, MISSION_CURRENT_DATA, MISSION_REQUEST_INT_DATA,
    MavMissionResult,
};

use crate::command::height;
use crate::coordinates::{ned, yaw_ned};
use crate::message::{Item, MISSION_ITEM_INT};
use crate::protocol::{Protocol, ProtocolConfig};
use crate::status_text::{Part, Severity};
use crate::vehicle::Vehicle;

/// Time after which an item is asked for again (us).
const REPEAT: u64 = 500_000;
/// Requests of the same item before the upload is given up.
const ATTEMPTS: u8 = 6;
/// Kind of list: the mission itself.
const MISSION: u8 = 0;
/// Kind of list: all of them.
const ALL: u8 = 255;

/// Filler of a list: zeros, like all of it, so that its memory needs no initial values.
const BLANK: MissionItem = MissionItem {
    kind: MissionKind::TakeOff,
    position_world: Vec3::ZERO,
    yaw: None,
    hold_time: 0.0,
    number: 0,
};

/// An upload on its way.
#[derive(Clone, Copy, Debug)]
struct Upload {
    station: (u8, u8),
    count: u16,
    attempts: u8,
    asked: u64,
    /// Home of the world frame that the items are converted by (m).
    home: Vec3,
}

/// The mission as it came, and the one that is coming.
#[derive(Clone, Debug)]
pub(crate) struct MissionStore {
    items: List<Item, MISSION_MAX>,
    arriving: List<Item, MISSION_MAX>,
    /// The arriving ones as the core flies them: each is converted when it comes, so that the last one has
    /// no more to do than the others.
    flown: List<MissionItem, MISSION_MAX>,
    upload: Option<Upload>,
}

impl MissionStore {
    pub(crate) const fn new() -> Self {
        let empty = List::empty(Item::ZERO);
        let flown = List::empty(BLANK);
        Self { items: empty, arriving: empty, flown, upload: None }
    }
}

impl Protocol<'_> {
    /// Begins an upload; one that is on its way is given up.
    pub(crate) fn begin_upload<V: Vehicle>(
        &mut self,
        count: u16,
        kind: u8,
        station: (u8, u8),
        vehicle: &mut V,
    ) {
        self.memory.mission.upload = None;
        if kind != MISSION {
            return self.end_mission(MavMissionResult::MAV_MISSION_UNSUPPORTED, kind, station);
        }
        if usize::from(count) > MISSION_MAX {
            let most = MISSION_MAX as u32;
            let count = Part::Count(count.into());
            let text = [count, Part::Text(" mission items, at most "), Part::Count(most)];
            self.say(Severity::Warning, &text);
            return self.end_mission(MavMissionResult::MAV_MISSION_NO_SPACE, kind, station);
        }
        if count == 0 {
            return self.clear_mission(kind, station, vehicle);
        }
        self.memory.mission.arriving.truncate(0);
        self.memory.mission.flown.truncate(0);
        let (asked, home) = (vehicle.view().time, vehicle.navigator().home_world());
        self.memory.mission.upload = Some(Upload { station, count, attempts: 0, asked, home });
        self.request_item();
    }

    /// Takes an item of the upload.
    pub(crate) fn take_item<V: Vehicle>(&mut self, item: Item, station: (u8, u8), vehicle: &mut V) {
        let Some(upload) = &mut self.memory.mission.upload else {
            // The acknowledgement of the last item was lost, or there is no upload.
            let known = self.memory.mission.items.get(usize::from(item.sequence));
            let result = if known.is_some_and(|known| same(known, &item)) {
                MavMissionResult::MAV_MISSION_ACCEPTED
            } else {
                MavMissionResult::MAV_MISSION_INVALID_SEQUENCE
            };
            return self.end_mission(result, item.mission_type, station);
        };
        if upload.station != station
            || usize::from(item.sequence) != self.memory.mission.arriving.len()
        {
            return; // repeated, or early: it is asked for again in time
        }
        (upload.attempts, upload.asked) = (0, vehicle.view().time);
        let complete = item.sequence + 1 >= upload.count;
        let flown = match flyable(&self.config, &item, upload.home, vehicle.navigator()) {
            Ok(flown) => flown,
            Err(result) => return self.refuse_item(&item, result, station),
        };
        // There is room: the count was checked.
        let _ = self.memory.mission.arriving.push(item);
        let _ = self.memory.mission.flown.push(flown);
        if complete {
            self.finish_upload(station, vehicle);
        } else {
            self.request_item();
        }
    }

    /// Gives an upload up for an item that the core cannot fly.
    fn refuse_item(&mut self, item: &Item, result: MavMissionResult, station: (u8, u8)) {
        self.memory.mission.upload = None;
        let Item { sequence, command, frame, .. } = *item;
        // wcet: at most 2 iterations
        let [sequence, command] = [sequence, command].map(|number| Part::Count(number.into()));
        let (item, refused) = (Part::Text("item "), Part::Text(" refused: command "));
        let (before, frame) = (Part::Text(", frame "), Part::Count(frame.into()));
        self.say(Severity::Warning, &[item, sequence, refused, command, before, frame]);
        self.end_mission(result, MISSION, station);
    }

    /// Puts a complete upload in force, unless home has moved since it began.
    fn finish_upload<V: Vehicle>(&mut self, station: (u8, u8), vehicle: &mut V) {
        let begun = self.memory.mission.upload.take().map(|upload| upload.home);
        let navigator = vehicle.navigator();
        if begun != Some(navigator.home_world()) {
            self.say(
                Severity::Warning,
                &[Part::Text("mission refused: home has moved, send it again")],
            );
            let result = MavMissionResult::MAV_MISSION_OPERATION_CANCELLED;
            return self.end_mission(result, MISSION, station);
        }
        let result = match navigator.set_mission(self.memory.mission.flown.iter().copied()) {
            Ok(()) => {
                self.memory.mission.items = self.memory.mission.arriving;
                MavMissionResult::MAV_MISSION_ACCEPTED
            }
            Err(error) => {
                self.say_invalid("mission refused: ", &error);
                MavMissionResult::MAV_MISSION_INVALID
            }
        };
        self.end_mission(result, MISSION, station);
    }

    fn request_item(&mut self) {
        let Some(upload) = self.memory.mission.upload else { return };
        let (target_system, target_component) = upload.station;
        let seq = self.memory.mission.arriving.len() as u16;
        self.answer(&MISSION_REQUEST_INT_DATA { seq, target_system, target_component }, &[]);
    }

    /// Asks again for an item that does not come, a few times.
    pub(crate) fn repeat_mission_request(&mut self, time: u64) {
        let Some(upload) = &mut self.memory.mission.upload else { return };
        if time.saturating_sub(upload.asked) < REPEAT {
            return;
        }
        (upload.attempts, upload.asked) = (upload.attempts + 1, time);
        if upload.attempts < ATTEMPTS {
            return self.request_item();
        }
        let station = upload.station;
        self.memory.mission.upload = None;
        let result = MavMissionResult::MAV_MISSION_OPERATION_CANCELLED;
        self.end_mission(result, MISSION, station);
    }

    /// Answers with the number of items.
    pub(crate) fn send_count(&mut self, kind: u8, station: (u8, u8)) {
        let count = if kind == MISSION { self.memory.mission.items.len() as u16 } else { 0 };
        let (target_system, target_component) = station;
        self.answer(&MISSION_COUNT_DATA { count, target_system, target_component }, &[kind]);
    }

    /// Answers with an item.
    pub(crate) fn send_item<V: Vehicle>(
        &mut self,
        sequence: u16,
        kind: u8,
        station: (u8, u8),
        vehicle: &mut V,
    ) {
        let item = self.memory.mission.items.get(usize::from(sequence)).copied();
        match item.filter(|_| kind == MISSION) {
            Some(item) => {
                let current = self.current_sequence(vehicle) == sequence;
                self.answer_bytes(MISSION_ITEM_INT, &item.payload(station, current));
            }
            None => {
                self.end_mission(MavMissionResult::MAV_MISSION_INVALID_SEQUENCE, kind, station);
            }
        }
    }

    /// Forgets the mission.
    pub(crate) fn clear_mission<V: Vehicle>(
        &mut self,
        kind: u8,
        station: (u8, u8),
        vehicle: &mut V,
    ) {
        self.memory.mission.upload = None;
        if matches!(kind, MISSION | ALL) {
            // No items, none of which can be refused.
            let _ = vehicle.navigator().set_mission(core::iter::empty());
            self.memory.mission.items.truncate(0);
        }
        self.end_mission(MavMissionResult::MAV_MISSION_ACCEPTED, kind, station);
    }

    /// Makes an item the current one; answered by `MISSION_CURRENT`.
    pub(crate) fn set_current<V: Vehicle>(&mut self, sequence: u16, vehicle: &mut V) {
        if let Err(refusal) = vehicle.navigator().set_current_item(sequence.into()) {
            let (number, why) = (Part::Count(sequence.into()), Part::Text(refusal.as_str()));
            self.say(Severity::Warning, &[Part::Text("item "), number, Part::Text(": "), why]);
        }
        let seq = self.current_sequence(vehicle);
        self.answer(&MISSION_CURRENT_DATA { seq }, &[]);
    }

    /// Number of the current item.
    pub(crate) fn current_sequence<V: Vehicle>(&self, vehicle: &mut V) -> u16 {
        vehicle.navigator().current_item() as u16
    }

    fn end_mission(&mut self, result: MavMissionResult, kind: u8, station: (u8, u8)) {
        let (target_system, target_component) = station;
        let data = MISSION_ACK_DATA { target_system, target_component, mavtype: result };
        self.answer(&data, &[kind]);
    }
}

/// The item as the core flies it; refuses one that it cannot fly. `home` is that of the world frame (m).
fn flyable(
    config: &ProtocolConfig,
    item: &Item,
    home: Vec3,
    navigator: &Navigator,
) -> Result<MissionItem, MavMissionResult> {
    let item = flown(config, item, home)?;
    let checked = navigator.check_item(&item);
    checked.map(|()| item).map_err(|_| MavMissionResult::MAV_MISSION_INVALID)
}

/// The item as the core flies it, unchecked; `home` is that of the world frame (m).
fn flown(
    config: &ProtocolConfig,
    item: &Item,
    home: Vec3,
) -> Result<MissionItem, MavMissionResult> {
    let [first, second, _, yaw] = item.parameters;
    let kind = match item.command {
        16 => MissionKind::Waypoint,
        17 => MissionKind::Loiter,
        19 => MissionKind::Waypoint, // stays for a time
        20 => MissionKind::Return,
        21 => MissionKind::Land,
        22 => MissionKind::TakeOff,
        178 => MissionKind::Speed(second),
        _ => return Err(MavMissionResult::MAV_MISSION_UNSUPPORTED),
    };
    let number = item.sequence;
    if matches!(kind, MissionKind::Return | MissionKind::Speed(_)) {
        return Ok(MissionItem { kind, number, ..MissionItem::default() });
    }
    let position_world = match item.frame {
        1 => ned(Vec3::new(item.x as f32 * 1e-4, item.y as f32 * 1e-4, item.z)),
        0 | 3 | 5 | 6 => {
            let world = config.origin.world(item.x, item.y, 0.0);
            Vec3::new(world.x, world.y, height(config, item.frame, item.z, home))
        }
        _ => return Err(MavMissionResult::MAV_MISSION_UNSUPPORTED_FRAME),
    };
    let position_world = match kind {
        // Its place is where the vehicle stands, which the station need not know.
        MissionKind::TakeOff => Vec3::new(0.0, 0.0, position_world.z),
        _ => position_world,
    };
    let waits = matches!(item.command, 16 | 19);
    let hold_time = if waits && first.is_finite() { first } else { 0.0 };
    let yaw = yaw.is_finite().then(|| yaw_ned(yaw.to_radians()));
    Ok(MissionItem { kind, position_world, yaw, hold_time, number })
}

/// Equality of two items to the bit: a parameter may be NaN.
fn same(one: &Item, other: &Item) -> bool {
    one.payload((0, 0), false) == other.payload((0, 0), false)
}
