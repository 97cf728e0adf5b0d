//! The auxiliary system of controller 2 near rest: what saturation takes from a torque, however
//! little, enters `w_a` (39); without saturation a decayed system comes to rest.

use ctrl_core::controller::ControllerConfig;
use ctrl_core::controller::{AdaptiveController, Auxiliary, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::saturated::Saturated;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use sim::scenario::LoadedScenario;

fn controller() -> Saturated {
    let loaded = LoadedScenario::open("paper-saturated", &[]).unwrap();
    let ControllerConfig::Saturated(config) = loaded.scenario().controller else { unreachable!() };
    Saturated::new(&config).unwrap()
}

/// Level at the reference, turning about x.
fn turning(rate: f32) -> VehicleState {
    VehicleState { rate_body: Vec3::X * rate, ..VehicleState::at_rest(Vec3::ZERO) }
}

/// Excess of the torque about x over its limit when turning at `rate` (N m).
fn excess(controller: &Saturated, rate: f32) -> f32 {
    let mut state = controller.initial_state();
    let output = controller.step(&mut state, &turning(rate), &Reference::hover(Vec3::ZERO));
    output.torque_demand_body.x.abs() - output.wrench.torque_body.x.abs()
}

/// The slowest turn whose torque saturates, by bisection (rad/s).
fn barely_saturating(controller: &Saturated) -> f32 {
    let (mut below, mut above) = (0.0, 1.0);
    assert!(excess(controller, below) == 0.0 && excess(controller, above) > 0.0);
    for _ in 0..40 {
        let middle = 0.5 * (below + above);
        if excess(controller, middle) > 0.0 { above = middle } else { below = middle }
    }
    above
}

#[test]
fn the_smallest_excess_of_torque_is_kept() {
    let controller = controller();
    let rate = barely_saturating(&controller);
    let taken = excess(&controller, rate);
    assert!(taken > 0.0 && taken < 1e-6, "{taken} N m");
    let mut state = controller.initial_state();
    let reference = Reference::hover(Vec3::ZERO);
    let output = controller.step(&mut state, &turning(rate), &reference);
    let theta = controller.estimates(&controller.initial_state()).inverse_inertia.x;
    let drive = theta * (output.wrench.torque_body - output.torque_demand_body).x;
    let expected = controller.step_period() * drive / (1.0 + 4.0 * controller.step_period());
    let entered = controller.auxiliary(&state).rate.x;
    assert!((entered - expected).abs() <= 1e-6 * expected.abs(), "{entered} for {expected}");
}

#[test]
fn without_saturation_it_comes_to_rest() {
    let controller = controller();
    let mut state = controller.initial_state();
    let reference = Reference::hover(Vec3::ZERO);
    controller.step(&mut state, &turning(barely_saturating(&controller)), &reference);
    assert_ne!(controller.auxiliary(&state), Auxiliary::REST);
    controller.step(&mut state, &turning(0.0), &reference);
    assert_eq!(controller.auxiliary(&state), Auxiliary::REST);
}
