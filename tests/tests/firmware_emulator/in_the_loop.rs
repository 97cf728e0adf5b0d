//! Scenarios flown with the image in the loop: every tick as in SIL, bit for bit.

use std::path::Path;

use sil_host::pil::flight::{OnBoard, fly, fly_ahead};
use sil_host::pil::recording::{Direction, Recording};
use sil_host::pil::replay::replay;
use sil_host::pil::session::VehicleSession;
use sil_host::pil::set_up::set_up;
use sim::observer::Observer;
use sim::scenario::LoadedScenario;
use sim::tick::Tick;

use crate::PAPER;
use crate::emulator::emulator;

/// Keeps what a flight looked like, in full precision.
#[derive(Default)]
struct TickLog(Vec<String>);

impl Observer for TickLog {
    fn observe(&mut self, tick: &Tick) {
        self.0.push(format!("{tick:?}"));
    }
}

/// Flies the first seconds of a scenario on the vehicle; all that was seen.
fn flown(name: &str, changes: &[&str]) -> (OnBoard, TickLog, LoadedScenario) {
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    let loaded = LoadedScenario::open(name, &changes).unwrap();
    let (mut session, _) = VehicleSession::boot(&emulator("firmware"), &[]).unwrap();
    set_up(&mut session, loaded.scenario()).unwrap();
    let mut kept = TickLog::default();
    let on_board = fly(&loaded, &mut session, &mut kept, &|_| ()).unwrap();
    (on_board, kept, loaded)
}

fn assert_flies_as_in_sil(name: &str, changes: &[&str]) {
    let (on_board, vehicle, loaded) = flown(name, changes);
    assert_eq!(on_board.difference, None, "{name}");
    let ticks = loaded.scenario().ticks();
    assert_eq!(on_board.ticks, ticks);
    let mut sil = TickLog::default();
    loaded.flight().unwrap().observe(ticks, &mut sil);
    for (vehicle, sil) in vehicle.0.iter().zip(&sil.0) {
        assert_eq!(vehicle, sil, "{name}");
    }
    assert_eq!(vehicle.0.len(), sil.0.len());
}

#[test]
fn each_paper_scenario_flies_on_the_image_as_in_sil_to_the_bit() {
    for name in PAPER {
        assert_flies_as_in_sil(name, &["duration=10"]);
    }
}

#[test]
fn gains_seed_and_trajectory_of_other_scenarios_reach_the_vehicle() {
    assert_flies_as_in_sil("lemniscate", &["duration=1"]);
    assert_flies_as_in_sil("waypoints", &["duration=1", "seed=7"]);
    assert_flies_as_in_sil("paper-saturated", &["duration=1", "controller.saturated.k4=3"]);
}

/// The image tells the estimates of the integral action; left out, they are zeros, which differ.
#[test]
fn estimates_of_the_integral_action_are_those_of_sil_to_the_bit() {
    let integral = "controller.robust_adaptive.integral";
    let set = ["acceleration_max=0.3", "gamma_d=0.1", "torque_max=0.01", "gamma_t=0.5"];
    let set = set.map(|value| format!("{integral}.{value}"));
    for (name, changes) in [("steady-wind", &[][..]), ("paper-robust-adaptive", &set)] {
        let changes: Vec<_> = changes.iter().map(String::as_str).chain(["duration=0.5"]).collect();
        let (on_board, vehicle, _) = flown(name, &changes);
        assert_eq!(on_board.difference, None, "{name}");
        let last = vehicle.0.last().unwrap();
        assert!(
            !last.contains("lasting: LastingEstimates { acceleration_world: Vec3(0.0,"),
            "{last}"
        );
        assert_flies_as_in_sil(name, &changes);
    }
}

#[test]
fn the_image_flies_by_sensors_as_in_sil_to_the_bit() {
    assert_flies_as_in_sil("sensors-indoors", &["duration=3"]);
    assert_flies_as_in_sil("sensors-outdoors", &["duration=3", "seed=3"]);
    assert_flies_as_in_sil("sensors-near-ground", &["duration=3"]);
    assert_flies_as_in_sil("sensors-lemniscate", &["duration=1"]);
    assert_flies_as_in_sil("sensors-wind", &["duration=1"]);
}

/// A pose that stands aside for a while is believed in the end, twice: the reference follows both restarts.
#[test]
fn restarts_of_the_estimate_are_the_same_aboard() {
    let fault = "sensors.faults=[{ sensor = \"capture\", kind = { jumping = 1.0 }, start = 1.0, \
                 duration = 1.5 }]";
    let changes = ["duration=4", fault];
    let loaded =
        LoadedScenario::open("sensors-indoors", &changes.map(ToString::to_string)).unwrap();
    let mut flight = loaded.flight().unwrap();
    flight.advance(loaded.scenario().ticks());
    assert_eq!(flight.navigation().unwrap().state().restart().count, 2);
    assert_flies_as_in_sil("sensors-indoors", &changes);
}

