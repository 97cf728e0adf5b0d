//! Rotors that lag: the command for a demand, and the torque that acts by the model.

use glam::DVec3;

use super::parameters::RotorGains;

/// Command for a demand and its effect over one step.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    /// Torque to be commanded (N m).
    pub torque: DVec3,
    /// `tau_m`: mean of the torque that acts over the step (N m).
    pub acting: DVec3,
}

impl RotorGains {
    /// `1 - e^(-dt/constant)`.
    fn gained(&self, constant: f64) -> f64 {
        1.0 - (-self.dt / constant).exp()
    }

    /// Command for the demand `u` (N m) within `limit` (N m), while `m` (N m) acts.
    #[must_use]
    pub fn command(&self, u: DVec3, limit: DVec3, m: DVec3) -> Command {
        if self.lag == 0.0 {
            let torque = u.clamp(-limit, limit); // (37)
            return Command { torque, acting: torque };
        }
        let r = self.gained(self.residual_lag) / self.gained(self.lag);
        let torque = (m + r * (u - m)).clamp(-limit, limit);
        let acting = torque + (m - torque) * self.gained(self.lag) * self.lag / self.dt;
        Command { torque, acting }
    }

    /// Torque that acts (N m) one step after `m`, while `command` is held.
    #[must_use]
    pub fn after(&self, m: DVec3, command: DVec3) -> DVec3 {
        if self.lag == 0.0 { command } else { m + self.gained(self.lag) * (command - m) }
    }
}
