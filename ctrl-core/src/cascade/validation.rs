//! The checks that turn a configuration into a controller's shared part.
//!
//! Beyond signs and order, they are the corrected inequalities of the paper and what a fixed step
//! asks of the gains: each loop below, with the step held over `dt`, has its fastest linear rate
//! (or, for a second-order loop, its natural frequency) times `dt` at most one, half of what makes a
//! held first-order loop unstable.

use glam::Vec3;

use super::Cascade;
use super::integral::{Integral, TorqueEstimate};
use super::step_rate::{require_integrable, require_integrable_axes};
use crate::config::{CascadeGains, IntegralAction};
use crate::error::Bound::{Below, Finite, Inside, NotNegative, Positive};
use crate::error::{Bound, ConfigError, Judge, axis_names};
use crate::sqrt::sqrt;
use crate::vehicle::{GRAVITY, InitialEstimate, Uncertainty, WrenchBounds};

/// `sqrt(3)`: norm of a vector whose components are one.
const SQRT_3: f32 = 1.732_050_8;

impl Cascade {
    /// Validates what the two controllers share. The torque bound is the controller's to set.
    pub fn new(
        step_period: f32,
        reference_acceleration_max: f32,
        uncertainty: Uncertainty,
        initial: InitialEstimate,
        gains: CascadeGains,
        (integral, torque): (&IntegralAction, TorqueEstimate),
        judge: &mut impl Judge,
    ) -> Result<Self, ConfigError> {
        judge.require(
            "step_period",
            step_period,
            Inside(1e-5, 0.1),
            "seconds between two steps",
        )?;
        require_uncertainty(judge, &uncertainty)?;
        require_initial(judge, &initial, &uncertainty)?;
        require_gains(judge, &gains)?;
        let loops = Integral::new(integral, torque, step_period, &gains, judge)?;
        let lasting = integral.acceleration_max;
        let bounds =
            thrust_bounds(judge, &uncertainty, &gains, reference_acceleration_max, lasting)?;
        require_integrable_cascade(judge, step_period, &uncertainty, &gains, bounds.thrust_max)?;
        Ok(Self {
            step_period,
            reference_acceleration_max,
            uncertainty,
            gains,
            bounds,
            integral: loops,
            initial,
            inverse_mass_min: 1.0 / uncertainty.mass.upper,
            inverse_mass_max: 1.0 / uncertainty.mass.lower,
            smoothing_decay: -libm::expm1f(-2.0 * gains.delta_1 * step_period),
            twice_c: 2.0 * gains.c,
            floor_translation: gains.delta_min_translation * gains.delta_min_translation,
            floor_rotation: gains.delta_min_rotation * gains.delta_min_rotation,
        })
    }
}

/// Assumptions 1 to 3.
#[inline(never)]
fn require_uncertainty(judge: &mut impl Judge, known: &Uncertainty) -> Result<(), ConfigError> {
    judge.require("uncertainty.mass.lower", known.mass.lower, Positive, "Assumption 1")?;
    let above = Inside(known.mass.lower, 1e6);
    judge.require("uncertainty.mass.upper", known.mass.upper, above, "Assumption 1, ordered")?;
    let inertia = known.inertia;
    let names = axis_names!("uncertainty.inertia.lower");
    judge.require_axes(names, inertia.lower, [Inside(1e-9, 1e6); 3], "Assumption 2")?;
    let above = inertia.lower.to_array().map(|lower| Inside(lower, 1e6));
    let names = axis_names!("uncertainty.inertia.upper");
    judge.require_axes(names, inertia.upper, above, "Assumption 2, ordered")?;
    let (d1, d2) = (known.disturbance_acceleration, known.disturbance_torque);
    judge.require("uncertainty.disturbance_acceleration", d1, NotNegative, "D1, Assumption 3")?;
    let names = axis_names!("uncertainty.disturbance_torque");
    judge.require_axes(names, d2, [NotNegative; 3], "D2, Assumption 3")
}

