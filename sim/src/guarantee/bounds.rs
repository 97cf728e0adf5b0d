//! Thrust bounds of the theorems for a controller's configuration.

use ctrl_core::controller::ControllerConfig;
use ctrl_core::vehicle::GRAVITY;

/// Bounds (19) and (20) of the thrust.
pub trait ThrustBounds {
    /// Lower thrust bound (19) (N).
    fn thrust_lower_bound(&self) -> f64;

    /// Upper thrust bound (20), with `D_c` of the integral action beside `D1` (N).
    fn thrust_upper_bound(&self) -> f64;
}

impl ThrustBounds for ControllerConfig {
    fn thrust_lower_bound(&self) -> f64 {
        let [m_p, m1, m2, d1] = accelerations(self);
        f64::from(self.uncertainty().mass.lower) * (f64::from(GRAVITY) - m_p - m1 - m2 - d1)
    }

    fn thrust_upper_bound(&self) -> f64 {
        let [m_p, m1, m2, d1] = accelerations(self);
        let lasting = f64::from(self.integral().acceleration_max);
        let total = 3f64.sqrt() * (m1 + m2 + d1 + m_p + lasting) + f64::from(GRAVITY);
        f64::from(self.uncertainty().mass.upper) * total
    }
}

/// `M_p`, `M1`, `M2`, `D1` (m/s^2).
fn accelerations(law: &ControllerConfig) -> [f64; 4] {
    let cascade = law.cascade();
    [
        law.reference_acceleration_max(),
        cascade.m1,
        cascade.m2,
        law.uncertainty().disturbance_acceleration,
    ]
    .map(f64::from)
}
