use std::boxed::Box;
use std::vec::Vec;

use ctrl_core::mode::navigation::{NavigationMode, Request};
use ctrl_core::mode::safety::{Hazards, Reaction, SafetyReport};
use ctrl_core::mode::{Command, Mode, Refusal};
use ctrl_core::trajectory::{HoverConfig, TrajectoryConfig};
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use link::{ParametersInForce, Received, Uplink};

use super::*;
use crate::scenario::BUILT_IN_MISSION;
use crate::session::{SessionConfig, SessionMemory};
use crate::stored_signing::Change;
use crate::tick_source::TickOrigin;

/// A vehicle between two parties: a host on the link, and a station on MAVLink.
struct Shared {
    session: HostSession<'static>,
    pilot: Pilot,
    station: &'static mut GroundStation,
    status: ControlStatus,
    sequence: u8,
    safety: SafetyReport,
}

impl Shared {
    fn new() -> Self {
        Self::with(None)
    }

    fn with(signing: Option<&StartedSigning>) -> Self {
        let config = SessionConfig {
            board: "test bench",
            sample_valid: 5,
            reference_timeout: 100,
            telemetry_period_min: 2,
        };
        let trajectory = TrajectoryConfig::Hover(HoverConfig { position_world: Vec3::X, yaw: 0.0 });
        let memory = Box::leak(Box::new(SessionMemory::new()));
        let (tuning, in_force) = (&BUILT_IN_MISSION.tuning, ParametersInForce::default());
        let session =
            HostSession::new(memory, config, tuning, &trajectory, in_force, None).unwrap();
        let pilot = Pilot::new(&Pilot::moderate(session.law()), session.law()).unwrap();
        let station = GroundStation::new_in(
            Box::leak(Box::new(MaybeUninit::uninit())),
            Box::leak(Box::new(ProtocolMemory::new())),
            signing,
        );
        let status = ControlStatus::default();
        Self { session, pilot, station, status, sequence: 0, safety: SafetyReport::default() }
    }

    /// A tick with a fresh state; the reference that it would fly, and the command that control takes.
    fn tick(&mut self) -> (ctrl_core::reference::Reference, Option<Command>) {
        self.status.uptime += 1;
        let state = VehicleState::at_rest(Vec3::ZERO);
        let message = Uplink::State { tick: self.status.uptime.into(), state };
        self.host(message);
        let prepared = self.pilot.prepare(&mut self.session, self.status, &self.safety);
        let command = self.pilot.next_command(false).or_else(|| self.session.next_command());
        (prepared.reference, command)
    }

    fn host(&mut self, message: Uplink) {
        let received = Received { sequence: 1, message };
        self.session.handle(&received, self.status, TickOrigin::Timer);
    }

    fn behind(&mut self) -> (&mut GroundStation, Behind<'_, 'static>) {
        let Self { session, pilot, station, status, .. } = self;
        let view = ControlView { ready: Ok(()), thrust: 0.0, cause: None };
        (station, Behind { session, pilot, status: *status, view })
    }

    /// A command of the station; its result once it is known.
    fn station(&mut self, number: u16, first: f32) -> Option<u8> {
        let mut payload = [0; 33];
        payload[..4].copy_from_slice(&first.to_le_bytes());
        payload[28..33].copy_from_slice(&[number as u8, (number >> 8) as u8, 1, 1, 0]);
        self.sequence += 1;
        let mut frame = std::vec![0xfd, 33, 0, 0, self.sequence, 255, 190, 76, 0, 0];
        frame.extend_from_slice(&payload);
        let crc = mavlink_crc(&frame[1..], 152);
        frame.extend(crc.to_le_bytes());
        for byte in frame {
            if let Some(packet) = self.station.push(byte)
                && self.station.check(&packet, self.status)
            {
                let (station, behind) = self.behind();
                station.handle(&packet, behind);
            }
        }
        self.acknowledged(number)
    }

    fn acknowledged(&mut self, number: u16) -> Option<u8> {
        let mut result = None;
        for frame in self.frames() {
            if frame[7] == 77 && frame[10..12] == number.to_le_bytes() {
                // A result of zero at the end of a payload is not sent, nor is what follows.
                result = Some(if frame[1] > 2 { frame[12] } else { 0 });
            }
        }
        result
    }

    fn frames(&mut self) -> Vec<Vec<u8>> {
        let mut frames = Vec::new();
        loop {
            let (station, behind) = self.behind();
            match station.next_frame(behind) {
                Some(mut frame) => {
                    station.sign(&mut frame);
                    frames.push(frame.as_bytes().to_vec());
                }
                None => return frames,
            }
        }
    }

