//! The linearisation at hover against the closed loop itself: the core's law on the RK4 plant, from the
//! plant's truth.

use ctrl_core::config::Checkpoint;
use ctrl_core::controller::ControllerConfig;
use ctrl_core::controller::{AdaptiveController, Auxiliary, LastingEstimates};
use ctrl_core::reference::Reference;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use glam::{DQuat, DVec3, Vec3};
use sil_host::tune::hover::{Corner, Hover, Loop};
use sil_host::tune::linear::{Matrix, STATES, Vector};
use sil_host::tune::request::{Request, WantedOptions};
use sil_host::tune::{design::design, pole::Pole};
use sim::plant::rigid_body::RigidBody;
use sim::plant::{Disturbance, PlantParameters, PlantState};
use sim::scenario::LoadedScenario;

/// Axis of the motion at hover.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Axis {
    /// Along x, tilting about y.
    Lateral,
    /// Along z, while the mass adapts.
    Vertical,
    /// About z.
    Heading,
}

/// The true loop at hover, long after the first step, with estimates as at `corner`.
fn fly(
    law: &ControllerConfig,
    corner: &Corner,
    axis: Axis,
    start: Vector,
    ticks: u32,
) -> Vec<Vector> {
    let inverse_mass =
        ((1.0 + if axis == Axis::Vertical { start[2] } else { 0.0 }) / corner.mass) as f32;
    let checkpoint = Checkpoint {
        elapsed: 1e5,
        inverse_mass,
        inertia: Vec3::splat(corner.inertia_estimate as f32),
        inverse_inertia: Vec3::splat((1.0 / corner.inertia_estimate) as f32),
        gyroscopic_ratio: Vec3::ZERO,
        auxiliary: Auxiliary::REST,
        lasting: estimates(axis, law, start),
    };
    match law {
        ControllerConfig::RobustAdaptive(config) => {
            let controller = RobustAdaptive::new(config).expect("accepted");
            let state = controller.resume(&checkpoint).expect("inside its sets");
            flown(&controller, state, corner, axis, start, ticks)
        }
        ControllerConfig::Saturated(config) => {
            let controller = Saturated::new(config).expect("accepted");
            let state = controller.resume(&checkpoint).expect("inside its sets");
            flown(&controller, state, corner, axis, start, ticks)
        }
    }
}

/// The estimates of the integral action in a state.
fn estimates(axis: Axis, law: &ControllerConfig, x: Vector) -> LastingEstimates {
    let (force, torque) = match axis {
        Axis::Lateral => (x[4] as f32 * Vec3::X, x[5] as f32 * Vec3::Y),
        Axis::Vertical => (Vec3::ZERO, Vec3::ZERO),
        Axis::Heading => (Vec3::ZERO, x[2] as f32 * Vec3::Z),
    };
    let acceleration_world = force;
    match law {
        ControllerConfig::RobustAdaptive(_) => LastingEstimates {
            acceleration_world,
            torque_body: torque,
            ..LastingEstimates::default()
        },
        ControllerConfig::Saturated(_) => LastingEstimates {
            acceleration_world,
            angular_acceleration_body: torque,
            ..LastingEstimates::default()
        },
    }
}

fn flown<C: AdaptiveController>(
    controller: &C,
    mut memory: C::State,
    corner: &Corner,
    axis: Axis,
    start: Vector,
    ticks: u32,
) -> Vec<Vector> {
    let parameters = PlantParameters::new(corner.mass, DVec3::splat(corner.inertia));
    let body = RigidBody::new(&parameters, controller.step_period().into(), 1);
    let reference = Reference::hover(Vec3::ZERO);
    let mut truth = placed(axis, start);
    let mut seen = Vec::new();
    for _ in 0..ticks {
        let bias = f64::from(controller.estimates(&memory).inverse_mass) * corner.mass - 1.0;
        seen.push(state_of(axis, &truth, bias, controller.lasting(&memory)));
        let output = controller.step(&mut memory, &truth.measured(), &reference);
        truth = body.advance(&truth, &output.wrench, &Disturbance::default());
    }
    seen
}

