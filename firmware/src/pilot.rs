//! The vehicle behind MAVLink: the parameters of the link's session, the supervisor of the control group,
//! and the modes of a commanded flight.
//!
//! A [`Pilot`] is memory of its own; [`PilotedVehicle`] lends it the session while a message is handled.
//! There is one parameter store and one supervisor, whichever protocol speaks.

use ctrl_core::controller::{AdaptiveController, AnyController, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::mode::navigation::{
    Navigation, NavigationConfig, NavigationEvent, NavigationRefusal, Navigator, Request,
};
use ctrl_core::mode::safety::SafetyReport;
use ctrl_core::mode::{Command, Mode, Refusal};
use ctrl_core::setpoint::{Setpoint, ShaperConfig};
use ctrl_core::vehicle::VehicleState;
use heapless::Deque;
use link::Rejection;
use mavlink_vehicle::{ParameterRefusal, Vehicle, View};

use crate::exchange::ControlStatus;
use crate::session::HostSession;

/// Events that wait for the protocol.
const EVENTS: usize = 8;

/// Modes, commands and events of a vehicle that is flown by commands.
#[derive(Clone, Debug)]
pub struct Pilot {
    navigator: Navigator,
    /// Command for the control group that it has not taken.
    waiting: Option<Queued>,
    /// Command that the control group has taken.
    in_control: Option<Queued>,
    answer: Option<Result<Mode, Refusal>>,
    events: Deque<NavigationEvent, EVENTS>,
}

/// A command and who gave it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Queued {
    command: Command,
    /// From a station, which waits for the answer; otherwise from the navigator.
    from_station: bool,
}

impl Pilot {
    /// On the ground, with references that `law` accepts.
    ///
    /// # Errors
    /// Names what the navigation or the law refuses.
    pub fn new(config: &NavigationConfig, law: &AnyController) -> Result<Self, ConfigError> {
        let shaper = &config.shaper;
        law.accept_limits(shaper.acceleration_max, shaper.step_period)?;
        Ok(Self {
            navigator: Navigator::new(config)?,
            waiting: None,
            in_control: None,
            answer: None,
            events: Deque::new(),
        })
    }

    /// Moderate limits for a vehicle under `law`: all of its `M_p`, and the speeds of a small vehicle near
    /// people.
    #[must_use]
    pub fn moderate(law: &AnyController) -> NavigationConfig {
        NavigationConfig {
            shaper: ShaperConfig {
                step_period: law.step_period(),
                acceleration_max: law.reference_acceleration_max(),
                speed_max: 3.0,
                climb_max: 1.5,
                descent_max: 1.0,
                yaw_rate_max: 0.6,
                smoothing_time: 0.1,
            },
            take_off_altitude: 2.5,
            return_altitude: 5.0,
            land_speed: 0.5,
            acceptance_radius: 0.4,
            setpoint_timeout: 0.5,
        }
    }

    /// The modes.
    #[must_use]
    pub fn navigator(&self) -> &Navigator {
        &self.navigator
    }

    /// Asks the navigation for something, as a station does.
    ///
    /// # Errors
    /// The reason for a refusal.
    pub fn request(&mut self, mode: Mode, request: Request) -> Result<(), NavigationRefusal> {
        self.navigator.request(mode, request)
    }

    /// Asks the supervisor for something, as the remote control does; dropped while another command waits.
    pub fn order(&mut self, command: Command) {
        if self.waiting.is_none() {
            self.waiting = Some(Queued { command, from_station: false });
        }
    }

    /// Takes a set-point of the remote control; it is followed in Offboard.
    ///
    /// # Errors
    /// Names a number that is out of its range.
    pub fn stream(&mut self, setpoint: Setpoint) -> Result<(), ConfigError> {
        self.navigator.stream(setpoint)
    }

    /// Follows the reaction to hazards of the tick that ended in `mode`, before [`step`](Self::step), and
    /// tells a station what has come up.
    pub fn react(&mut self, mode: Mode, safety: &SafetyReport) {
        if !safety.raised.is_empty() {
            let event = NavigationEvent::HazardRaised(safety.raised, safety.reaction);
            // A station that does not listen misses the newest.
            let _ = self.events.push_back(event);
        }
        self.navigator.react(mode, safety.reaction);
    }

