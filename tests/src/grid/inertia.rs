//! Inertias of rigid bodies inside the interval that the controller is told.

use ctrl_core::vehicle::Interval;
use glam::DVec3;

/// `lower + fraction * (upper - lower)`.
pub(super) fn between(lower: f64, upper: f64, fraction: f64) -> f64 {
    lower + fraction * (upper - lower)
}

/// Whether a rigid body can have these principal moments: none exceeds the sum of the others.
#[must_use]
pub fn is_rigid_body(j: DVec3) -> bool {
    let twice_largest = 2.0 * j.max_element();
    j.min_element() > 0.0 && twice_largest <= j.element_sum() * (1.0 + 1e-12)
}

/// Principal moments in the interval: two anywhere, the third where a rigid body allows it.
#[must_use]
pub fn rigid_body(interval: Interval, [x, y, z]: [f64; 3]) -> DVec3 {
    let (lower, upper) = (f64::from(interval.lower), f64::from(interval.upper));
    let (first, second) = (between(lower, upper, x), between(lower, upper, y));
    let third = between(lower.max((first - second).abs()), upper.min(first + second), z);
    DVec3::new(first, second, third)
}

/// The ends: a ball of the least and of the largest inertia, a plate, a rod along each axis, and a
/// body whose three moments are as unequal as the interval and the triangle inequality allow.
#[must_use]
pub fn ends(interval: Interval) -> [DVec3; 7] {
    let (lower, upper) = (f64::from(interval.lower), f64::from(interval.upper));
    let middle = upper - lower;
    [
        DVec3::splat(lower),
        DVec3::splat(upper),
        DVec3::new(lower, lower, upper.min(2.0 * lower)),
        DVec3::new(upper, upper, lower),
        DVec3::new(lower, upper, upper),
        DVec3::new(upper, lower, upper),
        DVec3::new(lower, middle.max(lower), upper),
    ]
}
