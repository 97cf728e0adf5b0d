//! Gains and bounds of a law in `f64`, and the true parameters of the vehicle.

use glam::{DVec3, Vec3};

use crate::lanes::{LANES, Scalars, all, lanes};
use crate::plant::PlantParameters;
use ctrl_core::config::IntegralAction;
use ctrl_core::controller::ControllerConfig;

/// Constants of the Lyapunov function of one law on one vehicle; symbols as in the theory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parameters {
    pub dt: f64,
    pub k1: f64,
    pub k2: f64,
    pub k3: DVec3,
    pub k4: DVec3,
    pub c: f64,
    pub m1: f64,
    pub m2: f64,
    pub d1: f64,
    pub d2: DVec3,
    pub gamma1: f64,
    pub gamma2: DVec3,
    pub delta_1: f64,
    pub delta_min_translation: f64,
    pub delta_min_rotation: f64,
    /// `[1/m_hi, 1/m_lo]`.
    pub inverse_mass_set: (f64, f64),
    /// `1/m`.
    pub inverse_mass: f64,
    /// `J`.
    pub inertia: DVec3,
    /// Constants of controller 2 alone.
    pub saturated: Option<SaturatedParameters>,
    /// `[J_lo, J_hi]` about each axis.
    pub inertia_set: (DVec3, DVec3),
    /// Share of a difference between acting and commanded wrench that is left in the mean of a step: `(1 - e^-x)/x`
    /// at `x = dt/T` for rotors with the lag `T`; zero for those that act at once.
    pub left_in_the_mean: f64,
    /// Constants of the integral action; none without it.
    pub integral: Option<IntegralParameters>,
}

/// Gains, bounds and true values of the integral action; what is switched off has gain and value zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct IntegralParameters {
    pub gamma_d: f64,
    pub gamma_t: f64,
    /// Bounds of the components of `d_hat`, and of `t_hat` or `s_hat`.
    pub bounds: (DVec3, DVec3),
    /// `d_c` (m/s^2).
    pub acceleration: DVec3,
    /// `t_c` (N m), controller 1, or `s_c = t_c/J` (rad/s^2), controller 2.
    pub torque: DVec3,
}

/// Parameters of controller 2 alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct SaturatedParameters {
    pub gamma3: f64,
    /// `theta = 1/J`.
    pub inverse_inertia: DVec3,
    /// `Pi`.
    pub gyroscopic_ratio: DVec3,
}

impl Parameters {
    pub fn new(law: &ControllerConfig, truth: &PlantParameters) -> Self {
        let (cascade, uncertainty) = (law.cascade(), law.uncertainty());
        let (k4, gamma2) = match law {
            ControllerConfig::RobustAdaptive(config) => (config.k4, config.gamma2),
            ControllerConfig::Saturated(config) => (config.k4, config.gamma2),
        };
        let (m_lo, m_hi) = (uncertainty.mass.lower, uncertainty.mass.upper);
        Self {
            dt: law.step_period().into(),
            k1: cascade.k1.into(),
            k2: cascade.k2.into(),
            k3: cascade.k3.as_dvec3(),
            k4: k4.as_dvec3(),
            c: cascade.c.into(),
            m1: cascade.m1.into(),
            m2: cascade.m2.into(),
            d1: uncertainty.disturbance_acceleration.into(),
            d2: uncertainty.disturbance_torque.as_dvec3(),
            gamma1: cascade.gamma1.into(),
            gamma2: gamma2.as_dvec3(),
            delta_1: cascade.delta_1.into(),
            delta_min_translation: cascade.delta_min_translation.into(),
            delta_min_rotation: cascade.delta_min_rotation.into(),
            inverse_mass_set: (1.0 / f64::from(m_hi), 1.0 / f64::from(m_lo)),
            inverse_mass: 1.0 / truth.mass,
            inertia: truth.inertia,
            saturated: SaturatedParameters::new(law, truth.inertia),
            inertia_set: (
                uncertainty.inertia.lower.as_dvec3(),
                uncertainty.inertia.upper.as_dvec3(),
            ),
            left_in_the_mean: 0.0,
            integral: IntegralParameters::new(law, truth),
        }
    }

    /// Puts rotors with the time constant `lag` (s) between command and wrench.
    pub fn set_rotor_lag(&mut self, lag: f64) {
        let x = self.dt / lag;
        self.left_in_the_mean = if lag > 0.0 { -(-x).exp_m1() / x } else { 0.0 };
    }

    /// Smoothing widths (17) of translation and rotation, each after that many ticks.
    pub fn widths(&self, ticks: &[u64; LANES]) -> (Widths, Widths) {
        let ticks = ticks.map(|ticks| ticks as f64);
        let decayed = lanes(|lane| (-2.0 * self.delta_1 * ticks[lane] * self.dt).exp());
        let ticks = Scalars::new(ticks);
        (
            Widths::new(ticks, decayed, self.delta_min_translation),
            Widths::new(ticks, decayed, self.delta_min_rotation),
        )
    }
}

/// Widths of a smooth sign at each tick of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Widths {
    /// `delta`.
    pub value: Scalars,
    /// Bound of the difference to `h` with the core's own width.
    pub sign_error: Scalars,
}

impl Widths {
    /// Over the floor `minimum`, when the square of the rest has `decayed` for `ticks`.
    fn new(ticks: Scalars, decayed: Scalars, minimum: f64) -> Self {
        let square = decayed + all(minimum * minimum);
        // The core multiplies `decayed` down in f32, half a digit's error a tick; d h/d ln delta is
        // at most 2/(3 sqrt 3).
        let drift = all(0.5) * ticks * all(0.5) * all(f64::from(f32::EPSILON)) * decayed / square;
        let sign_error = drift.min(all(1.0)) * all(2.0) / all(27f64.sqrt());
        Self { value: square.sqrt(), sign_error }
    }
}

impl IntegralParameters {
    fn new(law: &ControllerConfig, truth: &PlantParameters) -> Option<Self> {
        let integral = law.integral();
        let (divisor, inertia) = match law {
            ControllerConfig::RobustAdaptive(_) => (Vec3::ONE, DVec3::ONE),
            ControllerConfig::Saturated(_) => (law.uncertainty().inertia.lower, truth.inertia),
        };
        (*integral != IntegralAction::OFF).then(|| Self {
            gamma_d: integral.gamma_d.into(),
            gamma_t: integral.gamma_t.into(),
            bounds: (
                DVec3::splat(integral.acceleration_max.into()),
                (integral.torque_max / divisor).as_dvec3(),
            ),
            acceleration: truth.lasting.acceleration_world,
            torque: truth.lasting.torque_body / inertia,
        })
    }
}

impl SaturatedParameters {
    fn new(law: &ControllerConfig, inertia: DVec3) -> Option<Self> {
        let ControllerConfig::Saturated(config) = law else { return None };
        let DVec3 { x, y, z } = inertia;
        Some(Self {
            gamma3: config.gamma3.into(),
            inverse_inertia: inertia.recip(),
            gyroscopic_ratio: DVec3::new((y - z) / x, (z - x) / y, (x - y) / z),
        })
    }
}
