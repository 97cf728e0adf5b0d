//! Conversations with a host, message by message.

use std::vec::Vec;

use ctrl_core::trajectory::{HoverConfig, Leg};
use link::{FaultKind, REGISTERS};

use super::*;
use crate::scenario::built_in_mission;

const CONFIG: SessionConfig = SessionConfig {
    board: "test bench",
    sample_valid: 5,
    reference_timeout: 100,
    telemetry_period_min: 2,
};

const GROUND: Progress =
    Progress { mode: Mode::Disarmed, flight_tick: 0, uptime: 1000, in_step: false };
const FLYING: Progress = Progress { mode: Mode::Flying, flight_tick: 7, uptime: 2000, ..GROUND };

const BUILT_IN: ParametersInForce =
    ParametersInForce { origin: ParameterOrigin::BuiltIn, generation: 0, changed: false };

/// A session that has sent its greeting.
fn session() -> Session {
    let flown = BuiltInMission {
        tuning: Tuning { kind: ControllerKind::Saturated, ..built_in_mission().unwrap().tuning },
        trajectory: TrajectoryConfig::Hover(hover()),
    };
    let mut session = Session::new(CONFIG, &flown, BUILT_IN, None).unwrap();
    assert!(matches!(session.next_answer(), Some(Downlink::Identity(_))));
    assert_eq!(session.next_answer(), Some(Downlink::ParametersInForce(BUILT_IN)));
    session
}

fn hover() -> HoverConfig {
    HoverConfig { position_world: Vec3::new(0.0, 0.0, 2.0), yaw: 0.0 }
}

/// Says `message` and returns the answers.
fn say(session: &mut Session, message: Uplink, progress: Progress) -> Vec<Downlink> {
    session.handle(Received { sequence: 42, message }, progress);
    core::iter::from_fn(|| session.next_answer()).collect()
}

fn acknowledged(result: Result<(), Rejection>) -> Vec<Downlink> {
    [Downlink::Acknowledgement(Acknowledgement { sequence: 42, result })].into()
}

fn write(name: &str, value: f32) -> Uplink {
    Uplink::ParameterWrite { name: copy(name), value }
}

fn read(session: &mut Session, name: &str) -> f32 {
    match &say(session, Uplink::ParameterRead { name: copy(name) }, FLYING)[..] {
        [Downlink::Parameter(parameter)] => parameter.value,
        other => panic!("{other:?}"),
    }
}

fn report() -> FaultReport {
    FaultReport {
        kind: FaultKind::Panic,
        uptime_ticks: 5,
        registers: [1; REGISTERS],
        line: 6,
        text: copy("here"),
    }
}

#[test]
fn greets_after_the_start_and_when_greeted() {
    let mut session = Session::new(CONFIG, &built_in_mission().unwrap(), STORED, None).unwrap();
    assert!(!session.greeted() && session.has_answers());
    let Some(Downlink::Identity(greeting)) = session.next_answer() else { panic!() };
    assert_eq!((&*greeting.board, greeting.uptime_ticks), ("test bench", 0));
    assert_eq!(greeting.controller, built_in_mission().unwrap().tuning.kind);
    assert_eq!(session.next_answer(), Some(Downlink::ParametersInForce(STORED)));
    let [Downlink::Identity(identity), in_force] = &say(&mut session, Uplink::Hello, FLYING)[..]
    else {
        panic!()
    };
    assert_eq!(*in_force, Downlink::ParametersInForce(STORED));
    assert_eq!((identity.uptime_ticks, identity.fault_pending), (2000, false));
    assert!(session.greeted() && !session.has_answers());
}

const STORED: ParametersInForce =
    ParametersInForce { origin: ParameterOrigin::Stored, generation: 3, changed: false };

#[test]
fn a_sample_stands_for_its_ticks_and_is_not_answered() {
    let mut session = session();
    assert_eq!(session.sample(1000), None);
    let state = VehicleState::at_rest(Vec3::X);
    assert_eq!(say(&mut session, Uplink::State { tick: 0, state }, GROUND), []);
    assert_eq!(session.sample(1000), Some(state));
    assert_eq!(session.sample(1004), Some(state));
    assert_eq!(session.sample(1005), None);
}

