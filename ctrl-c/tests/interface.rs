//! The C interface called from Rust: the bits of the core, names that fit, and refusals as they are.
//! Bad input is tested from C (`tests/c`, by `cargo xtask c-library`).

use std::ffi::CStr;
use std::ptr::null_mut;

use ctrl_core::controller::{AdaptiveController, ControllerConfig, TrackingController};
use ctrl_core::error::{Bound, Condition};
use ctrl_core::reference::Reference;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::vehicle::VehicleState;
use glam::{Quat, Vec3};
use gyrfalcon::code::{GYRFALCON_OK, GYRFALCON_PARAMETER_REFUSED};
use gyrfalcon::*;

/// The same with other gains and bounds about each axis, and a model of the rotors.
fn unlike(mut config: GyrfalconConfig) -> GyrfalconConfig {
    config.k4.z *= 0.8;
    config.gamma2.y *= 0.5;
    config.torque_max.z *= 0.3;
    config.cascade.k3.y *= 0.9;
    config.uncertainty.disturbance_torque.z *= 0.2;
    config.uncertainty.inertia.upper.z *= 1.5;
    config.rotors = GyrfalconRotors { lag: 0.03, residual_lag: 0.01 };
    config
}

/// The paper's example under either controller, with axes that are alike and unlike.
fn configs() -> [ControllerConfig; 4] {
    let interval = |lower, upper| GyrfalconInterval { lower, upper };
    let splat = |x| GyrfalconVector { x, y: x, z: x };
    let config = GyrfalconConfig {
        struct_size: size_of::<GyrfalconConfig>() as u32,
        abi_version: GYRFALCON_ABI_VERSION,
        kind: GYRFALCON_SATURATED,
        step_period: 1e-3,
        reference_acceleration_max: 0.25,
        uncertainty: GyrfalconUncertainty {
            mass: interval(0.7, 1.0),
            inertia: GyrfalconVectorInterval { lower: splat(0.03), upper: splat(0.12) },
            disturbance_acceleration: 0.05,
            disturbance_torque: splat(0.05),
        },
        initial: GyrfalconInitial { mass: 0.75, inertia: splat(0.06) },
        cascade: GyrfalconCascade {
            k1: 0.5,
            k2: 1.0,
            k3: splat(2.0),
            c: 0.001,
            M1: 0.45,
            M2: 0.45,
            gamma1: 0.05,
            delta_1: 0.1,
            delta_min_translation: 0.1,
            delta_min_rotation: 0.05,
        },
        k4: splat(4.0),
        gamma2: splat(0.01),
        thrust_max: 12.0,
        torque_max: splat(0.05),
        k5: 0.5,
        gamma3: 0.01,
        integral: GyrfalconIntegral::default(),
        rotors: GyrfalconRotors::default(),
    };
    let first = GyrfalconConfig { kind: GYRFALCON_ROBUST_ADAPTIVE, k4: splat(0.5), ..config };
    [first, unlike(first), config, unlike(config)]
        .map(|config| ControllerConfig::try_from(config).expect("known kind and version"))
}

fn configured(config: &ControllerConfig) -> GyrfalconController {
    let mut controller = GyrfalconController::EMPTY;
    let size = size_of_val(&controller);
    // SAFETY: all pointers are to values of their types, or null.
    let result = unsafe { gyrfalcon_configure(&mut controller, size, &config.into(), null_mut()) };
    assert_eq!(result, GYRFALCON_OK);
    controller
}

