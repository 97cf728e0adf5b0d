//! The golden single steps of both controllers in `tests/data` (described in its README).

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Deserialize;

use crate::transcription::{Gains, Law, Memory, Quaternion, ReferencePoint, Truth};

const LINES: &str = include_str!("../data/control_step.jsonl");

/// One evaluation of a law by the golden implementation.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoldenStep {
    /// Index in the file, from zero.
    #[serde(skip)]
    pub index: usize,
    controller: Controller,
    /// Gains and bounds.
    pub gains: Gains,
    /// Vehicle.
    #[serde(rename = "state")]
    pub truth: Truth,
    /// Reference.
    pub reference: ReferencePoint,
    memory: GoldenMemory,
    /// Every quantity by name.
    pub expected: BTreeMap<String, Expected>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Controller {
    RobustAdaptive,
    Saturated,
}

/// A scalar or a vector.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum Expected {
    /// One number.
    Scalar(f64),
    /// Components, quaternions scalar first.
    Vector(Vec<f64>),
}

impl Expected {
    /// The components.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        match self {
            Self::Scalar(x) => std::slice::from_ref(x),
            Self::Vector(x) => x,
        }
    }
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct GoldenMemory {
    t: f64,
    beta: f64,
    a_hat: Option<DVec3>,
    theta_hat: Option<DVec3>,
    #[serde(rename = "Pi_hat")]
    pi_hat: Option<DVec3>,
    q_a: Option<Quaternion>,
    w_a: Option<DVec3>,
}

impl GoldenStep {
    /// The controller.
    #[must_use]
    pub fn law(&self) -> Law {
        match self.controller {
            Controller::RobustAdaptive => Law::RobustAdaptive,
            Controller::Saturated => Law::Saturated,
        }
    }

    /// Every quantity of the line by name, with its expected value.
    pub fn quantities(&self) -> impl Iterator<Item = (&str, &[f64])> {
        self.expected.iter().map(|(name, x)| (name.as_str(), x.as_slice()))
    }

    /// Time since the first step (s).
    #[must_use]
    pub fn elapsed(&self) -> f64 {
        self.memory.t
    }

    /// The memory before the step; what the line's controller does not have is at rest.
    #[must_use]
    pub fn memory(&self) -> Memory {
        let GoldenMemory { t, beta, a_hat, theta_hat, pi_hat, q_a, w_a } = self.memory;
        let middle = (self.gains.j[0] * self.gains.j[1]).map(f64::sqrt);
        Memory {
            acting: DVec3::ZERO,
            decay: (-2.0 * self.gains.delta_1 * t).exp(),
            beta,
            a_hat: a_hat.unwrap_or(middle),
            theta_hat: theta_hat.unwrap_or(middle.recip()),
            pi_hat: pi_hat.unwrap_or_default(),
            q_a: q_a.unwrap_or(Quaternion::IDENTITY),
            w_a: w_a.unwrap_or_default(),
            q_e: None,
            r2: DVec3::ZERO,
            d_hat: DVec3::ZERO,
            lasting_torque: DVec3::ZERO,
        }
    }
}

/// All golden steps.
///
/// # Panics
/// When the file is not what its README says.
#[must_use]
pub fn golden_steps() -> Vec<GoldenStep> {
    let parse = |line| serde_json::from_str(line).expect("a golden line");
    let numbered = |(index, step)| GoldenStep { index, ..step };
    LINES.lines().map(parse).enumerate().map(numbered).collect()
}