/// Initial estimates inside their sets.
#[inline(never)]
fn require_initial(
    judge: &mut impl Judge,
    initial: &InitialEstimate,
    known: &Uncertainty,
) -> Result<(), ConfigError> {
    let mass = Inside(known.mass.lower, known.mass.upper);
    judge.require("initial.mass", initial.mass, mass, "uncertainty.mass")?;
    let [x, y, z] = known.inertia.axes().map(Bound::from);
    judge.require("initial.inertia[0]", initial.inertia.x, x, "uncertainty.inertia")?;
    judge.require("initial.inertia[1]", initial.inertia.y, y, "uncertainty.inertia")?;
    judge.require("initial.inertia[2]", initial.inertia.z, z, "uncertainty.inertia")
}

/// Signs of the gains.
#[inline(never)]
fn require_gains(judge: &mut impl Judge, gains: &CascadeGains) -> Result<(), ConfigError> {
    judge.require("cascade.k1", gains.k1, Positive, "step 1")?;
    judge.require("cascade.k2", gains.k2, Positive, "step 1")?;
    judge.require_axes(axis_names!("cascade.k3"), gains.k3, [Positive; 3], "step 3")?;
    judge.require("cascade.c", gains.c, NotNegative, "weight of V1")?;
    judge.require("cascade.M1", gains.m1, Positive, "limit of sigma_1")?;
    judge.require("cascade.M2", gains.m2, Positive, "limit of sigma_2")?;
    judge.require("cascade.gamma1", gains.gamma1, NotNegative, "(14)")?;
    judge.require("cascade.delta_1", gains.delta_1, NotNegative, "decay of delta(t), (17)")?;
    let width = Inside(1e-6, 1e6);
    judge.require("cascade.delta_min_translation", gains.delta_min_translation, width, "(17)")?;
    judge.require("cascade.delta_min_rotation", gains.delta_min_rotation, width, "(17)")
}

/// The thrust bounds (19) and (20); refuses gains for which (19) fails. `lasting` is `D_c`: horizontal, so
/// that it joins `D1` in (20) and leaves (19), which is about the vertical axis.
#[inline(never)]
fn thrust_bounds(
    judge: &mut impl Judge,
    known: &Uncertainty,
    gains: &CascadeGains,
    reference_acceleration_max: f32,
    lasting: f32,
) -> Result<WrenchBounds, ConfigError> {
    let name = "reference_acceleration_max";
    judge.require(name, reference_acceleration_max, NotNegative, "M_p, Assumption 4")?;
    let spared = GRAVITY - reference_acceleration_max - known.disturbance_acceleration;
    let sum = gains.m1 + gains.m2;
    judge.require("cascade.M1 + cascade.M2", sum, Below(spared), "g - M_p - D1, (19)")?;
    let lateral = sum + known.disturbance_acceleration + reference_acceleration_max + lasting;
    let bounds = WrenchBounds {
        thrust_min: known.mass.lower * (spared - sum),
        thrust_max: known.mass.upper * (SQRT_3 * lateral + GRAVITY),
        torque_max: Vec3::splat(f32::MAX),
    };
    judge.require("lower thrust bound", bounds.thrust_min, Positive, "(19)")?;
    judge.require("upper thrust bound", bounds.thrust_max, Finite, "(20)")?;
    Ok(bounds)
}

/// Loops of steps 1 to 3.
#[inline(never)]
fn require_integrable_cascade(
    judge: &mut impl Judge,
    step_period: f32,
    known: &Uncertainty,
    gains: &CascadeGains,
    thrust_max: f32,
) -> Result<(), ConfigError> {
    let sum = gains.m1 + gains.m2;
    // Slope of G, and with it of the smooth sign, with respect to velocity.
    let slope = gains.k2 * gains.k2 * sum + gains.k1;
    let damping =
        gains.k2 * sum + known.disturbance_acceleration * slope / gains.delta_min_translation;
    let name = "step_period * (k2 (M1 + M2) + D1 (k2^2 (M1 + M2) + k1)/delta_min_translation)";
    require_integrable(judge, name, step_period, damping)?;
    let name = "step_period * sqrt(k1 M1)";
    require_integrable(judge, name, step_period, sqrt(gains.k1 * gains.m1))?;
    let name = "step_period * f_max sqrt(gamma1 (k2^2 (M1 + M2) + k1))";
    require_integrable(judge, name, step_period, thrust_max * sqrt(gains.gamma1 * slope))?;
    let names = axis_names!(expression "step_period * k3");
    require_integrable_axes(judge, names, step_period, gains.k3)?;
    require_integrable(judge, "step_period * delta_1", step_period, gains.delta_1)
}
