//! Tests of the modes, on a vehicle that is where its reference is unless the ground is in the way.

use std::vec;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;

const CONFIG: NavigationConfig = NavigationConfig {
    shaper: ShaperConfig {
        step_period: 0.01,
        acceleration_max: 1.0,
        speed_max: 3.0,
        climb_max: 1.5,
        descent_max: 1.0,
        yaw_rate_max: 1.0,
        smoothing_time: 0.1,
    },
    take_off_altitude: 2.5,
    return_altitude: 5.0,
    land_speed: 0.5,
    acceptance_radius: 0.3,
    setpoint_timeout: 0.5,
};
const HOME: Vec3 = Vec3::new(1.0, 2.0, 0.0);

struct World {
    navigator: Navigator,
    mode: Mode,
    vehicle: VehicleState,
    reference: Reference,
    events: Vec<NavigationEvent>,
}

impl World {
    fn new() -> Self {
        let navigator = Navigator::new(&CONFIG).unwrap();
        let vehicle = VehicleState::at_rest(HOME);
        let reference = Reference::hover(HOME);
        let mut world =
            Self { navigator, mode: Mode::Disarmed, vehicle, reference, events: Vec::new() };
        world.run(0.1);
        world
    }

    fn armed() -> Self {
        let mut world = Self::new();
        world.mode = Mode::Armed;
        world
    }

    /// In the air at the usual height above home.
    fn flying() -> Self {
        let mut world = Self::armed();
        world.ask(Request::TakeOff(None)).unwrap();
        world.run(10.0);
        assert_eq!(world.events, [NavigationEvent::TakenOff]);
        world.events.clear();
        world
    }

    fn ask(&mut self, request: Request) -> Result<(), NavigationRefusal> {
        self.navigator.request(self.mode, request)
    }

    fn run(&mut self, seconds: f32) {
        for _ in 0..(seconds * 100.0) as u32 {
            let step = self.navigator.step(self.mode, Some(&self.vehicle));
            match step.command {
                Some(Command::Start) => self.mode = Mode::Flying,
                Some(Command::Disarm) => self.mode = Mode::Disarmed,
                Some(command) => panic!("{command:?}"),
                None => {}
            }
            self.events.extend(step.event);
            assert!(step.reference.acceleration_world.length() <= CONFIG.shaper.acceleration_max);
            self.reference = step.reference;
            if self.mode == Mode::Flying {
                let before = self.vehicle.position_world;
                let place = step.reference.position_world;
                self.vehicle.position_world = Vec3::new(place.x, place.y, place.z.max(0.0));
                self.vehicle.velocity_world = (self.vehicle.position_world - before) * 100.0;
            }
        }
    }

    fn assert_near(&self, place: Vec3) {
        let here = self.vehicle.position_world;
        assert!((here - place).length() < 0.05, "{here} is not {place}");
    }
}

fn waypoint(x: f32, y: f32, z: f32, number: u16) -> MissionItem {
    MissionItem { position_world: Vec3::new(x, y, z), number, ..MissionItem::default() }
}

#[test]
fn take_off_starts_rises_and_holds() {
    let mut world = World::armed();
    assert_eq!(world.navigator.airborne(), Airborne::Ground);
    world.ask(Request::TakeOff(None)).unwrap();
    world.run(3.0);
    assert_eq!(world.navigator.airborne(), Airborne::TakingOff);
    world.run(7.0);
    assert_eq!(world.navigator.mode(), NavigationMode::Hold);
    assert_eq!(world.navigator.airborne(), Airborne::Air);
    assert_eq!(world.events, [NavigationEvent::TakenOff]);
    world.assert_near(HOME + 2.5 * Vec3::Z);
    assert_eq!(world.navigator.home_world(), HOME);
}

