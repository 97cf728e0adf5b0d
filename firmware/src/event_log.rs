//! Log of the changes since the last housekeeping: mode, overruns, late samples.

use ctrl_core::mode::Mode;
use link::{GROUPS, Health};

use crate::exchange::ControlStatus;

/// The state that has been logged.
#[derive(Debug, Default)]
pub struct EventLog {
    mode: Mode,
    overruns: [u32; GROUPS],
    late: u32,
}

impl EventLog {
    /// Logs the differences from the last call; `late` samples have been dropped so far.
    pub fn log(&mut self, status: ControlStatus, health: &Health, late: u32) {
        if self.mode != status.mode {
            self.mode = status.mode;
            defmt::info!("mode {=u8} at tick {=u32}", status.mode as u8, status.uptime);
        }
        if self.late != late {
            self.late = late;
            defmt::warn!("{=u32} samples dropped as late by their tick", late);
        }
        // wcet: at most 4 iterations
        for (group, (health, logged)) in health.groups.iter().zip(&mut self.overruns).enumerate() {
            if *logged != health.overruns {
                *logged = health.overruns;
                defmt::warn!("group {=usize}: {=u32} overruns", group, health.overruns);
            }
            defmt::debug!("group {=usize}: worst {=u32} us", group, health.worst_time);
        }
    }
}
