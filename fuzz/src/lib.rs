//! Shared parts of the fuzz targets: a session without hardware, and the bounds of every law.

pub mod station;

use ctrl_core::controller::{AdaptiveController, AnyController, TrackingController};
use ctrl_core::mode::Mode;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use firmware::exchange::ControlStatus;
use firmware::scenario::BUILT_IN_MISSION;
use firmware::session::{HostSession, SessionConfig, SessionMemory};
use firmware::tick_source::TickOrigin;
use glam::Vec3;
use link::{Acknowledgement, Downlink, ParametersInForce, Received, Rejection, Uplink};

/// A vehicle on the ground at some tick.
pub const GROUND: ControlStatus =
    ControlStatus { mode: Mode::Disarmed, flight_tick: 0, uptime: 1000 };

/// A session of the image's vehicle after its handshake.
///
/// # Panics
/// If the image's own configuration is refused.
#[must_use]
pub fn session(memory: &mut SessionMemory) -> HostSession<'_> {
    let config = SessionConfig {
        board: "fuzz",
        sample_valid: 5,
        reference_timeout: 100,
        telemetry_period_min: 2,
    };
    let (mission, in_force) = (&BUILT_IN_MISSION, ParametersInForce::default());
    let session =
        HostSession::new(memory, config, &mission.tuning, &mission.trajectory, in_force, None);
    let mut session = session.unwrap();
    while session.next_answer().is_some() {}
    session
}

/// Sends `message` and returns the one answer.
///
/// # Panics
/// Unless there is exactly one.
pub fn send(session: &mut HostSession, message: Uplink, status: ControlStatus) -> Downlink {
    session.handle(&Received { sequence: 42, message }, status, TickOrigin::Timer);
    let answer = session.next_answer().expect("an answer");
    assert_eq!(session.next_answer(), None);
    answer
}

/// Sends `message`, which is answered by an acknowledgement.
///
/// # Panics
/// If it is answered by anything else.
pub fn ask(
    session: &mut HostSession,
    message: Uplink,
    status: ControlStatus,
) -> Result<(), Rejection> {
    match send(session, message, status) {
        Downlink::Acknowledgement(Acknowledgement { sequence: 42, result }) => result,
        other => panic!("{other:?}"),
    }
}

/// Steps the law a few times and asserts that each wrench is finite and inside its bounds.
///
/// # Panics
/// If one is not.
pub fn assert_bounded(law: &AnyController, reference: &Reference) {
    let (bounds, mut state) = (law.bounds(), law.initial_state());
    let here = Vec3::new(1.0, -2.0, 0.5);
    for _ in 0..3 {
        let wrench = law.step(&mut state, &VehicleState::at_rest(here), reference).wrench;
        let torque = wrench.torque_body;
        assert!(wrench.thrust.is_finite() && torque.is_finite(), "{wrench:?}");
        assert!((bounds.thrust_min..=bounds.thrust_max).contains(&wrench.thrust), "{wrench:?}");
        assert!(torque.abs().cmple(bounds.torque_max).all(), "{wrench:?}");
    }
}
