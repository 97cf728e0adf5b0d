//! Data between the control group and the groups below it, exchanged under short locks.

use ctrl_core::controller::AnyController;
use ctrl_core::mode::{Command, Mode, Refusal};
use ctrl_core::reference::Reference;
use link::Telemetry;

use crate::flight_control::Inputs;
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
    /// A law that replaces the one before from the next start.
    pub law: Option<AnyController>,
    /// The vehicle must not fly.
    pub fault: bool,
}

/// For the control group, prepared by the state-input group.
#[derive(Clone, Copy, Debug)]
pub struct Inbox {
    prepared: PreparedInputs,
    command: Option<Command>,
}

impl Inbox {
    /// The inbox before the first tick.
    #[must_use]
    pub const fn new(prepared: PreparedInputs) -> Self {
        Self { prepared, command: None }
    }

    /// Replaces the inputs, but for a law that has not been taken and no newer one replaces; asks
    /// for the next command if none waits.
    pub fn put(
        &mut self,
        prepared: PreparedInputs,
        next_command: impl FnOnce() -> Option<Command>,
    ) {
        let law = prepared.law.or(self.prepared.law);
        self.prepared = PreparedInputs { law, ..prepared };
        self.command = self.command.or_else(next_command);
    }

    /// The inputs of one tick. Sample, command and law are taken: when state input is late, the
    /// next tick misses its sample.
    pub fn take(&mut self, overrun: bool, outputs_off: bool) -> (Inputs, Option<AnyController>) {
        let inputs = Inputs {
            sample: self.prepared.sample.take(),
            reference: self.prepared.reference,
            command: self.command.take(),
            overrun,
            fault: self.prepared.fault,
            outputs_off,
        };
        (inputs, self.prepared.law.take())
    }

    /// Turns a command that waits into Disarm: lock step has ended, and the command was meant for
    /// rotors that are off.
    pub fn disarm(&mut self) {
        self.command = self.command.map(|_| Command::Disarm);
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use ctrl_core::vehicle::VehicleState;
    use glam::Vec3;

    fn prepared() -> PreparedInputs {
        let state = VehicleState::at_rest(Vec3::X);
        PreparedInputs {
            sample: Some(StateSample { state, age_ticks: 3 }),
            reference: Reference::hover(Vec3::Y),
            law: None,
            fault: true,
        }
    }

    #[test]
    fn inputs_are_taken_once_and_the_reference_stays() {
        let mut inbox = Inbox::new(prepared());
        inbox.put(prepared(), || Some(Command::Arm));
        inbox.put(prepared(), || panic!("a command waits"));
        let (first, _) = inbox.take(false, true);
        assert_eq!((first.sample, first.command), (prepared().sample, Some(Command::Arm)));
        let (second, _) = inbox.take(true, false);
        assert_eq!((second.sample, second.command), (None, None));
        assert_eq!(second.reference, Reference::hover(Vec3::Y));
        assert!(second.fault && second.overrun && !first.overrun);
        assert!(first.outputs_off && !second.outputs_off);
    }

    #[test]
    fn a_waiting_command_becomes_disarm_and_none_stays_none() {
        let mut inbox = Inbox::new(prepared());
        inbox.disarm();
        assert_eq!(inbox.take(false, false).0.command, None);
        inbox.put(prepared(), || Some(Command::Start));
        inbox.disarm();
        assert_eq!(inbox.take(false, false).0.command, Some(Command::Disarm));
    }

    #[test]
    fn a_law_waits_until_it_is_taken() {
        let law = crate::scenario::built_in_mission().unwrap().tuning.controller().unwrap();
        let mut inbox = Inbox::new(PreparedInputs { law: Some(law), ..prepared() });
        inbox.put(prepared(), || None);
        assert!(inbox.take(false, false).1.is_some());
        assert!(inbox.take(false, false).1.is_none());
    }
}
