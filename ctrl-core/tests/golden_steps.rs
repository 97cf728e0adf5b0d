//! Golden steps: every intermediate quantity, the wrench and the advance of the memory against a separate
//! 64-bit implementation (`data/golden_steps.jsonl`, 12 steps of each controller, SI units, quaternions
//! scalar first; `memory` is the state before the step, `expected` the law before discretisation).

use ctrl_core::config::{
    CascadeGains, Checkpoint, IntegralAction, RobustAdaptiveConfig, SaturatedConfig,
};
use ctrl_core::controller::{
    AdaptiveController, Auxiliary, ControllerConfig, Intermediates, LastingEstimates,
};
use ctrl_core::reference::Reference;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::rotors::RotorModel;
use ctrl_core::saturated::Saturated;
use ctrl_core::vehicle::{InitialEstimate, Interval, Uncertainty, VectorInterval, VehicleState};
use glam::{Quat, Vec3};
use serde_json::Value;

const STEP_PERIOD: f32 = 1e-3;

/// Name, floor of the scale, and largest error relative to floor plus expected magnitude.
const ERROR_MAX: [(&str, f64, f64); 19] = [
    ("G", 1.0, 7e-6),
    ("alpha", 1.0, 9e-6),
    ("alpha_dot", 1.0, 2e-5),
    ("alpha_ddot", 1.0, 4e-4),
    ("f", 1.0, 2e-6),
    ("w_d", 0.1, 2e-5),
    ("w_d_dot", 0.1, 2e-4),
    ("q_e", 0.0, 4e-6),
    ("mu", 1.0, 6e-6),
    ("mu_dot", 1.0, 2e-4),
    ("w_e", 1.0, 5e-6),
    ("tau", 0.1, 3e-4),
    ("tau_d", 0.1, 5e-5),
    ("beta_dot", 0.01, 3e-5),
    ("a_hat_dot", 0.001, 2e-4),
    ("theta_hat_dot", 0.0001, 2e-5),
    ("Pi_hat_dot", 0.001, 2e-6),
    ("q_a_dot", 0.1, 9e-7),
    ("w_a_dot", 1.0, 7e-5),
];

fn number(value: &Value) -> f32 {
    value.as_f64().expect("a number") as f32
}

