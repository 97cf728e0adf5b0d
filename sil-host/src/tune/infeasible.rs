//! Refusal of a request that no gains meet, with remedies.

use core::fmt;

use glam::Vec3;

use super::digits::{rounded_down, rounded_up};
use super::request::Request;
use sim::number::number;

/// Factor by which a value is moved at a time until the request is feasible, and how often at most.
const GROWTH: f64 = 1.25;
const ROUNDS: i32 = 16;

/// Halvings of the last interval, down to 1.5 %.
const HALVINGS: u32 = 4;

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
    /// Deciding values of the request, each with what these gains need.
    pub deciding: Vec<(Remedy, f64)>,
}

/// A value of the request whose change makes it feasible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// `thrust_max` (N), larger.
    ThrustMax,
    /// `torque_max` (N m), larger: of all axes, or of one.
    TorqueMax(Option<usize>),
    /// `step_period` (s), shorter.
    StepPeriod,
    /// `wanted.attitude_bandwidth` (rad/s), smaller.
    AttitudeBandwidth,
    /// `wanted.heading_bandwidth` (rad/s), smaller.
    HeadingBandwidth,
    /// `wanted.position_bandwidth` (rad/s), smaller.
    PositionBandwidth,
    /// `wanted.damping`, smaller.
    Damping,
    /// `wanted.rotor_lead`, larger: the model of the rotors inside the law.
    RotorLead,
}

impl Remedy {
    /// Key in a vehicle file, `true` if a larger value helps, and the unit.
    fn parts(self) -> (&'static str, bool, &'static str) {
        match self {
            Self::ThrustMax => ("thrust_max", true, " N"),
            Self::TorqueMax(None) => ("torque_max", true, " N m"),
            Self::TorqueMax(Some(0)) => ("torque_max[0]", true, " N m"),
            Self::TorqueMax(Some(1)) => ("torque_max[1]", true, " N m"),
            Self::TorqueMax(Some(_)) => ("torque_max[2]", true, " N m"),
            Self::StepPeriod => ("step_period", false, " s"),
            Self::AttitudeBandwidth => ("wanted.attitude_bandwidth", false, " rad/s"),
            Self::HeadingBandwidth => ("wanted.heading_bandwidth", false, " rad/s"),
            Self::PositionBandwidth => ("wanted.position_bandwidth", false, " rad/s"),
            Self::Damping => ("wanted.damping", false, ""),
            Self::RotorLead => ("wanted.rotor_lead", true, ""),
        }
    }

    /// The request with this value.
    fn applied(self, request: &Request, value: f64) -> Request {
        let mut request = request.clone();
        let options = &mut request.options;
        match (self, &mut request.limits) {
            (Self::ThrustMax, Some(limits)) => limits.thrust_max = value as f32,
            (Self::TorqueMax(None), Some(limits)) => limits.torque_max = Vec3::splat(value as f32),
            (Self::TorqueMax(Some(axis)), Some(limits)) => limits.torque_max[axis] = value as f32,
            (Self::StepPeriod, _) => request.step_period = value as f32,
            (Self::AttitudeBandwidth, _) => options.attitude_bandwidth = Some(value),
            (Self::HeadingBandwidth, _) => options.heading_bandwidth = Some(value),
            (Self::PositionBandwidth, _) => options.position_bandwidth = Some(value),
            (Self::Damping, _) => options.damping = Some(value),
            (Self::RotorLead, _) => options.rotor_lead = Some(value),
            (_, None) => {}
        }
        request.completed()
    }

    /// A value, from `value` on, with which gains meet the request; none if this value alone does not help.
    /// A sweep finds one, and halving the last interval a close one.
    pub(super) fn sufficient(
        self,
        request: &Request,
        value: f64,
        meets: impl Fn(&Request) -> bool,
    ) -> Option<String> {
        let (key, larger, unit) = self.parts();
        let round = |value| if larger { rounded_up(value) } else { rounded_down(value) };
        let passes = |value| meets(&self.applied(request, value));
        let step = if larger { GROWTH } else { 1.0 / GROWTH };
        let mut sweep = (0..ROUNDS).map(|n| round(value * step.powi(n)));
        let mut good = sweep.find(|&value| passes(value))?;
        let mut bad = good / step;
        for _ in 0..HALVINGS {
            let middle = round((good * bad).sqrt());
            if good != round(value) && middle != good && passes(middle) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        let relation = if larger { ">=" } else { "<=" };
        Some(format!("{key} {relation} {}{unit}", number(good)))
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
