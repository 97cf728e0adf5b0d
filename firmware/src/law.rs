//! The control law that flies, with its memory: either controller, chosen on the ground.

use ctrl_core::controller::{Auxiliary, Estimates, StepOutput, TrackingController};
use ctrl_core::error::ConfigError;
use ctrl_core::reference::Reference;
use ctrl_core::robust_adaptive::{RobustAdaptive, RobustAdaptiveState};
use ctrl_core::saturated::{Saturated, SaturatedState};
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::VehicleState;
use glam::Quat;
use link::ControllerKind;

use crate::scenario::Tuning;

/// A validated controller and its memory.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put one on")]
pub enum Law {
    /// Controller 1.
    RobustAdaptive(RobustAdaptive, RobustAdaptiveState),
    /// Controller 2.
    Saturated(Saturated, SaturatedState),
}

/// Evaluates the expression for whichever controller it is.
macro_rules! of_either {
    ($law:expr, $controller:ident, $state:ident => $value:expr) => {
        match $law {
            Law::RobustAdaptive($controller, $state) => $value,
            Law::Saturated($controller, $state) => $value,
        }
    };
}

impl Law {
    /// The chosen controller, validated, before its first step.
    ///
    /// # Errors
    /// The parameter that the controller refuses.
    pub fn new(tuning: &Tuning) -> Result<Self, ConfigError> {
        Ok(match tuning.kind {
            ControllerKind::RobustAdaptive => {
                let controller = RobustAdaptive::new(&tuning.robust_adaptive)?;
                Self::RobustAdaptive(controller, controller.initial_state())
            }
            ControllerKind::Saturated => {
                let controller = Saturated::new(&tuning.saturated)?;
                Self::Saturated(controller, controller.initial_state())
            }
        })
    }

    /// Forgets all that was learnt.
    pub fn reset(&mut self) {
        of_either!(self, controller, state => *state = controller.initial_state());
    }

    /// One step, see [`TrackingController::step`].
    #[inline]
    pub fn step(&mut self, vehicle: &VehicleState, reference: &Reference) -> StepOutput {
        of_either!(self, controller, state => controller.step(state, vehicle, reference))
    }

    /// The estimates now.
    #[must_use]
    pub fn estimates(&self) -> Estimates {
        of_either!(self, controller, state => controller.estimates(state))
    }

    /// `q_e` of the latest step.
    #[must_use]
    pub fn attitude_error(&self) -> Quat {
        of_either!(self, controller, state => controller.attitude_error(state))
    }

    /// The auxiliary system now.
    #[must_use]
    pub fn auxiliary(&self) -> Auxiliary {
        of_either!(self, controller, state => controller.auxiliary(state))
    }

    /// The fixed step (s).
    #[must_use]
    pub fn step_period(&self) -> f32 {
        of_either!(self, controller, _state => controller.step_period())
    }

    /// Refuses a trajectory, see [`TrackingController::accept`].
    ///
    /// # Errors
    /// Names what is beyond the controller's bounds.
    pub fn accept(&self, trajectory: &impl Trajectory) -> Result<(), ConfigError> {
        of_either!(self, controller, _state => controller.accept(trajectory))
    }
}
