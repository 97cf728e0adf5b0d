//! The vehicle behind MAVLink: the parameters of the link's session, the supervisor of the control group,
//! and the modes of a commanded flight.
//!
//! A [`Pilot`] is memory of its own; [`PilotedVehicle`] lends it the session while a message is handled.
//! There is one parameter store and one supervisor, whichever protocol speaks. Who arms the vehicle flies it:
//! references are the navigator's after a station's Arm, and the session's after that of a host on the link.

use core::mem::MaybeUninit;

use ctrl_core::controller::{AdaptiveController, AnyController, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::mode::navigation::{
    CheckedNavigation, Navigation, NavigationConfig, NavigationEvent, NavigationRefusal, Navigator,
    Request,
};
use ctrl_core::mode::safety::{Reaction, SafetyReport};
use ctrl_core::mode::{Command, Mode, Refusal};
use ctrl_core::reference::Reference;
use ctrl_core::setpoint::{Setpoint, ShaperConfig};
use ctrl_core::vehicle::VehicleState;
use heapless::Deque;
use link::Rejection;
use mavlink_vehicle::{ParameterRefusal, Vehicle, View};

use crate::exchange::{ControlStatus, PreparedInputs};
use crate::flight_control::Health;
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
    /// The vehicle was armed by a station.
    flies: bool,
    /// The law has a bound `M_p` that references can be shaped inside.
    fit: bool,
    /// Uptime of the latest step, and its reference: inputs may be prepared more than once in a tick.
    latest: Option<(u32, Reference)>,
    /// Uptime of a station's latest message.
    heard: u32,
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
        Ok(Self::on_the_ground(&Self::check(config, law)?))
    }

    fn check(
        config: &NavigationConfig,
        law: &AnyController,
    ) -> Result<CheckedNavigation, ConfigError> {
        let shaper = &config.shaper;
        law.accept_limits(shaper.acceleration_max, shaper.step_period)?;
        config.check()
    }

    #[inline(always)]
    fn on_the_ground(checked: &CheckedNavigation) -> Self {
        Self {
            navigator: Navigator::of(checked),
            waiting: None,
            in_control: None,
            answer: None,
            events: Deque::new(),
            flies: false,
            fit: true,
            latest: None,
            heard: 0,
        }
    }

    /// As [`new`](Self::new), with moderate limits, in `place`: a mission is kilobytes.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    #[inline(never)]
    pub fn moderate_in<'p>(
        place: &'p mut MaybeUninit<Self>,
        law: &AnyController,
    ) -> Result<&'p mut Self, ConfigError> {
        let checked = Self::check(&Self::moderate(law), law)?;
        Ok(place.write(Self::on_the_ground(&checked)))
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
    /// tells a station what has come up. In a flight that a host leads, only the supervisor's reactions are
    /// carried out.
    pub fn react(&mut self, mode: Mode, safety: &SafetyReport) {
        let led = !self.is_flown_by_another(mode);
        let reaction = safety.reaction.filter(|reaction| led || *reaction >= Reaction::Failsafe);
        if !safety.raised.is_empty() {
            let event = NavigationEvent::HazardRaised(safety.raised, reaction);
            // A station that does not listen misses the newest.
            let _ = self.events.push_back(event);
        }
        self.navigator.react(if led { mode } else { Mode::Disarmed }, reaction);
    }

    /// The reference of the next tick, after the one that ended in `mode`; commands that follow from it are
    /// queued.
    pub fn step(&mut self, mode: Mode, vehicle: Option<&VehicleState>) -> Navigation {
        let mode = if self.is_flown_by_another(mode) { Mode::Disarmed } else { mode };
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

    /// The session's inputs of the tick after `status`, with the navigator's reference if a station flies the
    /// vehicle; it makes one step per tick, however often it is asked, and follows the reaction to hazards.
    pub fn prepare(
        &mut self,
        session: &mut HostSession<'_>,
        status: ControlStatus,
        safety: &SafetyReport,
    ) -> PreparedInputs {
        let mut prepared = session.prepare(status);
        let reference = match self.latest {
            Some((uptime, reference)) if uptime == status.uptime => reference,
            _ => self.advance(status, safety, prepared.sample.map(|sample| sample.state)),
        };
        if self.flies && status.mode != Mode::Disarmed {
            prepared.reference = reference;
        }
        prepared
    }

    /// The one step of a tick.
    #[inline(never)]
    fn advance(
        &mut self,
        status: ControlStatus,
        safety: &SafetyReport,
        state: Option<VehicleState>,
    ) -> Reference {
        self.react(status.mode, safety);
        let reference = self.step(status.mode, state.as_ref()).reference;
        self.latest = Some((status.uptime, reference));
        reference
    }

    /// `true` while a host on the link flies the vehicle, the supervisor being in `mode`.
    #[must_use]
    pub fn is_flown_by_another(&self, mode: Mode) -> bool {
        !self.flies && matches!(mode, Mode::Armed | Mode::Flying | Mode::Failsafe)
    }

    /// Takes note of a message of a station, at `uptime`.
    pub fn hear(&mut self, uptime: u32) {
        self.heard = uptime;
    }

    /// The state of the lines for the watch for hazards: in flight the silence is that of whoever armed the vehicle, on
    /// the ground that of the last who spoke. Nothing here measures a battery or reads a remote control.
    #[must_use]
    pub fn health(&self, session: &HostSession<'_>, status: ControlStatus) -> Health {
        let station = status.uptime.wrapping_sub(self.heard);
        let host = status.uptime.wrapping_sub(session.heard());
        let silence = match status.mode {
            Mode::Armed | Mode::Flying | Mode::Failsafe if self.flies => station,
            Mode::Armed | Mode::Flying | Mode::Failsafe => host,
            Mode::Disarmed | Mode::Locked => station.min(host),
        };
        let step_period = self.navigator.config().shaper.step_period;
        Health { link_silence: silence as f32 * step_period, ..Health::default() }
    }

    /// The next command for the control group, once the one before is [answered](Self::answered); while
    /// parameters are being stored, none that could lead to flight.
    pub fn next_command(&mut self, storing: bool) -> Option<Command> {
        let command = self.waiting?.command;
        if self.in_control.is_some()
            || (storing && !matches!(command, Command::Disarm | Command::Kill))
        {
            return None;
        }
        self.in_control = self.waiting.take();
        Some(command)
    }

    /// `true` while a command waits for its answer.
    #[must_use]
    pub fn has_command(&self) -> bool {
        self.waiting.is_some() || self.in_control.is_some()
    }

    /// Drops a command that waits when lock step ends: it was meant for rotors that are off.
    pub fn drop_command(&mut self) {
        self.waiting = None;
    }

    /// Takes the control group's answer: to the pilot's command, if there is one, otherwise to the session's,
    /// of which it is told all the same.
    pub fn answered(&mut self, answer: Result<Mode, Refusal>) {
        let queued = self.in_control.take();
        if answer == Ok(Mode::Armed) {
            self.flies = queued.is_some();
        }
        match queued {
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
    /// When the shaping cannot use the bound: stations do not fly the vehicle then.
    pub fn follow(&mut self, law: &AnyController) -> Result<(), ConfigError> {
        let mut config = *self.navigator.config();
        config.shaper.acceleration_max = law.reference_acceleration_max();
        let followed = self.navigator.reconfigure(&config);
        self.fit = followed.is_ok();
        followed
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

    fn out_of_command(&self) -> Option<&'static str> {
        if self.pilot.is_flown_by_another(self.view.mode) {
            return Some("flown over the other link");
        }
        (!self.pilot.fit).then_some("no reference suits the law's bound")
    }

    fn command(&mut self, command: Command) -> Result<(), Refusal> {
        // Replaces what the navigator asked for: a station comes first.
        self.pilot.waiting = Some(Queued { command, from_station: true });
        Ok(())
    }

    fn hear(&mut self) {
        self.pilot.hear(self.status.uptime);
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
        // wcet: at most 64 iterations
        // wcet: at most 48 bytes
        let all = (0..self.parameter_count()).filter_map(|index| self.parameter_at(index));
        // wcet: at most 64 iterations
        // wcet: at most 48 bytes
        let before = all.into_iter().find(|parameter| parameter.0 == name);
        self.session.set_parameter(name, value, self.status).map_err(refusal)?;
        self.pilot.follow(self.session.law()).map_err(|error| {
            if let Some((name, value)) = before {
                // It was in force a moment ago.
                let _ = self.session.set_parameter(name, value, self.status);
                let _ = self.pilot.follow(self.session.law());
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
        View {
            time: 0,
            mode,
            cause: None,
            state,
            ready: Ok(()),
            thrust: 0.0,
            load: 0.0,
            battery: None,
            lasting: None,
        }
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
        assert_eq!(pilot.next_command(false), None);
        let mut vehicle = PilotedVehicle {
            pilot: &mut pilot,
            session: &mut session,
            status: GROUND,
            view: view(Mode::Disarmed),
        };
        vehicle.command(Command::Arm).unwrap();
        assert_eq!(pilot.next_command(false), Some(Command::Arm));
        assert_eq!(pilot.next_command(false), None);
        pilot.answered(Ok(Mode::Armed));
        assert_eq!(pilot.answer.take(), Some(Ok(Mode::Armed)));
        pilot.request(Mode::Armed, Request::TakeOff(None)).unwrap();
        pilot.step(Mode::Armed, Some(&here));
        assert_eq!(pilot.next_command(false), Some(Command::Start));
        pilot.answered(Err(Refusal::StateStale));
        assert_eq!(pilot.answer, None);
        pilot.step(Mode::Armed, Some(&here));
        assert_eq!(pilot.next_command(false), None, "a refused start is not asked for again");
    }
}
