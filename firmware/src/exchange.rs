//! What the control group and the groups below it hand to each other, under short locks.

use ctrl_core::controller::AnyController;
use ctrl_core::mode::{Command, Mode, Refusal};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use link::{GROUPS, GroupHealth, Health, LinkStatistics, Telemetry};

use crate::flight_control::Inputs;
use crate::rate_loop::{Group, RateLoop};
use crate::session::Progress;

/// For the control group, prepared by the state-input group.
#[derive(Clone, Copy, Debug)]
pub struct Inbox {
    /// A valid state sample, if there is one.
    pub vehicle: Option<VehicleState>,
    /// The reference of the next tick.
    pub reference: Reference,
    /// A command that has not been obeyed yet.
    pub command: Option<Command>,
    /// A law to fly with from the next start.
    pub law: Option<AnyController>,
    /// The vehicle must not fly.
    pub fault: bool,
}

impl Inbox {
    /// The inputs of one tick. Sample, command and law are taken: when state input is late, the
    /// next tick misses its sample.
    pub fn take(&mut self, overrun: bool, outputs_off: bool) -> (Inputs, Option<AnyController>) {
        let inputs = Inputs {
            vehicle: self.vehicle.take(),
            reference: self.reference,
            command: self.command.take(),
            overrun,
            fault: self.fault,
            outputs_off,
        };
        (inputs, self.law.take())
    }

    /// Makes a command that waits one to disarm: lock step has ended, and with it what was meant for
    /// rotors that are off.
    pub fn disarm(&mut self) {
        self.command = self.command.map(|_| Command::Disarm);
    }
}

/// From the control group.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outbox {
    /// What it did last.
    pub progress: Progress,
    /// What became of a command, until the session hears it.
    pub answer: Option<Result<Mode, Refusal>>,
    /// The latest tick for telemetry, until it is sent.
    pub telemetry: Option<Telemetry>,
}

/// How link and rate groups fare.
#[must_use]
pub fn health(rate_loop: &RateLoop, link: LinkStatistics, transmit_dropped: u32) -> Health {
    let mut groups = [GroupHealth::default(); GROUPS];
    for (health, group) in groups.iter_mut().zip(Group::ALL) {
        let statistics = rate_loop.statistics(group);
        *health = GroupHealth {
            completed: statistics.completed,
            worst_time: statistics.worst_time,
            overruns: statistics.overruns,
        };
    }
    Health { uptime_ticks: u64::from(rate_loop.ticks()), groups, link, transmit_dropped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rates::RATE_LOOP;
    use glam::Vec3;

    #[test]
    fn what_is_taken_is_gone_and_the_reference_stays() {
        let mut inbox = Inbox {
            vehicle: Some(VehicleState::at_rest(Vec3::X)),
            reference: Reference::hover(Vec3::Y),
            command: Some(Command::Arm),
            law: None,
            fault: true,
        };
        let (first, _) = inbox.take(false, true);
        assert_eq!((first.vehicle.is_some(), first.command), (true, Some(Command::Arm)));
        let (second, _) = inbox.take(true, false);
        assert_eq!((second.vehicle, second.command), (None, None));
        assert_eq!(second.reference, Reference::hover(Vec3::Y));
        inbox.disarm();
        assert_eq!(inbox.command, None);
        inbox.command = Some(Command::Start);
        inbox.disarm();
        assert_eq!(inbox.command, Some(Command::Disarm));
        assert!(second.fault && second.overrun && !first.overrun);
        assert!(first.outputs_off && !second.outputs_off);
    }

    #[test]
    fn health_lists_the_groups_in_order() {
        let mut rate_loop = RATE_LOOP;
        for tick in 0..4 {
            rate_loop.tick(tick * 1000);
            rate_loop.finish(Group::Control, tick * 1000 + 11);
            rate_loop.finish(Group::StateInput, tick * 1000 + 22);
            rate_loop.finish(Group::Telemetry, tick * 1000 + 33);
        }
        let health = health(&rate_loop, LinkStatistics::default(), 9);
        assert_eq!(health.groups.map(|group| group.worst_time), [11, 22, 33, 0]);
        assert_eq!(health.groups.map(|group| group.completed), [4, 4, 1, 0]);
        assert_eq!((health.uptime_ticks, health.transmit_dropped), (4, 9));
    }
}