    /// Control takes a command and enters the mode that it leads to.
    fn answered(&mut self, answer: Result<Mode, Refusal>) {
        self.status.mode = answer.unwrap_or(self.status.mode);
        self.pilot.answered(answer);
        self.session.answered(answer);
    }
}

/// CRC-16/MCRF4XX, MAVLink's, over bytes and the extra one of the message.
fn mavlink_crc(bytes: &[u8], extra: u8) -> u16 {
    let crc = crc::Crc::<u16>::new(&crc::CRC_16_MCRF4XX);
    let mut digest = crc.digest();
    digest.update(bytes);
    digest.update(&[extra]);
    digest.finalize()
}

#[test]
fn who_arms_the_vehicle_flies_it() {
    let mut shared = Shared::new();
    shared.tick();
    assert_eq!(shared.station(400, 1.0), None, "waits for control");
    let (_, command) = shared.tick();
    assert_eq!(command, Some(Command::Arm));
    shared.answered(Ok(Mode::Armed));
    assert_eq!(shared.acknowledged(400), Some(0));
    let (reference, _) = shared.tick();
    assert_eq!(reference.position_world, Vec3::ZERO, "the navigator's, where the vehicle stands");
    assert_eq!(shared.station(400, 0.0), None);
    assert_eq!(shared.tick().1, Some(Command::Disarm));
    shared.answered(Ok(Mode::Disarmed));
    shared.host(Uplink::Command(Command::Arm));
    assert_eq!(shared.tick().1, Some(Command::Arm));
    shared.answered(Ok(Mode::Armed));
    let (reference, _) = shared.tick();
    assert_eq!(reference.position_world, Vec3::X, "the session's");
}

#[test]
fn inputs_that_are_prepared_twice_in_a_tick_are_one_step_of_the_reference() {
    let mut shared = Shared::new();
    shared.tick();
    shared.station(400, 1.0);
    assert_eq!(shared.tick().1, Some(Command::Arm));
    shared.answered(Ok(Mode::Armed));
    shared.acknowledged(400);
    shared.pilot.request(Mode::Armed, Request::TakeOff(None)).unwrap();
    assert_eq!(shared.tick().1, Some(Command::Start));
    shared.answered(Ok(Mode::Flying));
    let mut before = 0.0;
    for _ in 0..200 {
        let reference = shared.tick().0;
        let again =
            shared.pilot.prepare(&mut shared.session, shared.status, &shared.safety).reference;
        assert_eq!(again, reference);
        let (position, velocity) = (reference.position_world.z, reference.velocity_world.z);
        let moved = (position - before) / TICK as f32 * 1e6;
        assert!((moved - velocity).abs() < 1e-3, "{moved} m/s, and {velocity}");
        before = position;
    }
    assert!(before > 0.0);
}

#[test]
fn a_station_neither_leads_nor_disarms_a_host_s_flight_unless_it_is_forced() {
    let mut shared = Shared::new();
    shared.tick();
    shared.host(Uplink::Command(Command::Arm));
    assert_eq!(shared.tick().1, Some(Command::Arm));
    shared.answered(Ok(Mode::Armed));
    let temporarily_rejected = Some(1);
    assert_eq!(shared.station(22, 0.0), temporarily_rejected, "take-off");
    shared.status.mode = Mode::Flying;
    assert_eq!(shared.station(21, 0.0), temporarily_rejected, "land");
    assert_eq!(shared.station(400, 0.0), Some(2), "disarm");
    assert_eq!(shared.tick().1, None);
    // Flight termination asks nobody.
    assert_eq!(shared.station(185, 1.0), None);
    assert_eq!(shared.tick().1, Some(Command::Kill));
}

#[test]
fn a_hazard_in_a_host_s_flight_is_told_and_turns_nothing_that_the_supervisor_does_not() {
    let mut shared = Shared::new();
    shared.tick();
    shared.host(Uplink::Command(Command::Arm));
    assert_eq!(shared.tick().1, Some(Command::Arm));
    shared.answered(Ok(Mode::Armed));
    shared.status.mode = Mode::Flying;
    let mut said = |reaction| {
        let (hazards, raised) = (Hazards::GEOFENCE, Hazards::GEOFENCE);
        shared.safety = SafetyReport { hazards, raised, reaction: Some(reaction) };
        assert_eq!(shared.tick().0.position_world, Vec3::X, "the session's");
        assert_eq!(shared.pilot.navigator().mode(), NavigationMode::Hold);
        let texts = shared.frames().into_iter().filter(|frame| frame[7..10] == [253, 0, 0]);
        texts.map(|frame| std::string::String::from_utf8_lossy(&frame[11..]).into_owned()).collect()
    };
    let texts: Vec<_> = said(Reaction::Return);
    let name = Hazards::GEOFENCE.words().next().unwrap();
    assert!(texts.iter().any(|text| text.contains(name)), "{texts:?}");
    assert!(!texts.iter().any(|text| text.contains("returning")), "{texts:?}");
    assert!(said(Reaction::Failsafe).iter().any(|text| text.contains("descending")));
}