    /// The reference of the next tick, after the one that ended in `mode`; commands that follow from it are
    /// queued.
    pub fn step(&mut self, mode: Mode, vehicle: Option<&VehicleState>) -> Navigation {
        let navigation = self.navigator.step(mode, vehicle);
        if let Some(event) = navigation.event {
            // A station that does not listen misses the newest.
            let _ = self.events.push_back(event);
        }
        if let Some(command) = navigation.command
            && self.waiting.is_none()
            && self.in_control.is_none()
        {
            self.waiting = Some(Queued { command, from_station: false });
        }
        navigation
    }

    /// The next command for the control group, once the one before is [answered](Self::answered).
    pub fn next_command(&mut self) -> Option<Command> {
        if self.in_control.is_some() {
            return None;
        }
        self.in_control = self.waiting.take();
        self.in_control.map(|queued| queued.command)
    }

    /// Takes the control group's answer, if the command was one of the pilot's.
    pub fn answered(&mut self, answer: Result<Mode, Refusal>) {
        match self.in_control.take() {
            Some(Queued { from_station: true, .. }) => self.answer = Some(answer),
            Some(Queued { command: Command::Start, .. }) if answer.is_err() => {
                self.navigator.start_refused();
            }
            _ => {}
        }
    }

    /// Follows a change of the law: references stay inside its `M_p`.
    ///
    /// # Errors
    /// When the shaping cannot use the bound.
    fn follow(&mut self, law: &AnyController) -> Result<(), ConfigError> {
        let mut config = *self.navigator.config();
        config.shaper.acceleration_max = law.reference_acceleration_max();
        self.navigator.reconfigure(&config)
    }
}

/// A pilot with everything that a message may read or change.
#[derive(Debug)]
pub struct PilotedVehicle<'p, 's, 'm> {
    /// The pilot.
    pub pilot: &'p mut Pilot,
    /// The session, for its parameters.
    pub session: &'s mut HostSession<'m>,
    /// State of the control group.
    pub status: ControlStatus,
    /// The state for telemetry.
    pub view: View,
}

impl Vehicle for PilotedVehicle<'_, '_, '_> {
    fn view(&self) -> View {
        self.view
    }

    fn navigator(&mut self) -> &mut Navigator {
        &mut self.pilot.navigator
    }

    fn command(&mut self, command: Command) -> Result<(), Refusal> {
        // Replaces what the navigator asked for: a station comes first.
        self.pilot.waiting = Some(Queued { command, from_station: true });
        Ok(())
    }

    fn take_answer(&mut self) -> Option<Result<Mode, Refusal>> {
        self.pilot.answer.take()
    }

    fn take_event(&mut self) -> Option<NavigationEvent> {
        self.pilot.events.pop_front()
    }

    fn parameter_count(&self) -> u16 {
        self.session.parameter_count()
    }

    fn parameter_at(&self, index: u16) -> Option<(&'static str, f32)> {
        self.session.parameter_at(index)
    }

    fn write_parameter(&mut self, name: &str, value: f32) -> Result<(), ParameterRefusal> {
        let before = (0..).map_while(|index| self.parameter_at(index));
        let before = before.into_iter().find(|parameter| parameter.0 == name);
        self.session.set_parameter(name, value, self.status).map_err(refusal)?;
        self.pilot.follow(self.session.law()).map_err(|error| {
            if let Some((name, value)) = before {
                // It was in force a moment ago.
                let _ = self.session.set_parameter(name, value, self.status);
            }
            error.into()
        })
    }
}

