//! Tests of the state machine.

use core::f32::consts::PI;

use proptest::prelude::*;

use super::*;

const CONFIG: SupervisorConfig = SupervisorConfig {
    arming_tilt_max: 0.35,
    fresh_samples: 3,
    missed_samples_max: 5,
    faulted_steps_max: 4,
    overruns_max: 2,
    failsafe: FailsafePolicy::Descend { thrust: 7.0, ticks: 10 },
};

const GOOD: Conditions = Conditions {
    attitude: Some(Quat::IDENTITY),
    step: StepStatus::empty(),
    overrun: false,
    fault: false,
    outputs_off: false,
    kill: false,
    safety: SafetyReport { hazards: Hazards::empty(), raised: Hazards::empty(), reaction: None },
};
const MISSED: Conditions = Conditions { attitude: None, ..GOOD };
const FAULTED: Conditions = Conditions { step: StepStatus::STATE_INVALID, ..GOOD };
const OVERRUN: Conditions = Conditions { overrun: true, ..GOOD };
const FAULT: Conditions = Conditions { fault: true, ..GOOD };

const LIVE: Wrench = Wrench { thrust: 9.0, torque_body: Vec3::new(0.1, 0.2, 0.3) };

/// A vehicle under supervision with its own clock.
struct Flight {
    supervisor: Supervisor,
    state: SupervisorState,
    tick: u64,
}

impl Flight {
    fn new(config: &SupervisorConfig) -> Self {
        let supervisor = Supervisor::new(config).unwrap();
        Self { supervisor, state: SupervisorState::default(), tick: 0 }
    }

    fn flying(config: &SupervisorConfig) -> Self {
        let mut flight = Self::new(config);
        flight.run(&GOOD, 3);
        flight.order(Command::Arm).unwrap();
        flight.order(Command::Start).unwrap();
        flight
    }

    fn run(&mut self, conditions: &Conditions, ticks: u32) -> Mode {
        for _ in 0..ticks {
            self.tick += 1;
            self.supervisor.step(&mut self.state, self.tick, conditions);
        }
        self.state.mode()
    }

    fn order(&mut self, command: Command) -> Result<Mode, Refusal> {
        self.supervisor.command(&mut self.state, self.tick, command)
    }

    fn output(&self) -> Wrench {
        self.supervisor.gate(&self.state, LIVE)
    }
}

#[test]
fn arm_and_start_make_the_output_live_and_stop_and_disarm_cut_it() {
    let mut flight = Flight::new(&CONFIG);
    assert_eq!((flight.run(&GOOD, 3), flight.output()), (Mode::Disarmed, SAFE));
    assert_eq!(flight.order(Command::Arm), Ok(Mode::Armed));
    assert_eq!(flight.output(), SAFE);
    assert_eq!(flight.order(Command::Start), Ok(Mode::Flying));
    assert_eq!((flight.run(&GOOD, 100), flight.output()), (Mode::Flying, LIVE));
    assert_eq!(flight.state.since(), 3);
    assert_eq!(flight.order(Command::Stop), Ok(Mode::Armed));
    assert_eq!(flight.output(), SAFE);
    assert_eq!(flight.order(Command::Disarm), Ok(Mode::Disarmed));
    assert_eq!((flight.output(), flight.state.since()), (SAFE, 103));
}

#[test]
fn a_repeated_command_changes_nothing() {
    let mut flight = Flight::flying(&CONFIG);
    assert_eq!(flight.order(Command::Start), Ok(Mode::Flying));
    assert_eq!(flight.order(Command::Arm), Ok(Mode::Flying));
    flight.order(Command::Stop).unwrap();
    assert_eq!(flight.order(Command::Arm), Ok(Mode::Armed));
    assert_eq!(flight.order(Command::Stop), Ok(Mode::Armed));
    flight.order(Command::Disarm).unwrap();
    assert_eq!(flight.order(Command::Disarm), Ok(Mode::Disarmed));
    assert_eq!(flight.order(Command::Stop), Ok(Mode::Disarmed));
}

#[test]
fn start_needs_arm() {
    let mut flight = Flight::new(&CONFIG);
    flight.run(&GOOD, 10);
    assert_eq!(flight.order(Command::Start), Err(Refusal::NotArmed));
    assert_eq!(flight.output(), SAFE);
}

#[test]
fn arm_needs_a_fresh_state() {
    let mut flight = Flight::new(&CONFIG);
    assert_eq!(flight.order(Command::Arm), Err(Refusal::StateStale));
    flight.run(&GOOD, 2);
    assert_eq!(flight.order(Command::Arm), Err(Refusal::StateStale));
    flight.run(&GOOD, 1);
    flight.run(&MISSED, 1);
    assert_eq!(flight.order(Command::Arm), Err(Refusal::StateStale));
    flight.run(&GOOD, 3);
    assert_eq!(flight.order(Command::Arm), Ok(Mode::Armed));
}

