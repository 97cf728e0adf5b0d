//! Data between the control group and the groups below it, exchanged under short locks.

use ctrl_core::controller::{AnyController, Estimates, LastingEstimates};
use ctrl_core::mode::safety::{Hazards, SafetyReport};
use ctrl_core::mode::{Cause, Command, Mode, Refusal};
use ctrl_core::reference::Reference;
use link::Telemetry;
use mavlink_vehicle::Lasting;

use crate::flight_control::{Health, Inputs};
use crate::state_sample::StateSample;

/// State of the control group after its latest tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ControlStatus {
    /// Mode of the tick.
    pub mode: Mode,
    /// Ticks of flight; zero on the ground.
    pub flight_tick: u32,
    /// Ticks since the start of the program.
    pub uptime: u32,
}

impl ControlStatus {
    /// `true` if settings may change.
    #[must_use]
    pub fn on_ground(self) -> bool {
        !matches!(self.mode, Mode::Flying | Mode::Failsafe)
    }
}

/// Inputs that the state-input group has prepared at one release.
#[derive(Clone, Copy, Debug)]
pub struct PreparedInputs {
    /// The latest state sample, none if it is too old.
    pub sample: Option<StateSample>,
    /// The reference of the next tick.
    pub reference: Reference,
    /// The vehicle must not fly.
    pub fault: bool,
}

/// For the control group, prepared by the state-input group.
#[derive(Clone, Copy, Debug)]
pub struct Inbox {
    prepared: PreparedInputs,
    command: Option<Command>,
    /// The latest law, and whether the control group has to take it.
    law: AnyController,
    law_waits: bool,
    /// Kill switch, lines and battery, until they are told anew.
    kill: bool,
    health: Health,
}

impl Inbox {
    /// The inbox before the first tick, whose law the control group has.
    #[must_use]
    pub fn new(prepared: PreparedInputs, law: &AnyController) -> Self {
        let health = Health::default();
        Self { prepared, command: None, law: *law, law_waits: false, kill: false, health }
    }

    /// Replaces the inputs; asks for the next command if none waits.
    pub fn put(
        &mut self,
        prepared: PreparedInputs,
        next_command: impl FnOnce() -> Option<Command>,
    ) {
        self.prepared = prepared;
        self.command = self.command.or_else(next_command);
    }

    /// Tells the kill switch, and the state of lines and battery.
    pub fn put_health(&mut self, kill: bool, health: Health) {
        (self.kill, self.health) = (kill, health);
    }

    /// Puts in a law that replaces the one before from the next start.
    pub fn put_law(&mut self, law: &AnyController) {
        self.law = *law;
        self.law_waits = true;
    }

    /// The inputs of one tick. Sample and command are taken: when state input is late, the
    /// next tick misses its sample.
    pub fn take(&mut self, overrun: bool, outputs_off: bool) -> Inputs {
        Inputs {
            sample: self.prepared.sample.take(),
            reference: self.prepared.reference,
            command: self.command.take(),
            overrun,
            fault: self.prepared.fault,
            outputs_off,
            kill: self.kill,
            health: self.health,
        }
    }

    /// A law that has come since it was last taken.
    pub fn take_law(&mut self) -> Option<&AnyController> {
        core::mem::take(&mut self.law_waits).then_some(&self.law)
    }

    /// Turns a command that waits into Disarm: lock step has ended, and the command was meant for
    /// rotors that are off.
    pub fn disarm(&mut self) {
        self.command = self.command.map(|_| Command::Disarm);
    }
}

/// State of the control group for ground stations, as of the latest release of telemetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlView {
    /// Readiness to arm, or the reason against it.
    pub ready: Result<(), Refusal>,
    /// Commanded thrust (N).
    pub thrust: f32,
    /// Reason for the latest change to a safer mode, as of the latest tick.
    pub cause: Option<Cause>,
    /// The integral action's estimates, if the law has any.
    pub lasting: Option<Lasting>,
}

/// Estimates of the integral action as ground stations are shown them.
#[must_use]
pub fn shown(lasting: &LastingEstimates, estimates: &Estimates) -> Lasting {
    Lasting {
        acceleration_world: lasting.acceleration_world,
        torque_body: lasting.torque(estimates),
    }
}

