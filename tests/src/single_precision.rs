//! The core asked the same question as the transcription: inputs rounded to `f32`, and every
//! intermediate quantity of its step under the names of the golden file.

use ctrl_core::config::{
    CascadeGains, Checkpoint, IntegralAction, RobustAdaptiveConfig, SaturatedConfig,
};
use ctrl_core::controller::{
    AdaptiveController, Auxiliary, Intermediates, LastingEstimates, StepOutput,
};
use ctrl_core::error::ConfigError;
use ctrl_core::reference::Reference;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::rotors::RotorModel;
use ctrl_core::saturated::Saturated;
use ctrl_core::vehicle::{InitialEstimate, Interval, Uncertainty, VectorInterval, VehicleState};
use glam::{DVec3, Quat, Vec3};

use crate::transcription::{Gains, Law, Memory, Quantities, Quaternion, ReferencePoint, Truth};

/// `M_p` of every configuration built here (m/s^2); the paper's trajectory needs 0.25.
pub const REFERENCE_ACCELERATION_MAX: f32 = 0.3;

/// The nearest `f32`, as `f64`.
#[must_use]
pub fn rounded(x: f64) -> f64 {
    f64::from(x as f32)
}

/// [`rounded`] for each component.
#[must_use]
pub fn rounded_each(x: DVec3) -> DVec3 {
    x.as_vec3().as_dvec3()
}

/// The quaternion in `f32`.
#[must_use]
pub fn quaternion(q: Quaternion) -> Quat {
    Quat::from_xyzw(q.eps.x as f32, q.eps.y as f32, q.eps.z as f32, q.eta as f32)
}

/// The vehicle state in `f32`.
#[must_use]
pub fn vehicle(truth: &Truth) -> VehicleState {
    VehicleState {
        position_world: truth.p.as_vec3(),
        velocity_world: truth.v.as_vec3(),
        attitude: quaternion(truth.q),
        rate_body: truth.w.as_vec3(),
    }
}

/// The reference in `f32`.
#[must_use]
pub fn reference(r: &ReferencePoint) -> Reference {
    Reference {
        position_world: r.p.as_vec3(),
        velocity_world: r.v.as_vec3(),
        acceleration_world: r.a.as_vec3(),
        jerk_world: r.jerk.as_vec3(),
        snap_world: r.snap.as_vec3(),
        left_world: r.b2.as_vec3(),
        left_rate_world: r.b2_dot.as_vec3(),
        left_acceleration_world: r.b2_ddot.as_vec3(),
    }
}

/// The memory in `f32`; `elapsed` is the time behind its `decay` (s).
#[must_use]
pub fn checkpoint(law: Law, memory: &Memory, elapsed: f64) -> Checkpoint {
    Checkpoint {
        elapsed: elapsed as f32,
        inverse_mass: memory.beta as f32,
        inertia: memory.a_hat.as_vec3(),
        inverse_inertia: memory.theta_hat.as_vec3(),
        gyroscopic_ratio: memory.pi_hat.as_vec3(),
        auxiliary: Auxiliary { attitude: quaternion(memory.q_a), rate: memory.w_a.as_vec3() },
        lasting: lasting(law, memory),
    }
}

fn lasting(law: Law, memory: &Memory) -> LastingEstimates {
    let estimates = LastingEstimates {
        acceleration_world: memory.d_hat.as_vec3(),
        ..LastingEstimates::default()
    };
    let torque = memory.lasting_torque.as_vec3();
    match law {
        Law::RobustAdaptive => LastingEstimates { torque_body: torque, ..estimates },
        Law::Saturated => LastingEstimates { angular_acceleration_body: torque, ..estimates },
    }
}

fn integral(gains: &Gains) -> IntegralAction {
    IntegralAction {
        acceleration_max: gains.integral.d_c as f32,
        gamma_d: gains.integral.gamma_d as f32,
        torque_max: gains.integral.d_t as f32,
        gamma_t: gains.integral.gamma_t as f32,
    }
}

fn rotors(gains: &Gains) -> RotorModel {
    RotorModel { lag: gains.rotors.lag as f32, residual_lag: gains.rotors.residual_lag as f32 }
}

fn uncertainty(gains: &Gains) -> Uncertainty {
    let interval = |[lower, upper]: [f64; 2]| Interval { lower: lower as f32, upper: upper as f32 };
    Uncertainty {
        mass: interval(gains.m),
        inertia: VectorInterval { lower: gains.j[0].as_vec3(), upper: gains.j[1].as_vec3() },
        disturbance_acceleration: gains.d1 as f32,
        disturbance_torque: gains.d2.as_vec3(),
    }
}

/// Those of the page's prototype, inside the intervals of all gains here.
fn initial() -> InitialEstimate {
    InitialEstimate { mass: 0.75, inertia: Vec3::splat(0.06) }
}

fn cascade(gains: &Gains) -> CascadeGains {
    CascadeGains {
        k1: gains.k1 as f32,
        k2: gains.k2 as f32,
        k3: gains.k3.as_vec3(),
        c: gains.c as f32,
        m1: gains.m1 as f32,
        m2: gains.m2 as f32,
        gamma1: gains.gamma1 as f32,
        delta_1: gains.delta_1 as f32,
        delta_min_translation: gains.delta_min_translation as f32,
        delta_min_rotation: gains.delta_min_rotation as f32,
    }
}

