//! What the fuzz targets share: a session without hardware, and what every law promises.

use ctrl_core::controller::{AdaptiveController, AnyController, TrackingController};
use ctrl_core::mode::Mode;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use firmware::scenario::built_in_mission;
use firmware::session::{Progress, Session, SessionConfig};
use glam::Vec3;
use link::{Acknowledgement, Downlink, ParametersInForce, Received, Rejection, Uplink};

/// A vehicle on the ground at some tick.
pub const GROUND: Progress =
    Progress { mode: Mode::Disarmed, flight_tick: 0, uptime: 1000, in_step: false };

/// A session of the image's vehicle after its greeting.
///
/// # Panics
/// If the image's own configuration is refused.
#[must_use]
pub fn session() -> Session {
    let config = SessionConfig {
        board: "fuzz",
        sample_valid: 5,
        reference_timeout: 100,
        telemetry_period_min: 2,
    };
    let mut session =
        Session::new(config, &built_in_mission().unwrap(), ParametersInForce::default(), None)
            .unwrap();
    while session.next_answer().is_some() {}
    session
}

/// Says `message` and returns the one answer.
///
/// # Panics
/// Unless there is exactly one.
pub fn say(session: &mut Session, message: Uplink, progress: Progress) -> Downlink {
    session.handle(Received { sequence: 42, message }, progress);
    let answer = session.next_answer().expect("an answer");
    assert_eq!(session.next_answer(), None);
    answer
}

/// Says `message`, which is answered by an acknowledgement.
///
/// # Panics
/// If it is answered by anything else.
pub fn ask(session: &mut Session, message: Uplink, progress: Progress) -> Result<(), Rejection> {
    match say(session, message, progress) {
        Downlink::Acknowledgement(Acknowledgement { sequence: 42, result }) => result,
        other => panic!("{other:?}"),
    }
}

/// Steps the law a few times and asserts that each wrench is finite and inside its bounds.
///
/// # Panics
/// If one is not.
pub fn assert_bounded(law: AnyController, reference: &Reference) {
    let (bounds, mut state) = (law.bounds(), law.initial_state());
    let here = Vec3::new(1.0, -2.0, 0.5);
    for _ in 0..3 {
        let wrench = law.step(&mut state, &VehicleState::at_rest(here), reference).wrench;
        let torque = wrench.torque_body;
        assert!(wrench.thrust.is_finite() && torque.is_finite(), "{wrench:?}");
        assert!((bounds.thrust_min..=bounds.thrust_max).contains(&wrench.thrust), "{wrench:?}");
        assert!(torque.abs().max_element() <= bounds.torque_max, "{wrench:?}");
    }
}