fn vector(value: &Value) -> Vec3 {
    Vec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

fn quaternion(value: &Value) -> Quat {
    Quat::from_xyzw(number(&value[1]), number(&value[2]), number(&value[3]), number(&value[0]))
}

fn interval(value: &Value) -> Interval {
    Interval { lower: number(&value[0]), upper: number(&value[1]) }
}

struct GoldenStep(Value);

fn golden_steps() -> impl Iterator<Item = GoldenStep> {
    let lines = include_str!("data/golden_steps.jsonl").lines();
    lines.map(|line| GoldenStep(serde_json::from_str(line).expect("a golden line")))
}

impl GoldenStep {
    fn is_saturated(&self) -> bool {
        self.0["controller"] == "saturated"
    }

    fn vehicle(&self) -> VehicleState {
        let s = &self.0["state"];
        VehicleState {
            position_world: vector(&s["p"]),
            velocity_world: vector(&s["v"]),
            attitude: quaternion(&s["q"]),
            rate_body: vector(&s["w"]),
        }
    }

    fn reference(&self) -> Reference {
        let r = &self.0["reference"];
        Reference {
            position_world: vector(&r["p"]),
            velocity_world: vector(&r["v"]),
            acceleration_world: vector(&r["a"]),
            jerk_world: vector(&r["jerk"]),
            snap_world: vector(&r["snap"]),
            left_world: vector(&r["b2"]),
            left_rate_world: vector(&r["b2_dot"]),
            left_acceleration_world: vector(&r["b2_ddot"]),
        }
    }

    fn checkpoint(&self) -> Checkpoint {
        let m = &self.0["memory"];
        let or = |name: &str, other: Vec3| m.get(name).map_or(other, vector);
        let auxiliary = Auxiliary {
            attitude: m.get("q_a").map_or(Quat::IDENTITY, quaternion),
            rate: or("w_a", Vec3::ZERO),
        };
        Checkpoint {
            elapsed: number(&m["t"]),
            inverse_mass: number(&m["beta"]),
            inertia: or("a_hat", Vec3::splat(0.06)),
            inverse_inertia: or("theta_hat", Vec3::splat(16.0)),
            gyroscopic_ratio: or("Pi_hat", Vec3::ZERO),
            auxiliary,
            lasting: LastingEstimates::default(),
        }
    }

    /// The configuration with adaptation gains of `adaptation` times the listed ones.
    fn config(&self, adaptation: f32) -> ControllerConfig {
        let g = &self.0["gains"];
        let gain = |name: &str| number(&g[name]);
        let uncertainty = Uncertainty {
            mass: interval(&g["m"]),
            inertia: VectorInterval::splat(number(&g["J"][0]), number(&g["J"][1])),
            disturbance_acceleration: gain("D1"),
            disturbance_torque: Vec3::splat(gain("D2")),
        };
        let cascade = CascadeGains {
            k1: gain("k1"),
            k2: gain("k2"),
            k3: Vec3::splat(gain("k3")),
            c: gain("c"),
            m1: gain("M1"),
            m2: gain("M2"),
            gamma1: gain("gamma1") * adaptation,
            delta_1: gain("delta_1"),
            delta_min_translation: gain("delta_min_translation"),
            delta_min_rotation: gain("delta_min_rotation"),
        };
        let initial = InitialEstimate { mass: 0.75, inertia: Vec3::splat(0.06) };
        let (step_period, reference_acceleration_max) = (STEP_PERIOD, 0.3);
        let [k4, gamma2] = [gain("k4"), gain("gamma2") * adaptation].map(Vec3::splat);
        if self.is_saturated() {
            ControllerConfig::Saturated(SaturatedConfig {
                step_period,
                reference_acceleration_max,
                uncertainty,
                initial,
                cascade,
                thrust_max: 40.0,
                torque_max: Vec3::splat(gain("M_tau")),
                k4,
                k5: gain("k5"),
                gamma2,
                gamma3: gain("gamma3") * adaptation,
                integral: IntegralAction::OFF,
                rotors: RotorModel::OFF,
            })
        } else {
            ControllerConfig::RobustAdaptive(RobustAdaptiveConfig {
                step_period,
                reference_acceleration_max,
                uncertainty,
                initial,
                cascade,
                k4,
                gamma2,
                integral: IntegralAction::OFF,
                rotors: RotorModel::OFF,
            })
        }
    }

    fn check(&self, line: usize, name: &str, actual: &[f32]) {
        let Some(expected) = self.0["expected"].get(name) else { return };
        let expected: Vec<f64> = match expected {
            Value::Array(items) => items.iter().map(|x| x.as_f64().unwrap()).collect(),
            one => vec![one.as_f64().unwrap()],
        };
        let (_, floor, bound) = ERROR_MAX.into_iter().find(|row| row.0 == name).unwrap();
        let scale = floor + expected.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        assert_eq!(actual.len(), expected.len(), "line {line}, {name}");
        for (a, e) in actual.iter().zip(&expected) {
            let error = (f64::from(*a) - e).abs() / scale;
            assert!(
                error <= bound,
                "line {line}, {name}: {actual:?} is not {expected:?} ({error:e})"
            );
        }
    }
}

/// Compares one step from the line's memory, and the change of the memory.
fn compare<C: AdaptiveController>(
    step: &GoldenStep,
    line: usize,
    controller: &C,
    mut state: C::State,
) {
    let before = (controller.estimates(&state), controller.auxiliary(&state));
    let mut seen = Intermediates::default();
    let output =
        controller.step_observed(&mut state, &step.vehicle(), &step.reference(), |i| seen = *i);
    let q_e = seen.attitude_error;
    let q_a = before.1.attitude;
    let half = 0.5 * seen.auxiliary_attitude_rate;
    let turn = q_a * Quat::from_xyzw(half.x, half.y, half.z, 0.0); // (38)
    let quantities: [(&str, &[f32]); 19] = [
        ("G", &seen.g.to_array()),
        ("alpha", &seen.alpha.to_array()),
        ("alpha_dot", &seen.alpha_dot.to_array()),
        ("alpha_ddot", &seen.alpha_ddot.to_array()),
        ("f", &[output.wrench.thrust]),
        ("w_d", &seen.desired_rate.to_array()),
        ("w_d_dot", &seen.desired_rate_dot.to_array()),
        ("q_e", &[q_e.w, q_e.x, q_e.y, q_e.z]),
        ("mu", &seen.mu.to_array()),
        ("mu_dot", &seen.mu_dot.to_array()),
        ("w_e", &seen.rate_error.to_array()),
        ("tau", &output.wrench.torque_body.to_array()),
        ("tau_d", &output.torque_demand_body.to_array()),
        ("beta_dot", &[seen.inverse_mass_rate]),
        ("a_hat_dot", &seen.inertia_rate.to_array()),
        ("theta_hat_dot", &seen.inverse_inertia_rate.to_array()),
        ("Pi_hat_dot", &seen.gyroscopic_ratio_rate.to_array()),
        ("q_a_dot", &[turn.w, turn.x, turn.y, turn.z]),
        ("w_a_dot", &seen.auxiliary_rate_dot.to_array()),
    ];
    for (name, actual) in quantities {
        step.check(line, name, actual);
    }
    // The memory moves by its rate times the step, to the first order of the step.
    let after = controller.auxiliary(&state);
    let moved = (after.rate - before.1.rate) / STEP_PERIOD;
    let rate = seen.auxiliary_rate_dot;
    let allowed = 0.01 * rate.length() + 1e-3;
    assert!((moved - rate).length() <= allowed, "line {line}: w_a moves by {moved}, not {rate}");
    let moved = (after.attitude - q_a) * (1.0 / STEP_PERIOD);
    assert!((moved - turn).length() <= 2e-3, "line {line}: q_a moves by {moved}, not {turn}");
    let beta = (controller.estimates(&state).inverse_mass - before.0.inverse_mass) / STEP_PERIOD;
    let rate = seen.inverse_mass_rate;
    assert!((beta - rate).abs() <= 1e-3, "line {line}: beta moves by {beta}, not {rate}");
}

#[test]
fn every_quantity_of_every_golden_step() {
    let mut count = [0, 0];
    for (line, step) in golden_steps().enumerate() {
        count[usize::from(step.is_saturated())] += 1;
        match step.config(1.0) {
            ControllerConfig::RobustAdaptive(config) => {
                let controller = RobustAdaptive::new(&config).unwrap();
                let state = controller.resume(&step.checkpoint()).unwrap();
                compare(&step, line, &controller, state);
            }
            ControllerConfig::Saturated(config) => {
                let controller = Saturated::new(&config).unwrap();
                let state = controller.resume(&step.checkpoint()).unwrap();
                compare(&step, line, &controller, state);
            }
        }
    }
    assert_eq!(count, [12, 12]);
}

/// Ends of an estimate's set and which of them it reached.
struct Set {
    name: &'static str,
    ends: [f32; 2],
    reached: [bool; 2],
}

impl Set {
    fn see(&mut self, x: f32) {
        let [lower, upper] = self.ends;
        assert!(lower <= x && x <= upper, "{} = {x} leaves [{lower}, {upper}]", self.name);
        self.reached = [self.reached[0] | (x == lower), self.reached[1] | (x == upper)];
    }
}

#[test]
fn estimates_reach_both_ends_of_their_sets_and_stay_inside() {
    let set = |name, lower, upper| Set { name, ends: [lower, upper], reached: [false; 2] };
    let (m, j) = ([0.7, 1.0], [0.03, 0.12]);
    let mut sets = [
        set("beta", 1.0 / m[1], 1.0 / m[0]),
        set("a_hat", j[0], j[1]),
        set("theta_hat", 1.0 / j[1], 1.0 / j[0]),
        set("Pi_hat", -1.0, 1.0),
    ];
    for step in golden_steps() {
        let controller = step.config(200.0).build().unwrap();
        let mut state = ctrl_core::controller::TrackingController::initial_state(&controller);
        let (vehicle, reference) = (step.vehicle(), step.reference());
        for _ in 0..20_000 {
            controller.step_observed(&mut state, &vehicle, &reference, |_| {});
            let estimates = controller.estimates(&state);
            sets[0].see(estimates.inverse_mass);
            if step.is_saturated() {
                estimates.inverse_inertia.to_array().into_iter().for_each(|x| sets[2].see(x));
                estimates.gyroscopic_ratio.to_array().into_iter().for_each(|x| sets[3].see(x));
            } else {
                estimates.inertia.to_array().into_iter().for_each(|x| sets[1].see(x));
            }
        }
    }
    for set in sets {
        assert_eq!(set.reached, [true; 2], "{} did not reach both ends", set.name);
    }
}
