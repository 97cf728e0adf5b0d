//! Activity of the torque that acts: its root mean square and that of its change per tick.

use glam::DVec3;

use super::Monitor;
use super::verdict::{Extreme, Requirement, Verdict};
use crate::observer::Observer;
use crate::tick::Tick;

/// Root mean squares, over the flight, of the applied torque and of its change from one tick to the next;
/// of the length of the vector of all three axes. Noise in the state shows here first.
#[derive(Clone, Copy, Debug, Default)]
pub struct TorqueActivity {
    ticks: u64,
    latest: f64,
    previous: DVec3,
    square_sum: f64,
    change_square_sum: f64,
}

impl TorqueActivity {
    /// Names of its rows: root mean square of the torque, and of its change per tick.
    pub const ROWS: [&str; 2] =
        ["torque activity, rms", "torque activity, rms of the change per tick"];

    /// Root mean square of the torque (N m); none before the first tick.
    #[must_use]
    pub fn rms(&self) -> Option<f64> {
        (self.ticks > 0).then(|| (self.square_sum / self.ticks as f64).sqrt())
    }

    /// Root mean square of the torque's change per tick (N m); none before the second tick.
    #[must_use]
    pub fn change_rms(&self) -> Option<f64> {
        (self.ticks > 1).then(|| (self.change_square_sum / (self.ticks - 1) as f64).sqrt())
    }
}

impl Observer for TorqueActivity {
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        let torque = tick.applied.torque_body;
        self.square_sum += torque.length_squared();
        if self.ticks > 0 {
            self.change_square_sum += (torque - self.previous).length_squared();
        }
        self.previous = torque;
        self.latest = tick.time;
        self.ticks += 1;
    }
}

impl Monitor for TorqueActivity {
    fn verdicts(&self) -> Vec<Verdict> {
        let row = |(name, value): (_, Option<f64>)| {
            let extreme = value.map_or_else(Extreme::default, |it| Extreme::at(it, self.latest));
            Verdict::new((name, "-", "N m"), Requirement::Information, extreme)
        };
        Self::ROWS.into_iter().zip([self.rms(), self.change_rms()]).map(row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_flight::{both, sample};
    use super::*;

    #[test]
    fn a_sinusoid_has_the_root_mean_squares_of_the_closed_form() {
        let (mut activity, mut tick) = (TorqueActivity::default(), sample(&both(1e-3)[0]));
        assert!(activity.rms().is_none() && activity.change_rms().is_none());
        // Whole periods: amplitude/sqrt(2), and amplitude sqrt(2) sin(angle/2) of the differences.
        let (amplitude, angle, n) =
            (DVec3::new(0.3, 0.0, -0.4), core::f64::consts::TAU / 40.0, 4_000);
        for k in 0..n {
            tick.time = f64::from(k) * 1e-3;
            tick.applied.torque_body = amplitude * (angle * f64::from(k)).sin();
            activity.observe(&tick);
        }
        let (rms, change) = (0.5f64 / 2f64.sqrt(), 0.5 * 2f64.sqrt() * (angle / 2.0).sin());
        assert!((activity.rms().expect("flown") / rms - 1.0).abs() < 1e-9);
        assert!((activity.change_rms().expect("flown") / change - 1.0).abs() < 1e-3);
        let rows = activity.verdicts();
        assert!(rows.iter().all(|row| row.pass && row.margin.is_none()));
        assert_eq!(rows[0].time, Some(3.999));
    }
}