#[test]
fn commands_wait_for_the_control_group_and_are_answered_in_order() {
    let mut session = session();
    for (sequence, command) in [(1, Command::Arm), (2, Command::Start)] {
        session.handle(Received { sequence, message: Uplink::Command(command) }, GROUND);
    }
    assert_eq!(session.next_command(), Some(Command::Arm));
    assert_eq!(session.next_command(), None, "one at a time");
    assert_eq!(session.next_answer(), None);
    session.answered(Ok(Mode::Armed));
    assert_eq!(session.next_command(), Some(Command::Start));
    session.answered(Err(Refusal::Tilted));
    let answers: Vec<_> = core::iter::from_fn(|| session.next_answer()).collect();
    let answer = |sequence, result| Downlink::Acknowledgement(Acknowledgement { sequence, result });
    assert_eq!(answers, [answer(1, Ok(())), answer(2, Err(Rejection::Mode(Refusal::Tilted)))]);
}

#[test]
fn more_commands_than_fit_are_refused_not_forgotten() {
    let mut session = session();
    for _ in 0..COMMANDS {
        assert_eq!(say(&mut session, Uplink::Command(Command::Stop), GROUND), []);
    }
    let refused = say(&mut session, Uplink::Command(Command::Stop), GROUND);
    assert_eq!(refused, acknowledged(Err(Rejection::NotNow)));
}

#[test]
fn a_parameter_is_written_read_back_and_reaches_the_law() {
    let mut session = session();
    assert!(session.take_law().is_none());
    let answer = say(&mut session, write("k4", 3.5), GROUND);
    assert_eq!(answer, acknowledged(Ok(())));
    assert_eq!(read(&mut session, "k4"), 3.5);
    let Some(AnyController::Saturated(law)) = session.take_law() else { panic!() };
    assert_eq!(law.config().k4, 3.5);
    assert!(session.take_law().is_none(), "once");
}

#[test]
fn a_refused_parameter_changes_nothing_and_names_the_bound() {
    let mut session = session();
    let before = read(&mut session, "k4");
    let answer = say(&mut session, write("k4", -1.0), GROUND);
    let [Downlink::Acknowledgement(Acknowledgement { result: Err(rejection), .. })] = &answer[..]
    else {
        panic!("{answer:?}")
    };
    let Rejection::Invalid { parameter, value, lower, .. } = rejection else { panic!() };
    assert_eq!((&**parameter, *value, *lower), ("k4", -1.0, 0.0));
    assert_eq!(read(&mut session, "k4"), before);
    assert!(session.take_law().is_none());
    let unknown = say(&mut session, write("k9", 1.0), GROUND);
    assert_eq!(unknown, acknowledged(Err(Rejection::UnknownParameter)));
}

#[test]
fn every_parameter_can_be_listed() {
    let mut session = session();
    let mut names = Vec::new();
    loop {
        let index = names.len() as u16;
        match &say(&mut session, Uplink::ParameterAt { index }, GROUND)[..] {
            [Downlink::Parameter(parameter)] => {
                assert_eq!(parameter.index, index);
                names.push(parameter.name.clone());
            }
            answer => {
                assert_eq!(answer, acknowledged(Err(Rejection::UnknownParameter)));
                break;
            }
        }
    }
    assert!(names.len() > 20);
    assert!(names.iter().any(|name| name == "cascade.k1"));
}

#[test]
fn settings_are_refused_in_flight() {
    let mut session = session();
    let settings = [
        write("k4", 3.5),
        Uplink::SelectController(ControllerKind::RobustAdaptive),
        Uplink::SelectTrajectory(TrajectorySelection::Stream),
        Uplink::PathBegin { start_world: Vec3::ZERO, yaw: 0.0, legs: 1 },
    ];
    for setting in settings {
        let answer = say(&mut session, setting, FLYING);
        assert_eq!(answer, acknowledged(Err(Rejection::NotNow)));
    }
    assert!(session.take_law().is_none());
}

#[test]
fn the_controller_is_chosen_by_the_host() {
    let mut session = session();
    let choice = Uplink::SelectController(ControllerKind::RobustAdaptive);
    assert_eq!(say(&mut session, choice, GROUND), acknowledged(Ok(())));
    assert!(matches!(session.take_law(), Some(AnyController::RobustAdaptive(..))));
}

