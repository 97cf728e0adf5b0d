//! Tests of the allocation.

use proptest::prelude::*;

use super::*;

const LIMITS: Interval = Interval { lower: 0.1, upper: 4.0 };

fn quad_x() -> Allocator {
    Allocator::new(&RotorGeometry::quad_x(0.2, 0.016, LIMITS)).unwrap()
}

const ALTERNATING: [Spin; 8] = {
    use Spin::{Anticlockwise as A, Clockwise as C};
    [C, A, C, A, C, A, C, A]
};

fn hexarotor() -> RotorGeometry {
    RotorGeometry::ring(&ALTERNATING[..6], 0.3, 0.0, 0.02, LIMITS)
}

fn octorotor() -> RotorGeometry {
    RotorGeometry::ring(&ALTERNATING, 0.3, 0.2, 0.02, LIMITS)
}

fn wrench(thrust: f32, x: f32, y: f32, z: f32) -> Wrench {
    Wrench { thrust, torque_body: Vec3::new(x, y, z) }
}

fn assert_close(a: &Wrench, b: &Wrench) {
    let error = (a.torque_body - b.torque_body).length().max((a.thrust - b.thrust).abs());
    assert!(error < 1e-5 * (1.0 + b.thrust), "{a:?} is not {b:?}");
}

#[test]
fn each_axis_of_the_quad_x_drives_the_rotors_that_it_should() {
    // Front left, rear left, rear right, front right.
    let thrusts = |w| quad_x().allocate(&w).thrusts;
    assert_eq!(*thrusts(wrench(8.0, 0.0, 0.0, 0.0)), [2.0; 4]);
    // Positive roll torque lifts the left (body +y), positive pitch torque the rear (body -x).
    let signs =
        |w| -> std::vec::Vec<f32> { thrusts(w).iter().map(|f| (f - 2.0).signum()).collect() };
    assert_eq!(signs(wrench(8.0, 0.1, 0.0, 0.0)), [1.0, 1.0, -1.0, -1.0]);
    assert_eq!(signs(wrench(8.0, 0.0, 0.1, 0.0)), [-1.0, 1.0, 1.0, -1.0]);
    // Positive yaw torque is the reaction of the clockwise rotors.
    assert_eq!(signs(wrench(8.0, 0.0, 0.0, 0.01)), [1.0, -1.0, 1.0, -1.0]);
}

#[test]
fn the_quad_plus_rolls_with_its_side_rotors_only() {
    let geometry = RotorGeometry::quad_plus(0.25, 0.016, LIMITS);
    let Allocation { thrusts, limited, .. } =
        Allocator::new(&geometry).unwrap().allocate(&wrench(4.0, 0.1, 0.0, 0.0));
    assert_eq!(limited, Limited::empty());
    for (thrust, expected) in thrusts.iter().zip([1.0, 1.2, 1.0, 0.8]) {
        assert!((thrust - expected).abs() < 1e-6, "{thrusts:?}");
    }
}

#[test]
fn yaw_gives_way_first() {
    let command = wrench(14.0, 0.1, 0.05, 0.2);
    let Allocation { thrusts, limited, .. } = quad_x().allocate(&command);
    let made = quad_x().wrench(&thrusts);
    assert_eq!(limited, Limited::YAW);
    assert!(made.torque_body.z > 0.0 && made.torque_body.z < 0.2);
    let yaw = made.torque_body.z;
    assert_close(&made, &wrench(14.0, 0.1, 0.05, yaw));
}

#[test]
fn thrust_gives_way_to_roll_and_pitch() {
    let Allocation { thrusts, limited, .. } = quad_x().allocate(&wrench(16.0, 0.3, -0.1, 0.0));
    let made = quad_x().wrench(&thrusts);
    assert_eq!(limited, Limited::THRUST);
    assert!(made.thrust < 16.0 && made.thrust > 12.0);
    assert_close(&made, &wrench(made.thrust, 0.3, -0.1, 0.0));
    // At the lower end it is raised instead.
    let Allocation { thrusts, limited, .. } = quad_x().allocate(&wrench(0.0, 0.3, 0.0, 0.0));
    assert_eq!(limited, Limited::THRUST);
    assert_close(&quad_x().wrench(&thrusts), &wrench(0.4 + 0.3 / 0.141_421_36, 0.3, 0.0, 0.0));
}

