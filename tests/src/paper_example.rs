//! The paper's example: its trajectory in `f64`, and the gains that the theory page found to fly it.

use glam::DVec3;

use crate::transcription::{Gains, IntegralGains, ReferencePoint, RotorGains};

/// A circle with a climb that fades out, as in the paper's example, facing its centre.
#[derive(Clone, Copy, Debug)]
pub struct Circle {
    /// Radius (m).
    pub radius: f64,
    /// Angular rate (rad/s).
    pub rate: f64,
    /// Height climbed in the end (m).
    pub climb: f64,
    /// Rate at which the climb fades (1/s).
    pub fading: f64,
}

impl Circle {
    /// The paper's: `p_d = (100 cos 0.05t, 100 sin 0.05t, 10 - 10 exp(-0.1t))`.
    pub const PAPER: Self = Self { radius: 100.0, rate: 0.05, climb: 10.0, fading: 0.1 };
    /// As much acceleration near the origin, where `f32` positions are fine.
    pub const SMALL: Self = Self { radius: 1.0, rate: 0.5, climb: 1.0, fading: 0.1 };

    /// The reference at time `t` (s).
    #[must_use]
    pub fn at(&self, t: f64) -> ReferencePoint {
        let (sin, cos) = (self.rate * t).sin_cos();
        let climbing = self.climb * (-self.fading * t).exp();
        let order = |n: i32, x: f64, y: f64| {
            let along = self.radius * self.rate.powi(n);
            DVec3::new(along * x, along * y, -climbing * (-self.fading).powi(n))
        };
        let b2 = DVec3::new(sin, -cos, 0.0);
        ReferencePoint {
            p: order(0, cos, sin) + self.climb * DVec3::Z,
            v: order(1, -sin, cos),
            a: order(2, -cos, -sin),
            jerk: order(3, sin, -cos),
            snap: order(4, cos, sin),
            b2,
            b2_dot: self.rate * DVec3::new(cos, sin, 0.0),
            b2_ddot: -self.rate * self.rate * b2,
        }
    }
}

/// Gains of the theory page that fly the paper's example with controller 1 (second row).
pub const ROBUST_ADAPTIVE_GAINS: Gains = Gains {
    m1: 4.0,
    m2: 4.0,
    k1: 0.5,
    k2: 1.0,
    k3: DVec3::splat(4.0),
    k4: DVec3::splat(0.5),
    k5: 0.5,
    c: 0.01,
    gamma1: 0.05,
    gamma2: DVec3::splat(0.01),
    gamma3: 0.01,
    d1: 0.05,
    d2: DVec3::splat(0.05),
    delta_1: 0.1,
    delta_min_translation: 0.1,
    delta_min_rotation: 0.05,
    m: [0.7, 1.0],
    j: [DVec3::splat(0.03), DVec3::splat(0.12)],
    m_tau: DVec3::splat(0.05),
    g: 9.81,
    integral: IntegralGains { d_c: 0.0, gamma_d: 0.0, d_t: 0.0, gamma_t: 0.0 },
    rotors: RotorGains { lag: 0.0, residual_lag: 0.0, dt: 0.0 },
};

/// Gains of the theory page that fly the paper's example with controller 2 (third row).
pub const SATURATED_GAINS: Gains = Gains {
    m1: 0.45,
    m2: 0.45,
    k3: DVec3::splat(2.0),
    k4: DVec3::splat(4.0),
    c: 0.001,
    ..ROBUST_ADAPTIVE_GAINS
};