#[test]
fn arm_and_start_need_an_upright_vehicle() {
    let tilted = |angle| Conditions {
        attitude: Some(Quat::from_xyzw(0.0, libm::sinf(angle / 2.0), 0.0, libm::cosf(angle / 2.0))),
        ..GOOD
    };
    for (angle, upright) in
        [(0.34, true), (-0.34, true), (0.36, false), (-0.36, false), (PI, false)]
    {
        let mut flight = Flight::new(&CONFIG);
        flight.run(&tilted(angle), 3);
        assert_eq!(flight.order(Command::Arm).is_ok(), upright, "{angle}");
    }
    for broken in [Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0)] {
        let mut flight = Flight::new(&CONFIG);
        flight.run(&Conditions { attitude: Some(broken), ..GOOD }, 3);
        assert_eq!(flight.order(Command::Arm), Err(Refusal::Tilted));
    }
    let mut flight = Flight::new(&CONFIG);
    flight.run(&GOOD, 3);
    flight.order(Command::Arm).unwrap();
    flight.run(&tilted(1.0), 1);
    assert_eq!(flight.order(Command::Start), Err(Refusal::Tilted));
}

#[test]
fn with_the_outputs_off_any_rotation_may_arm() {
    let arm = |attitude, outputs_off| {
        let mut flight = Flight::new(&CONFIG);
        flight.run(&Conditions { attitude: Some(attitude), outputs_off, ..GOOD }, 3);
        flight.order(Command::Arm)
    };
    let upside_down = Quat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    assert_eq!(arm(upside_down, true), Ok(Mode::Armed));
    assert_eq!(arm(upside_down, false), Err(Refusal::Tilted));
    for broken in [Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Quat::NAN] {
        assert_eq!(arm(broken, true), Err(Refusal::Tilted));
    }
}

#[test]
fn tilt_is_no_failsafe_in_flight() {
    let mut flight = Flight::flying(&CONFIG);
    let upside_down = Conditions { attitude: Some(Quat::from_xyzw(1.0, 0.0, 0.0, 0.0)), ..GOOD };
    assert_eq!(flight.run(&upside_down, 100), Mode::Flying);
}

#[test]
fn the_stated_number_in_a_row_triggers_the_failsafe_in_that_period() {
    for (bad, count, cause) in [
        (MISSED, 5, Cause::SamplesMissed),
        (FAULTED, 4, Cause::StepsFaulted),
        (OVERRUN, 2, Cause::Overruns),
    ] {
        let mut flight = Flight::flying(&CONFIG);
        assert_eq!(flight.run(&bad, count - 1), Mode::Flying, "{cause:?}");
        assert_eq!(flight.run(&GOOD, 1), Mode::Flying, "{cause:?}: not in a row");
        assert_eq!(flight.run(&bad, count - 1), Mode::Flying, "{cause:?}");
        assert_eq!(flight.output(), LIVE);
        assert_eq!(flight.run(&bad, 1), Mode::Failsafe, "{cause:?}");
        assert_eq!(flight.output(), Wrench { thrust: 7.0, torque_body: Vec3::ZERO });
        assert_eq!(flight.state.cause(), Some(cause));
    }
}

#[test]
fn the_descent_ends_in_locked() {
    let mut flight = Flight::flying(&CONFIG);
    flight.run(&MISSED, 5);
    assert_eq!(flight.run(&MISSED, 9), Mode::Failsafe);
    assert_eq!(flight.run(&MISSED, 1), Mode::Locked);
    assert_eq!((flight.output(), flight.state.cause()), (SAFE, Some(Cause::SamplesMissed)));
    for command in [Command::Arm, Command::Start, Command::Stop] {
        assert_eq!(flight.order(command), Err(Refusal::Locked));
    }
    assert_eq!(flight.order(Command::Disarm), Ok(Mode::Disarmed));
    assert_eq!(flight.state.cause(), None);
}

#[test]
fn the_cut_policy_locks_at_once() {
    let config = SupervisorConfig { failsafe: FailsafePolicy::Cut, ..CONFIG };
    let mut flight = Flight::flying(&config);
    assert_eq!((flight.run(&OVERRUN, 2), flight.output()), (Mode::Locked, SAFE));
}