#[test]
fn roll_and_pitch_keep_their_direction_when_nothing_makes_room() {
    let Allocation { thrusts, limited, .. } = quad_x().allocate(&wrench(8.0, 4.0, 2.0, 0.1));
    let torque = quad_x().wrench(&thrusts).torque_body;
    assert!(limited.contains(Limited::ROLL_PITCH | Limited::YAW));
    assert!((torque.x / torque.y - 2.0).abs() < 1e-4, "{torque}");
    // The outermost rotors are at their limits: no larger part would fit.
    assert!(thrusts.iter().any(|f| (f - LIMITS.upper).abs() < 1e-5));
    assert!(thrusts.iter().any(|f| (f - LIMITS.lower).abs() < 1e-5));
}

#[test]
fn a_wrench_that_is_not_finite_gives_the_lower_limits() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for command in [wrench(bad, 0.0, 0.0, 0.0), wrench(8.0, 0.0, bad, 0.0)] {
            let Allocation { thrusts, limited, .. } = quad_x().allocate(&command);
            assert_eq!((&*thrusts, limited), ([0.1; 4].as_slice(), Limited::INVALID));
        }
    }
}

#[test]
fn full_roll_of_a_hexarotor_is_not_given_up_for_yaw() {
    let allocator = Allocator::new(&hexarotor()).unwrap();
    let Allocation { thrusts, achieved, limited } =
        allocator.allocate(&wrench(12.0, 9.0, 0.0, 0.1));
    // Left (body +y) at most, right at least; front and rear, on the roll axis, are free for the rest.
    let lever = 0.3 * libm::sinf(core::f32::consts::FRAC_PI_3);
    assert!((achieved.torque_body.x - 2.0 * lever * (LIMITS.upper - LIMITS.lower)).abs() < 1e-5);
    assert!(achieved.torque_body.y.abs() < 1e-5);
    assert!(limited.contains(Limited::ROLL_PITCH));
    for (index, limit) in
        [(1, LIMITS.upper), (2, LIMITS.upper), (4, LIMITS.lower), (5, LIMITS.lower)]
    {
        assert!((thrusts[index] - limit).abs() < 1e-5, "{thrusts:?}");
    }
}

#[test]
fn redundant_rotors_take_what_least_squares_would_ask_of_one() {
    let allocator = Allocator::new(&octorotor()).unwrap();
    let mut beyond = 0;
    for index in 0..40 {
        let (roll, yaw) = (1.4 + 0.01 * index as f32, 0.002 * index as f32);
        let command = wrench(18.0, roll, 0.3, yaw);
        let wanted = Vec4::new(18.0, roll, 0.3, yaw);
        let least_squares = |channel: &Channel| channel.limits.contains(channel.share.dot(wanted));
        beyond += u32::from(!allocator.channels.iter().all(least_squares));
        let Allocation { thrusts, achieved, limited } = allocator.allocate(&command);
        assert_eq!(limited, Limited::empty(), "{command:?}");
        assert_close(&achieved, &command);
        assert_close(&allocator.wrench(&thrusts), &command);
    }
    assert!(beyond > 10, "{beyond}");
}

#[test]
fn a_failed_rotor_gives_nothing_and_the_others_make_its_part() {
    for index in 0..8 {
        let failed = RotorSet::rotor(index);
        let allocator = Allocator::without(&octorotor(), failed).unwrap();
        let command = wrench(14.0, 0.2, -0.3, 0.02);
        let Allocation { thrusts, achieved, limited } = allocator.allocate(&command);
        assert_eq!((thrusts[index], thrusts.len()), (0.0, 8));
        assert_eq!((achieved, limited), (command, Limited::empty()));
        assert_close(&allocator.wrench(&thrusts), &command);
        assert_eq!(allocator.allocate(&wrench(f32::NAN, 0.0, 0.0, 0.0)).thrusts[index], 0.0);
    }
}

