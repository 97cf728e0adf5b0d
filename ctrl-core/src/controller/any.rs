//! A controller of any kind, chosen at run time.

use glam::{Quat, Vec3};

use super::{
    AdaptiveController, Auxiliary, Estimates, Intermediates, LastingEstimates, StepOutput,
    StepStatus, TrackingController,
};
use crate::reference::Reference;
use crate::robust_adaptive::{RobustAdaptive, RobustAdaptiveState};
use crate::saturated::{Saturated, SaturatedState};
use crate::vehicle::{VehicleState, Wrench, WrenchBounds};

/// A controller of any kind. Another kind costs a variant here and an arm of the macro below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnyController {
    /// Controller 1.
    RobustAdaptive(RobustAdaptive),
    /// Controller 2.
    Saturated(Saturated),
}

/// Memory of a controller of any kind.
///
/// A step with the memory of another kind holds the lowest thrust once and begins anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnyControllerState {
    /// Memory of controller 1.
    RobustAdaptive(RobustAdaptiveState),
    /// Memory of controller 2.
    Saturated(SaturatedState),
}

/// Evaluates the expression for the controller of whichever kind.
macro_rules! of_each {
    ($any:expr, $controller:ident => $value:expr) => {
        match $any {
            AnyController::RobustAdaptive($controller) => $value,
            AnyController::Saturated($controller) => $value,
        }
    };
}

/// Evaluates the expression for a controller with its own state, else `$mismatch`.
macro_rules! with_state {
    ($any:expr, $of:expr, $controller:ident, $state:ident => $value:expr, $mismatch:expr) => {
        match ($any, $of) {
            (
                AnyController::RobustAdaptive($controller),
                AnyControllerState::RobustAdaptive($state),
            ) => $value,
            (AnyController::Saturated($controller), AnyControllerState::Saturated($state)) => {
                $value
            }
            _ => $mismatch,
        }
    };
}

impl AnyController {
    /// Replaces the memory of another kind by the initial state; the output for that one step.
    #[cold]
    #[inline(never)]
    fn begin_anew(&self, state: &mut AnyControllerState) -> StepOutput {
        *state = self.initial_state();
        let wrench = Wrench { thrust: self.bounds().thrust_min, torque_body: Vec3::ZERO };
        StepOutput { status: StepStatus::OUTPUT_HELD, ..StepOutput::from(wrench) }
    }
}

impl TrackingController for AnyController {
    type State = AnyControllerState;

    fn initial_state(&self) -> AnyControllerState {
        match self {
            Self::RobustAdaptive(controller) => {
                AnyControllerState::RobustAdaptive(controller.initial_state())
            }
            Self::Saturated(controller) => {
                AnyControllerState::Saturated(controller.initial_state())
            }
        }
    }

    #[inline]
    fn step(
        &self,
        state: &mut AnyControllerState,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        self.step_observed(state, vehicle, reference, |_| {})
    }

    fn step_period(&self) -> f32 {
        of_each!(self, controller => controller.step_period())
    }
}

impl AdaptiveController for AnyController {
    #[inline]
    fn step_observed(
        &self,
        state: &mut AnyControllerState,
        vehicle: &VehicleState,
        reference: &Reference,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        with_state!(
            self, &mut *state, controller, own =>
            controller.step_observed(own, vehicle, reference, observe),
            self.begin_anew(state)
        )
    }

    #[inline]
    fn step_limited(
        &self,
        state: &mut AnyControllerState,
        vehicle: &VehicleState,
        reference: &Reference,
        made: impl FnOnce(&Wrench) -> Vec3,
        observe: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        with_state!(
            self, &mut *state, controller, own =>
            controller.step_limited(own, vehicle, reference, made, observe),
            self.begin_anew(state)
        )
    }

    fn has_integral_action(&self) -> bool {
        of_each!(self, controller => controller.has_integral_action())
    }

    fn reference_acceleration_max(&self) -> f32 {
        of_each!(self, controller => controller.reference_acceleration_max())
    }

    fn bounds(&self) -> WrenchBounds {
        of_each!(self, controller => controller.bounds())
    }

    fn estimates(&self, state: &AnyControllerState) -> Estimates {
        with_state!(self, state, controller, own => controller.estimates(own), {
            of_each!(self, controller => controller.estimates(&controller.initial_state()))
        })
    }

    fn attitude_error(&self, state: &AnyControllerState) -> Quat {
        with_state!(self, state, controller, own => controller.attitude_error(own), Quat::IDENTITY)
    }

    fn auxiliary(&self, state: &AnyControllerState) -> Auxiliary {
        with_state!(self, state, controller, own => controller.auxiliary(own), Auxiliary::REST)
    }

    fn lasting(&self, state: &AnyControllerState) -> LastingEstimates {
        with_state!(
            self, state, controller, own => controller.lasting(own), LastingEstimates::default()
        )
    }
}
