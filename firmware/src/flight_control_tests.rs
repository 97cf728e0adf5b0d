//! Short histories of control periods under the shipped vehicle and the flown scenario.

use ctrl_core::filter::LowPassConfig;
use ctrl_core::vehicle::Wrench;
use glam::{Quat, Vec3};
use link::ControllerKind;

use ctrl_core::mode::safety::{AttitudeGuard, Hazards, Reaction, Silence};

use super::*;
use crate::scenario::{BUILT_IN_MISSION, Tuning};
use crate::vehicle::VEHICLE;

fn law() -> AnyController {
    let mission = &BUILT_IN_MISSION;
    Tuning { kind: ControllerKind::Saturated, ..mission.tuning }.controller().unwrap()
}

fn supervisor() -> SupervisorConfig {
    VEHICLE.supervisor
}

fn new() -> FlightControl {
    let config = &VEHICLE;
    FlightControl::new(&law(), &config.supervisor, &config.geometry).unwrap()
}

fn fresh(state: VehicleState) -> Option<StateSample> {
    Some(StateSample { state, age_ticks: 0 })
}

fn inputs() -> Inputs {
    Inputs {
        sample: fresh(VehicleState::at_rest(Vec3::new(0.1, -0.2, 0.0))),
        reference: Reference::hover(Vec3::ZERO),
        command: None,
        overrun: false,
        fault: false,
        outputs_off: false,
        kill: false,
        health: Health::default(),
    }
}

fn command(command: Command) -> Inputs {
    Inputs { command: Some(command), ..inputs() }
}

/// On the ground with a fresh state, armed, then started.
fn flying() -> FlightControl {
    let mut flight = new();
    for _ in 0..supervisor().fresh_samples {
        flight.tick(&inputs());
    }
    assert_eq!(flight.tick(&command(Command::Arm)).answer, Some(Ok(Mode::Armed)));
    assert_eq!(flight.tick(&command(Command::Start)).answer, Some(Ok(Mode::Flying)));
    flight
}

#[test]
fn rotors_stand_still_until_armed_and_started() {
    let mut flight = new();
    assert_eq!(flight.tick(&command(Command::Arm)).answer, Some(Err(Refusal::StateStale)));
    for _ in 0..100 {
        let outputs = flight.tick(&inputs());
        assert_eq!((outputs.thrusts, outputs.wrench), (None, SAFE));
    }
    assert_eq!(flight.tick(&command(Command::Start)).answer, Some(Err(Refusal::NotArmed)));
    let armed = flight.tick(&command(Command::Arm));
    assert_eq!((armed.mode, armed.thrusts, armed.flight_tick), (Mode::Armed, None, 0));
    let flying = flight.tick(&command(Command::Start));
    assert_eq!((flying.mode, flying.flight_tick), (Mode::Flying, 1));
    assert!(flying.thrusts.unwrap().iter().all(|thrust| *thrust > 1.0));
}

#[test]
fn the_law_flies_on_the_filtered_rate_of_every_good_sample() {
    let low_pass = LowPassConfig { frequency: 60.0, quality: 0.7 };
    let config = RateFilterConfig { low_pass: Some(low_pass), ..RateFilterConfig::default() };
    let (mut flight, law) = (new(), law());
    flight.set_rate_filter(&config).unwrap();
    let filter = RateFilter::new(&config, law.step_period()).unwrap();
    let (mut memory, mut state) = (filter.initial_state(), law.initial_state());
    let fresh_samples = supervisor().fresh_samples;
    for tick in 0..fresh_samples + 200 {
        let mut sample = VehicleState::at_rest(Vec3::new(0.1, -0.2, 0.0));
        sample.rate_body = Vec3::new(0.05, -0.1, 0.02) * if tick % 3 == 0 { 1.0 } else { -0.6 };
        let command = match tick.checked_sub(fresh_samples) {
            Some(0) => Some(Command::Arm),
            Some(1) => Some(Command::Start),
            _ => None,
        };
        let outputs = flight.tick(&Inputs { sample: fresh(sample), command, ..inputs() });
        sample.rate_body = filter.step(&mut memory, sample.rate_body);
        if tick > fresh_samples {
            assert_eq!(outputs.step, law.step(&mut state, &sample, &inputs().reference));
        }
    }
    let fast = LowPassConfig { frequency: 600.0, quality: 0.7 };
    let config = RateFilterConfig { low_pass: Some(fast), ..config };
    let refused = flight.set_rate_filter(&config).unwrap_err();
    assert_eq!(refused.parameter, "rate_filter.low_pass.frequency");
}

