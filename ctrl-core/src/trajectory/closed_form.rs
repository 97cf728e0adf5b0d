//! Test support: a trajectory against its closed form, differentiated in f64.

use std::vec::Vec;

use glam::Vec3;

use super::Trajectory;
use crate::jet::Jet;
use crate::reference::Reference;
use crate::vehicle::GRAVITY;

/// Central differences over seven points: first to fourth derivative, of order `h^4` or better.
const STENCILS: [([f64; 7], f64); 4] = [
    ([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0], 60.0),
    ([2.0, -27.0, 270.0, -490.0, 270.0, -27.0, 2.0], 180.0),
    ([1.0, -8.0, 13.0, 0.0, -13.0, 8.0, -1.0], 8.0),
    ([-1.0, 12.0, -39.0, 56.0, -39.0, 12.0, -1.0], 6.0),
];

/// Accuracy asked of the f32 evaluation of position to snap and `b2d` with two derivatives,
/// relative to the largest value over the samples.
const ACCURACY: [f64; 8] = [1e-6, 1e-6, 1e-6, 1e-6, 5e-6, 1e-6, 1e-6, 1e-6];

/// Time at `tick` (s).
pub fn at(trajectory: &impl Trajectory, tick: u64) -> f64 {
    tick as f64 * f64::from(trajectory.step_period())
}

/// `b2d = unit((p_d'' + g e3) × forward)` in f64.
pub fn facing([ax, ay, az]: [f64; 3], [fx, fy, fz]: [f64; 3]) -> [f64; 3] {
    let az = az + f64::from(GRAVITY);
    let cross = [ay * fz - az * fy, az * fx - ax * fz, ax * fy - ay * fx];
    let norm = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
    cross.map(|x| x / norm)
}

/// The derivative of `f` at `t` of the order (1 to 4), by central differences.
pub fn derivative(f: &impl Fn(f64) -> [f64; 3], t: f64, h: f64, order: usize) -> [f64; 3] {
    let (weights, divisor) = STENCILS[order - 1];
    let mut sum = [0.0; 3];
    for (i, weight) in weights.iter().enumerate() {
        let sample = f(t + (i as f64 - 3.0) * h);
        for j in 0..3 {
            sum[j] += weight * sample[j] / (divisor * h.powi(order as i32));
        }
    }
    sum
}

/// Asserts position to snap and `b2d` with two derivatives against closed forms of time, and the
/// orthogonality of `b2d`, over `duration` (s). `scale` (s) is the time in which the motion changes.
pub fn assert_follows(
    trajectory: &impl Trajectory,
    duration: f64,
    scale: f64,
    position: impl Fn(f64) -> [f64; 3],
    left: impl Fn(f64) -> [f64; 3],
) {
    let ticks_per_sample = (duration / 300.0 / f64::from(trajectory.step_period())) as u64;
    let h = 0.04 * scale;
    let (mut worst, mut size) = ([0.0f64; 8], [0.0f64; 8]);
    for sample in 0..300 {
        let tick = sample * ticks_per_sample.max(1);
        let t = at(trajectory, tick);
        let reference = trajectory.reference(tick);
        assert_orthogonal(&reference);
        let exact: Vec<[f64; 3]> = core::iter::once(position(t))
            .chain((1..5).map(|order| derivative(&position, t, h, order)))
            .chain([left(t), derivative(&left, t, h, 1), derivative(&left, t, h, 2)])
            .collect();
        for (i, (got, exact)) in quantities(&reference).iter().zip(&exact).enumerate() {
            for (got, exact) in got.to_array().iter().zip(exact) {
                worst[i] = worst[i].max((f64::from(*got) - exact).abs());
                size[i] = size[i].max(exact.abs());
            }
        }
    }
    let rounding = |order: i32| 1e-14 * (1.0 + size[0]) / h.powi(order);
    for (i, order) in [0, 1, 2, 3, 4, 0, 1, 2].into_iter().enumerate() {
        assert!(
            worst[i] <= ACCURACY[i] * size[i] + rounding(order),
            "quantity {i}: {worst:?} of {size:?}"
        );
    }
}

/// Position to snap, then `b2d` to its second derivative.
fn quantities(reference: &Reference) -> [Vec3; 8] {
    [
        reference.position_world,
        reference.velocity_world,
        reference.acceleration_world,
        reference.jerk_world,
        reference.snap_world,
        reference.left_world,
        reference.left_rate_world,
        reference.left_acceleration_world,
    ]
}

/// Asserts `|b2d| = 1` and `b2d . b3d = 0` with two derivatives, to f32 rounding.
pub fn assert_orthogonal(reference: &Reference) {
    let thrust: Jet<Vec3> = reference.specific_force().unit();
    let dot = thrust.dot(reference.left());
    let scale = |size: f32| 4e-7 * (1.0 + size);
    let rate = thrust.first.length() + reference.left_rate_world.length();
    let acceleration = thrust.second.length() + reference.left_acceleration_world.length();
    assert!((reference.left_world.length() - 1.0).abs() < 3e-7, "{reference:?}");
    assert!(dot.value.abs() < 3e-7, "{dot:?}");
    assert!(dot.first.abs() < scale(rate), "{dot:?}");
    assert!(dot.second.abs() < scale(acceleration + rate * rate), "{dot:?}");
}

/// Asserts that no acceleration in the first `ticks` exceeds the bound and that `share` of it is
/// reached.
pub fn assert_bound(trajectory: &impl Trajectory, ticks: u64, share: f32) {
    let bound = trajectory.acceleration_bound();
    let largest = (0..ticks)
        .map(|tick| trajectory.reference(tick).acceleration_world.abs().max_element())
        .fold(0.0, f32::max);
    assert!(largest <= bound, "{largest} exceeds {bound}");
    assert!(largest >= share * bound, "{largest} is far from {bound}");
}
