//! Estimates between the steps of `f32`.
//!
//! The core accumulates its estimates with compensation, far below one `f32` step, but reports them
//! rounded. Divided by a small `gamma`, that rounding would drown the change of V over a tick. So
//! the monitor integrates the update law itself, and clamps the result to what the reported number
//! may stand for: it adds digits to the report, and cannot depart from it.

use crate::lanes::Scalars;

/// Relative error of a reported estimate: a digit in the compensation, then a rounded reciprocal.
const REPORTED: f64 = 3.0 * f32::EPSILON as f64;

/// Four estimates with the digits that the report lacks: `value` of the tick before, moved by `increment` since then,
/// then projected on `set`, then clamped to `reported`.
#[inline(always)]
pub(super) fn resolved(
    value: Scalars,
    increment: Scalars,
    set: (Scalars, Scalars),
    reported: Scalars,
) -> Scalars {
    let projected = (value + increment).fast_max(set.0).fast_min(set.1);
    let rounding = Scalars::splat(REPORTED) * reported.abs();
    projected.fast_max(reported - rounding).fast_min(reported + rounding)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::all;

    #[test]
    fn digits_below_the_report_are_kept_and_the_report_wins() {
        let set = (all(0.0), all(100.0));
        let step = all(1e-9);
        let mut value = all(20.0);
        for _ in 0..100 {
            value = resolved(value, step, set, all(20.0));
        }
        assert!((value - all(20.000_000_1)).abs().simd_lt(all(1e-12)).all());
        value = resolved(value, step, set, all(21.0));
        assert!((value - all(21.0)).abs().simd_le(all(21.0 * REPORTED)).all());
    }
}
