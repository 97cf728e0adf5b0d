//! Gains of the integral action: as much as leaves the loops half the damping wanted, as with the adaptation of the
//! mass.

use ctrl_core::config::IntegralAction;
use ctrl_core::controller::ControllerConfig;
use ctrl_core::vehicle::GRAVITY;
use glam::DVec3;
use serde::Serialize;

use super::digits::{rounded, rounded_up};
use super::hover::Hover;
use super::infeasible::Infeasible;
use super::margin::of_loop;
use super::request::Request;
use super::survey::{LoopSurvey, Which};

const G: f64 = GRAVITY as f64;

/// Disturbances that last, on top of `D1` and `D2`: what integral action is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Steady {
    /// Acceleration along each horizontal axis (m/s^2); zero for no estimate of it.
    pub acceleration: f64,
    /// Torque about each axis (N m); zero for no estimate of it.
    pub torque: f64,
}

/// Decrease of a gain at a time, and the most times.
const DECREASE: f64 = 1.08;
const ROUNDS: u32 = 120;

/// Share of the bandwidth of the fastest axis at which the lasting torque is learnt at most.
const TORQUE_SPEED: f64 = 0.5;

/// A gain that the constructor accepts, until [`adapt`] finds the one to propose.
const PROVISIONAL: f64 = 1e-6;

impl Steady {
    /// What a law with this integral action bears, where `D1` is `disturbance` (m/s^2).
    #[must_use]
    pub fn borne(integral: &IntegralAction, disturbance: f64) -> Self {
        Self {
            acceleration: f64::from(integral.acceleration_max) / room(disturbance),
            torque: integral.torque_max.into(),
        }
    }

    /// `true` if nothing lasts.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Integral action with the bounds for it, where `D1` is `disturbance` (m/s^2).
    pub(super) fn bounded(&self, disturbance: f64) -> IntegralAction {
        let gain = |on: f64| if on > 0.0 { PROVISIONAL as f32 } else { 0.0 };
        IntegralAction {
            acceleration_max: rounded_up(self.acceleration * room(disturbance)) as f32,
            gamma_d: gain(self.acceleration),
            torque_max: self.torque as f32,
            gamma_t: gain(self.torque),
        }
    }
}

/// `1 + D1/g`: a vertical push within `D1` moves the mass estimate by so much, and the estimate of the horizontal one
/// with it (`docs/theory.md`).
fn room(disturbance: f64) -> f64 {
    1.0 + disturbance / G
}

/// Gives `law` the largest gains of its estimates that leave every loop half the damping and, behind rotors, the phase
/// margin.
///
/// # Errors
/// The loop that has neither at any gain.
pub(super) fn adapt(request: &Request, law: &mut ControllerConfig) -> Result<(), Infeasible> {
    let Steady { acceleration, torque } = request.steady;
    let hover = Hover::new(law);
    if torque > 0.0 {
        let start = TORQUE_SPEED * (request.attitude_bandwidths() * hover.k4).max_element();
        // By itself first: the other estimate is at rest.
        law.integral_mut().gamma_d = 0.0;
        largest(request, law, start, |law| &mut law.integral_mut().gamma_t)?;
    }
    if acceleration > 0.0 {
        // Tilt aside, the poles of height while the mass adapts.
        let weight = f64::from(hover.known.mass.upper) * G;
        let start = f64::from(law.cascade().gamma1) * weight * weight;
        largest(request, law, start, |law| &mut law.integral_mut().gamma_d)?;
    }
    Ok(())
}

fn largest(
    request: &Request,
    law: &mut ControllerConfig,
    start: f64,
    gain: fn(&mut ControllerConfig) -> &mut f32,
) -> Result<(), Infeasible> {
    let mut fault = None;
    for round in 0..ROUNDS {
        *gain(law) = rounded(start / DECREASE.powi(round as i32)) as f32;
        fault = first_fault(request, law);
        if fault.is_none() {
            return Ok(());
        }
    }
    fault.map_or(Ok(()), Err)
}

fn first_fault(request: &Request, law: &ControllerConfig) -> Option<Infeasible> {
    let asked = 0.5 * request.wanted.damping;
    let phase = request.wanted.phase_margin_deg;
    let prompt = request.rotors.is_prompt() && request.rate_filter.is_empty();
    let fault = |which: Which, what: &str, left: f64, right: f64, unit| Infeasible {
        inequality: format!("{what} asked of the loop of {} at any gain", which.name()),
        left,
        right,
        unit,
        remedies: vec!["no steady_acceleration or steady_torque".to_owned()],
        remedy: None,
    };
    let learning = Which::of(law).into_iter().filter(|it| it.is_integral());
    learning.into_iter().find_map(|which| {
        let survey = LoopSurvey::new(which, law);
        if survey.damping.value < asked || survey.decay.value <= 0.0 {
            let damping = survey.damping.value.min(asked * (1.0 - f64::EPSILON));
            return Some(fault(which, "damping", asked, damping, "of critical"));
        }
        let met = || of_loop(which, law, &request.rotors, &request.rate_filter).phase.to_degrees();
        let met = if prompt { f64::INFINITY } else { met() };
        (met < phase).then(|| fault(which, "phase margin", phase, met, "deg"))
    })
}

/// Bound of the lasting torque about each axis, on top of what `D2` has of it (N m).
pub(super) fn lasting_torque(request: &Request) -> DVec3 {
    request.lasting_torque + DVec3::splat(request.steady.torque)
}
