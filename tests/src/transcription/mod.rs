//! The theory page once more: both control laws in `f64`, matrix by matrix, in the page's order.
//!
//! Written from the page alone, apart from `ctrl-core`, which is measured against it. Nothing
//! here is fast: every matrix is formed, and the three passes of the derivatives evaluate the
//! force command three times. Equation numbers stand beside their lines.

pub mod cascade;
pub mod jet;
pub mod memory;
pub mod parameters;
pub mod robust_adaptive;
pub mod rotation;
pub mod rotors;
pub mod saturated;

use std::collections::BTreeMap;

pub use memory::{Memory, MemoryRate};
pub use parameters::{Gains, IntegralGains, ReferencePoint, RotorGains, Truth};
pub use rotation::Quaternion;

/// The two controllers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Law {
    /// Controller 1, Theorem 1.
    RobustAdaptive,
    /// Controller 2, Theorem 2.
    Saturated,
}

/// Every quantity of one evaluation, by its name in the golden file.
pub type Quantities = BTreeMap<&'static str, Vec<f64>>;

/// One evaluation of a law.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// Everything that the page names.
    pub quantities: Quantities,
    /// `f` (21) (N).
    pub thrust: f64,
    /// `tau` (34), (37) (N m).
    pub torque: glam::DVec3,
    /// Time derivatives of the memory, before any discretisation.
    pub rate: MemoryRate,
    /// `q_e` with the sign that was chosen.
    pub attitude_error: Quaternion,
    /// `r2` (23), to be held where it is singular.
    pub lateral: glam::DVec3,
}

impl Law {
    /// Evaluates the law at one instant.
    #[must_use]
    pub fn evaluate(
        self,
        gains: &Gains,
        truth: &Truth,
        reference: &ReferencePoint,
        memory: &Memory,
    ) -> Evaluation {
        match self {
            Self::RobustAdaptive => robust_adaptive::evaluate(gains, truth, reference, memory),
            Self::Saturated => saturated::evaluate(gains, truth, reference, memory),
        }
    }

    /// Evaluates the law and advances the memory by `dt` (s), as the page discretises it.
    pub fn step(
        self,
        gains: &Gains,
        truth: &Truth,
        reference: &ReferencePoint,
        memory: &mut Memory,
        dt: f64,
    ) -> Evaluation {
        let evaluation = self.evaluate(gains, truth, reference, memory);
        memory.advance(self, gains, &evaluation, dt);
        evaluation
    }
}