impl Default for ControlView {
    /// Before the first tick.
    fn default() -> Self {
        Self { ready: Err(Refusal::StateStale), thrust: 0.0, cause: None, lasting: None }
    }
}

/// From the control group.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outbox {
    /// Its state after the latest tick.
    pub status: ControlStatus,
    /// Result of a command, until the session takes it.
    pub answer: Option<Result<Mode, Refusal>>,
    /// The latest tick for telemetry, until it is sent.
    pub telemetry: Option<Telemetry>,
    /// The integral action's estimates after it, if the law has any.
    pub lasting: Option<LastingEstimates>,
    /// The same for ground stations.
    pub view: ControlView,
    /// The reaction to hazards, and those that have come up since they were taken.
    pub safety: SafetyReport,
}

impl Outbox {
    /// Tells the hazards of a tick.
    pub fn put_safety(&mut self, safety: &SafetyReport) {
        let raised = self.safety.raised | safety.raised;
        self.safety = SafetyReport { raised, ..*safety };
    }

    /// The hazards; each that has come up is reported once.
    pub fn take_safety(&mut self) -> SafetyReport {
        let safety = self.safety;
        self.safety.raised = Hazards::empty();
        safety
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::BUILT_IN_MISSION;
    use ctrl_core::vehicle::VehicleState;
    use glam::Vec3;
    use link::ControllerKind;

    fn law(kind: ControllerKind) -> AnyController {
        BUILT_IN_MISSION.tuning.controller_of(kind).unwrap()
    }

    fn inbox() -> Inbox {
        Inbox::new(prepared(), &law(ControllerKind::Saturated))
    }

    fn prepared() -> PreparedInputs {
        let state = VehicleState::at_rest(Vec3::X);
        PreparedInputs {
            sample: Some(StateSample { state, age_ticks: 3 }),
            reference: Reference::hover(Vec3::Y),
            fault: true,
        }
    }

    #[test]
    fn inputs_are_taken_once_and_the_reference_stays() {
        let mut inbox = inbox();
        inbox.put(prepared(), || Some(Command::Arm));
        inbox.put(prepared(), || panic!("a command waits"));
        let first = inbox.take(false, true);
        assert_eq!((first.sample, first.command), (prepared().sample, Some(Command::Arm)));
        let second = inbox.take(true, false);
        assert_eq!((second.sample, second.command), (None, None));
        assert_eq!(second.reference, Reference::hover(Vec3::Y));
        assert!(second.fault && second.overrun && !first.overrun);
        assert!(first.outputs_off && !second.outputs_off);
    }

    #[test]
    fn a_waiting_command_becomes_disarm_and_none_stays_none() {
        let mut inbox = inbox();
        inbox.disarm();
        assert_eq!(inbox.take(false, false).command, None);
        inbox.put(prepared(), || Some(Command::Start));
        inbox.disarm();
        assert_eq!(inbox.take(false, false).command, Some(Command::Disarm));
    }

    #[test]
    fn a_hazard_that_has_come_up_is_reported_once_and_not_lost() {
        use ctrl_core::mode::safety::Reaction;
        let mut outbox = Outbox::default();
        let report =
            |hazards, raised| SafetyReport { hazards, raised, reaction: Some(Reaction::Land) };
        let (first, both) = (Hazards::GEOFENCE, Hazards::GEOFENCE | Hazards::SATURATION);
        outbox.put_safety(&report(first, first));
        outbox.put_safety(&report(both, Hazards::SATURATION));
        assert_eq!(outbox.take_safety(), report(both, both));
        outbox.put_safety(&report(both, Hazards::empty()));
        assert_eq!(outbox.take_safety(), report(both, Hazards::empty()));
    }

    #[test]
    fn a_law_waits_until_it_is_taken() {
        let mut inbox = inbox();
        assert!(inbox.take_law().is_none());
        let law = law(ControllerKind::RobustAdaptive);
        inbox.put_law(&law);
        inbox.put(prepared(), || None);
        assert_eq!(inbox.take_law(), Some(&law));
        assert!(inbox.take_law().is_none());
    }
}