#[test]
fn a_returning_host_recovers_with_start() {
    let mut flight = Flight::flying(&CONFIG);
    flight.run(&MISSED, 5);
    assert_eq!(flight.order(Command::Start), Err(Refusal::StateStale));
    assert_eq!(flight.order(Command::Arm), Err(Refusal::InFailsafe));
    assert_eq!(flight.order(Command::Stop), Err(Refusal::InFailsafe));
    assert_eq!(flight.run(&GOOD, 3), Mode::Failsafe, "not by itself");
    assert_eq!(flight.order(Command::Start), Ok(Mode::Flying));
    assert_eq!((flight.output(), flight.state.cause()), (LIVE, None));
    assert_eq!(flight.run(&GOOD, 100), Mode::Flying);
    flight.run(&MISSED, 5);
    assert_eq!(flight.order(Command::Disarm), Ok(Mode::Disarmed));
}

#[test]
fn arming_is_lost_with_the_samples() {
    let mut flight = Flight::new(&CONFIG);
    flight.run(&GOOD, 3);
    flight.order(Command::Arm).unwrap();
    assert_eq!(flight.run(&MISSED, 5), Mode::Disarmed);
    assert_eq!(flight.state.cause(), Some(Cause::SamplesMissed));
}

#[test]
fn a_fault_locks_every_mode_until_it_is_gone_and_disarmed() {
    let mut flights = [Flight::new(&CONFIG), Flight::flying(&CONFIG), Flight::flying(&CONFIG)];
    flights[2].run(&MISSED, 5);
    for flight in &mut flights {
        assert_eq!((flight.run(&FAULT, 1), flight.output()), (Mode::Locked, SAFE));
        assert_eq!(flight.order(Command::Disarm), Err(Refusal::Fault));
        assert_eq!(flight.order(Command::Arm), Err(Refusal::Locked));
        assert_eq!(flight.run(&GOOD, 3), Mode::Locked);
        assert_eq!(flight.state.cause(), Some(Cause::Fault));
        assert_eq!(flight.order(Command::Disarm), Ok(Mode::Disarmed));
        assert_eq!(flight.order(Command::Arm), Ok(Mode::Armed));
    }
}

#[test]
fn a_wrench_that_is_not_finite_never_passes() {
    let flight = Flight::flying(&CONFIG);
    let bad = Wrench { torque_body: Vec3::new(0.0, f32::NAN, 0.0), ..LIVE };
    assert_eq!(flight.supervisor.gate(&flight.state, bad), SAFE);
}

#[test]
fn each_limit_is_checked() {
    let refused = |config| Supervisor::new(&config).unwrap_err().parameter;
    let descend = |thrust, ticks| SupervisorConfig {
        failsafe: FailsafePolicy::Descend { thrust, ticks },
        ..CONFIG
    };
    assert_eq!(refused(SupervisorConfig { arming_tilt_max: 1.6, ..CONFIG }), "arming_tilt_max");
    assert_eq!(refused(SupervisorConfig { fresh_samples: 0, ..CONFIG }), "fresh_samples");
    assert_eq!(refused(SupervisorConfig { missed_samples_max: 0, ..CONFIG }), "missed_samples_max");
    assert_eq!(refused(SupervisorConfig { faulted_steps_max: 0, ..CONFIG }), "faulted_steps_max");
    assert_eq!(refused(SupervisorConfig { overruns_max: 0, ..CONFIG }), "overruns_max");
    assert_eq!(refused(descend(f32::NAN, 10)), "failsafe.descend.thrust");
    assert_eq!(refused(descend(7.0, 0)), "failsafe.descend.ticks");
}

fn hazard(reaction: Reaction) -> Conditions {
    let hazards = Hazards::BATTERY_LOW;
    Conditions {
        safety: SafetyReport { hazards, raised: hazards, reaction: Some(reaction) },
        ..GOOD
    }
}

const KILLED: Conditions = Conditions { kill: true, ..GOOD };

