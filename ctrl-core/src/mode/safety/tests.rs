//! Tests of the watch for hazards.

use std::string::ToString;
use std::vec::Vec;

use glam::Quat;
use proptest::prelude::*;

use super::*;

const PERIOD: f32 = 0.01;

fn all() -> SafetyConfig {
    let silence = |timeout| Some(Silence { timeout, reaction: Reaction::Return });
    SafetyConfig {
        link: silence(5.0),
        rc: silence(0.5),
        battery: Some(BatteryGuard {
            low: 14.0,
            critical: 13.2,
            time: 0.5,
            low_reaction: Reaction::Return,
            critical_reaction: Reaction::Land,
        }),
        geofence: Some(Geofence { radius: 50.0, height: 30.0, reaction: Reaction::Return }),
        attitude: Some(AttitudeGuard {
            tilt: 1.2,
            rate: 8.0,
            time: 0.2,
            reaction: Reaction::Failsafe,
        }),
        saturation: Some(SaturationGuard { time: 2.0, reaction: Reaction::Land }),
        crash: Some(CrashGuard { tilt: 1.0, speed: 0.3, time: 0.5 }),
    }
}

fn calm() -> Observations {
    Observations {
        vehicle: Some(VehicleState::at_rest(Vec3::new(3.0, 4.0, 5.0))),
        link_silence: 0.0,
        rc_silence: 0.0,
        voltage: Some(15.0),
        saturated: false,
    }
}

struct Watch(Safety, SafetyState);

impl Watch {
    fn new(config: &SafetyConfig) -> Self {
        let mut watch = Self(Safety::new(config, PERIOD).unwrap(), SafetyState::default());
        assert_eq!(watch.run(Mode::Disarmed, &calm(), 1), SafetyReport::default());
        watch
    }

    fn run(&mut self, mode: Mode, seen: &Observations, periods: u32) -> SafetyReport {
        let mut raised = Hazards::empty();
        let mut last = SafetyReport::default();
        for _ in 0..periods {
            last = self.0.step(&mut self.1, mode, seen);
            raised |= last.raised;
        }
        SafetyReport { raised, ..last }
    }
}

fn moved(change: impl Fn(&mut VehicleState)) -> Observations {
    let mut vehicle = calm().vehicle.unwrap();
    change(&mut vehicle);
    Observations { vehicle: Some(vehicle), ..calm() }
}

#[test]
fn each_hazard_comes_after_its_time_and_has_its_reaction() {
    let tilted = Quat::from_rotation_x(1.3);
    let fast = |vehicle: &mut VehicleState| vehicle.rate_body.z = 9.0;
    let crashed = |vehicle: &mut VehicleState| vehicle.attitude = Quat::from_rotation_y(1.1);
    let far = |vehicle: &mut VehicleState| vehicle.position_world.x += 51.0;
    let high = |vehicle: &mut VehicleState| vehicle.position_world.z += 31.0;
    let tilt = move |vehicle: &mut VehicleState| {
        (vehicle.attitude, vehicle.velocity_world.x) = (tilted, 2.0);
    };
    let low = Observations { voltage: Some(13.9), ..calm() };
    let empty = Observations { voltage: Some(13.0), ..calm() };
    let both = Hazards::BATTERY_LOW | Hazards::BATTERY_CRITICAL;
    let cases = [
        (Observations { link_silence: 5.1, ..calm() }, 1, Hazards::LINK_LOST, Reaction::Return),
        (Observations { rc_silence: f32::NAN, ..calm() }, 1, Hazards::RC_LOST, Reaction::Return),
        (low, 50, Hazards::BATTERY_LOW, Reaction::Return),
        (empty, 50, both, Reaction::Land),
        (moved(far), 1, Hazards::GEOFENCE, Reaction::Return),
        (moved(high), 1, Hazards::GEOFENCE, Reaction::Return),
        (moved(tilt), 20, Hazards::ATTITUDE, Reaction::Failsafe),
        (moved(fast), 20, Hazards::ATTITUDE, Reaction::Failsafe),
        (Observations { saturated: true, ..calm() }, 200, Hazards::SATURATION, Reaction::Land),
        (moved(crashed), 50, Hazards::CRASH, Reaction::Stop),
    ];
    for (seen, periods, hazard, reaction) in cases {
        let mut watch = Watch::new(&all());
        assert_eq!(watch.run(Mode::Flying, &calm(), 500), SafetyReport::default());
        assert_eq!(
            watch.run(Mode::Flying, &seen, periods - 1),
            SafetyReport::default(),
            "{hazard}"
        );
        let report = watch.run(Mode::Flying, &seen, 1);
        let expected = SafetyReport { hazards: hazard, raised: hazard, reaction: Some(reaction) };
        assert_eq!(report, expected);
        assert_eq!(watch.run(Mode::Flying, &seen, 1).raised, Hazards::empty(), "raised once");
        let mut unwatched = Watch::new(&SafetyConfig::default());
        assert_eq!(unwatched.run(Mode::Flying, &seen, 1000), SafetyReport::default());
    }
}