#[test]
fn a_trajectory_must_suit_the_controller() {
    let mut session = session();
    let place = HoverConfig { position_world: Vec3::new(1.0, 2.0, 3.0), yaw: 0.0 };
    let choice = Uplink::SelectTrajectory(TrajectorySelection::Hover(place));
    assert_eq!(say(&mut session, choice, GROUND), acknowledged(Ok(())));
    assert_eq!(session.reference(GROUND).position_world, place.position_world);
    let too_fast = ctrl_core::trajectory::LemniscateConfig {
        centre_world: Vec3::ZERO,
        amplitude_x: 4.0,
        amplitude_y: 2.0,
        angular_rate: 1.0,
        yaw: 0.0,
    };
    let choice = Uplink::SelectTrajectory(TrajectorySelection::Lemniscate(too_fast));
    let answer = say(&mut session, choice, GROUND);
    let [Downlink::Acknowledgement(Acknowledgement { result: Err(rejection), .. })] = &answer[..]
    else {
        panic!("{answer:?}")
    };
    assert!(matches!(rejection, Rejection::Invalid { .. }), "{rejection:?}");
    assert_eq!(session.reference(GROUND).position_world, place.position_world, "unchanged");
}

#[test]
fn a_stream_is_followed_once_selected() {
    let mut session = session();
    let reference = Reference::hover(Vec3::new(9.0, 9.0, 9.0));
    say(&mut session, Uplink::Reference { tick: 0, reference }, GROUND);
    assert_eq!(session.reference(GROUND).position_world, hover().position_world);
    let choice = Uplink::SelectTrajectory(TrajectorySelection::Stream);
    assert_eq!(say(&mut session, choice, GROUND), acknowledged(Ok(())));
    say(&mut session, Uplink::Reference { tick: 0, reference }, GROUND);
    assert_eq!(session.reference(GROUND), reference);
}

#[test]
fn an_uploaded_path_is_flown_when_complete() {
    let mut session = session();
    let choice = || Uplink::SelectTrajectory(TrajectorySelection::UploadedPath);
    let answer = say(&mut session, choice(), GROUND);
    assert_eq!(answer, acknowledged(Err(Rejection::NoPath)));
    let start_world = Vec3::new(5.0, 0.0, 1.0);
    let begin = Uplink::PathBegin { start_world, yaw: 0.0, legs: 1 };
    assert_eq!(say(&mut session, begin, GROUND), acknowledged(Ok(())));
    let leg = Leg::to(start_world + Vec3::X, 20.0);
    let upload = Uplink::PathLeg { index: 0, leg };
    assert_eq!(say(&mut session, upload, GROUND), acknowledged(Ok(())));
    assert_eq!(say(&mut session, choice(), GROUND), acknowledged(Ok(())));
    assert_eq!(session.reference(GROUND).position_world, start_world);
}

#[test]
fn telemetry_is_subscribed_within_what_the_link_carries() {
    let mut session = session();
    assert_eq!(session.telemetry_period(), 0);
    assert_eq!(say(&mut session, Uplink::Subscribe { period: 20 }, GROUND), acknowledged(Ok(())));
    assert_eq!(session.telemetry_period(), 20);
    let refused = say(&mut session, Uplink::Subscribe { period: 1 }, GROUND);
    assert!(matches!(
        &refused[..],
        [Downlink::Acknowledgement(Acknowledgement { result: Err(Rejection::Invalid { .. }), .. })]
    ));
    assert_eq!(session.telemetry_period(), 20);
    assert_eq!(say(&mut session, Uplink::Subscribe { period: 0 }, GROUND), acknowledged(Ok(())));
    assert_eq!(session.telemetry_period(), 0);
}

#[test]
fn a_fault_is_pending_until_it_is_acknowledged() {
    let mut session =
        Session::new(CONFIG, &built_in_mission().unwrap(), BUILT_IN, Some(report())).unwrap();
    let Some(Downlink::Identity(identity)) = session.next_answer() else { panic!() };
    assert!(identity.fault_pending && session.fault_pending());
    assert_eq!(session.next_answer(), Some(Downlink::ParametersInForce(BUILT_IN)));
    assert_eq!(session.next_answer(), Some(Downlink::Fault(report())), "unasked");
    let answer = say(&mut session, Uplink::FaultAcknowledge, GROUND);
    assert_eq!(answer[0], Downlink::Fault(report()));
    assert_eq!(answer[1..], acknowledged(Ok(())));
    assert!(!session.fault_pending());
    let again = say(&mut session, Uplink::FaultAcknowledge, GROUND);
    assert_eq!(again, acknowledged(Ok(())));
}

