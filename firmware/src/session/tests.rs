//! Sessions with a host, message by message.

use std::boxed::Box;
use std::vec::Vec;

use ctrl_core::mode::{Mode, Refusal};
use ctrl_core::trajectory::{HoverConfig, Leg, TrajectoryConfig};
use ctrl_core::vehicle::VehicleState;
use link::{
    ControllerKind, FaultKind, Guidance, ParameterOrigin, REGISTERS, Secret, TrajectorySelection,
};

use super::*;
use crate::parameter_store::StoreError;
use crate::scenario::{BUILT_IN_MISSION, BuiltInMission};
use crate::stored_parameters::StoredParameters;
use crate::stored_signing::{AHEAD, Change, StoredSigning};

const CONFIG: SessionConfig = SessionConfig {
    board: "test bench",
    sample_valid: 5,
    reference_timeout: 100,
    telemetry_period_min: 2,
};

const GROUND: ControlStatus = ControlStatus { mode: Mode::Disarmed, flight_tick: 0, uptime: 1000 };
const FLYING: ControlStatus = ControlStatus { mode: Mode::Flying, flight_tick: 7, uptime: 2000 };

const BUILT_IN: ParametersInForce =
    ParametersInForce { origin: ParameterOrigin::BuiltIn, generation: 0, changed: false };

/// A session in memory of its own, which outlives the test.
fn begin(
    mission: &BuiltInMission,
    in_force: ParametersInForce,
    fault: Option<FaultReport>,
) -> HostSession<'static> {
    let memory = Box::leak(Box::new(SessionMemory::new()));
    let BuiltInMission { tuning, trajectory } = mission;
    HostSession::new(memory, CONFIG, tuning, trajectory, in_force, fault).unwrap()
}

/// A session that has sent its handshake.
fn session() -> HostSession<'static> {
    let mission = BuiltInMission {
        tuning: Tuning { kind: ControllerKind::Saturated, ..BUILT_IN_MISSION.tuning },
        trajectory: TrajectoryConfig::Hover(hover()),
    };
    let mut session = begin(&mission, BUILT_IN, None);
    assert!(matches!(session.next_answer(), Some(Downlink::Identity(_))));
    assert_eq!(session.next_answer(), Some(Downlink::ParametersInForce(BUILT_IN)));
    session
}

fn hover() -> HoverConfig {
    HoverConfig { position_world: Vec3::new(0.0, 0.0, 2.0), yaw: 0.0 }
}

/// Sends `message` to a vehicle whose ticks begin by the timer, and returns the answers.
fn send(session: &mut HostSession, message: Uplink, status: ControlStatus) -> Vec<Downlink> {
    send_by(TickOrigin::Timer, session, message, status)
}

fn send_by(
    origin: TickOrigin,
    session: &mut HostSession,
    message: Uplink,
    status: ControlStatus,
) -> Vec<Downlink> {
    session.handle(&Received { sequence: 42, message }, status, origin);
    core::iter::from_fn(|| session.next_answer()).collect()
}

fn acknowledged(result: Result<(), Rejection>) -> Vec<Downlink> {
    [Downlink::Acknowledgement(Acknowledgement { sequence: 42, result })].into()
}

fn write(name: &str, value: f32) -> Uplink {
    Uplink::ParameterWrite { name: copy(name), value }
}