#[test]
fn the_rotors_make_the_wrench_of_the_law() {
    let config = &VEHICLE;
    let allocator = ctrl_core::allocation::Allocator::new(&config.geometry).unwrap();
    let law = law();
    let mut state = law.initial_state();
    let mut flight = flying();
    law.step(&mut state, &inputs().sample.unwrap().state, &inputs().reference);
    for tick in 2..50 {
        let outputs = flight.tick(&inputs());
        let expected = law.step(&mut state, &inputs().sample.unwrap().state, &inputs().reference);
        assert_eq!((outputs.step, outputs.flight_tick), (expected, tick));
        assert_eq!(outputs.limited, Limited::empty());
        let Wrench { thrust, torque_body } = allocator.wrench(&outputs.thrusts.unwrap());
        assert!((thrust - expected.wrench.thrust).abs() < 1e-5);
        assert!((torque_body - expected.wrench.torque_body).abs().max_element() < 1e-6);
    }
}

#[test]
fn a_missed_sample_is_held_and_many_lead_to_the_failsafe() {
    let mut flight = flying();
    let missed = Inputs { sample: None, ..inputs() };
    for _ in 1..supervisor().missed_samples_max {
        let outputs = flight.tick(&missed);
        assert_eq!(outputs.mode, Mode::Flying);
        assert!(!outputs.step.status.intersects(StepStatus::FAULT));
    }
    let failsafe = flight.tick(&missed);
    assert_eq!((failsafe.mode, failsafe.cause), (Mode::Failsafe, Some(Cause::SamplesMissed)));
    assert_eq!(failsafe.wrench.torque_body, Vec3::ZERO);
    let sum: f32 = failsafe.thrusts.unwrap().iter().sum();
    assert!((sum - failsafe.wrench.thrust).abs() < 1e-5 && sum > 0.0);
}

#[test]
fn a_bad_sample_counts_as_missed_and_never_reaches_the_law() {
    let good = inputs().sample.unwrap().state;
    let bad = [
        VehicleState { position_world: Vec3::new(f32::NAN, 0.0, 0.0), ..good },
        VehicleState { velocity_world: Vec3::splat(f32::INFINITY), ..good },
        VehicleState { rate_body: Vec3::new(0.0, f32::NAN, 0.0), ..good },
        VehicleState { attitude: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..good },
        VehicleState { attitude: Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0), ..good },
    ];
    for vehicle in bad {
        let mut flight = flying();
        for period in 1..=supervisor().missed_samples_max {
            let outputs = flight.tick(&Inputs { sample: fresh(vehicle), ..inputs() });
            assert!(!outputs.step.status.intersects(StepStatus::FAULT));
            let last = period == supervisor().missed_samples_max;
            assert_eq!(outputs.mode == Mode::Failsafe, last, "{vehicle:?}");
        }
    }
}

#[test]
fn a_bad_reference_leads_to_the_failsafe() {
    let mut flight = flying();
    let bad = Inputs { reference: Reference::hover(Vec3::splat(f32::NAN)), ..inputs() };
    let modes: std::vec::Vec<_> =
        (0..=supervisor().faulted_steps_max).map(|_| flight.tick(&bad).mode).collect();
    assert_eq!(modes.last(), Some(&Mode::Failsafe));
    assert!(modes[..modes.len() - 1].iter().all(|mode| *mode == Mode::Flying));
}

#[test]
fn overruns_lead_to_the_failsafe_and_a_fault_stops_the_rotors() {
    let mut flight = flying();
    let late = Inputs { overrun: true, ..inputs() };
    for _ in 1..supervisor().overruns_max {
        assert_eq!(flight.tick(&late).mode, Mode::Flying);
    }
    assert_eq!(flight.tick(&late).cause, Some(Cause::Overruns));
    let locked = flight.tick(&Inputs { fault: true, ..inputs() });
    assert_eq!((locked.mode, locked.thrusts, locked.wrench), (Mode::Locked, None, SAFE));
    assert_eq!(flight.tick(&command(Command::Arm)).answer, Some(Err(Refusal::Locked)));
}

#[test]
fn every_flight_begins_afresh() {
    let mut flight = flying();
    let first = flight.tick(&inputs());
    for _ in 0..500 {
        flight.tick(&inputs());
    }
    assert_eq!(flight.tick(&command(Command::Stop)).thrusts, None);
    flight.tick(&command(Command::Start));
    assert_eq!(flight.tick(&inputs()), first);
}

#[test]
fn a_failsafe_that_recovers_goes_on_with_the_flight() {
    let mut flight = flying();
    let missed = Inputs { sample: None, ..inputs() };
    while flight.tick(&missed).mode == Mode::Flying {}
    for _ in 0..supervisor().fresh_samples {
        flight.tick(&inputs());
    }
    let before = flight.tick(&inputs()).flight_tick;
    let recovered = flight.tick(&command(Command::Start));
    assert_eq!((recovered.mode, recovered.flight_tick), (Mode::Flying, before + 1));
}

