//! The app's twin in Rust: the same conversions, then the core without the C interface.

use ctrl_core::controller::{
    AnyController, AnyControllerState, ControllerConfig, StepOutput, TrackingController,
};
use ctrl_core::jet::Jet;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use sim::closed_loop::ObservedController;

use crate::set_point::SetPoint;

const RADIANS_PER_DEGREE: f32 = 0.017_453_292;

/// The controller of a scenario behind the app's conversions.
pub struct Twin(AnyController);

impl Twin {
    /// With these gains.
    pub fn new(config: &ControllerConfig) -> Self {
        Self(config.build().expect("gains"))
    }
}

impl TrackingController for Twin {
    type State = AnyControllerState;

    fn initial_state(&self) -> AnyControllerState {
        self.0.initial_state()
    }

    fn step(
        &self,
        state: &mut AnyControllerState,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        let set_point = SetPoint::new(vehicle, reference);
        let vehicle = VehicleState { rate_body: set_point.gyro * RADIANS_PER_DEGREE, ..*vehicle };
        self.0.step(state, &vehicle, &wanted(&set_point))
    }

    fn step_period(&self) -> f32 {
        self.0.step_period()
    }
}

impl ObservedController for Twin {}

/// The reference that the app makes of a set-point.
#[allow(clippy::disallowed_methods, reason = "the app calls the platform's sine, too")]
fn wanted(set_point: &SetPoint) -> Reference {
    let SetPoint { reference, yaw, yaw_rate, .. } = set_point;
    let (yaw, rate) = (yaw * RADIANS_PER_DEGREE, yaw_rate * RADIANS_PER_DEGREE);
    let forward = Vec3::new(yaw.cos(), yaw.sin(), 0.0);
    let first = Vec3::new(-rate * forward.y, rate * forward.x, 0.0);
    let second = Vec3::new(-rate * rate * forward.x, -rate * rate * forward.y, 0.0);
    let bare = Reference {
        left_world: Vec3::ZERO,
        left_rate_world: Vec3::ZERO,
        left_acceleration_world: Vec3::ZERO,
        snap_world: Vec3::ZERO,
        ..*reference
    };
    bare.facing(Jet::new(forward, first, second))
}
