//! Disturbances at their full bound.

use glam::DVec3;
use sim::plant::disturbance::{Constant, DisturbanceConfig, Gust, Noise, Sinusoid};

use super::Case;

/// Disturbance of a flight of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Nothing.
    Calm,
    /// Uniform noise, drawn anew at every tick.
    Noise,
    /// A constant push on every axis.
    Constant,
    /// A sinusoid on every axis.
    Sinusoid,
    /// A random push that lasts for some seconds.
    Gust,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Calm, Self::Noise, Self::Constant, Self::Sinusoid, Self::Gust];

    /// The kind of that name in lower case.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| format!("{kind:?}").eq_ignore_ascii_case(name))
    }
}

impl Case {
    /// The same flight under `kind`, at `D1` and `D2` on every axis. `signs` choose the direction of
    /// each component, `fraction` in 0 to 1 the time scale: 0.02 to 5 Hz, logarithmically.
    #[must_use]
    pub fn disturbed(mut self, kind: Kind, signs: [f64; 6], fraction: f64) -> Self {
        let known = self.scenario.controller.uncertainty();
        let d1 = f64::from(known.disturbance_acceleration);
        let d2 = known.disturbance_torque.as_dvec3();
        let acceleration = d1 * DVec3::new(signs[0], signs[1], signs[2]);
        let torque = d2 * DVec3::new(signs[3], signs[4], signs[5]);
        let frequency = 0.02 * 250f64.powf(fraction);
        let mut config = DisturbanceConfig::default();
        match kind {
            Kind::Calm => {}
            Kind::Noise => config.noise = Some(Noise { acceleration: d1, torque: d2 }),
            Kind::Constant => config.constant = Some(Constant { acceleration, torque }),
            Kind::Sinusoid => config.sinusoid = Some(Sinusoid { frequency, acceleration, torque }),
            Kind::Gust => {
                config.gust = Some(Gust { hold: 0.5 / frequency, acceleration: d1, torque: d2 });
            }
        }
        self.disturbance = kind;
        self.scenario.disturbance = config;
        self
    }

    /// The same flight with the disturbance torque multiplied by `fraction`.
    #[must_use]
    pub fn with_torque_fraction(mut self, fraction: f64) -> Self {
        let config = &mut self.scenario.disturbance;
        if let Some(noise) = &mut config.noise {
            noise.torque *= fraction;
        }
        if let Some(constant) = &mut config.constant {
            constant.torque *= fraction;
        }
        if let Some(wave) = &mut config.sinusoid {
            wave.torque *= fraction;
        }
        if let Some(gust) = &mut config.gust {
            gust.torque *= fraction;
        }
        self
    }
}