#[test]
fn land_comes_down_disarms_and_says_so_once() {
    let mut world = World::flying();
    world.ask(Request::Land(None)).unwrap();
    world.run(3.0);
    assert_eq!((world.mode, world.navigator.airborne()), (Mode::Flying, Airborne::Landing));
    world.run(10.0);
    assert_eq!((world.mode, world.navigator.airborne()), (Mode::Disarmed, Airborne::Ground));
    assert_eq!(world.events, [NavigationEvent::Landed]);
    assert_eq!(world.reference.position_world, HOME, "the next flight starts here");
}

#[test]
fn a_place_is_flown_to_and_hold_stops_on_the_way() {
    let mut world = World::flying();
    let far = Vec3::new(21.0, 2.0, 4.0);
    world.ask(Request::GoTo(Setpoint::at(far))).unwrap();
    world.run(4.0);
    world.ask(Request::Hold).unwrap();
    world.run(8.0);
    let stopped = world.vehicle.position_world;
    assert!(stopped.x > 4.0 && stopped.x < 15.0, "{stopped}");
    world.run(2.0);
    world.assert_near(stopped);
    world.ask(Request::GoTo(Setpoint::at(far))).unwrap();
    world.run(20.0);
    world.assert_near(far);
}

#[test]
fn return_climbs_flies_home_and_lands() {
    let mut world = World::flying();
    world.ask(Request::GoTo(Setpoint::at(Vec3::new(9.0, 2.0, 2.0)))).unwrap();
    world.run(12.0);
    world.ask(Request::Return).unwrap();
    let mut highest = 0.0f32;
    for _ in 0..60 {
        world.run(0.5);
        let here = world.vehicle.position_world;
        highest = highest.max(here.z);
        let away = (here - HOME).truncate().length();
        assert!(away > 0.5 || here.z < 6.0);
        assert!(away < 0.5 || world.mode == Mode::Flying, "lands at {here}");
    }
    assert!((highest - 5.0).abs() < 0.1, "{highest}");
    assert_eq!((world.mode, world.events.last()), (Mode::Disarmed, Some(&NavigationEvent::Landed)));
    world.assert_near(HOME);
}

#[test]
fn a_mission_is_flown_item_by_item_from_the_ground_to_the_ground() {
    let mut world = World::armed();
    let take_off = MissionItem { kind: MissionKind::TakeOff, ..waypoint(0.0, 0.0, 3.0, 10) };
    let slow = MissionItem { kind: MissionKind::Speed(1.0), ..waypoint(0.0, 0.0, 0.0, 11) };
    let wait = MissionItem { hold_time: 2.0, ..waypoint(5.0, 2.0, 3.0, 12) };
    let land = MissionItem { kind: MissionKind::Land, ..waypoint(5.0, 6.0, 0.0, 13) };
    world.navigator.set_mission([take_off, slow, wait, land].into_iter()).unwrap();
    world.ask(Request::Mission).unwrap();
    world.run(60.0);
    use NavigationEvent::{ItemReached, Landed};
    let expected = [ItemReached(10), ItemReached(11), ItemReached(12), ItemReached(13), Landed];
    assert_eq!(world.events, expected);
    assert_eq!(world.mode, Mode::Disarmed);
    world.assert_near(Vec3::new(5.0, 6.0, 0.0));
}

#[test]
fn a_mission_ends_in_hold_and_a_waypoint_waits_its_time() {
    let mut world = World::flying();
    let wait = MissionItem { hold_time: 3.0, ..waypoint(1.0, 2.0, 2.5, 7) };
    world.navigator.set_mission([wait].into_iter()).unwrap();
    world.ask(Request::Mission).unwrap();
    world.run(2.5);
    assert_eq!(world.navigator.mode(), NavigationMode::Mission);
    world.run(1.0);
    let expected = [NavigationEvent::ItemReached(7), NavigationEvent::MissionFinished];
    assert_eq!(world.events, expected);
    assert_eq!(world.navigator.mode(), NavigationMode::Hold);
    world.assert_near(HOME + 2.5 * Vec3::Z);
}

