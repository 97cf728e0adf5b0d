//! What the theorems promise of a controller's configuration.

use ctrl_core::config::CascadeGains;
use ctrl_core::vehicle::GRAVITY;

use crate::scenario::ControllerConfig;

impl ControllerConfig {
    /// Gains of the shared cascade.
    #[must_use]
    pub fn cascade(&self) -> &CascadeGains {
        match self {
            Self::RobustAdaptive(config) => &config.cascade,
            Self::Saturated(config) => &config.cascade,
        }
    }

    /// The same, to change.
    pub fn cascade_mut(&mut self) -> &mut CascadeGains {
        match self {
            Self::RobustAdaptive(config) => &mut config.cascade,
            Self::Saturated(config) => &mut config.cascade,
        }
    }

    /// Lower thrust bound (19) (N).
    #[must_use]
    pub fn thrust_lower_bound(&self) -> f64 {
        let (m1, m2, d1, m_p) = self.accelerations();
        f64::from(self.uncertainty().mass.lower) * (f64::from(GRAVITY) - m_p - m1 - m2 - d1)
    }

    /// Upper thrust bound (20) (N).
    #[must_use]
    pub fn thrust_upper_bound(&self) -> f64 {
        let (m1, m2, d1, m_p) = self.accelerations();
        let total = 3f64.sqrt() * (m1 + m2 + d1 + m_p) + f64::from(GRAVITY);
        f64::from(self.uncertainty().mass.upper) * total
    }

    /// `M_tau` (N m), controller 2 only.
    #[must_use]
    pub fn torque_max(&self) -> Option<f64> {
        match self {
            Self::RobustAdaptive(_) => None,
            Self::Saturated(config) => Some(f64::from(config.torque_max)),
        }
    }

    /// `M_f` (N), controller 2 only.
    #[must_use]
    pub fn thrust_max(&self) -> Option<f64> {
        match self {
            Self::RobustAdaptive(_) => None,
            Self::Saturated(config) => Some(f64::from(config.thrust_max)),
        }
    }

    /// `M1`, `M2`, `D1`, `M_p` (m/s^2).
    fn accelerations(&self) -> (f64, f64, f64, f64) {
        let m_p = match self {
            Self::RobustAdaptive(config) => config.reference_acceleration_max,
            Self::Saturated(config) => config.reference_acceleration_max,
        };
        let cascade = self.cascade();
        (
            cascade.m1.into(),
            cascade.m2.into(),
            self.uncertainty().disturbance_acceleration.into(),
            m_p.into(),
        )
    }
}