/// 100 ticks of a flight whose vehicle has another gain than the law on the host, `batch` ticks sent at once.
fn flown_with_another_gain(batch: usize) -> OnBoard {
    let changes = ["duration=0.1".to_owned()];
    let loaded = LoadedScenario::open("paper-saturated", &changes).unwrap();
    let other = "controller.saturated.k4=3".to_owned();
    let set = [changes[0].clone(), other];
    let tuned = LoadedScenario::open("paper-saturated", &set).unwrap();
    let (mut session, _) = VehicleSession::boot(&emulator("firmware"), &[]).unwrap();
    set_up(&mut session, tuned.scenario()).unwrap();
    fly_ahead(&loaded, &mut session, batch, &mut TickLog::default(), &|_| ()).unwrap()
}

#[test]
fn a_difference_names_the_first_tick_and_number_as_well_with_the_host_ahead() {
    let difference = flown_with_another_gain(1).difference.expect("another gain");
    assert!(difference.tick < 10, "{difference}");
    assert_ne!(difference.vehicle, difference.host);
    let ahead = flown_with_another_gain(32);
    assert_eq!(ahead.difference, Some(difference));
}

/// A number of ticks that is no multiple of the batch; the vehicle answers every one of them.
#[test]
fn with_the_host_ahead_every_tick_is_compared_and_costs_the_same() {
    let by_tick = flown("paper-robust-adaptive", &["duration=0.3"]).0;
    for (name, batch) in [("paper-robust-adaptive", 7), ("sensors-indoors", 32)] {
        let loaded = LoadedScenario::open(name, &["duration=0.3".to_owned()]).unwrap();
        let (mut session, _) = VehicleSession::boot(&emulator("firmware"), &[]).unwrap();
        set_up(&mut session, loaded.scenario()).unwrap();
        let flown = fly_ahead(&loaded, &mut session, batch, &mut (), &|_| ()).unwrap();
        assert_eq!((flown.difference, flown.ticks), (None, 300), "{name}");
        if name == "paper-robust-adaptive" {
            assert_eq!(flown.cost, by_tick.cost, "{name}");
        }
    }
}

#[test]
fn the_cost_of_a_tick_is_counted_in_instructions() {
    let (on_board, ..) = flown("paper-robust-adaptive", &["duration=0.2"]);
    let (maximum, tick, _) = on_board.cost.maximum().unwrap();
    assert!(on_board.cost.minimum() > 1000, "{}", on_board.cost);
    assert!(maximum < 10_000 && tick < 200, "{}", on_board.cost);
    assert!(
        (f64::from(on_board.cost.minimum())..=f64::from(maximum)).contains(&on_board.cost.mean())
    );
}

/// `tests/data/README.md` says how to renew them.
#[test]
fn the_recordings_in_the_repository_are_flown_again_by_core_and_image() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    for name in PAPER {
        let recording = Recording::load(&data.join(format!("{name}.rec"))).unwrap();
        assert_eq!(recording.scenario, name);
        let replayed = replay(&recording, &emulator("firmware")).unwrap();
        assert!(replayed.same(), "{name}: {replayed:?}");
        assert_eq!(replayed.host_ticks, 200);
        assert!(replayed.packets > 200, "{name}: {replayed:?}");
    }
}

#[test]
fn a_recorded_flight_is_flown_again_by_host_and_image() {
    let changes = ["duration=0.5".to_owned()];
    let loaded = LoadedScenario::open("paper-robust-adaptive", &changes).unwrap();
    let blank = Recording::new("paper-robust-adaptive", loaded.text());
    let emulator = emulator("firmware");
    let (mut session, _) = VehicleSession::boot_recorded(&emulator, &[], Some(blank)).unwrap();
    set_up(&mut session, loaded.scenario()).unwrap();
    fly(&loaded, &mut session, &mut TickLog::default(), &|_| ()).unwrap();
    let mut recording = session.take_recording().unwrap();
    let replayed = replay(&recording, &emulator).unwrap();
    assert!(replayed.same() && replayed.packets > 500, "{replayed:?}");
    assert_eq!(replayed.host_ticks, 500);
    // A tick that was not flown with is noticed by both.
    let tick = recording.packets.iter().rposition(|(to, _)| *to == Direction::ToVehicle).unwrap();
    recording.packets[tick].1.clear();
    let replayed = replay(&recording, &emulator).unwrap();
    assert!(replayed.host_difference.is_some_and(|difference| difference.tick == 499));
    assert!(replayed.image_difference.is_some(), "{replayed:?}");
}
