//! Tests of the shaping: bound, derivatives, arrival, totality.

use std::vec::Vec;

use proptest::prelude::*;

use super::*;

const CONFIG: ShaperConfig = ShaperConfig {
    step_period: 1e-3,
    acceleration_max: 0.25,
    speed_max: 2.0,
    climb_max: 1.0,
    descent_max: 0.7,
    yaw_rate_max: 0.6,
    smoothing_time: 0.1,
};

fn shaper() -> Shaper {
    Shaper::new(&CONFIG).unwrap()
}

/// References of `ticks` ticks towards the set-points, each followed for as long as the others.
fn flown(setpoints: &[Setpoint], ticks: usize) -> Vec<Reference> {
    let (shaper, mut state) = (shaper(), ShaperState::at_rest(Vec3::new(1.0, -2.0, 3.0), 0.4));
    let each = setpoints.iter().flat_map(|setpoint| core::iter::repeat_n(setpoint, ticks));
    each.map(|setpoint| shaper.step(&mut state, setpoint)).collect()
}

/// Velocity, acceleration and so on are the derivatives of one another: the trapezoid of the derivative
/// over a tick is the difference of the values, to the third order of the tick.
fn assert_derivatives(references: &[Reference], tolerance: [f32; 4]) {
    let dt = CONFIG.step_period;
    for pair in references.windows(2) {
        let orders = |r: &Reference| {
            [r.position_world, r.velocity_world, r.acceleration_world, r.jerk_world, r.snap_world]
        };
        let (before, after) = (orders(&pair[0]), orders(&pair[1]));
        for order in 0..4 {
            let change = (after[order] - before[order]) / dt;
            let mean = 0.5 * (before[order + 1] + after[order + 1]);
            let error = (change - mean).abs().max_element();
            assert!(error < tolerance[order], "order {order}: {error}");
        }
    }
}

#[test]
fn a_position_is_reached_without_overshoot_within_the_bounds() {
    let target = Vec3::new(9.0, -2.0, 5.0);
    let references = flown(&[Setpoint::at(target).facing(-2.0)], 40_000);
    let start = Vec3::new(1.0, -2.0, 3.0);
    for reference in &references {
        assert!(reference.acceleration_world.length() <= CONFIG.acceleration_max);
        assert!(reference.velocity_world.z <= CONFIG.climb_max + 1e-5);
        let way = (target - start).normalize();
        let gone = reference.position_world - start;
        assert!((gone - way * gone.dot(way)).length() < 1e-4, "leaves the line: {gone}");
        assert!(gone.dot(way) < (target - start).length() + 1e-4, "overshoots: {gone}");
    }
    let last = references.last().unwrap();
    assert!((last.position_world - target).length() < 1e-4, "{last:?}");
    assert!(last.velocity_world.length() < 1e-4 && last.snap_world.length() < 1e-3);
    let left = Vec3::new(-libm::sinf(-2.0), libm::cosf(-2.0), 0.0);
    assert!((last.left_world - left).length() < 1e-4, "{}", last.left_world);
}

#[test]
fn derivatives_are_exact_through_jumps_of_the_setpoint() {
    let east = Setpoint { velocity_world: [Some(1.5), Some(-1.0), None], ..Setpoint::default() };
    let push = Setpoint { acceleration_world: [None, None, Some(0.2)], ..Setpoint::default() };
    let back = Setpoint::at(Vec3::ZERO).facing(3.0);
    let references = flown(&[back, east, push, back], 3_000);
    // Rounding of f32 over a tick of 1 ms, then the trapezoid's own error.
    assert_derivatives(&references, [1.5e-3, 1e-3, 3e-3, 0.3]);
    let jump = |r: &[Reference]| (r[1].snap_world - r[0].snap_world).length();
    let largest = references.windows(2).map(jump).fold(0.0, f32::max);
    assert!(largest < 1.0, "the snap jumps by {largest}");
}

#[test]
fn a_velocity_is_taken_up_and_given_back() {
    let north =
        Setpoint { velocity_world: [Some(0.0), Some(1.0), Some(0.0)], ..Setpoint::default() };
    let stop = Setpoint { velocity_world: [Some(0.0); 3], ..Setpoint::default() };
    let references = flown(&[north, stop], 10_000);
    let at = |tick: usize| references[tick].velocity_world;
    assert!((at(9_999) - Vec3::Y).length() < 1e-3, "{}", at(9_999));
    assert!(at(19_999).length() < 1e-3, "{}", at(19_999));
    let fast = Setpoint { velocity_world: [Some(50.0), None, None], ..Setpoint::default() };
    let references = flown(&[fast], 20_000);
    assert!((references[19_999].velocity_world.x - CONFIG.speed_max).abs() < 1e-3);
}

#[test]
fn an_acceleration_is_followed_up_to_the_speed_limit() {
    let push = Setpoint { acceleration_world: [Some(0.2), None, None], ..Setpoint::default() };
    let references = flown(&[push], 30_000);
    assert!((references[3_000].acceleration_world - 0.2 * Vec3::X).length() < 1e-4);
    let last = references.last().unwrap().velocity_world;
    assert!(last.x > 1.9 && last.x < CONFIG.speed_max + 0.1, "{last}");
}