fn refusal(rejection: Rejection) -> ParameterRefusal {
    match rejection {
        Rejection::Invalid { parameter, value, lower, upper } => {
            ParameterRefusal::Invalid { parameter, value, bounds: (lower, upper) }
        }
        Rejection::UnknownParameter => ParameterRefusal::Unknown,
        _ => ParameterRefusal::NotNow,
    }
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;

    use ctrl_core::trajectory::{HoverConfig, TrajectoryConfig};
    use glam::Vec3;
    use link::ParametersInForce;

    use super::*;
    use crate::scenario::BUILT_IN_MISSION;
    use crate::session::{SessionConfig, SessionMemory};

    const GROUND: ControlStatus =
        ControlStatus { mode: Mode::Disarmed, flight_tick: 0, uptime: 1000 };

    fn session() -> HostSession<'static> {
        let config = SessionConfig {
            board: "test bench",
            sample_valid: 5,
            reference_timeout: 100,
            telemetry_period_min: 2,
        };
        let hover = HoverConfig { position_world: Vec3::ZERO, yaw: 0.0 };
        let trajectory = TrajectoryConfig::Hover(hover);
        let memory = Box::leak(Box::new(SessionMemory::new()));
        let in_force = ParametersInForce::default();
        HostSession::new(memory, config, &BUILT_IN_MISSION.tuning, &trajectory, in_force, None)
            .unwrap()
    }

    fn pilot(session: &HostSession) -> Pilot {
        Pilot::new(&Pilot::moderate(session.law()), session.law()).unwrap()
    }

    fn view(mode: Mode) -> View {
        let state = Some(VehicleState::at_rest(Vec3::ZERO));
        View { time: 0, mode, state, ready: Ok(()), thrust: 0.0, load: 0.0, battery: None }
    }

    #[test]
    fn references_beyond_the_laws_bound_are_refused() {
        let session = session();
        let mut config = Pilot::moderate(session.law());
        config.shaper.acceleration_max *= 1.01;
        let error = Pilot::new(&config, session.law()).unwrap_err();
        assert_eq!(error.parameter, "trajectory.acceleration_bound");
        let mut config = Pilot::moderate(session.law());
        config.shaper.step_period *= 2.0;
        let error = Pilot::new(&config, session.law()).unwrap_err();
        assert_eq!(error.parameter, "trajectory.step_period");
    }

    #[test]
    fn parameters_are_the_sessions_and_the_references_follow_its_bound() {
        let mut session = session();
        let mut pilot = pilot(&session);
        let status = GROUND;
        let mut vehicle = PilotedVehicle {
            pilot: &mut pilot,
            session: &mut session,
            status,
            view: view(status.mode),
        };
        assert!(vehicle.parameter_count() > 20);
        let name = "reference_acceleration_max";
        vehicle.write_parameter(name, 0.125).unwrap();
        assert_eq!(vehicle.navigator().config().shaper.acceleration_max, 0.125);
        let all = (0..).map_while(|index| vehicle.parameter_at(index));
        assert_eq!(all.last(), vehicle.parameter_at(vehicle.parameter_count() - 1));
        let read = (0..).map_while(|index| vehicle.parameter_at(index)).find(|p| p.0 == name);
        assert_eq!(read, Some((name, 0.125)));
        for value in [50.0, 1e-4] {
            let refused = vehicle.write_parameter(name, value);
            assert!(matches!(refused, Err(ParameterRefusal::Invalid { .. })), "{refused:?}");
        }
        assert_eq!(vehicle.write_parameter("k9", 1.0), Err(ParameterRefusal::Unknown));
        vehicle.status.mode = Mode::Flying;
        assert_eq!(vehicle.write_parameter(name, 0.2), Err(ParameterRefusal::NotNow));
        assert_eq!(session.law().reference_acceleration_max(), 0.125);
    }

    #[test]
    fn a_stations_command_is_answered_and_the_navigators_is_not() {
        let mut session = session();
        let mut pilot = pilot(&session);
        let here = VehicleState::at_rest(Vec3::ZERO);
        pilot.step(Mode::Disarmed, Some(&here));
        assert_eq!(pilot.next_command(), None);
        let mut vehicle = PilotedVehicle {
            pilot: &mut pilot,
            session: &mut session,
            status: GROUND,
            view: view(Mode::Disarmed),
        };
        vehicle.command(Command::Arm).unwrap();
        assert_eq!(pilot.next_command(), Some(Command::Arm));
        assert_eq!(pilot.next_command(), None);
        pilot.answered(Ok(Mode::Armed));
        assert_eq!(pilot.answer.take(), Some(Ok(Mode::Armed)));
        pilot.request(Mode::Armed, Request::TakeOff(None)).unwrap();
        pilot.step(Mode::Armed, Some(&here));
        assert_eq!(pilot.next_command(), Some(Command::Start));
        pilot.answered(Err(Refusal::StateStale));
        assert_eq!(pilot.answer, None);
        pilot.step(Mode::Armed, Some(&here));
        assert_eq!(pilot.next_command(), None, "a refused start is not asked for again");
    }
}
