//! Whatever the input and its order: no panic, a finite wrench inside its bounds, estimates inside
//! their sets and unmoved by refused input, and a good step right after.

use ctrl_core::controller::AdaptiveController;
use ctrl_core::controller::{Estimates, StepOutput, StepStatus, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use glam::{Quat, Vec3};
use proptest::prelude::*;
use system_tests::paper_example::{Circle, ROBUST_ADAPTIVE_GAINS, SATURATED_GAINS};
use system_tests::single_precision::{reference, robust_adaptive, saturated};
use system_tests::transcription::Gains;

const DT: f32 = 1e-3;

/// Numbers that a broken estimator, link or memory may send, next to ordinary numbers.
fn number() -> impl Strategy<Value = f32> {
    let extremes = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        1e30,
        -1e30,
        1e18,
        -1e7,
        f32::MIN_POSITIVE,
        f32::MIN_POSITIVE / 8.0,
        f32::EPSILON,
        0.0,
        -0.0,
    ];
    prop_oneof![
        6 => -3.0f32..3.0,
        3 => proptest::sample::select(extremes.to_vec()),
        2 => any::<u32>().prop_map(f32::from_bits),
    ]
}

fn vector() -> impl Strategy<Value = Vec3> {
    prop_oneof![
        2 => prop::array::uniform3(-3.0f32..3.0).prop_map(Vec3::from),
        1 => prop::array::uniform3(number()).prop_map(Vec3::from),
    ]
}

fn quaternion() -> impl Strategy<Value = Quat> {
    let any_length = prop::array::uniform4(-1.0f32..1.0).prop_map(Quat::from_array);
    prop_oneof![
        3 => any_length.prop_filter_map("no direction", |q| q.is_finite().then(|| q.normalize())),
        1 => prop::array::uniform4(-2.0f32..2.0).prop_map(Quat::from_array),
        1 => prop::array::uniform4(number()).prop_map(Quat::from_array),
        1 => Just(Quat::from_array([0.0; 4])),
    ]
}

fn vehicle() -> impl Strategy<Value = VehicleState> {
    (vector(), vector(), quaternion(), vector()).prop_map(|(p, v, q, w)| VehicleState {
        position_world: p,
        velocity_world: v,
        attitude: q,
        rate_body: w,
    })
}

/// A point of the paper's circle of which at most three vectors are something else.
fn hostile_reference() -> impl Strategy<Value = Reference> {
    let changes = prop::collection::vec((0usize..8, vector()), 0..=3);
    (0.0f64..100.0, changes).prop_map(|(t, changes)| {
        let mut r = reference(&Circle::SMALL.at(t));
        for (field, value) in changes {
            *reference_vectors(&mut r)[field] = value;
        }
        r
    })
}

fn sequence() -> impl Strategy<Value = Vec<(VehicleState, Reference)>> {
    prop::collection::vec((vehicle(), hostile_reference()), 1..30)
}

/// A vehicle beside the reference, as after the bad input.
fn good(tick: u32) -> (VehicleState, Reference) {
    let reference = reference(&Circle::SMALL.at(f64::from(tick) * f64::from(DT)));
    let position_world = reference.position_world + Vec3::new(0.1, -0.2, 0.1);
    (VehicleState::at_rest(position_world), reference)
}

/// The sets in which the estimates of both controllers must stay; `zero` for what one has not.
fn inside_their_sets(estimates: &Estimates) -> Result<(), TestCaseError> {
    let gains = ROBUST_ADAPTIVE_GAINS;
    let [m_lo, m_hi] = gains.m.map(|m| m as f32);
    let [j_lo, j_hi] = gains.j.map(|j| j.x as f32);
    prop_assert!((1.0 / m_hi..=1.0 / m_lo).contains(&estimates.inverse_mass));
    let within = |x: Vec3, lower: f32, upper: f32| {
        x == Vec3::ZERO || (x.cmpge(Vec3::splat(lower)) & x.cmple(Vec3::splat(upper))).all()
    };
    prop_assert!(within(estimates.inertia, j_lo, j_hi), "{estimates:?}");
    prop_assert!(within(estimates.inverse_inertia, 1.0 / j_hi, 1.0 / j_lo), "{estimates:?}");
    prop_assert!(within(estimates.gyroscopic_ratio, -1.0, 1.0), "{estimates:?}");
    Ok(())
}

fn keeps_its_bounds<C: AdaptiveController>(
    controller: &C,
    output: &StepOutput,
) -> Result<(), TestCaseError> {
    let (wrench, bounds) = (output.wrench, controller.bounds());
    prop_assert!(wrench.thrust.is_finite() && wrench.torque_body.is_finite(), "{wrench:?}");
    prop_assert!(bounds.thrust_min > 0.0);
    prop_assert!((bounds.thrust_min..=bounds.thrust_max).contains(&wrench.thrust), "{wrench:?}");
    prop_assert!(wrench.torque_body.abs().cmple(bounds.torque_max).all(), "{wrench:?}");
    Ok(())
}