#[test]
fn nothing_is_stored_while_a_stations_command_is_on_its_way_nor_the_other_way_round() {
    let mut shared = Shared::new();
    shared.tick();
    shared.station(400, 1.0);
    shared.session.set_piloted(shared.pilot.has_command());
    shared.host(Uplink::ParametersPersist);
    assert!(!shared.session.is_storing());
    assert_eq!(shared.tick().1, Some(Command::Arm));
    shared.answered(Err(Refusal::Tilted));
    assert_eq!(shared.acknowledged(400), Some(1));
    shared.session.set_piloted(shared.pilot.has_command());
    shared.host(Uplink::ParametersPersist);
    assert!(shared.session.is_storing());
    shared.station(400, 1.0);
    assert_eq!(shared.pilot.next_command(true), None);
    assert_eq!(shared.pilot.next_command(false), Some(Command::Arm));
}

#[test]
fn a_law_whose_bound_no_reference_suits_is_not_flown_by_stations() {
    let mut shared = Shared::new();
    shared.tick();
    let law = *shared.session.law();
    assert!(shared.pilot.follow(&law).is_ok());
    assert_eq!(shared.station(17, 0.0), Some(0), "hold");
    let name = "reference_acceleration_max".try_into().unwrap();
    shared.host(Uplink::SelectTrajectory(link::TrajectorySelection::Stream));
    shared.host(Uplink::ParameterWrite { name, value: 1e-4 });
    let law = *shared.session.law();
    assert_eq!(law.reference_acceleration_max(), 1e-4);
    assert!(shared.pilot.follow(&law).is_err());
    assert_eq!(shared.station(17, 0.0), Some(1));
}

#[test]
fn one_release_is_bounded_and_a_second_of_telemetry_fits_the_wire() {
    let mut shared = Shared::new();
    let (mut bytes, mut frames) = (0, 0);
    for _ in 0..1000 {
        shared.tick();
        let sent = shared.frames();
        bytes += sent.iter().map(Vec::len).sum::<usize>();
        frames += sent.len();
    }
    assert!(bytes < 16_000, "{bytes} B of the 92,160 that the wire carries");
    let releases = 1000 / RELEASE_EVERY as usize;
    assert!(frames < releases * SENT_PER_RELEASE, "{frames} frames");
}

#[test]
fn with_a_stored_key_everything_is_signed_from_its_time_on_and_what_is_not_signed_has_no_effect() {
    let from = StoredSigning { key: [3; 32], timestamp: 7_000_000 };
    let mut shared = Shared::with(Some(&StartedSigning { from, stored: from.timestamp + AHEAD }));
    shared.tick();
    shared.status.uptime += 1000;
    assert_eq!(shared.station.keep_time(None, shared.status), None);
    assert_eq!(shared.station(400, 1.0), None, "not signed");
    assert_eq!(shared.tick().1, None);
    let frames = shared.frames();
    let all = shared.frames().into_iter().chain(frames);
    for frame in all {
        let [.., t0, t1, t2, t3, t4, t5, _, _, _, _, _, _] = frame[..] else { panic!() };
        let time = u64::from_le_bytes([t0, t1, t2, t3, t4, t5, 0, 0]);
        // A second has passed.
        assert!(frame[2] == 1 && (7_100_000..7_200_000).contains(&time), "{frame:?}");
    }
}

#[test]
fn a_later_time_is_stored_before_the_stored_one_is_near_and_only_on_the_ground() {
    let from = StoredSigning { key: [3; 32], timestamp: 0 };
    let mut shared = Shared::with(Some(&StartedSigning { from, stored: AHEAD }));
    let passes = |shared: &mut Shared, seconds: u32, mode| {
        shared.status.uptime += seconds * 1000;
        shared.status.mode = mode;
        let change = shared.session.take_signing();
        if let Some(later) = shared.station.keep_time(change, shared.status) {
            shared.session.keep_signing_time(later, shared.status);
        }
        shared.session.next_to_store()
    };
    assert_eq!(passes(&mut shared, 1700, Mode::Disarmed), None);
    assert_eq!(passes(&mut shared, 200, Mode::Flying), None);
    let change = passes(&mut shared, 0, Mode::Disarmed);
    let later = StoredSigning { key: [3; 32], timestamp: 190_000_000 + AHEAD };
    assert_eq!(change, Some(Change::Signing(Some(later))));
    shared.session.stored(Ok(1));
    assert_eq!(passes(&mut shared, 1, Mode::Disarmed), None);
}