#[test]
fn without_a_rotor_an_alternating_hexarotor_keeps_tilt_and_thrust_and_gives_up_yaw() {
    let allocator = Allocator::without(&hexarotor(), RotorSet::FIRST).unwrap();
    let command = wrench(9.0, 0.1, -0.1, 0.0);
    let Allocation { achieved, limited, .. } = allocator.allocate(&command);
    assert_eq!(limited, Limited::YAW);
    let yaw = achieved.torque_body.z;
    assert_close(&achieved, &wrench(9.0, 0.1, -0.1, yaw));
    assert!(yaw.abs() > 1e-4, "{achieved:?}");
}

/// Every pair of rotors that may be lost one after the other, of a hexarotor in pairs and an octorotor.
fn losses() -> impl Iterator<Item = (RotorGeometry, usize, usize)> {
    [hexarotor(), octorotor()].into_iter().flat_map(|geometry| {
        let rotors = geometry.rotors.len();
        (0..rotors * rotors).map(move |pair| (geometry.clone(), pair % rotors, pair / rotors))
    })
}

#[test]
fn a_rotor_lost_in_flight_leaves_what_is_planned_without_it() {
    let mut refused = 0;
    for (geometry, first, second) in losses() {
        let mut allocator = Allocator::new(&geometry).unwrap();
        allocator.lose(first).unwrap();
        let failed = RotorSet::rotor(first) | RotorSet::rotor(second);
        let before = allocator.clone();
        match (Allocator::without(&geometry, failed), allocator.lose(second)) {
            (Ok(planned), Ok(())) => {
                for thrust in [4.0f32, 9.0, 14.0, 30.0] {
                    for x in [-0.6f32, -0.1, 0.0, 0.3] {
                        let command = wrench(thrust, x, 0.2 - x, 0.03 * x);
                        let expected = planned.allocate(&command);
                        let found = allocator.allocate(&command);
                        let apart = |a: &Allocation, b: &Allocation| {
                            let pairs = a.thrusts.iter().zip(&b.thrusts);
                            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
                        };
                        let apart = apart(&expected, &found);
                        assert!(apart < 1e-3, "{first} {second} {command:?}: {apart}");
                        assert_close(&found.achieved, &expected.achieved);
                        assert_eq!(found.thrusts[first], 0.0);
                        assert_eq!(found.thrusts[second], 0.0);
                    }
                }
            }
            (Err(planned), Err(lost)) => {
                assert_eq!(lost.parameter, planned.parameter, "{first} {second}");
                assert!(allocator == before, "a refusal changes nothing");
                refused += 1;
            }
            (planned, lost) => panic!("{first} {second}: {planned:?} {lost:?}"),
        }
    }
    assert!(refused > 0);
}

#[test]
fn a_quadrotor_cannot_lose_a_rotor_and_no_vehicle_one_that_it_has_not() {
    let mut quad = quad_x();
    assert_eq!(quad.lose(2).unwrap_err().parameter, "rotors (count)");
    assert_eq!(quad.lose(4).unwrap_err().parameter, "rotors (place)");
    assert_eq!(quad.lose(usize::MAX).unwrap_err().parameter, "rotors (place)");
    assert!(quad == quad_x());
}

#[test]
fn a_small_allocator_gives_the_same_bits() {
    let small =
        SizedAllocator::<{ slabs(4) }>::new(&RotorGeometry::quad_x(0.2, 0.016, LIMITS)).unwrap();
    for command in [wrench(8.0, 0.1, 0.0, 0.0), wrench(15.0, 0.4, -0.3, 0.2)] {
        assert_eq!(small.allocate(&command), quad_x().allocate(&command));
    }
}

#[test]
fn too_few_rotors_are_refused() {
    let refused = |geometry: &RotorGeometry, failed| {
        Allocator::without(geometry, failed).unwrap_err().parameter
    };
    let quad = RotorGeometry::quad_x(0.2, 0.016, LIMITS);
    assert_eq!(refused(&quad, RotorSet::FIRST), "rotors (count)");
    // Both of one side of an octorotor and their neighbours.
    let failed = RotorSet::from_bits_retain(0b1111);
    assert_eq!(refused(&octorotor(), failed), "rotors (tilt torque)");
    let small = SizedAllocator::<{ slabs(5) }>::new(&octorotor()).unwrap_err();
    assert_eq!(small.parameter, "rotors (facets)");
    let small = QuadAllocator::new(&octorotor()).unwrap_err();
    assert_eq!(small.parameter, "rotors (count)");
    assert_eq!(RotorSet::rotor(8), RotorSet::empty());
    assert_eq!(RotorSet::rotor(usize::MAX), RotorSet::empty());
}