#[test]
fn what_is_over_is_forgotten_but_for_the_battery() {
    let mut watch = Watch::new(&all());
    let seen = Observations { link_silence: 6.0, voltage: Some(13.5), ..calm() };
    let hazards = watch.run(Mode::Flying, &seen, 100).hazards;
    assert_eq!(hazards, Hazards::LINK_LOST | Hazards::BATTERY_LOW);
    assert_eq!(hazards.to_string(), "link lost, battery low");
    assert_eq!(watch.run(Mode::Flying, &calm(), 10).hazards, Hazards::BATTERY_LOW);
    assert_eq!(watch.run(Mode::Disarmed, &calm(), 1), SafetyReport::default());
    // A short sag does not count.
    watch.run(Mode::Flying, &seen, 40);
    assert_eq!(watch.run(Mode::Flying, &calm(), 40), SafetyReport::default());
}

#[test]
fn each_number_is_checked() {
    let refused = |change: fn(&mut SafetyConfig)| {
        let mut config = all();
        change(&mut config);
        Safety::new(&config, PERIOD).unwrap_err().parameter
    };
    let names = [
        refused(|config| config.link.as_mut().unwrap().timeout = 0.0),
        refused(|config| config.rc.as_mut().unwrap().timeout = f32::NAN),
        refused(|config| config.battery.as_mut().unwrap().low = 0.0),
        refused(|config| config.battery.as_mut().unwrap().critical = 14.5),
        refused(|config| config.battery.as_mut().unwrap().time = 1e9),
        refused(|config| config.geofence.as_mut().unwrap().radius = 0.0),
        refused(|config| config.geofence.as_mut().unwrap().height = f32::INFINITY),
        refused(|config| config.attitude.as_mut().unwrap().tilt = 4.0),
        refused(|config| config.attitude.as_mut().unwrap().rate = 0.0),
        refused(|config| config.attitude.as_mut().unwrap().time = 0.0),
        refused(|config| config.saturation.as_mut().unwrap().time = 0.0),
        refused(|config| config.crash.as_mut().unwrap().tilt = 0.0),
        refused(|config| config.crash.as_mut().unwrap().speed = 0.0),
        refused(|config| config.crash.as_mut().unwrap().time = 0.0),
    ];
    let expected = "link.timeout rc.timeout battery.low battery.critical battery.time geofence.radius \
                    geofence.height attitude.tilt attitude.rate attitude.time saturation.time crash.tilt \
                    crash.speed crash.time";
    for (name, expected) in names.iter().zip(expected.split(' ')) {
        assert_eq!(name.strip_prefix("safety."), Some(expected));
    }
}

proptest! {
    #[test]
    fn no_bits_break_the_watch_and_every_present_hazard_has_a_reaction(
        bits in prop::collection::vec(prop::array::uniform8(any::<u32>()), 1..40)
    ) {
        let mut watch = Watch::new(&all());
        let mut before = Hazards::empty();
        for bits in bits {
            let [x, y, z, w, v, link, rc, volt] = bits.map(f32::from_bits);
            let vehicle = VehicleState {
                position_world: Vec3::new(x, y, z),
                velocity_world: Vec3::new(v, x, w),
                attitude: Quat::from_xyzw(x, y, z, w),
                rate_body: Vec3::splat(v),
            };
            let seen = Observations {
                vehicle: Some(vehicle),
                link_silence: link,
                rc_silence: rc,
                voltage: Some(volt),
                saturated: volt > 0.0,
            };
            let report = watch.run(Mode::Flying, &seen, 1);
            prop_assert_eq!(report.reaction.is_some(), !report.hazards.is_empty());
            prop_assert_eq!(report.raised, report.hazards - before);
            before = report.hazards;
        }
    }
}

#[test]
fn reactions_are_ordered_from_mild_to_strong() {
    use Reaction::{Failsafe, Land, Return, Stop, Warn};
    let order: Vec<_> = [Stop, Warn, Land, Return, Failsafe].into_iter().collect();
    let mut sorted = order;
    sorted.sort();
    assert_eq!(sorted, [Warn, Return, Land, Failsafe, Stop]);
    assert!(None < Some(Warn));
}