#[test]
fn answers_beyond_the_queue_are_counted() {
    let mut session = session();
    for _ in 0..ANSWERS + 3 {
        let message = Uplink::ParameterAt { index: 0 };
        session.handle(Received { sequence: 0, message }, GROUND);
    }
    assert_eq!(session.dropped(), 3);
}

fn in_force(origin: ParameterOrigin, generation: u32, changed: bool) -> Downlink {
    Downlink::ParametersInForce(ParametersInForce { origin, generation, changed })
}

/// The answers to a `Hello` without the identity.
fn asked(session: &mut Session) -> Downlink {
    say(session, Uplink::Hello, GROUND).remove(1)
}

#[test]
fn parameters_are_handed_out_to_be_kept_and_the_host_hears_the_end() {
    let mut session = session();
    say(&mut session, write("k4", 3.5), GROUND);
    assert_eq!(asked(&mut session), in_force(ParameterOrigin::BuiltIn, 0, true));
    assert_eq!(say(&mut session, Uplink::ParametersPersist, GROUND), []);
    let parameters = session.next_to_store().unwrap();
    assert_eq!(parameters, StoredParameters::of(&session.tuning));
    assert_eq!((session.next_to_store(), session.next_answer()), (None, None), "once");
    session.stored(Ok(9));
    let answers: Vec<_> = core::iter::from_fn(|| session.next_answer()).collect();
    assert_eq!(answers[0], in_force(ParameterOrigin::Stored, 9, false));
    assert_eq!(answers[1..], acknowledged(Ok(())));
    say(&mut session, write("k4", 3.75), GROUND);
    assert_eq!(asked(&mut session), in_force(ParameterOrigin::Stored, 9, true));
}

#[test]
fn forgetting_brings_the_built_in_parameters_back_at_once() {
    let mut session = session();
    let built_in = built_in_mission().unwrap().tuning.saturated.k4;
    say(&mut session, write("k4", 3.5), GROUND);
    session.take_law();
    assert_eq!(say(&mut session, Uplink::ParametersForget, GROUND), []);
    assert_eq!(session.next_to_store(), Some(StoredParameters::Forgotten));
    session.stored(Ok(2));
    assert_eq!(session.next_answer(), Some(in_force(ParameterOrigin::BuiltIn, 2, false)));
    assert_eq!(
        core::iter::from_fn(|| session.next_answer()).collect::<Vec<_>>(),
        acknowledged(Ok(()))
    );
    assert_eq!(read(&mut session, "k4"), built_in);
    assert!(session.take_law().is_some());
}

#[test]
fn nothing_arms_or_changes_while_parameters_are_stored() {
    let mut session = session();
    say(&mut session, Uplink::ParametersPersist, GROUND);
    let refused = acknowledged(Err(Rejection::NotNow));
    let others = [
        write("k4", 3.5),
        Uplink::Command(Command::Arm),
        Uplink::Command(Command::Start),
        Uplink::ParametersPersist,
        Uplink::ParametersForget,
        Uplink::SelectController(ControllerKind::RobustAdaptive),
    ];
    for begin in [false, true] {
        if begin {
            session.next_to_store().unwrap();
        }
        for message in &others {
            assert_eq!(say(&mut session, message.clone(), GROUND), refused, "{message:?}");
        }
    }
    assert_eq!(say(&mut session, Uplink::Command(Command::Disarm), GROUND), [], "is heard");
    session.stored(Ok(1));
    while session.next_answer().is_some() {}
    assert_eq!(say(&mut session, write("k4", 3.5), GROUND), acknowledged(Ok(())));
}

#[test]
fn parameters_are_stored_disarmed_only_and_not_behind_a_command() {
    let refused = acknowledged(Err(Rejection::NotNow));
    for mode in [Mode::Armed, Mode::Flying, Mode::Failsafe, Mode::Locked] {
        for message in [Uplink::ParametersPersist, Uplink::ParametersForget] {
            let progress = Progress { mode, ..GROUND };
            assert_eq!(say(&mut session(), message, progress), refused, "{mode:?}");
        }
    }
    let mut session = session();
    say(&mut session, Uplink::Command(Command::Arm), GROUND);
    assert_eq!(say(&mut session, Uplink::ParametersPersist, GROUND), refused);
    session.next_command().unwrap();
    assert_eq!(say(&mut session, Uplink::ParametersPersist, GROUND), refused);
}