#[test]
fn the_limits_follow_the_supply_and_hostile_ones_do_not_break_them() {
    let full = wrench(16.0, 0.0, 0.0, 0.0);
    for (supply, expected) in [(1.0, 4.0), (0.81, 3.24), (1.1, 4.0), (0.0, 0.4), (f32::NAN, 0.4)] {
        let thrusts = quad_x().allocate_at(&full, supply).thrusts;
        assert!(thrusts.iter().all(|thrust| (thrust - expected).abs() < 1e-5), "{thrusts:?}");
    }
    // What the rotors can make at either supply is the same.
    let command = wrench(8.0, 0.1, -0.2, 0.02);
    let made = quad_x().wrench(&quad_x().allocate_at(&command, 0.9).thrusts);
    assert_close(&made, &command);
}

/// The parameter that a geometry is refused for, after `change` to the quad-X.
fn refused(change: impl Fn(&mut List<Rotor, MAX_ROTORS>)) -> &'static str {
    let mut geometry = RotorGeometry::quad_x(0.2, 0.016, LIMITS);
    change(&mut geometry.rotors);
    Allocator::new(&geometry).unwrap_err().parameter
}

#[test]
fn refuses_geometries_that_lack_an_axis() {
    let lacks = "rotors (independence)";
    let no_yaw = |rotors: &mut List<Rotor, 8>| {
        rotors.iter_mut().for_each(|rotor| rotor.spin = Spin::Clockwise);
    };
    assert_eq!(refused(no_yaw), lacks);
    let no_roll = |rotors: &mut List<Rotor, 8>| {
        rotors.iter_mut().for_each(|rotor| rotor.position_body.y = 0.0);
    };
    assert_eq!(refused(no_roll), lacks);
    // Pairs of one spin on each side: yaw and roll are the same torque.
    let entangled = |rotors: &mut List<Rotor, 8>| {
        for rotor in rotors {
            let left = rotor.position_body.y > 0.0;
            rotor.spin = if left { Spin::Clockwise } else { Spin::Anticlockwise };
        }
    };
    assert_eq!(refused(entangled), lacks);
}

#[test]
fn refuses_each_field_out_of_range() {
    assert_eq!(refused(|rotors| rotors.truncate(3)), "rotors (count)");
    assert_eq!(refused(|rotors| rotors[1].position_body.x = f32::NAN), "rotors.position_body");
    assert_eq!(refused(|rotors| rotors[2].torque_ratio = 0.0), "rotors.torque_ratio");
    assert_eq!(refused(|rotors| rotors[3].thrust.upper = f32::INFINITY), "rotors.thrust.upper");
    assert_eq!(refused(|rotors| rotors[0].thrust.lower = 3.9), "rotors.thrust.lower");
    // Far off the centre of mass: more thrust would need less of the rear rotors.
    let shifted = |rotors: &mut List<Rotor, 8>| {
        rotors.iter_mut().for_each(|rotor| rotor.position_body.x += 0.2);
    };
    assert_eq!(refused(shifted), "rotors (tilt torque)");
}

