//! Inertias at the ends of the interval that the controller is told, alike about each axis.

use ctrl_core::vehicle::VectorInterval;
use glam::DVec3;

/// The ends: a ball of the least and of the largest inertia, a plate, a rod along each axis, and a
/// body whose three moments are as unequal as the interval and the triangle inequality allow.
#[must_use]
pub fn ends(interval: VectorInterval) -> [DVec3; 7] {
    let (lower, upper) = (f64::from(interval.lower.x), f64::from(interval.upper.x));
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

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL: VectorInterval = VectorInterval::splat(0.03, 0.12);

    /// No moment exceeds the sum of the others, and each is in the interval.
    fn assert_possible(j: DVec3) {
        assert!(2.0 * j.max_element() <= j.element_sum() + 1e-12, "{j}");
        assert!(j.min_element() >= f64::from(INTERVAL.lower.x), "{j}");
        assert!(j.max_element() <= f64::from(INTERVAL.upper.x), "{j}");
    }

    #[test]
    fn every_end_is_a_rigid_body() {
        ends(INTERVAL).into_iter().for_each(assert_possible);
    }

    #[test]
    fn the_ends_reach_both_ends_and_the_triangle_inequality() {
        let ends = ends(INTERVAL);
        let flat = |j: &DVec3| (2.0 * j.max_element() - j.element_sum()).abs() < 1e-12;
        assert!(ends.iter().any(flat));
        assert!(ends.iter().any(|j| j.max_element() == f64::from(INTERVAL.lower.x)));
        assert!(ends.iter().any(|j| j.min_element() == f64::from(INTERVAL.upper.x)));
    }
}
