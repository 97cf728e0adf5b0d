//! Ultimate bound of the position error under a bounded error of the state and of the force.
//!
//! `docs/guarantees.md#with-an-estimate` derives it. Each axis of the true translational error obeys
//!
//! ```text
//! p' = v,   v' = -sig_1(k1 p + k2 v) - sig_2(k2 v) - D1 h(G, delta) + n,   |n| <= N + D1
//! ```
//!
//! with any course of `n`. In the plane `(p, v)` no course can cross the orbit of the worst one, `n = (N + D1) sign(v)`,
//! from inside to outside: for `v > 0` its slope is the largest that there is, for `v < 0` the smallest. Its
//! outermost closed orbit encloses what every flight ends in.

use ctrl_core::config::CascadeGains;

/// Half orbits after which the closed orbit counts as reached.
const HALF_ORBITS: usize = 400;
/// Steps of one half orbit.
const STEPS: usize = 400_000;
/// Change from one half orbit to the next at which the orbit counts as closed.
const CLOSED: f64 = 1e-4;
/// Allowance for the integration and for the orbit that is not quite closed.
const ALLOWANCE: f64 = 1.01;

/// The translational law along one axis.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    k1: f64,
    k2: f64,
    m1: f64,
    m2: f64,
    /// `D1`.
    sign: f64,
    /// Width of the smooth sign.
    delta: f64,
}

/// Bounds of what the state's error adds to one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateErrorBounds {
    /// Of the position (m).
    pub position: f64,
    /// Of the velocity (m/s).
    pub velocity: f64,
    /// Of the force per mass, less what the law asks for (m/s^2).
    pub force: f64,
}

impl Axis {
    /// Of a law's gains, with the bound `sign` (`D1`, m/s^2) of the disturbance and the width `delta` of the smooth sign.
    #[must_use]
    pub fn new(gains: &CascadeGains, sign: f64, delta: f64) -> Self {
        let CascadeGains { k1, k2, m1, m2, .. } = *gains;
        Self { k1: k1.into(), k2: k2.into(), m1: m1.into(), m2: m2.into(), sign, delta }
    }

    /// `N` of state errors within `bounds`.
    #[must_use]
    pub fn disturbance(&self, bounds: &StateErrorBounds) -> f64 {
        let Self { k1, k2, m1, m2, sign, delta } = *self;
        let l2 = k2 * bounds.velocity;
        let l1 = k1 * bounds.position + l2;
        // `sig_i` changes by `M_i` times its argument, and by no more than from one limit to the other.
        let (s1, s2) = (m1 * l1.min(2.0), m2 * l2.min(2.0));
        let g = k2 * (s1 + s2) + k1 * bounds.velocity;
        bounds.force + s1 + s2 + sign * (g / delta).min(2.0)
    }

    /// `v'` for `n = push`.
    fn acceleration(&self, p: f64, v: f64, push: f64) -> f64 {
        let Self { k1, k2, m1, m2, sign, delta } = *self;
        let (s1, s2) = (m1 * libm::tanh(k1 * p + k2 * v), m2 * libm::tanh(k2 * v));
        let g = k2 * s1 + k2 * s2 + k1 * v;
        push - s1 - s2 - sign * g / (g * g + delta * delta).sqrt()
    }

    /// A tenth of the time in which anything changes (s).
    fn step(&self) -> f64 {
        let Self { k1, k2, m1, m2, sign, delta } = *self;
        0.1 / (k2 * (m1 + m2) + sign / delta * (k2 * k2 * (m1 + m2) + k1) + k1)
    }

