//! Refusal of a request that no gains meet, with remedies.

use core::fmt;

use super::digits::{rounded_down, rounded_up};
use super::request::Request;
use ctrl_core::controller::ControllerConfig;
use sim::number::number;

/// Factor by which a value is moved at a time until the request is feasible, and how often at most.
const GROWTH: f64 = 1.04;
const ROUNDS: u32 = 60;

/// Inequality that no gains meet, its two sides, and remedies.
#[derive(Clone, Debug, PartialEq)]
pub struct Infeasible {
    /// The inequality.
    pub inequality: String,
    /// Its left side, which is too large.
    pub left: f64,
    /// Its right side.
    pub right: f64,
    /// Unit of both sides.
    pub unit: &'static str,
    /// Changes with which it would hold.
    pub remedies: Vec<String>,
    /// Deciding value of the request, and the value that these gains need.
    pub remedy: Option<(Remedy, f64)>,
}

/// A value of the request whose change makes it feasible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// `thrust_max` (N), larger.
    ThrustMax,
    /// `torque_max` (N m), larger.
    TorqueMax,
    /// `step_period` (s), shorter.
    StepPeriod,
}

impl Remedy {
    /// The request with this value.
    fn applied(self, request: &Request, value: f64) -> Request {
        let mut request = request.clone();
        match (self, &mut request.limits) {
            (Self::ThrustMax, Some(limits)) => limits.thrust_max = value as f32,
            (Self::TorqueMax, Some(limits)) => limits.torque_max = value as f32,
            (Self::StepPeriod, _) => request.step_period = value as f32,
            (_, None) => {}
        }
        request.completed()
    }

    /// First value, from `value` on, with which another inequality fails or none; the search may need
    /// more than the gains that were refused first.
    pub(super) fn sufficient(
        self,
        request: &Request,
        value: f64,
        attempt: impl Fn(&Request) -> Result<ControllerConfig, Infeasible>,
    ) -> Option<String> {
        let shorter = self == Self::StepPeriod;
        let mut value = value;
        for _ in 0..ROUNDS {
            value = if shorter { rounded_down(value) } else { rounded_up(value) };
            match attempt(&self.applied(request, value)) {
                Err(Infeasible { remedy: Some((remedy, _)), .. }) if remedy == self => {
                    value *= if shorter { 1.0 / GROWTH } else { GROWTH };
                }
                _ => return Some(self.words(value)),
            }
        }
        None
    }

    fn words(self, value: f64) -> String {
        let value = number(value);
        match self {
            Self::ThrustMax => format!("thrust_max >= {value} N"),
            Self::TorqueMax => format!("torque_max >= {value} N m"),
            Self::StepPeriod => format!("step_period <= {value} s"),
        }
    }
}

impl fmt::Display for Infeasible {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { inequality, left, right, unit, remedies, .. } = self;
        let (left, right, short) = (number(*left), number(*right), number(left - right));
        write!(out, "no gains meet the request: {inequality}: {left} against {right} {unit}, ")?;
        write!(out, "{short} too much; ")?;
        write!(out, "it would hold with {}", remedies.join(", or "))
    }
}

impl core::error::Error for Infeasible {}