proptest! {
    #[test]
    fn no_path_leads_to_live_outputs_without_arm_and_start(
        events in proptest::collection::vec(0usize..15, 0..200)
    ) {
        let mut flight = Flight::new(&CONFIG);
        let (mut armed, mut started) = (false, false);
        let conditions = [
            GOOD, MISSED, FAULTED, OVERRUN, FAULT, KILLED,
            hazard(Reaction::Warn), hazard(Reaction::Land), hazard(Reaction::Failsafe), hazard(Reaction::Stop),
        ];
        let commands = [Command::Arm, Command::Disarm, Command::Start, Command::Stop, Command::Kill];
        for event in events {
            match conditions.get(event) {
                Some(conditions) => {
                    flight.run(conditions, 2);
                }
                None => {
                    let command = commands[event - conditions.len()];
                    let accepted = flight.order(command).is_ok();
                    armed |= accepted && command == Command::Arm;
                    started |= accepted && command == Command::Start;
                    prop_assert!(accepted || command != Command::Kill);
                    prop_assert!(command != Command::Kill || flight.output() == SAFE);
                }
            }
            let mode = flight.state.mode();
            armed &= !matches!(mode, Mode::Disarmed | Mode::Locked);
            started &= armed && mode != Mode::Armed;
            prop_assert_eq!(flight.output() == LIVE, mode == Mode::Flying);
            prop_assert!(flight.output() == SAFE || (armed && started), "{:?}", flight.state);
        }
    }

    #[test]
    fn every_failsafe_ends_with_the_rotors_stopped_unless_an_operator_starts_again(
        before in proptest::collection::vec(0usize..3, 0..50),
        end in 0usize..6,
    ) {
        let mut flight = Flight::flying(&CONFIG);
        for event in before {
            flight.run(&[GOOD, hazard(Reaction::Warn), hazard(Reaction::Return)][event], 1);
        }
        prop_assert_eq!(flight.state.mode(), Mode::Flying);
        let fatal = [MISSED, FAULTED, OVERRUN, hazard(Reaction::Failsafe), hazard(Reaction::Stop), FAULT];
        flight.run(&fatal[end], 5);
        prop_assert!(flight.state.mode() != Mode::Flying);
        flight.run(&GOOD, 10);
        prop_assert_eq!((flight.state.mode(), flight.output()), (Mode::Locked, SAFE));
    }
}

#[test]
fn the_kill_switch_locks_from_every_mode_and_while_it_is_on() {
    for failsafe in [FailsafePolicy::Cut, CONFIG.failsafe] {
        let config = SupervisorConfig { failsafe, ..CONFIG };
        let mut disarmed = Flight::new(&config);
        disarmed.run(&GOOD, 3);
        let mut armed = disarmed.order(Command::Arm).map(|_| disarmed).unwrap();
        armed.run(&GOOD, 1);
        let mut failing = Flight::flying(&CONFIG);
        failing.run(&MISSED, 5);
        assert_eq!(failing.state.mode(), Mode::Failsafe);
        for mut flight in [armed, Flight::flying(&config), failing] {
            assert_eq!(flight.run(&KILLED, 1), Mode::Locked);
            assert_eq!((flight.output(), flight.state.cause()), (SAFE, Some(Cause::Killed)));
            assert_eq!(flight.order(Command::Disarm), Err(Refusal::Killed));
            assert_eq!(flight.supervisor.readiness(&flight.state), Err(Refusal::Killed));
            flight.run(&GOOD, 3);
            assert_eq!(flight.order(Command::Arm), Err(Refusal::Locked));
            assert_eq!(flight.order(Command::Disarm), Ok(Mode::Disarmed));
            assert_eq!(flight.order(Command::Kill), Ok(Mode::Locked));
            assert_eq!(flight.state.cause(), Some(Cause::Killed));
        }
    }
}

#[test]
fn hazards_keep_it_on_the_ground_by_name_and_strong_ones_end_the_flight() {
    let mut flight = Flight::new(&CONFIG);
    flight.run(&hazard(Reaction::Warn), 3);
    let refused = flight.order(Command::Arm).unwrap_err();
    assert_eq!(refused, Refusal::Hazard(Hazards::BATTERY_LOW));
    assert_eq!(std::format!("{refused}"), "battery low");
    flight.run(&GOOD, 1);
    flight.order(Command::Arm).unwrap();
    assert_eq!(flight.run(&hazard(Reaction::Warn), 1), Mode::Disarmed);
    assert_eq!(flight.state.cause(), Some(Cause::Hazard));
    let ends = [
        (Reaction::Warn, Mode::Flying),
        (Reaction::Return, Mode::Flying),
        (Reaction::Land, Mode::Flying),
        (Reaction::Failsafe, Mode::Failsafe),
        (Reaction::Stop, Mode::Locked),
    ];
    for (reaction, mode) in ends {
        assert_eq!(Flight::flying(&CONFIG).run(&hazard(reaction), 3), mode);
        let mut failing = Flight::flying(&CONFIG);
        failing.run(&MISSED, 5);
        let after = if reaction == Reaction::Stop { Mode::Locked } else { Mode::Failsafe };
        assert_eq!(failing.run(&hazard(reaction), 1), after);
    }
}

#[test]
fn readiness_says_what_an_arm_would_be_answered() {
    let mut flight = Flight::new(&CONFIG);
    let ready = |flight: &Flight| flight.supervisor.readiness(&flight.state);
    assert_eq!(ready(&flight), Err(Refusal::StateStale));
    flight.run(&GOOD, 3);
    assert_eq!(ready(&flight), Ok(()));
    flight.run(&FAULT, 1);
    assert_eq!(ready(&flight), Err(Refusal::Fault));
    flight.run(&GOOD, 3);
    assert_eq!(ready(&flight), Err(Refusal::Locked));
    assert_eq!(flight.order(Command::Arm), Err(Refusal::Locked));
}