    /// Position at which the worst course rests again that starts at rest at `-start`, and its largest velocity; none if it does not come
    /// to rest.
    fn half_orbit(&self, start: f64, push: f64) -> Option<(f64, f64)> {
        let dt = self.step();
        let (mut p, mut v, mut fastest) = (-start, 0.0, 0.0f64);
        let at = |p: f64, v: f64| (v, self.acceleration(p, v, push));
        for _ in 0..STEPS {
            let (a1, b1) = at(p, v);
            let (a2, b2) = at(p + 0.5 * dt * a1, v + 0.5 * dt * b1);
            let (a3, b3) = at(p + 0.5 * dt * a2, v + 0.5 * dt * b2);
            let (a4, b4) = at(p + dt * a3, v + dt * b3);
            let next_v = v + dt / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4);
            let next_p = p + dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            if next_v <= 1e-9 * push {
                return Some((next_p.max(p), fastest));
            }
            (p, v) = (next_p, next_v);
            fastest = fastest.max(v);
        }
        None
    }

    /// Ultimate bound of the position error along the axis for a disturbance of at most `n` beside `D1` (m); none if
    /// there is no bound.
    #[must_use]
    pub fn ultimate(&self, n: f64) -> Option<f64> {
        self.region(n).map(|(position, _)| position)
    }

    /// Ultimate bounds of position (m) and velocity errors (m/s), as [`ultimate`](Self::ultimate).
    #[must_use]
    pub fn region(&self, n: f64) -> Option<(f64, f64)> {
        let push = n + self.sign;
        if push <= 0.0 {
            return Some((0.0, 0.0));
        }
        let held = self.m1 + self.sign;
        if push >= held.min(self.m2 + self.sign) {
            return None;
        }
        // From far outside, so that it is the outermost closed orbit.
        let rest = libm::atanh((push / held).min(0.999)) / self.k1;
        let mut amplitude = 10.0 * rest + 1.0;
        for _ in 0..HALF_ORBITS {
            let (next, fastest) = self.half_orbit(amplitude, push)?;
            if (amplitude - next).abs() < CLOSED * next {
                return Some((ALLOWANCE * amplitude.max(next), ALLOWANCE * fastest));
            }
            if next > amplitude {
                return None;
            }
            amplitude = next;
        }
        None
    }

    /// Ultimate bound of the position error along the axis for state errors within `bounds` (m).
    #[must_use]
    pub fn position_bound(&self, bounds: &StateErrorBounds) -> Option<f64> {
        self.ultimate(self.disturbance(bounds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: Axis = Axis { k1: 0.5, k2: 1.0, m1: 4.0, m2: 3.0, sign: 0.0, delta: 0.1 };
    /// Oscillates: little damping.
    const LIVELY: Axis = Axis { k1: 0.8, k2: 0.2, m1: 4.0, m2: 3.0, ..GAINS };
    const SIGNED: Axis = Axis { sign: 0.3, ..GAINS };

    /// Largest error over the second half of a flight of one axis, over pushes of size `n` that change their sign at
    /// some period, with the velocity (period 0), or never.
    fn flown(axis: &Axis, n: f64) -> f64 {
        let (mut worst, dt, push) = (0.0f64, 1e-3, n + axis.sign);
        for period in [0.0, 0.5, 2.0, 4.0, 6.0, 9.0, 20.0, 1e9] {
            let (mut p, mut v) = (0.5, -0.1);
            for k in 0..120_000 {
                let time = f64::from(k) * dt;
                let first =
                    if period == 0.0 { v > 0.0 } else { libm::fmod(time, period) < 0.5 * period };
                v += dt * axis.acceleration(p, v, if first { push } else { -push });
                p += dt * v;
                if k > 60_000 {
                    worst = worst.max(f64::abs(p));
                }
            }
        }
        worst
    }

    #[test]
    fn flights_of_an_axis_end_inside_the_bound_and_the_worst_one_near_it() {
        for axis in [GAINS, LIVELY, SIGNED] {
            for n in [0.02, 0.2, 1.0, 2.0] {
                let (bound, seen) = (axis.ultimate(n).expect("bounded"), flown(&axis, n));
                println!("{axis:?}, N {n}: {seen} within {bound}");
                assert!(seen <= bound, "N {n}: {seen} > {bound}");
                assert!(bound < 1.1 * seen, "N {n}: {seen} far below {bound}");
            }
        }
    }

    #[test]
    fn a_disturbance_as_large_as_a_saturation_has_no_bound() {
        assert_eq!(GAINS.ultimate(3.0), None);
        assert!(GAINS.ultimate(2.5).is_some());
        // It drifts away.
        assert!(flown(&Axis { m1: 1.0, m2: 1.0, ..GAINS }, 2.5) > 1e3);
    }

    #[test]
    fn the_bound_grows_with_every_part_and_vanishes_with_all() {
        let bounds = StateErrorBounds { position: 0.01, velocity: 0.02, force: 0.1 };
        let axis = Axis { sign: 0.05, ..GAINS };
        // 0.1 + 4 (0.005 + 0.02) + 3 0.02 + 0.05 (0.16 + 0.01)/0.1.
        assert!((axis.disturbance(&bounds) - 0.345).abs() < 1e-12);
        for more in [
            StateErrorBounds { position: 0.02, ..bounds },
            StateErrorBounds { velocity: 0.03, ..bounds },
            StateErrorBounds { force: 0.2, ..bounds },
        ] {
            assert!(axis.position_bound(&more) > axis.position_bound(&bounds));
        }
        assert_eq!(GAINS.ultimate(0.0), Some(0.0));
    }
}