fn read(session: &mut HostSession, name: &str) -> f32 {
    match &send(session, Uplink::ParameterRead { name: copy(name) }, FLYING)[..] {
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
fn identifies_itself_after_the_start_and_at_a_handshake() {
    let mut session = begin(&BUILT_IN_MISSION, STORED, None);
    assert!(!session.greeted() && session.has_answers());
    let Some(Downlink::Identity(greeting)) = session.next_answer() else { panic!() };
    assert_eq!((&*greeting.board, greeting.uptime_ticks), ("test bench", 0));
    assert_eq!(greeting.controller, BUILT_IN_MISSION.tuning.kind);
    assert_eq!(session.next_answer(), Some(Downlink::ParametersInForce(STORED)));
    let [Downlink::Identity(identity), in_force] = &send(&mut session, Uplink::Hello, FLYING)[..]
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
    assert_eq!(send(&mut session, Uplink::State { tick: 0, state }, GROUND), []);
    assert_eq!(session.sample(1000), Some(StateSample { state, age_ticks: 0 }));
    assert_eq!(session.sample(1004), Some(StateSample { state, age_ticks: 4 }));
    assert_eq!(session.sample(1005), None);
}

#[test]
fn commands_wait_for_the_control_group_and_are_answered_in_order() {
    let mut session = session();
    for (sequence, command) in [(1, Command::Arm), (2, Command::Start)] {
        session.handle(
            &Received { sequence, message: Uplink::Command(command) },
            GROUND,
            TickOrigin::Timer,
        );
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
        assert_eq!(send(&mut session, Uplink::Command(Command::Stop), GROUND), []);
    }
    let refused = send(&mut session, Uplink::Command(Command::Stop), GROUND);
    assert_eq!(refused, acknowledged(Err(Rejection::NotNow)));
}

#[test]
fn a_parameter_is_written_read_back_and_reaches_the_law() {
    let mut session = session();
    assert!(session.take_law().is_none());
    let answer = send(&mut session, write("k4.x", 3.5), GROUND);
    assert_eq!(answer, acknowledged(Ok(())));
    assert_eq!(read(&mut session, "k4.x"), 3.5);
    let Some(AnyController::Saturated(law)) = session.take_law() else { panic!() };
    assert_eq!(law.config().k4.x, 3.5);
    assert!(session.take_law().is_none(), "once");
}

#[test]
fn a_refused_parameter_changes_nothing_and_names_the_bound() {
    let mut session = session();
    let before = read(&mut session, "k4.x");
    let answer = send(&mut session, write("k4.x", -1.0), GROUND);
    let [Downlink::Acknowledgement(Acknowledgement { result: Err(rejection), .. })] = &answer[..]
    else {
        panic!("{answer:?}")
    };
    let Rejection::Invalid { parameter, value, lower, .. } = rejection else { panic!() };
    assert_eq!((&**parameter, *value, *lower), ("k4[0]", -1.0, 0.0));
    assert_eq!(read(&mut session, "k4.x"), before);
    assert!(session.take_law().is_none());
    let unknown = send(&mut session, write("k9", 1.0), GROUND);
    assert_eq!(unknown, acknowledged(Err(Rejection::UnknownParameter)));
}

#[test]
fn every_parameter_can_be_listed() {
    let mut session = session();
    let mut names = Vec::new();
    loop {
        let index = names.len() as u16;
        match &send(&mut session, Uplink::ParameterAt { index }, GROUND)[..] {
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
        write("k4.x", 3.5),
        Uplink::SelectController(ControllerKind::RobustAdaptive),
        Uplink::SelectTrajectory(TrajectorySelection::Stream),
        Uplink::PathBegin { start_world: Vec3::ZERO, yaw: 0.0, legs: 1 },
    ];
    for setting in settings {
        let answer = send(&mut session, setting, FLYING);
        assert_eq!(answer, acknowledged(Err(Rejection::NotNow)));
    }
    assert!(session.take_law().is_none());
}

#[test]
fn the_controller_is_chosen_by_the_host() {
    let mut session = session();
    let choice = Uplink::SelectController(ControllerKind::RobustAdaptive);
    assert_eq!(send(&mut session, choice, GROUND), acknowledged(Ok(())));
    assert!(matches!(session.take_law(), Some(AnyController::RobustAdaptive(..))));
}

#[test]
fn a_trajectory_must_suit_the_controller() {
    let mut session = session();
    let place = HoverConfig { position_world: Vec3::new(1.0, 2.0, 3.0), yaw: 0.0 };
    let choice = Uplink::SelectTrajectory(TrajectorySelection::Hover(place));
    assert_eq!(send(&mut session, choice, GROUND), acknowledged(Ok(())));
    assert_eq!(session.reference(GROUND).position_world, place.position_world);
    let too_fast = ctrl_core::trajectory::LemniscateConfig {
        centre_world: Vec3::ZERO,
        amplitude_x: 4.0,
        amplitude_y: 2.0,
        angular_rate: 1.0,
        yaw: 0.0,
    };
    let choice = Uplink::SelectTrajectory(TrajectorySelection::Lemniscate(too_fast));
    let answer = send(&mut session, choice, GROUND);
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
    send(&mut session, Uplink::Reference { tick: 0, reference }, GROUND);
    assert_eq!(session.reference(GROUND).position_world, hover().position_world);
    let choice = Uplink::SelectTrajectory(TrajectorySelection::Stream);
    assert_eq!(send(&mut session, choice, GROUND), acknowledged(Ok(())));
    send(&mut session, Uplink::Reference { tick: 0, reference }, GROUND);
    assert_eq!(session.reference(GROUND), reference);
}

#[test]
fn an_uploaded_path_is_flown_when_complete() {
    let mut session = session();
    let choice = || Uplink::SelectTrajectory(TrajectorySelection::UploadedPath);
    let answer = send(&mut session, choice(), GROUND);
    assert_eq!(answer, acknowledged(Err(Rejection::NoPath)));
    let start_world = Vec3::new(5.0, 0.0, 1.0);
    let begin = Uplink::PathBegin { start_world, yaw: 0.0, legs: 1 };
    assert_eq!(send(&mut session, begin, GROUND), acknowledged(Ok(())));
    let leg = Leg::to(start_world + Vec3::X, 20.0);
    let upload = Uplink::PathLeg { index: 0, leg };
    assert_eq!(send(&mut session, upload, GROUND), acknowledged(Ok(())));
    assert_eq!(send(&mut session, choice(), GROUND), acknowledged(Ok(())));
    assert_eq!(session.reference(GROUND).position_world, start_world);
}

#[test]
fn telemetry_is_subscribed_within_what_the_link_carries() {
    let mut session = session();
    assert_eq!(session.telemetry_period(), 0);
    assert_eq!(send(&mut session, Uplink::Subscribe { period: 20 }, GROUND), acknowledged(Ok(())));
    assert_eq!(session.telemetry_period(), 20);
    let refused = send(&mut session, Uplink::Subscribe { period: 1 }, GROUND);
    assert!(matches!(
        &refused[..],
        [Downlink::Acknowledgement(Acknowledgement { result: Err(Rejection::Invalid { .. }), .. })]
    ));
    assert_eq!(session.telemetry_period(), 20);
    assert_eq!(send(&mut session, Uplink::Subscribe { period: 0 }, GROUND), acknowledged(Ok(())));
    assert_eq!(session.telemetry_period(), 0);
}

#[test]
fn a_fault_is_pending_until_it_is_acknowledged() {
    let mut session = begin(&BUILT_IN_MISSION, BUILT_IN, Some(report()));
    let Some(Downlink::Identity(identity)) = session.next_answer() else { panic!() };
    assert!(identity.fault_pending && session.fault_pending());
    assert_eq!(session.next_answer(), Some(Downlink::ParametersInForce(BUILT_IN)));
    assert_eq!(session.next_answer(), Some(Downlink::Fault(report())), "unasked");
    let answer = send(&mut session, Uplink::FaultAcknowledge, GROUND);
    assert_eq!(answer[0], Downlink::Fault(report()));
    assert_eq!(answer[1..], acknowledged(Ok(())));
    assert!(!session.fault_pending());
    let again = send(&mut session, Uplink::FaultAcknowledge, GROUND);
    assert_eq!(again, acknowledged(Ok(())));
}

#[test]
fn answers_beyond_the_queue_are_counted() {
    let mut session = session();
    for _ in 0..ANSWERS + 3 {
        let message = Uplink::ParameterAt { index: 0 };
        session.handle(&Received { sequence: 0, message }, GROUND, TickOrigin::Timer);
    }
    assert_eq!(session.dropped(), 3);
}

fn in_force(origin: ParameterOrigin, generation: u32, changed: bool) -> Downlink {
    Downlink::ParametersInForce(ParametersInForce { origin, generation, changed })
}

/// The answers to a `Hello` without the identity.
fn asked(session: &mut HostSession) -> Downlink {
    send(session, Uplink::Hello, GROUND).remove(1)
}

#[test]
fn parameters_to_be_stored_are_handed_out_once_and_the_end_is_answered() {
    let mut session = session();
    send(&mut session, write("k4.x", 3.5), GROUND);
    assert_eq!(asked(&mut session), in_force(ParameterOrigin::BuiltIn, 0, true));
    assert_eq!(send(&mut session, Uplink::ParametersPersist, GROUND), []);
    let parameters = StoredParameters::of(&session.tuning);
    assert_eq!(session.next_to_store(), Some(Change::Parameters(parameters)));
    assert_eq!((session.next_to_store(), session.next_answer()), (None, None), "once");
    session.stored(Ok(9));
    let answers: Vec<_> = core::iter::from_fn(|| session.next_answer()).collect();
    assert_eq!(answers[0], in_force(ParameterOrigin::Stored, 9, false));
    assert_eq!(answers[1..], acknowledged(Ok(())));
    send(&mut session, write("k4.x", 3.75), GROUND);
    assert_eq!(asked(&mut session), in_force(ParameterOrigin::Stored, 9, true));
}

#[test]
fn forgetting_brings_the_built_in_parameters_back_at_once() {
    let mut session = session();
    let built_in = BUILT_IN_MISSION.tuning.saturated.k4.x;
    send(&mut session, write("k4.x", 3.5), GROUND);
    session.take_law();
    assert_eq!(send(&mut session, Uplink::ParametersForget, GROUND), []);
    assert_eq!(session.next_to_store(), Some(Change::Parameters(StoredParameters::Forgotten)));
    session.stored(Ok(2));
    assert_eq!(session.next_answer(), Some(in_force(ParameterOrigin::BuiltIn, 2, false)));
    assert_eq!(
        core::iter::from_fn(|| session.next_answer()).collect::<Vec<_>>(),
        acknowledged(Ok(()))
    );
    assert_eq!(read(&mut session, "k4.x"), built_in);
    assert!(session.take_law().is_some());
}

#[test]
fn nothing_arms_or_changes_while_parameters_are_stored() {
    let mut session = session();
    send(&mut session, Uplink::ParametersPersist, GROUND);
    let refused = acknowledged(Err(Rejection::NotNow));
    let others = [
        write("k4.x", 3.5),
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
            assert_eq!(send(&mut session, message.clone(), GROUND), refused, "{message:?}");
        }
    }
    assert_eq!(send(&mut session, Uplink::Command(Command::Disarm), GROUND), [], "is queued");
    session.stored(Ok(1));
    while session.next_answer().is_some() {}
    assert_eq!(send(&mut session, write("k4.x", 3.5), GROUND), acknowledged(Ok(())));
}

#[test]
fn parameters_are_stored_disarmed_only_and_not_behind_a_command() {
    let refused = acknowledged(Err(Rejection::NotNow));
    for mode in [Mode::Armed, Mode::Flying, Mode::Failsafe, Mode::Locked] {
        for message in [Uplink::ParametersPersist, Uplink::ParametersForget] {
            let status = ControlStatus { mode, ..GROUND };
            assert_eq!(send(&mut session(), message, status), refused, "{mode:?}");
        }
    }
    let mut session = session();
    send(&mut session, Uplink::Command(Command::Arm), GROUND);
    assert_eq!(send(&mut session, Uplink::ParametersPersist, GROUND), refused);
    session.next_command().unwrap();
    assert_eq!(send(&mut session, Uplink::ParametersPersist, GROUND), refused);
}

#[test]
fn a_memory_that_fails_or_is_full_is_reported_and_changes_nothing() {
    for (error, rejection) in
        [(StoreError::Failed, Rejection::StorageFailed), (StoreError::Full, Rejection::StorageFull)]
    {
        let mut session = session();
        send(&mut session, write("k4.x", 3.5), GROUND);
        send(&mut session, Uplink::ParametersPersist, GROUND);
        session.next_to_store().unwrap();
        session.stored(Err(error));
        assert_eq!(session.next_answer(), Some(in_force(ParameterOrigin::BuiltIn, 0, true)));
        let answers: Vec<_> = core::iter::from_fn(|| session.next_answer()).collect();
        assert_eq!(answers, acknowledged(Err(rejection)));
        assert_eq!(read(&mut session, "k4.x"), 3.5);
    }
}

#[test]
fn a_key_is_in_force_once_it_is_stored_and_leaves_the_parameters_alone() {
    let message = |key| Uplink::SigningKey { key: Secret(key), timestamp: 5 };
    let mut session = session();
    send(&mut session, write("k4.x", 3.5), GROUND);
    assert_eq!(send(&mut session, message([1; 32]), GROUND), []);
    let stored = StoredSigning { key: [1; 32], timestamp: 5 + AHEAD };
    assert_eq!(session.next_to_store(), Some(Change::Signing(Some(stored))));
    assert_eq!(session.take_signing(), None);
    session.stored(Ok(4));
    let answers: Vec<_> = core::iter::from_fn(|| session.next_answer()).collect();
    assert_eq!(answers, acknowledged(Ok(())));
    let change = SigningChange { stored: Some(stored), timestamp: Some(5) };
    assert_eq!((session.take_signing(), session.take_signing()), (Some(change), None));
    assert_eq!(asked(&mut session), in_force(ParameterOrigin::BuiltIn, 4, true));
    for (status, error) in [(GROUND, StoreError::Failed), (FLYING, StoreError::Full)] {
        send(&mut session, message([0; 32]), status);
        if status == GROUND {
            assert_eq!(session.next_to_store(), Some(Change::Signing(None)));
            session.stored(Err(error));
        }
        while session.next_answer().is_some() {}
        assert_eq!(session.take_signing(), None);
    }
    // A later time is stored without an answer, and not again once the memory is full.
    session.keep_signing_time(stored, FLYING);
    assert_eq!(session.next_to_store(), None);
    for (result, change) in [(Ok(5), true), (Err(StoreError::Full), false)] {
        session.keep_signing_time(stored, GROUND);
        assert_eq!(session.next_to_store(), Some(Change::Signing(Some(stored))));
        session.stored(result);
        assert_eq!((session.take_signing().is_some(), session.next_answer()), (change, None));
    }
    session.keep_signing_time(stored, GROUND);
    assert_eq!(session.next_to_store(), None);
}

#[test]
fn the_reference_of_the_next_tick_is_told_once_to_a_host_that_asks() {
    let mut session = session();
    assert_eq!(send(&mut session, Uplink::GuidanceRead, GROUND), []);
    let reference = Reference::hover(Vec3::X);
    for told in [true, false] {
        session.guide(NavigationMode::Land, &reference);
        let guidance = Guidance { law_changes: 0, navigation: NavigationMode::Land, reference };
        assert_eq!(session.next_answer(), told.then_some(Downlink::Guidance(guidance)));
    }
    send(&mut session, write("k4.x", 3.5), GROUND);
    send(&mut session, Uplink::GuidanceRead, GROUND);
    session.guide(NavigationMode::Hold, &reference);
    let answer = session.next_answer();
    assert!(
        matches!(answer, Some(Downlink::Guidance(Guidance { law_changes: 1, .. }))),
        "{answer:?}"
    );
}

#[test]
fn a_set_that_cannot_fly_the_built_in_trajectory_is_not_stored() {
    let mut session = session();
    assert_eq!(
        send(&mut session, write("reference_acceleration_max", 1e-3), GROUND),
        acknowledged(Ok(()))
    );
    let answers = send(&mut session, Uplink::ParametersPersist, GROUND);
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
        let status = ControlStatus { mode, ..GROUND };
        assert_eq!(send(&mut session, Uplink::LockStep(true), status), refused);
        assert_eq!(session.take_lock_step_request(), None);
    }
    let mut session = session();
    send(&mut session, Uplink::Command(Command::Arm), GROUND);
    assert_eq!(send(&mut session, Uplink::LockStep(true), GROUND), refused, "an Arm is on its way");
}

#[test]
fn lock_step_is_entered_stepped_and_left() {
    let mut session = session();
    let step = || Uplink::Step { uptime_ticks: 1001 };
    let in_lock_step = |session: &mut HostSession, message| {
        send_by(TickOrigin::LockStep, session, message, GROUND)
    };
    assert_eq!(send(&mut session, step(), GROUND), acknowledged(Err(Rejection::NotNow)));
    assert_eq!(send(&mut session, Uplink::LockStep(true), GROUND), acknowledged(Ok(())));
    assert_eq!(session.take_lock_step_request(), Some(LockStepRequest::Enter));
    assert_eq!(session.take_lock_step_request(), None, "once");
    assert_eq!(in_lock_step(&mut session, step()), []);
    assert_eq!(session.take_lock_step_request(), Some(LockStepRequest::Step(1001)));
    // Repeated, since the answer was lost: it is announced again, whatever is pending.
    send_by(TickOrigin::LockStep, &mut session, Uplink::Command(Command::Arm), GROUND);
    assert_eq!(in_lock_step(&mut session, Uplink::LockStep(true)), acknowledged(Ok(())));
    assert_eq!(session.take_lock_step_request(), Some(LockStepRequest::Enter));
    let left = send_by(TickOrigin::LockStep, &mut session, Uplink::LockStep(false), FLYING);
    assert_eq!(left, acknowledged(Ok(())));
    assert_eq!(session.take_lock_step_request(), Some(LockStepRequest::Leave));
    assert_eq!(send(&mut session, Uplink::LockStep(false), GROUND), acknowledged(Ok(())));
    assert_eq!(session.take_lock_step_request(), None);
}

#[test]
fn commands_that_wait_at_the_end_of_lock_step_are_refused() {
    let mut session = session();
    send(&mut session, Uplink::Command(Command::Arm), GROUND);
    assert_eq!(session.next_command(), Some(Command::Arm));
    send(&mut session, Uplink::Command(Command::Start), GROUND);
    session.refuse_commands();
    assert_eq!(session.next_answer(), acknowledged(Err(Rejection::NotNow)).pop());
    session.answered(Ok(Mode::Armed));
    assert_eq!(session.next_answer(), acknowledged(Ok(())).pop());
    assert_eq!(session.next_command(), None);
    // By the timer they are carried out as ever.
    send(&mut session, Uplink::Command(Command::Disarm), GROUND);
    assert_eq!(session.next_command(), Some(Command::Disarm));
}

/// A sample at `x` (m) of a tick.
fn sample_at(x: f32, tick: u64) -> Uplink {
    Uplink::State { tick, state: VehicleState::at_rest(Vec3::X * x) }
}

/// Position along x (m) of the sample in use.
fn x_in_use(session: &HostSession) -> f32 {
    session.sample(FLYING.uptime).unwrap().state.position_world.x
}

#[test]
fn in_flight_a_sample_older_than_the_newest_is_dropped_and_counted() {
    let mut session = session();
    for (x, tick) in [(1.0, 7), (2.0, 9), (3.0, 8), (4.0, 6)] {
        assert_eq!(send(&mut session, sample_at(x, tick), FLYING), []);
    }
    assert_eq!((x_in_use(&session), session.late()), (2.0, 2));
    send(&mut session, sample_at(5.0, 9), FLYING);
    assert_eq!(x_in_use(&session), 5.0, "a tick may be repeated");
}

#[test]
fn a_late_sample_does_not_renew_the_age_of_the_one_in_use() {
    let mut session = session();
    send(&mut session, sample_at(1.0, 9), FLYING);
    let later = ControlStatus { uptime: FLYING.uptime + 4, ..FLYING };
    send(&mut session, sample_at(2.0, 8), later);
    assert_eq!(session.sample(later.uptime).unwrap().age_ticks, 4);
    assert_eq!(session.sample(later.uptime + 1), None);
}

#[test]
fn the_ticks_of_references_have_an_order_of_their_own() {
    let mut session = session();
    let stream = Uplink::SelectTrajectory(TrajectorySelection::Stream);
    send(&mut session, stream, GROUND);
    let place = |x: f32| Reference::hover(Vec3::X * x);
    send(&mut session, sample_at(1.0, 500), FLYING);
    for (x, tick) in [(1.0, 20), (2.0, 19)] {
        send(&mut session, Uplink::Reference { tick, reference: place(x) }, FLYING);
    }
    assert_eq!((session.reference(FLYING), session.late()), (place(1.0), 1));
}

#[test]
fn a_handshake_and_a_new_flight_let_ticks_begin_anew() {
    let mut session = session();
    send(&mut session, sample_at(1.0, 5000), FLYING);
    send(&mut session, sample_at(2.0, 0), FLYING);
    assert_eq!(x_in_use(&session), 1.0, "a host that restarts without a handshake");
    send(&mut session, Uplink::Hello, FLYING);
    send(&mut session, sample_at(3.0, 0), FLYING);
    assert_eq!(x_in_use(&session), 3.0);
    send(&mut session, sample_at(4.0, 5000), FLYING);
    let ground = ControlStatus { uptime: FLYING.uptime, ..GROUND };
    send(&mut session, sample_at(5.0, 0), ground);
    send(&mut session, sample_at(6.0, 1), FLYING);
    assert_eq!((x_in_use(&session), session.late()), (6.0, 1));
}