#[test]
fn offboard_needs_set_points_and_holds_when_they_end() {
    let mut world = World::flying();
    assert_eq!(world.ask(Request::Offboard), Err(NavigationRefusal::NoSetpoint));
    let east =
        Setpoint { velocity_world: [Some(1.0), Some(0.0), Some(0.0)], ..Setpoint::default() };
    world.navigator.stream(east).unwrap();
    world.ask(Request::Offboard).unwrap();
    for _ in 0..30 {
        world.navigator.stream(east).unwrap();
        world.run(0.2);
    }
    assert_eq!(world.navigator.mode(), NavigationMode::Offboard);
    assert!((world.vehicle.velocity_world - Vec3::X).length() < 0.01);
    world.run(0.2);
    assert_eq!(world.navigator.mode(), NavigationMode::Offboard);
    world.run(0.2);
    assert_eq!(world.navigator.mode(), NavigationMode::Hold);
    assert_eq!(world.events, [NavigationEvent::OffboardLost]);
    world.run(6.0);
    assert!(world.vehicle.velocity_world.length() < 0.01);
    let wild = Setpoint { velocity_world: [Some(f32::NAN), None, None], ..Setpoint::default() };
    assert_eq!(world.navigator.stream(wild).unwrap_err().parameter, "setpoint.velocity");
}

#[test]
fn requests_are_refused_where_they_make_no_sense() {
    let mut world = World::new();
    for request in [Request::TakeOff(None), Request::Mission, Request::Land(None), Request::Return]
    {
        assert_eq!(world.ask(request), Err(NavigationRefusal::NotArmed));
    }
    world.mode = Mode::Armed;
    assert_eq!(world.ask(Request::Land(None)), Err(NavigationRefusal::NotFlying));
    assert_eq!(world.ask(Request::GoTo(Setpoint::at(HOME))), Err(NavigationRefusal::NotFlying));
    assert_eq!(world.ask(Request::Mission), Err(NavigationRefusal::NoMission));
    assert!(matches!(world.ask(Request::TakeOff(Some(-3.0))), Err(NavigationRefusal::Invalid(_))));
    assert!(matches!(
        world.ask(Request::TakeOff(Some(f32::NAN))),
        Err(NavigationRefusal::Invalid(_))
    ));
    assert_eq!(world.navigator.set_current_item(0), Err(NavigationRefusal::NoItem));
    world.run(1.0);
    assert_eq!(world.mode, Mode::Armed, "nothing of it started a flight");
}

#[test]
fn a_refused_start_and_a_lost_flight_end_in_hold() {
    let mut world = World::armed();
    world.ask(Request::TakeOff(None)).unwrap();
    world.navigator.start_refused();
    world.run(1.0);
    assert_eq!((world.mode, world.navigator.mode()), (Mode::Armed, NavigationMode::Hold));
    let mut world = World::flying();
    world.ask(Request::Return).unwrap();
    world.run(1.0);
    world.mode = Mode::Locked;
    world.run(0.1);
    assert_eq!(world.navigator.mode(), NavigationMode::Hold);
}

#[test]
fn a_hazard_leads_home_or_down_and_allows_nothing_else() {
    for (reaction, place) in [(Reaction::Return, HOME), (Reaction::Land, Vec3::new(9.0, 2.0, 0.0))]
    {
        let mut world = World::flying();
        world.ask(Request::GoTo(Setpoint::at(Vec3::new(9.0, 2.0, 2.0)))).unwrap();
        world.run(12.0);
        for _ in 0..6000 {
            world.navigator.react(world.mode, Some(reaction));
            world.run(0.01);
            if world.mode == Mode::Flying {
                let hold = world.ask(Request::Hold);
                assert_eq!(hold, Err(NavigationRefusal::Hazard));
            }
        }
        assert_eq!(world.mode, Mode::Disarmed, "{reaction:?}");
        world.assert_near(place);
    }
    let mut world = World::flying();
    world.navigator.react(world.mode, Some(Reaction::Land));
    assert_eq!(world.ask(Request::Return), Err(NavigationRefusal::Hazard));
    world.navigator.react(world.mode, Some(Reaction::Return));
    assert_eq!(world.navigator.mode(), NavigationMode::Land, "a landing is not broken off");
    world.navigator.react(world.mode, None);
    world.ask(Request::Hold).unwrap();
    world.navigator.react(world.mode, Some(Reaction::Warn));
    world.ask(Request::TakeOff(None)).unwrap();
}