fn placed(axis: Axis, x: Vector) -> PlantState {
    let mut state = PlantState {
        position_world: DVec3::ZERO,
        velocity_world: DVec3::ZERO,
        attitude: DQuat::IDENTITY,
        rate_body: DVec3::ZERO,
    };
    match axis {
        Axis::Lateral => {
            (state.position_world.x, state.velocity_world.x) = (x[0], x[1]);
            (state.attitude, state.rate_body.y) = (DQuat::from_rotation_y(x[2]), x[3]);
        }
        Axis::Vertical => (state.position_world.z, state.velocity_world.z) = (x[0], x[1]),
        Axis::Heading => {
            (state.attitude, state.rate_body.z) = (DQuat::from_rotation_z(x[0]), x[1]);
        }
    }
    state
}

fn state_of(axis: Axis, truth: &PlantState, bias: f64, lasting: LastingEstimates) -> Vector {
    let (q, w) = (truth.attitude, truth.rate_body);
    let force = f64::from(lasting.acceleration_world.x);
    // One of both is zero.
    let torque = (lasting.torque_body + lasting.angular_acceleration_body).as_dvec3();
    let position = truth.position_world;
    let velocity = truth.velocity_world;
    let states = match axis {
        Axis::Lateral => [position.x, velocity.x, 2.0 * q.y.atan2(q.w), w.y, force, torque.y],
        Axis::Vertical => [position.z, velocity.z, bias, 0.0, 0.0, 0.0],
        Axis::Heading => [2.0 * q.z.atan2(q.w), w.z, torque.z, 0.0, 0.0, 0.0],
    };
    Vector(states)
}

fn linear(hover: &Hover, corner: &Corner, axis: Axis) -> Loop {
    match axis {
        Axis::Lateral => hover.lateral(&Corner { axis: 1, ..*corner }, true),
        Axis::Vertical => hover.vertical(corner, true),
        Axis::Heading => hover.attitude(&Corner { axis: 2, ..*corner }, true),
    }
}

/// Gains of both controllers, designed for the paper's vehicle, as shipped, unlike about each axis, and with integral
/// action.
fn laws() -> Vec<ControllerConfig> {
    let names = ["paper-robust-adaptive", "paper-saturated"];
    let shipped =
        names.map(|name| LoadedScenario::open(name, &[]).expect("built in").scenario().controller);
    let tuned = names.map(|name| {
        let request = Request::open(name, WantedOptions::default()).expect("built in");
        design(&request).expect("feasible")
    });
    let lasting = names.map(|name| {
        let wanted = WantedOptions {
            steady_acceleration: Some(0.1),
            steady_torque: Some(0.005),
            ..WantedOptions::default()
        };
        design(&Request::open(name, wanted).expect("built in")).expect("feasible")
    });
    [shipped, tuned, tuned.map(unlike), lasting].concat()
}

/// The same law with other gains and bounds about each axis.
fn unlike(mut law: ControllerConfig) -> ControllerConfig {
    law.cascade_mut().k3 *= Vec3::new(1.0, 0.8, 0.5);
    let (k4, known) = match &mut law {
        ControllerConfig::RobustAdaptive(config) => (&mut config.k4, &mut config.uncertainty),
        ControllerConfig::Saturated(config) => (&mut config.k4, &mut config.uncertainty),
    };
    *k4 *= Vec3::new(1.0, 0.9, 0.6);
    known.disturbance_torque *= Vec3::new(1.0, 0.7, 0.4);
    known.inertia.lower.z = 0.025;
    law
}

/// Inertia and estimate at the nominal point and at opposite corners; signals are small.
fn corners() -> [Corner; 3] {
    [(0.06, 0.06), (0.0301, 0.1199), (0.1199, 0.0301)].map(|(inertia, inertia_estimate)| Corner {
        axis: 0,
        mass: 0.85,
        inertia,
        inertia_estimate,
        translation_slope: 1.0,
        rotation_slope: 1.0,
    })
}

/// Steps of each state that stay within a hundredth of the smooth signs' widths.
fn small(law: &ControllerConfig, of: &Loop, axis: Axis) -> [f64; STATES] {
    let cascade = law.cascade();
    let (translation, rotation) =
        (f64::from(cascade.delta_min_translation), f64::from(cascade.delta_min_rotation));
    core::array::from_fn(|i| {
        let unit = Vector::unit(i);
        let share = (of.outputs.g.dot(unit) / translation).abs();
        let share = share + (of.outputs.rate_error.dot(unit) / rotation).abs();
        let limit = if axis == Axis::Lateral { 0.02 } else { 0.05 };
        if share > 0.0 { (0.01 / share).min(limit) } else { 1e-3 }
    })
}

