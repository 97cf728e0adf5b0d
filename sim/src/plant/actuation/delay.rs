//! A pure transport delay: what is commanded at `t` acts from `t + delay` on.
//!
//! The delay is a whole number of plant steps, `n = round(delay / h)`, halves away from zero. With `S`
//! plant steps per tick and `n = q S + r`, the first `r` steps of tick `k` are moved by the command of tick
//! `k - q - 1`, the others by that of tick `k - q`.

use std::collections::VecDeque;

use crate::plant::rigid_body::RigidBody;

/// Commands on their way, wrenches or thrusts of rotors.
#[derive(Clone, Debug)]
pub(in crate::plant) struct Delay<T> {
    /// `r`.
    rest: u32,
    /// The commands of ticks `k - q - 1` to `k`.
    commands: VecDeque<T>,
}

impl<T: Copy> Delay<T> {
    /// By `delay` (s), not negative; `before` acts until the first command has arrived.
    pub fn new(delay: f64, before: T, body: &RigidBody) -> Self {
        let steps = (delay / body.sub_step_duration()).round() as u64;
        let per_tick = u64::from(body.sub_steps());
        let (ticks, rest) = ((steps / per_tick) as usize, (steps % per_tick) as u32);
        Self { rest, commands: VecDeque::from(vec![before; ticks + 2]) }
    }

    /// Takes the command of the next tick.
    pub fn take(&mut self, command: T) {
        self.commands.pop_front();
        self.commands.push_back(command);
    }

    /// The command that acts in the plant step `step` of the tick whose command was received last.
    pub fn acting(&self, step: u32) -> T {
        self.commands[usize::from(step >= self.rest)]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::plant::{AppliedWrench, PlantParameters};

    /// The tick whose command acts in each plant step, for `delay` of the 4 ms ticks of 4 steps.
    fn acting(delay: f64) -> Vec<f64> {
        let parameters = PlantParameters::new(1.0, DVec3::ONE);
        let body = RigidBody::new(&parameters, 4e-3, 4);
        let mark = |thrust| AppliedWrench { thrust, torque_body: DVec3::ZERO };
        let mut delay = Delay::new(delay, mark(-1.0), &body);
        let mut seen = Vec::new();
        for tick in 0..4 {
            delay.take(mark(f64::from(tick)));
            seen.extend((0..4).map(|step| delay.acting(step).thrust));
        }
        seen
    }

    #[test]
    fn commands_act_a_whole_number_of_plant_steps_later() {
        for (delay, steps) in [(0.0, 0), (1e-3, 1), (3e-3, 3), (4e-3, 4), (6e-3, 6), (9e-3, 9)] {
            let expected: Vec<_> =
                (0..16).map(|step| if step < steps { -1 } else { (step - steps) / 4 }).collect();
            assert_eq!(acting(delay), expected.into_iter().map(f64::from).collect::<Vec<_>>());
        }
    }

    #[test]
    fn delays_between_steps_are_rounded_to_the_nearest() {
        assert_eq!(acting(0.49e-3), acting(0.0));
        assert_eq!(acting(0.51e-3), acting(1e-3));
        assert_eq!(acting(5.4e-3), acting(5e-3));
    }
}