#[test]
fn a_vehicle_that_does_not_lift_is_disarmed() {
    let mut world = World::armed();
    world.ask(Request::TakeOff(None)).unwrap();
    for _ in 0..1000 {
        world.run(0.01);
        (world.vehicle.position_world, world.vehicle.velocity_world) = (HOME, Vec3::ZERO);
    }
    assert_eq!((world.mode, world.events), (Mode::Disarmed, vec![NavigationEvent::TakeOffFailed]));
}

#[test]
fn a_bad_mission_is_refused_whole() {
    let mut world = World::flying();
    let good = waypoint(1.0, 1.0, 1.0, 0);
    world.navigator.set_mission([good].into_iter()).unwrap();
    let refused = |world: &mut World, items: Vec<MissionItem>| {
        world.navigator.set_mission(items.into_iter()).unwrap_err().parameter
    };
    let far = MissionItem { position_world: Vec3::splat(f32::INFINITY), ..good };
    assert_eq!(refused(&mut world, std::vec![good, far]), "setpoint.position");
    let fast = MissionItem { kind: MissionKind::Speed(99.0), ..good };
    assert_eq!(refused(&mut world, std::vec![fast]), "speed");
    let long = MissionItem { hold_time: -1.0, ..good };
    assert_eq!(refused(&mut world, std::vec![long]), "mission.hold_time");
    assert_eq!(refused(&mut world, std::vec![good; MISSION_MAX + 1]), "mission (count)");
    assert_eq!(world.navigator.mission(), [good]);
}

#[test]
fn each_number_of_the_configuration_is_checked() {
    let refused = |config| Navigator::new(&config).unwrap_err().parameter;
    let bad = NavigationConfig { take_off_altitude: 0.0, ..CONFIG };
    assert_eq!(refused(bad), "navigation.take_off_altitude");
    assert_eq!(
        refused(NavigationConfig { return_altitude: f32::NAN, ..CONFIG }),
        "navigation.return_altitude"
    );
    assert_eq!(refused(NavigationConfig { land_speed: 2.0, ..CONFIG }), "navigation.land_speed");
    assert_eq!(
        refused(NavigationConfig { acceptance_radius: 0.0, ..CONFIG }),
        "navigation.acceptance_radius"
    );
    assert_eq!(
        refused(NavigationConfig { setpoint_timeout: 0.0, ..CONFIG }),
        "navigation.setpoint_timeout"
    );
}

proptest! {
    #[test]
    fn no_request_starts_a_flight_that_is_not_armed_and_the_reference_keeps_its_bound(
        events in prop::collection::vec((0usize..12, -30.0f32..30.0), 0..40)
    ) {
        let mut world = World::new();
        for (event, number) in events {
            let place = Vec3::new(number, 2.0, number.abs());
            let _ = match event {
                0 => world.ask(Request::TakeOff(Some(number))),
                1 => world.ask(Request::Hold),
                2 => world.ask(Request::GoTo(Setpoint::at(place).facing(number * 0.1))),
                3 => world.ask(Request::Mission),
                4 => world.ask(Request::Offboard),
                5 => world.ask(Request::Return),
                6 => world.ask(Request::Land(Some(place))),
                7 => world.navigator.set_mission([waypoint(number, 0.0, 3.0, 1); 3].into_iter())
                    .map_err(NavigationRefusal::from),
                8 => world.navigator.stream(Setpoint::at(place)).map_err(NavigationRefusal::from),
                9 => { world.mode = Mode::Armed; Ok(()) }
                10 => { world.mode = Mode::Disarmed; Ok(()) }
                _ => Ok(()),
            };
            let armed = matches!(world.mode, Mode::Armed | Mode::Flying);
            world.run(number.abs() * 0.1);
            prop_assert!(armed || world.mode == Mode::Disarmed);
        }
    }
}