#[test]
fn a_small_step_far_out_is_not_lost_to_rounding() {
    let (shaper, far) = (shaper(), Vec3::new(90_000.0, -80_000.0, 100.0));
    let mut state = ShaperState::at_rest(far, 0.0);
    let target = far + Vec3::new(0.5, 0.0, 0.25);
    for _ in 0..20_000 {
        shaper.step(&mut state, &Setpoint::at(target));
    }
    let reached = shaper.reference(&state).position_world;
    assert!((reached - target).length() < 0.02, "{reached}");
}

#[test]
fn the_heading_turns_the_short_way_within_its_rate() {
    let (shaper, mut state) = (shaper(), ShaperState::at_rest(Vec3::ZERO, 3.0));
    let mut before = shaper.yaw(&state);
    for _ in 0..4_000 {
        shaper.step(&mut state, &Setpoint { yaw: Some(-3.0), ..Setpoint::default() });
        let yaw = shaper.yaw(&state);
        let turned = libm::remainderf(yaw - before, core::f32::consts::TAU);
        assert!(turned.abs() <= CONFIG.yaw_rate_max * 1e-3 * 1.01 + 1e-6, "{turned}");
        assert!(yaw.abs() > 2.9, "the long way: {yaw}");
        before = yaw;
    }
    assert!(libm::remainderf(before + 3.0, core::f32::consts::TAU).abs() < 1e-2, "{before}");
}

#[test]
fn each_limit_and_each_field_of_a_setpoint_is_checked() {
    let refused = |config: ShaperConfig| Shaper::new(&config).unwrap_err().parameter;
    let bad = ShaperConfig { acceleration_max: f32::NAN, ..CONFIG };
    assert_eq!(refused(bad), "shaper.acceleration_max");
    assert_eq!(refused(ShaperConfig { speed_max: 0.0, ..CONFIG }), "shaper.speed_max");
    assert_eq!(refused(ShaperConfig { climb_max: -1.0, ..CONFIG }), "shaper.climb_max");
    assert_eq!(refused(ShaperConfig { descent_max: 1e9, ..CONFIG }), "shaper.descent_max");
    assert_eq!(refused(ShaperConfig { yaw_rate_max: 9.0, ..CONFIG }), "shaper.yaw_rate_max");
    assert_eq!(refused(ShaperConfig { smoothing_time: 1e-3, ..CONFIG }), "shaper.smoothing_time");
    assert_eq!(refused(ShaperConfig { step_period: 0.0, ..CONFIG }), "shaper.step_period");
    let refused = |setpoint: Setpoint| shaper().check(&setpoint).unwrap_err().parameter;
    let field = |x| [None, Some(x), None];
    let none = Setpoint::default();
    assert_eq!(shaper().check(&Setpoint::at(Vec3::ONE).facing(1.0)), Ok(()));
    assert_eq!(refused(Setpoint { position_world: field(f32::NAN), ..none }), "setpoint.position");
    assert_eq!(refused(Setpoint { velocity_world: field(99.0), ..none }), "setpoint.velocity");
    let pull = Setpoint { acceleration_world: field(0.3), ..none };
    assert_eq!(refused(pull), "setpoint.acceleration");
    assert_eq!(refused(Setpoint { yaw: Some(99.0), ..none }), "setpoint.yaw");
    assert_eq!(refused(Setpoint { yaw_rate: Some(1.0), ..none }), "setpoint.yaw_rate");
}

fn any_number() -> impl Strategy<Value = Option<f32>> {
    prop_oneof![
        Just(None),
        (-20.0f32..20.0).prop_map(Some),
        prop::sample::select(std::vec![f32::NAN, f32::INFINITY, -3e38, 1e-40, 1e5]).prop_map(Some),
    ]
}

fn any_setpoint() -> impl Strategy<Value = Setpoint> {
    let axes = || [any_number(), any_number(), any_number()];
    (axes(), axes(), axes(), any_number(), any_number()).prop_map(
        |(position_world, velocity_world, acceleration_world, yaw, yaw_rate)| Setpoint {
            position_world,
            velocity_world,
            acceleration_world,
            yaw,
            yaw_rate,
        },
    )
}

proptest! {
    #[test]
    fn whatever_the_setpoints_the_reference_keeps_its_bound_and_stays_finite(
        setpoints in prop::collection::vec(any_setpoint(), 1..12)
    ) {
        for reference in flown(&setpoints, 400) {
            prop_assert!(reference.acceleration_world.length() <= CONFIG.acceleration_max);
            prop_assert!(reference.position_world.is_finite() && reference.snap_world.is_finite());
            prop_assert!((reference.left_world.length() - 1.0).abs() < 1e-4);
            prop_assert!(reference.left_acceleration_world.is_finite());
            let tilt = reference.left_world.dot(reference.specific_force().value);
            prop_assert!(tilt.abs() < 1e-3, "left is not orthogonal: {}", tilt);
        }
    }
}