#[test]
fn steps_have_the_bits_of_the_core() {
    for config in configs() {
        let mut through_c = configured(&config);
        let core = config.build().unwrap();
        let mut state = core.initial_state();
        let reference = Reference::hover(Vec3::new(0.3, -0.2, 1.0));
        for tick in 0..3000 {
            let t = tick as f32 * 1e-3;
            let vehicle = VehicleState {
                velocity_world: Vec3::new(0.2 * t, 0.1, -0.3),
                attitude: Quat::from_xyzw(0.6 - 0.1 * t, 0.1, 0.2 * t, 0.8).normalize(),
                rate_body: Vec3::new(4.0 - t, -3.0 + t, 0.5),
                ..VehicleState::at_rest(Vec3::new(t, 0.0, 0.0))
            };
            let expected = core.step(&mut state, &vehicle, &reference);
            let mut output = GyrfalconOutput {
                struct_size: size_of::<GyrfalconOutput>() as u32,
                ..GyrfalconOutput::default()
            };
            // SAFETY: all pointers are to values of their types.
            let result = unsafe {
                gyrfalcon_step(
                    &mut through_c,
                    &(&vehicle).into(),
                    &(&reference).into(),
                    &mut output,
                )
            };
            assert_eq!(result, GYRFALCON_OK);
            assert_eq!(output.thrust.to_bits(), expected.wrench.thrust.to_bits());
            let (found, wanted) = (Vec3::from(output.torque_body), expected.wrench.torque_body);
            assert_eq!(found.to_array().map(f32::to_bits), wanted.to_array().map(f32::to_bits));
            assert_eq!(Vec3::from(output.torque_demand_body), expected.torque_demand_body);
            assert_eq!(output.status, u32::from(expected.status.bits()));
        }
        let mut estimates = GyrfalconEstimates {
            struct_size: size_of::<GyrfalconEstimates>() as u32,
            ..GyrfalconEstimates::default()
        };
        // SAFETY: both pointers are to values of their types.
        let result = unsafe { gyrfalcon_get_estimates(&through_c, &mut estimates) };
        assert_eq!(result, GYRFALCON_OK);
        assert_eq!(estimates.inverse_mass, core.estimates(&state).inverse_mass);
        assert_ne!(estimates.inverse_mass, 1.0 / 0.75);
    }
}

#[test]
fn every_refusal_fits_and_has_a_bound_that_the_header_names() {
    let mut conditions = 0;
    let mut see = |condition: &Condition| {
        conditions += 1;
        for text in [condition.parameter, condition.source] {
            assert!(text.len() < GYRFALCON_NAME_SIZE, "{text} has {} bytes", text.len());
            assert!(text.is_ascii(), "{text}");
        }
        let named = matches!(
            condition.bound,
            Bound::Finite
                | Bound::Positive
                | Bound::NotNegative
                | Bound::Below(_)
                | Bound::AtMost(_)
                | Bound::AtLeast(_)
                | Bound::Inside(..)
        );
        assert!(named, "{}: a bound that the header does not name", condition.parameter);
    };
    for config in configs() {
        match config {
            ControllerConfig::RobustAdaptive(config) => RobustAdaptive::audit(&config, &mut see),
            ControllerConfig::Saturated(config) => Saturated::audit(&config, &mut see),
        }
    }
    assert!(conditions > 60, "{conditions} conditions seen");
}

#[test]
fn refusals_are_those_of_the_core() {
    for config in configs() {
        let mut c: GyrfalconConfig = (&config).into();
        c.cascade.k3.y = -1.0;
        let error = ControllerConfig::try_from(c).unwrap().build().unwrap_err();
        let mut refusal = GyrfalconRefusal::EMPTY;
        let mut controller = GyrfalconController::EMPTY;
        let size = size_of_val(&controller);
        // SAFETY: all pointers are to values of their types.
        let result = unsafe { gyrfalcon_configure(&mut controller, size, &c, &mut refusal) };
        assert_eq!(result, GYRFALCON_PARAMETER_REFUSED);
        let bytes = refusal.parameter.map(|c| c as u8);
        let name = CStr::from_bytes_until_nul(&bytes).unwrap().to_str().unwrap();
        assert_eq!((name, refusal.value), (error.parameter, error.value));
        assert_eq!((refusal.bound, refusal.lower), (bound::GYRFALCON_BOUND_POSITIVE, 0.0));
    }
}