#[test]
fn disarming_ends_flight_and_failsafe_but_not_a_lock_by_a_fault() {
    let mut flight = flying();
    flight.disarm();
    let outputs = flight.tick(&inputs());
    assert_eq!((outputs.mode, outputs.wrench, outputs.thrusts), (Mode::Disarmed, SAFE, None));
    let mut flight = flying();
    flight.tick(&Inputs { fault: true, ..inputs() });
    flight.disarm();
    assert_eq!(flight.tick(&Inputs { fault: true, ..inputs() }).mode, Mode::Locked);
}

#[test]
fn hazards_are_reported_refuse_to_arm_and_cut_where_they_must() {
    let safety = SafetyConfig {
        rc: Some(Silence { timeout: 0.5, reaction: Reaction::Return }),
        attitude: Some(AttitudeGuard {
            tilt: 1.0,
            rate: 10.0,
            time: 0.01,
            reaction: Reaction::Stop,
        }),
        ..SafetyConfig::default()
    };
    let silent = Health { rc_silence: 0.6, ..Health::default() };
    let mut ground: FlightControl =
        FlightControl::new(&law(), &supervisor(), &VEHICLE.geometry).unwrap();
    ground.set_safety(&safety).unwrap();
    for _ in 0..100 {
        ground.tick(&Inputs { health: silent, ..inputs() });
    }
    let answer = ground.tick(&Inputs { health: silent, ..command(Command::Arm) }).answer;
    assert_eq!(answer, Some(Err(Refusal::Hazard(Hazards::RC_LOST))));

    let mut flight = flying();
    flight.set_safety(&safety).unwrap();
    let outputs = flight.tick(&Inputs { health: silent, ..inputs() });
    assert_eq!(outputs.safety.raised, Hazards::RC_LOST);
    assert_eq!((outputs.mode, outputs.safety.reaction), (Mode::Flying, Some(Reaction::Return)));
    let mut sample = inputs().sample.unwrap();
    sample.state.rate_body.x = 11.0;
    let outputs: std::vec::Vec<_> =
        (0..20).map(|_| flight.tick(&Inputs { sample: Some(sample), ..inputs() })).collect();
    let last = outputs.last().unwrap();
    assert_eq!((last.mode, last.cause), (Mode::Locked, Some(Cause::Hazard)));
    assert_eq!((&last.thrusts, last.achieved), (&None, SAFE));
}

#[test]
fn the_kill_switch_stops_the_rotors_in_the_same_tick() {
    let mut flight = flying();
    assert!(flight.tick(&inputs()).thrusts.is_some());
    let outputs = flight.tick(&Inputs { kill: true, ..inputs() });
    assert_eq!(
        (outputs.thrusts, outputs.mode, outputs.cause),
        (None, Mode::Locked, Some(Cause::Killed))
    );
}

#[test]
fn the_limits_of_the_rotors_follow_the_battery() {
    let mut flight = flying();
    let config = BatteryConfig { nominal_voltage: 15.0, smoothing_time: 0.01 };
    flight.set_battery(&config).unwrap();
    let command = flight.tick(&inputs()).wrench.thrust;
    // Half of the voltage is a quarter of the thrust: 4 N of 16 N.
    let health = Health { voltage: Some(7.5), ..Health::default() };
    let outputs = (0..200).map(|_| flight.tick(&Inputs { health, ..inputs() })).last().unwrap();
    assert!(command > 7.0 && outputs.limited.contains(Limited::THRUST), "{outputs:?}");
    // Less what roll and pitch torque need.
    let achieved = outputs.achieved;
    assert!((achieved.thrust - 4.0).abs() < 0.05, "{achieved:?}");
    let short = achieved.torque_body - outputs.wrench.torque_body;
    assert!(short.truncate().length() < 1e-6, "{outputs:?}");
}

#[test]
fn a_quadrotor_refuses_to_fly_without_a_rotor_and_flies_on_as_it_was() {
    let (mut flight, mut other) = (flying(), flying());
    assert_eq!(flight.lose_rotor(1).unwrap_err().parameter, "rotors (count)");
    let watch = RotorWatchConfig {
        inertia: Vec3::splat(0.05),
        disturbance_torque: 0.05,
        rotor_lag: 0.03,
        smoothing_time: 0.05,
        share: 0.6,
        time: 0.03,
    };
    let refused = flight.set_rotor_watch(&watch, &VEHICLE.geometry).unwrap_err();
    assert_eq!(refused.parameter, "rotors (count)");
    assert_eq!(flight.tick(&inputs()), other.tick(&inputs()));
}
