//! A rotor that is weak or dead from some time on: a broken blade, a motor that loses a phase.

use serde::{Deserialize, Serialize};

use super::Thrusts;

/// Failure of one rotor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RotorFailure {
    /// Place of the rotor in the frame, from 0.
    pub rotor: usize,
    /// First instant of the failure (s).
    pub time: f64,
    /// Part of its thrust that it still gives: 0 is dead (-).
    pub thrust_left: f64,
    /// Time from the failure until the mixer allocates to the other rotors; never where it is absent (s).
    pub reallocated_after: Option<f64>,
}

/// Part of its thrust that each rotor gives at `time` (s).
#[must_use]
pub(super) fn health(failures: &[RotorFailure], time: f64) -> Thrusts {
    let mut health = Thrusts::ALL_ONE;
    for failure in failures.iter().filter(|failure| failure.time <= time) {
        if let Some(rotor) = health.0.get_mut(failure.rotor) {
            *rotor *= failure.thrust_left;
        }
    }
    health
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotor_fails_at_its_time_and_failures_of_one_rotor_multiply() {
        let failure = |rotor, time, thrust_left| RotorFailure {
            rotor,
            time,
            thrust_left,
            reallocated_after: None,
        };
        let failures = [failure(2, 1.0, 0.5), failure(5, 2.0, 0.0), failure(2, 3.0, 0.5)];
        let left = |time| health(&failures, time).0;
        assert_eq!(left(0.999), [1.0; 8]);
        assert_eq!(left(1.0), [1.0, 1.0, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(left(3.0), [1.0, 1.0, 0.25, 1.0, 1.0, 0.0, 1.0, 1.0]);
    }
}