/// `(x[1] - x[0])/dt` by central differences, column by column, against the sampled matrix.
#[test]
fn one_tick_of_the_true_loop_is_the_sampled_matrix() {
    for law in laws() {
        let hover = Hover::new(&law);
        for corner in corners() {
            for axis in [Axis::Lateral, Axis::Vertical, Axis::Heading] {
                let of = linear(&hover, &corner, axis);
                let steps = small(&law, &of, axis);
                for (column, step) in steps.into_iter().enumerate().take(of.order) {
                    let mut found = Vector::ZERO;
                    for sign in [1.0, -1.0] {
                        let start = sign * step * Vector::unit(column);
                        let x = fly(&law, &corner, axis, start, 2);
                        found = found + sign / (2.0 * hover.dt * step) * (x[1] - x[0]);
                    }
                    assert_column(&of.sampled, column, found, (axis, corner, &law));
                }
            }
        }
    }
}

/// To half a percent, which is what rounding to `f32` and the curvature over the steps leave.
fn assert_column(
    sampled: &Matrix,
    column: usize,
    found: Vector,
    (axis, corner, law): (Axis, Corner, &ControllerConfig),
) {
    // The mass estimate grows by less than one `f32` unit a tick; the step responses show it.
    let rows = if axis == Axis::Vertical { 0..2 } else { 0..STATES };
    for row in rows {
        let expected = sampled.0[row][column];
        let error = (found[row] - expected).abs();
        let tolerance = 5e-3 * expected.abs() + 2e-3;
        assert!(
            error <= tolerance,
            "{} {axis:?} {corner:?}: row {row}, column {column}: {} is not {expected}",
            law.key(),
            found[row]
        );
    }
}

/// The response to a small step, all along: within 2 % of the step of what the matrix says.
#[test]
fn step_responses_follow_the_sampled_matrix() {
    for law in laws() {
        let hover = Hover::new(&law);
        for corner in corners() {
            for axis in [Axis::Lateral, Axis::Vertical, Axis::Heading] {
                let of = linear(&hover, &corner, axis);
                let step = small(&law, &of, axis)[0];
                let start = step * Vector::unit(0);
                let ticks = 12_000;
                let flown = fly(&law, &corner, axis, start, ticks);
                let advance = Matrix::identity() + hover.dt * of.sampled;
                let mut x = start;
                for (tick, seen) in flown.iter().enumerate() {
                    let error = (seen[0] - x[0]).abs();
                    assert!(
                        error <= 0.02 * step,
                        "{} {axis:?} {corner:?} tick {tick}: {} is not {}",
                        law.key(),
                        seen[0],
                        x[0]
                    );
                    x = advance * x;
                }
            }
        }
    }
}

/// Once the fast modes are gone, the position moves as the slowest pair of poles says: for the step
/// `T`, `e(t + 2T) - 2 r cos(wT) e(t + T) + r^2 e(t) = 0`.
#[test]
fn dominant_poles_are_seen_in_the_flight() {
    for law in laws() {
        let hover = Hover::new(&law);
        let corner = corners()[0];
        let of = linear(&hover, &corner, Axis::Lateral);
        let poles = of.sampled_poles();
        let [first, second, third] = [poles[0], poles[1], poles[2]];
        let step = small(&law, &of, Axis::Lateral)[0];
        let period = 0.6 / second.modulus();
        let span = (period / hover.dt).round() as usize;
        // Five time constants of the third pole leave less than a percent of it.
        let begin = (5.0 / -third.re / hover.dt) as usize;
        let flown =
            fly(&law, &corner, Axis::Lateral, step * Vector::unit(0), (begin + 3 * span) as u32);
        let (sum, product) = pair(first, second, span as f64 * hover.dt);
        let e = |tick: usize| flown[tick][0];
        let scale = e(begin).abs().max(e(begin + span).abs());
        assert!(scale > 1e-4 * step, "nothing left to see");
        for tick in begin..begin + span {
            let left = e(tick + 2 * span) - sum * e(tick + span) + product * e(tick);
            assert!(left.abs() < 0.03 * scale, "{}: {left:e} of {scale:e}", law.key());
        }
    }
}

/// Sum and product of `exp(s T)` of two poles, a pair or both real.
fn pair(a: Pole, b: Pole, t: f64) -> (f64, f64) {
    let (za, zb) = ((a.re * t).exp(), (b.re * t).exp());
    (za * (a.im * t).cos() + zb * (b.im * t).cos(), za * zb * ((a.im + b.im) * t).cos())
}