proptest! {
    #[test]
    fn there_and_back_inside_the_limits(
        thrusts in proptest::array::uniform4(LIMITS.lower..LIMITS.upper)
    ) {
        // A quad's rotors and wrench determine each other.
        let command = quad_x().wrench(&thrusts);
        let back = quad_x().allocate(&command).thrusts;
        for (a, b) in back.iter().zip(thrusts) {
            prop_assert!((a - b).abs() < 2e-5, "{:?} {:?}", back, thrusts);
        }
    }

    #[test]
    fn the_hexarotor_makes_the_wrench_that_is_asked(
        thrust in 9.0f32..15.0, x in -0.5f32..0.5, y in -0.5f32..0.5, z in -0.05f32..0.05
    ) {
        let allocator = Allocator::new(&hexarotor()).unwrap();
        let Allocation { thrusts, limited, .. } = allocator.allocate(&wrench(thrust, x, y, z));
        prop_assert_eq!(limited, Limited::empty());
        assert_close(&allocator.wrench(&thrusts), &wrench(thrust, x, y, z));
    }

    #[test]
    fn limits_hold_and_the_report_is_true_for_any_wrench(
        thrust in -1e3f32..1e3, x in -20f32..20.0, y in -20f32..20.0, z in -20f32..20.0,
        shrink in prop_oneof![Just(1.0f32), Just(1e-2)]
    ) {
        let command = wrench(thrust * shrink, x * shrink, y * shrink, z * shrink);
        for geometry in [RotorGeometry::quad_x(0.2, 0.016, LIMITS), hexarotor(), octorotor()] {
            let allocator = Allocator::new(&geometry).unwrap();
            let Allocation { thrusts, limited, .. } = allocator.allocate(&command);
            prop_assert!(thrusts.iter().all(|f| LIMITS.contains(*f)));
            let made = allocator.wrench(&thrusts);
            let (got, asked) = (made.torque_body, command.torque_body);
            let tolerance = 1e-4 * (1.0 + asked.abs().max_element());
            if !limited.contains(Limited::ROLL_PITCH) {
                prop_assert!((got - asked).truncate().length() < tolerance, "{:?}", made);
            }
            if !limited.contains(Limited::YAW) {
                prop_assert!((got - asked).z.abs() < tolerance, "{:?}", made);
            }
            if !limited.contains(Limited::THRUST) {
                prop_assert!((made.thrust - command.thrust).abs() < 1e-4 * (1.0 + made.thrust));
            }
            // Full roll and pitch of a hexarotor leave no choice of yaw.
            let quad = geometry.rotors.len() == 4;
            prop_assert!(!quad || got.z * asked.z >= -1e-5, "yaw never turns round: {:?}", made);
        }
    }

    #[test]
    fn no_bit_pattern_breaks_a_limit(bits in proptest::array::uniform4(any::<u32>())) {
        let [f, x, y, z] = bits.map(f32::from_bits);
        let octorotor = Allocator::new(&octorotor()).unwrap();
        for allocator in [quad_x(), octorotor] {
            let Allocation { thrusts, achieved, .. } = allocator.allocate(&wrench(f, x, y, z));
            prop_assert!(thrusts.iter().all(|f| LIMITS.contains(*f)), "{:?}", thrusts);
            prop_assert!(achieved.thrust.is_finite() && achieved.torque_body.is_finite());
        }
    }
}

#[test]
fn four_rotors_have_nothing_to_distribute() {
    let mut bits: u64 = 0x9E37_79B9_7F4A_7C15;
    let mut random = move || {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        (bits >> 40) as f32 * (1.0 / 8_388_608.0) - 1.0
    };
    let mut compared = 0;
    for case in 0..100 {
        let mut geometry = RotorGeometry::quad_x(0.2, 0.016, LIMITS);
        for rotor in &mut geometry.rotors {
            rotor.position_body += 0.1 * Vec3::new(random(), random(), 0.3 * random());
            rotor.thrust.upper *= 1.0 + 0.6 * random();
        }
        let (Ok(quad), Ok(any)) = (QuadAllocator::new(&geometry), Allocator::new(&geometry)) else {
            continue;
        };
        compared += 1;
        for size in [0.5, 1.0, 1e4] {
            let torque_body = size * Vec3::new(random(), random(), 0.1 * random());
            let command = Wrench { thrust: 8.0 + 10.0 * size * random(), torque_body };
            let [four, any] = [quad.allocate(&command), any.allocate(&command)];
            assert_eq!(four.limited, any.limited, "{case}");
            for (a, b) in four.thrusts.iter().zip(&any.thrusts) {
                assert!((a - b).abs() < 1e-3, "{case}: {a} and {b} N");
            }
        }
    }
    assert!(compared > 50, "{compared}");
}
