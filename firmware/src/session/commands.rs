//! Commands for the control group, and lock-step requests.

use ctrl_core::mode::{Command, Mode, Refusal};
use link::Rejection;

use super::HostSession;
use crate::exchange::ControlStatus;
use crate::tick_source::{LockStepRequest, TickOrigin};

impl HostSession<'_> {
    /// Queues a command for the control group; none that could lead to flight while parameters are
    /// being stored.
    pub(super) fn queue_command(
        &mut self,
        sequence: u16,
        command: Command,
    ) -> Result<(), Rejection> {
        if self.storage.is_some() && command != Command::Disarm {
            return Err(Rejection::NotNow);
        }
        self.commands.push_back((sequence, command)).map_err(|_| Rejection::NotNow)
    }

    /// Refuses unless the vehicle is disarmed, no command is pending and nothing is being stored.
    pub(super) fn require_idle(&self, status: ControlStatus) -> Result<(), Rejection> {
        let quiet = self.storage.is_none()
            && self.commands.is_empty()
            && self.in_control.is_none()
            && !self.piloted;
        let disarmed = status.mode == Mode::Disarmed;
        (quiet && disarmed).then_some(()).ok_or(Rejection::NotNow)
    }

    /// Enters lock step, disarmed and with nothing pending, or leaves it.
    pub(super) fn lock_step(
        &mut self,
        enter: bool,
        status: ControlStatus,
        origin: TickOrigin,
    ) -> Result<(), Rejection> {
        self.lock_step_request = match (enter, origin) {
            (false, TickOrigin::Timer) => None,
            (false, TickOrigin::LockStep) => Some(LockStepRequest::Leave),
            (true, TickOrigin::LockStep) => Some(LockStepRequest::Enter), // announced again
            (true, TickOrigin::Timer) => {
                self.require_idle(status)?;
                Some(LockStepRequest::Enter)
            }
        };
        Ok(())
    }

    /// Refuses the commands that wait when lock step ends: they were meant for rotors that are off.
    pub fn refuse_commands(&mut self) {
        // wcet: at most 4 iterations
        while let Some((sequence, _)) = self.commands.pop_front() {
            self.acknowledge(sequence, Err(Rejection::NotNow));
        }
    }

    /// The latest lock-step request of the host, once.
    pub fn take_lock_step_request(&mut self) -> Option<LockStepRequest> {
        self.lock_step_request.take()
    }

    /// The next command for the control group, once the one before is [answered](Self::answered).
    pub fn next_command(&mut self) -> Option<Command> {
        if self.in_control.is_some() {
            return None;
        }
        let (sequence, command) = self.commands.pop_front()?;
        self.in_control = Some(sequence);
        Some(command)
    }

    /// Sends the control group's answer to the command that it has taken.
    pub fn answered(&mut self, answer: Result<Mode, Refusal>) {
        if let Some(sequence) = self.in_control.take() {
            self.acknowledge(sequence, answer.map(|_| ()).map_err(Rejection::Mode));
        }
    }
}
