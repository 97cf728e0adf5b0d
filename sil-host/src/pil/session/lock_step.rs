//! Entering and leaving the link's lock step.

use link::{Downlink, Uplink};

use super::{AGAIN_AFTER, VehicleSession, answer_to};
use crate::pil::PilError;

impl VehicleSession {
    /// Enters lock step: the vehicle's control ticks begin at this host's requests, its rotors off.
    ///
    /// # Errors
    /// When the vehicle refuses or is silent.
    pub fn enter_lock_step(&mut self) -> Result<(), PilError> {
        let mut received = self.send(&[Uplink::LockStep(true)])?;
        let mut refused = None;
        for round in 1..=self.patience() {
            for message in received {
                match message {
                    Downlink::Stepped { uptime_ticks } => {
                        self.uptime = Some(uptime_ticks);
                        return Ok(());
                    }
                    Downlink::Acknowledgement(answer) => refused = answer.result.err(),
                    _ => {}
                }
            }
            let again = [Uplink::LockStep(true)];
            received = self.send(if round % AGAIN_AFTER == 0 { &again } else { &[] })?;
        }
        let what = "lock step".to_owned();
        Err(match refused {
            Some(rejection) => PilError::Refused(what, rejection),
            None => PilError::Answer(what, "nothing".to_owned()),
        })
    }

    /// Leaves lock step: the vehicle's ticks begin by its timer again, and it is disarmed.
    ///
    /// # Errors
    /// When the vehicle is silent.
    pub fn leave_lock_step(&mut self) -> Result<(), PilError> {
        self.uptime = None;
        let mut asked = Vec::new();
        for round in 0..self.patience() {
            let again = [Uplink::LockStep(false)];
            let ask = round % AGAIN_AFTER == 0;
            if ask {
                asked.push(self.encoder.next_sequence());
            }
            let received = self.send(if ask { &again } else { &[] })?;
            if asked.iter().any(|sequence| answer_to(*sequence, &received).is_some()) {
                return Ok(());
            }
        }
        Err(PilError::Answer("to leave lock step".to_owned(), "nothing".to_owned()))
    }
}