/// Needs gains with `delta_1 = 0`: a refused step then changes nothing at all in the memory.
fn survives<C: AdaptiveController>(
    controller: &C,
    sequence: &[(VehicleState, Reference)],
) -> Result<(), TestCaseError>
where
    C::State: PartialEq + core::fmt::Debug,
{
    let mut state = controller.initial_state();
    for (vehicle, reference) in sequence {
        let before = state.clone();
        let output = controller.step(&mut state, vehicle, reference);
        keeps_its_bounds(controller, &output)?;
        inside_their_sets(&controller.estimates(&state))?;
        if output.status.intersects(StepStatus::FAULT) {
            prop_assert!(output.status.contains(StepStatus::OUTPUT_HELD));
            prop_assert_eq!(&state, &before);
        }
    }
    for tick in 0..20 {
        let (vehicle, reference) = good(tick);
        let output = controller.step(&mut state, &vehicle, &reference);
        keeps_its_bounds(controller, &output)?;
        inside_their_sets(&controller.estimates(&state))?;
        prop_assert!(!output.status.intersects(StepStatus::FAULT), "{:?}", output.status);
    }
    Ok(())
}

/// Every component of a good step's input, replaced one at a time by what no vehicle sends.
#[test]
fn each_component_out_of_range_is_refused_by_name() {
    let controller = saturated(&SATURATED_GAINS, DT).expect("shipped gains");
    let (vehicle, reference) = good(0);
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e30, -1e30];
    for value in bad {
        for component in 0..13 {
            let (mut vehicle, mut state) = (vehicle, controller.initial_state());
            *state_component(&mut vehicle, component) = value;
            let output = controller.step(&mut state, &vehicle, &reference);
            let expected = StepStatus::STATE_INVALID | StepStatus::OUTPUT_HELD;
            assert_eq!(output.status, expected, "{value} as {component}");
        }
        for component in 0..24 {
            let (mut reference, mut state) = (reference, controller.initial_state());
            *reference_component(&mut reference, component) = value;
            let output = controller.step(&mut state, &vehicle, &reference);
            let harmless = component >= HEADING && value.is_finite();
            assert_refused(
                &controller,
                &output,
                &state,
                harmless,
                &format!("{value} as {component}"),
            );
        }
    }
}

/// First component of the heading in [`reference_component`].
const HEADING: usize = 15;

/// The reference was refused by name; or, where it may be `harmless`, it has moved no estimate.
///
/// Only the direction of `b2d` counts, not its length, and a component of `b2d''` along the other
/// axes has no effect: then there is nothing to refuse.
fn assert_refused<C: AdaptiveController>(
    controller: &C,
    output: &StepOutput,
    state: &C::State,
    harmless: bool,
    what: &str,
) {
    let refused = StepStatus::REFERENCE_INVALID | StepStatus::OUTPUT_HELD;
    if output.status == refused {
        return;
    }
    assert!(
        harmless && !output.status.intersects(StepStatus::FAULT),
        "{what}: {:?}",
        output.status
    );
    keeps_its_bounds(controller, output).expect(what);
    let (now, start) = (controller.estimates(state), controller.initial_state());
    let start = controller.estimates(&start);
    let moved = (now.inverse_inertia - start.inverse_inertia).abs() / start.inverse_inertia;
    assert!(moved.max_element() < 1e-3, "{what}: {start:?} became {now:?}");
    assert!((now.inverse_mass / start.inverse_mass - 1.0).abs() < 1e-3, "{what}");
}

fn state_component(state: &mut VehicleState, i: usize) -> &mut f32 {
    match i {
        0..3 => &mut state.position_world[i],
        3..6 => &mut state.velocity_world[i - 3],
        6..9 => &mut state.rate_body[i - 6],
        9 => &mut state.attitude.x,
        10 => &mut state.attitude.y,
        11 => &mut state.attitude.z,
        _ => &mut state.attitude.w,
    }
}

fn reference_component(r: &mut Reference, i: usize) -> &mut f32 {
    &mut reference_vectors(r)[i / 3][i % 3]
}

fn reference_vectors(r: &mut Reference) -> [&mut Vec3; 8] {
    [
        &mut r.position_world,
        &mut r.velocity_world,
        &mut r.acceleration_world,
        &mut r.jerk_world,
        &mut r.snap_world,
        &mut r.left_world,
        &mut r.left_rate_world,
        &mut r.left_acceleration_world,
    ]
}

/// Two components out of range by the same magnitude and opposite signs.
#[test]
fn components_out_of_range_do_not_excuse_each_other() {
    let controller = saturated(&SATURATED_GAINS, DT).expect("shipped gains");
    for (i, j) in (0..24).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let (vehicle, mut reference) = good(0);
        *reference_component(&mut reference, i) = 1e12;
        *reference_component(&mut reference, j) = -1e12;
        let mut state = controller.initial_state();
        let output = controller.step(&mut state, &vehicle, &reference);
        let what = format!("components {i} and {j}");
        assert_refused(&controller, &output, &state, j >= HEADING, &what);
    }
}

/// Without decay of the smoothing width.
fn steady(gains: Gains) -> Gains {
    Gains { delta_1: 0.0, ..gains }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 250, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn first_controller_survives(sequence in sequence()) {
        survives(&robust_adaptive(&steady(ROBUST_ADAPTIVE_GAINS), DT).expect("gains"), &sequence)?;
    }

    #[test]
    fn second_controller_survives(sequence in sequence()) {
        survives(&saturated(&steady(SATURATED_GAINS), DT).expect("gains"), &sequence)?;
    }
}