/// Controller 1 with these gains.
///
/// # Errors
/// What its constructor refuses.
pub fn robust_adaptive(gains: &Gains, step_period: f32) -> Result<RobustAdaptive, ConfigError> {
    RobustAdaptive::new(&RobustAdaptiveConfig {
        step_period,
        reference_acceleration_max: REFERENCE_ACCELERATION_MAX,
        uncertainty: uncertainty(gains),
        initial: initial(),
        cascade: cascade(gains),
        k4: gains.k4.as_vec3(),
        gamma2: gains.gamma2.as_vec3(),
        integral: integral(gains),
        rotors: rotors(gains),
    })
}

/// Controller 2 with these gains and the least thrust limit that (54) allows them.
///
/// # Errors
/// What its constructor refuses.
pub fn saturated(gains: &Gains, step_period: f32) -> Result<Saturated, ConfigError> {
    let sum =
        gains.m1 + gains.m2 + gains.d1 + gains.integral.d_c + f64::from(REFERENCE_ACCELERATION_MAX);
    let thrust_max = 1.0001 * gains.m[1] * (3f64.sqrt() * sum + gains.g); // (54), (20)
    Saturated::new(&SaturatedConfig {
        step_period,
        reference_acceleration_max: REFERENCE_ACCELERATION_MAX,
        uncertainty: uncertainty(gains),
        initial: initial(),
        cascade: cascade(gains),
        thrust_max: thrust_max as f32,
        torque_max: gains.m_tau.as_vec3(),
        k4: gains.k4.as_vec3(),
        k5: gains.k5 as f32,
        gamma2: gains.gamma2.as_vec3(),
        gamma3: gains.gamma3 as f32,
        integral: integral(gains),
        rotors: rotors(gains),
    })
}

/// One step of the core from a memory: its output and every intermediate quantity.
///
/// # Errors
/// What the constructor or `resume` refuses.
pub fn observe(
    law: Law,
    gains: &Gains,
    truth: &Truth,
    r: &ReferencePoint,
    memory: &Memory,
    elapsed: f64,
    step_period: f32,
) -> Result<(StepOutput, Quantities), ConfigError> {
    let (vehicle, reference) = (vehicle(truth), reference(r));
    let checkpoint = checkpoint(law, memory, elapsed);
    match law {
        Law::RobustAdaptive => {
            let controller = robust_adaptive(gains, step_period)?;
            let mut state = controller.resume(&checkpoint)?;
            Ok(observed_step(&controller, &mut state, &vehicle, &reference))
        }
        Law::Saturated => {
            let controller = saturated(gains, step_period)?;
            let mut state = controller.resume(&checkpoint)?;
            let (output, mut seen) = observed_step(&controller, &mut state, &vehicle, &reference);
            let turn = memory.q_a.rate(DVec3::from_slice(&seen["W_a"])); // (38)
            seen.insert("q_a_dot", turn.to_array().to_vec());
            Ok((output, seen))
        }
    }
}

/// A step and what its observer saw; nothing when the step held its output.
pub fn observed_step<C: AdaptiveController>(
    controller: &C,
    state: &mut C::State,
    vehicle: &VehicleState,
    reference: &Reference,
) -> (StepOutput, Quantities) {
    let mut seen = Quantities::new();
    let output = controller.step_observed(state, vehicle, reference, |i| seen = quantities(i));
    (output, seen)
}

/// The observer's quantities by their golden names; those of the other controller are zero.
fn quantities(i: &Intermediates) -> Quantities {
    let vectors = [
        ("e_p", i.position_error_world),
        ("e_v", i.velocity_error_world),
        ("G", i.g),
        ("alpha", i.alpha),
        ("alpha_dot", i.alpha_dot),
        ("alpha_ddot", i.alpha_ddot),
        ("w_d", i.desired_rate),
        ("w_d_dot", i.desired_rate_dot),
        ("mu", i.mu),
        ("mu_dot", i.mu_dot),
        ("w_e", i.rate_error),
        ("tau_d", i.torque_demand_body),
        ("tau", i.torque_body),
        ("tau_m", i.acting_torque_body),
        ("a_hat_dot", i.inertia_rate),
        ("theta_hat_dot", i.inverse_inertia_rate),
        ("Pi_hat_dot", i.gyroscopic_ratio_rate),
        ("W_a", i.auxiliary_attitude_rate),
        ("w_a_dot", i.auxiliary_rate_dot),
        ("d_hat_dot", i.lasting_acceleration_rate),
        ("lasting_torque_dot", i.lasting_torque_rate),
    ];
    let q_e = i.attitude_error;
    let others = [
        ("q_e", vec![q_e.w, q_e.x, q_e.y, q_e.z]),
        ("f", vec![i.thrust]),
        ("beta_dot", vec![i.inverse_mass_rate]),
    ];
    let vectors = vectors.map(|(name, x)| (name, x.to_array().to_vec()));
    let wide = |(name, x): (_, Vec<f32>)| (name, x.into_iter().map(f64::from).collect());
    vectors.into_iter().chain(others).map(wide).collect()
}
