//! Gains of the integral action: as much as leaves the loops half the damping wanted, as with the adaptation of the
//! mass.

use ctrl_core::controller::ControllerConfig;
use ctrl_core::vehicle::GRAVITY;

use super::digits::rounded;
use super::hover::Hover;
use super::infeasible::Infeasible;
use super::margin::of_loop;
use super::request::Request;
use super::steady::Steady;
use super::survey::{LoopSurvey, Which};

const G: f64 = GRAVITY as f64;

/// Decrease of a gain at a time, and the most times.
const DECREASE: f64 = 1.08;
const ROUNDS: u32 = 120;

/// Share of the bandwidth of the fastest axis at which the lasting torque is learnt at most.
const TORQUE_SPEED: f64 = 0.5;

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
        deciding: vec![],
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