#[test]
fn a_memory_that_fails_or_is_full_is_told_and_nothing_is_in_force_that_was_not() {
    for (error, rejection) in
        [(StoreError::Failed, Rejection::StorageFailed), (StoreError::Full, Rejection::StorageFull)]
    {
        let mut session = session();
        say(&mut session, write("k4", 3.5), GROUND);
        say(&mut session, Uplink::ParametersPersist, GROUND);
        session.next_to_store().unwrap();
        session.stored(Err(error));
        assert_eq!(session.next_answer(), Some(in_force(ParameterOrigin::BuiltIn, 0, true)));
        let answers: Vec<_> = core::iter::from_fn(|| session.next_answer()).collect();
        assert_eq!(answers, acknowledged(Err(rejection)));
        assert_eq!(read(&mut session, "k4"), 3.5);
    }
}

#[test]
fn what_could_not_fly_the_built_in_trajectory_is_not_kept() {
    let mut session = session();
    assert_eq!(
        say(&mut session, write("reference_acceleration_max", 1e-3), GROUND),
        acknowledged(Ok(()))
    );
    let answers = say(&mut session, Uplink::ParametersPersist, GROUND);
    let [
        Downlink::Acknowledgement(Acknowledgement {
            result: Err(Rejection::Invalid { upper, .. }),
            ..
        }),
    ] = answers[..]
    else {
        panic!("{answers:?}")
    };
    assert_eq!(upper, 1e-3);
    assert_eq!(session.next_to_store(), None);
}

#[test]
fn lock_step_is_entered_disarmed_and_idle_only() {
    let refused = acknowledged(Err(Rejection::NotNow));
    for mode in [Mode::Armed, Mode::Flying, Mode::Failsafe, Mode::Locked] {
        let mut session = session();
        let progress = Progress { mode, ..GROUND };
        assert_eq!(say(&mut session, Uplink::LockStep(true), progress), refused);
        assert_eq!(session.take_pace_request(), None);
    }
    let mut session = session();
    say(&mut session, Uplink::Command(Command::Arm), GROUND);
    assert_eq!(say(&mut session, Uplink::LockStep(true), GROUND), refused, "an Arm is on its way");
}

#[test]
fn lock_step_is_entered_stepped_and_left() {
    let mut session = session();
    let step = || Uplink::Step { uptime_ticks: 1001 };
    assert_eq!(say(&mut session, step(), GROUND), acknowledged(Err(Rejection::NotNow)));
    assert_eq!(say(&mut session, Uplink::LockStep(true), GROUND), acknowledged(Ok(())));
    assert_eq!(session.take_pace_request(), Some(PaceRequest::Enter));
    assert_eq!(session.take_pace_request(), None, "once");
    let in_step = Progress { in_step: true, ..GROUND };
    assert_eq!(say(&mut session, step(), in_step), []);
    assert_eq!(session.take_pace_request(), Some(PaceRequest::Step(1001)));
    // Repeated, since the answer was lost: the host hears where the vehicle is.
    assert_eq!(say(&mut session, Uplink::LockStep(true), in_step), acknowledged(Ok(())));
    assert_eq!(session.take_pace_request(), Some(PaceRequest::Step(1000)));
    let flying = Progress { mode: Mode::Flying, ..in_step };
    assert_eq!(say(&mut session, Uplink::LockStep(false), flying), acknowledged(Ok(())));
    assert_eq!(session.take_pace_request(), Some(PaceRequest::Leave));
    assert_eq!(say(&mut session, Uplink::LockStep(false), GROUND), acknowledged(Ok(())));
    assert_eq!(session.take_pace_request(), None);
}

#[test]
fn commands_that_wait_at_the_end_of_lock_step_are_refused() {
    let mut session = session();
    let in_step = Progress { in_step: true, ..GROUND };
    session.keep_pace(true);
    say(&mut session, Uplink::Command(Command::Arm), in_step);
    session.keep_pace(true);
    assert_eq!(session.next_answer(), None);
    assert_eq!(session.next_command(), Some(Command::Arm));
    say(&mut session, Uplink::Command(Command::Start), in_step);
    session.keep_pace(false);
    assert_eq!(session.next_answer(), acknowledged(Err(Rejection::NotNow)).pop());
    session.answered(Ok(Mode::Armed));
    assert_eq!(session.next_command(), None);
    // By the clock they are obeyed as ever.
    say(&mut session, Uplink::Command(Command::Disarm), GROUND);
    session.keep_pace(false);
    assert_eq!(session.next_command(), Some(Command::Disarm));
}
