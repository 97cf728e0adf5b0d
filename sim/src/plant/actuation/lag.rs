//! A first-order lag: `T u' = command - u` for thrust and torque, as of rotors that take time to turn
//! faster. All rotors have the same `T`, so the lag of their thrusts is that of the wrench.
//!
//! Over a plant step of `h` the command is held, and with `x = h/T`
//!
//! ```text
//! u(h) = command + (u(0) - command) e^-x            mean = command + (u(0) - command) (1 - e^-x)/x
//! ```
//!
//! exactly. RK4 weighs its stages 1 : 4 : 1; the middle one is given what makes their mean the true one,
//! `u_m = (6 mean - u(0) - u(h))/4 = u(h/2) + O(h^4)`. So momentum and angular momentum gain exactly what
//! the rotors gave, for any `T`, however short, and RK4 keeps its order.

use super::Combine;

/// The lag in progress, of a wrench or of the thrusts of rotors.
#[derive(Clone, Copy, Debug)]
pub(in crate::plant) struct Lag<T> {
    /// `e^-x`.
    left: f64,
    /// `(1 - e^-x)/x`.
    left_in_the_mean: f64,
    now: T,
}

impl<T: Combine> Lag<T> {
    /// With the time constant `constant` from `start` on, for plant steps of `h` (s); none for zero.
    pub fn new(constant: f64, start: T, h: f64) -> Option<Self> {
        let x = h / constant;
        let left_in_the_mean = -(-x).exp_m1() / x;
        (constant > 0.0).then(|| Self { left: (-x).exp(), left_in_the_mean, now: start })
    }

    /// What acts now.
    pub fn now(&self) -> T {
        self.now
    }

    /// Moves on by one plant step; what acts in its three stages.
    pub fn advance(&mut self, command: T) -> [T; 3] {
        let after = |left: f64, start| command.combined(1.0 - left, start, left);
        let start = self.now;
        let (end, mean) = (after(self.left, start), after(self.left_in_the_mean, start));
        let ends = start.combined(-0.25, end, -0.25);
        self.now = end;
        [start, mean.combined(1.5, ends, 1.0), end]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::plant::AppliedWrench;

    fn wrench(thrust: f64) -> AppliedWrench {
        AppliedWrench { thrust, torque_body: DVec3::new(0.1, -0.2, 0.3) * thrust }
    }

    #[test]
    fn it_follows_a_step_exponentially_whatever_the_plant_step() {
        for h in [1e-4, 1e-3, 0.05] {
            let mut lag = Lag::new(0.03, wrench(2.0), h).unwrap();
            let steps = (0.1 / h).round() as u32;
            for _ in 0..steps {
                lag.advance(wrench(5.0));
            }
            let expected = 5.0 - 3.0 * (-0.1f64 / 0.03).exp();
            assert!((lag.now().thrust - expected).abs() < 1e-13);
            assert!((lag.now().torque_body - wrench(expected).torque_body).length() < 1e-13);
        }
    }

    #[test]
    fn the_middle_stage_is_the_value_there_to_fourth_order_and_the_mean_exact() {
        let error = |h: f64| {
            let [start, middle, end] = Lag::new(0.1, wrench(1.0), h).unwrap().advance(wrench(0.0));
            let exact = 0.1 / h * (1.0 - (-h / 0.1).exp());
            let mean = (start.thrust + 4.0 * middle.thrust + end.thrust) / 6.0;
            assert!((mean - exact).abs() < 1e-15);
            (middle.thrust - (-0.5 * h / 0.1).exp()).abs()
        };
        let ratio = error(0.04) / error(0.02);
        assert!((14.0..18.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_constant_much_shorter_than_the_step_acts_at_once_and_zero_is_none() {
        let mut lag = Lag::new(1e-9, wrench(1.0), 1e-3).unwrap();
        let [start, middle, end] = lag.advance(wrench(3.0));
        assert_eq!(end, wrench(3.0));
        let mean = (start.thrust + 4.0 * middle.thrust + end.thrust) / 6.0;
        assert!((mean - 3.0).abs() < 1e-5);
        assert!(Lag::new(0.0, wrench(1.0), 1e-3).is_none());
    }
}
