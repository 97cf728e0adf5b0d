//! Estimates between the steps of `f32`.
//!
//! The core accumulates its estimates with compensation, far below one `f32` step, but reports them
//! rounded. Divided by a small `gamma`, that rounding would drown the change of V over a tick. So
//! the monitor integrates the update law itself, and clamps the result to what the reported number
//! may stand for: it adds digits to the report, and cannot depart from it.

use glam::DVec3;

/// Relative error of a reported estimate: a digit in the compensation, then a rounded reciprocal.
const REPORTED: f64 = 3.0 * f32::EPSILON as f64;

/// Three estimates with the digits that the report lacks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Resolved {
    value: Option<DVec3>,
}

impl Resolved {
    /// The estimate at this tick: moved by `increment` since the last one, then projected on `set`,
    /// then clamped to `reported`.
    pub fn advance(&mut self, increment: DVec3, set: (DVec3, DVec3), reported: DVec3) -> DVec3 {
        let predicted = self.value.unwrap_or(reported) + increment;
        let projected = predicted.clamp(set.0, set.1);
        let rounding = REPORTED * reported.abs();
        let value = projected.clamp(reported - rounding, reported + rounding);
        self.value = Some(value);
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_below_the_report_are_kept_and_the_report_wins() {
        let mut resolved = Resolved::default();
        let set = (DVec3::ZERO, DVec3::splat(100.0));
        let step = DVec3::splat(1e-9);
        resolved.advance(DVec3::ZERO, set, DVec3::splat(20.0));
        let mut value = DVec3::ZERO;
        for _ in 0..100 {
            value = resolved.advance(step, set, DVec3::splat(20.0));
        }
        assert!((value - DVec3::splat(20.000_000_1)).abs().max_element() < 1e-12);
        value = resolved.advance(step, set, DVec3::splat(21.0));
        assert!((value - DVec3::splat(21.0)).abs().max_element() <= 21.0 * REPORTED);
    }
}
