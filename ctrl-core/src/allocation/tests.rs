//! Tests of the allocation.

use proptest::prelude::*;

use super::*;

const LIMITS: Interval = Interval { lower: 0.1, upper: 4.0 };

fn quad_x() -> Allocator {
    Allocator::new(&RotorGeometry::quad_x(0.2, 0.016, LIMITS)).unwrap()
}

fn hexarotor() -> RotorGeometry {
    let rotors = (0..6).map(|i| {
        let (sin, cos) = libm::sincosf(i as f32 * core::f32::consts::FRAC_PI_3);
        Rotor {
            position_body: Vec3::new(0.3 * cos, 0.3 * sin, 0.02),
            spin: if i % 2 == 0 { Spin::Clockwise } else { Spin::Anticlockwise },
            torque_ratio: 0.02,
            thrust: LIMITS,
        }
    });
    RotorGeometry { rotors: List::taking(rotors) }
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
    let thrusts = |w| quad_x().allocate(&w).0;
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
    let (thrusts, limited) =
        Allocator::new(&geometry).unwrap().allocate(&wrench(4.0, 0.1, 0.0, 0.0));
    assert_eq!(limited, Limited::empty());
    for (thrust, expected) in thrusts.iter().zip([1.0, 1.2, 1.0, 0.8]) {
        assert!((thrust - expected).abs() < 1e-6, "{thrusts:?}");
    }
}

#[test]
fn yaw_gives_way_first() {
    let command = wrench(14.0, 0.1, 0.05, 0.2);
    let (thrusts, limited) = quad_x().allocate(&command);
    let made = quad_x().wrench(&thrusts);
    assert_eq!(limited, Limited::YAW);
    assert!(made.torque_body.z > 0.0 && made.torque_body.z < 0.2);
    let yaw = made.torque_body.z;
    assert_close(&made, &wrench(14.0, 0.1, 0.05, yaw));
}

#[test]
fn thrust_gives_way_to_roll_and_pitch() {
    let (thrusts, limited) = quad_x().allocate(&wrench(16.0, 0.3, -0.1, 0.0));
    let made = quad_x().wrench(&thrusts);
    assert_eq!(limited, Limited::THRUST);
    assert!(made.thrust < 16.0 && made.thrust > 12.0);
    assert_close(&made, &wrench(made.thrust, 0.3, -0.1, 0.0));
    // At the lower end it is raised instead.
    let (thrusts, limited) = quad_x().allocate(&wrench(0.0, 0.3, 0.0, 0.0));
    assert_eq!(limited, Limited::THRUST);
    assert_close(&quad_x().wrench(&thrusts), &wrench(0.4 + 0.3 / 0.141_421_36, 0.3, 0.0, 0.0));
}

#[test]
fn roll_and_pitch_keep_their_direction_when_nothing_makes_room() {
    let (thrusts, limited) = quad_x().allocate(&wrench(8.0, 4.0, 2.0, 0.1));
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
            let (thrusts, limited) = quad_x().allocate(&command);
            assert_eq!((&*thrusts, limited), ([0.1; 4].as_slice(), Limited::INVALID));
        }
    }
}

#[test]
fn throttle_is_the_root_of_the_thrust_within_zero_and_one() {
    for (thrust, expected) in [(0.0, 0.0), (1.0, 0.5), (4.0, 1.0), (9.0, 1.0), (-1.0, 0.0)] {
        assert_eq!(throttle(thrust, 4.0), expected);
    }
    assert_eq!(throttle(f32::NAN, 4.0), 0.0);
    assert_eq!(throttle(0.0, 0.0), 0.0);
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
    assert_eq!(refused(shifted), "rotors (share of the thrust)");
}

proptest! {
    #[test]
    fn there_and_back_inside_the_limits(
        thrusts in proptest::array::uniform4(LIMITS.lower..LIMITS.upper)
    ) {
        // A quad's rotors and wrench determine each other.
        let command = quad_x().wrench(&thrusts);
        let (back, _) = quad_x().allocate(&command);
        for (a, b) in back.iter().zip(thrusts) {
            prop_assert!((a - b).abs() < 2e-5, "{:?} {:?}", back, thrusts);
        }
    }

    #[test]
    fn the_hexarotor_makes_the_wrench_that_is_asked(
        thrust in 9.0f32..15.0, x in -0.5f32..0.5, y in -0.5f32..0.5, z in -0.05f32..0.05
    ) {
        let allocator = Allocator::new(&hexarotor()).unwrap();
        let (thrusts, limited) = allocator.allocate(&wrench(thrust, x, y, z));
        prop_assert_eq!(limited, Limited::empty());
        assert_close(&allocator.wrench(&thrusts), &wrench(thrust, x, y, z));
    }

    #[test]
    fn limits_hold_and_the_report_is_true_for_any_wrench(
        thrust in -1e3f32..1e3, x in -20f32..20.0, y in -20f32..20.0, z in -20f32..20.0,
        shrink in prop_oneof![Just(1.0f32), Just(1e-2)]
    ) {
        let command = wrench(thrust * shrink, x * shrink, y * shrink, z * shrink);
        for geometry in [RotorGeometry::quad_x(0.2, 0.016, LIMITS), hexarotor()] {
            let allocator = Allocator::new(&geometry).unwrap();
            let (thrusts, limited) = allocator.allocate(&command);
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
            prop_assert!(got.z * asked.z >= -1e-5, "yaw never turns round: {:?}", made);
        }
    }

    #[test]
    fn no_bit_pattern_breaks_a_limit(bits in proptest::array::uniform4(any::<u32>())) {
        let [f, x, y, z] = bits.map(f32::from_bits);
        let (thrusts, _) = quad_x().allocate(&wrench(f, x, y, z));
        prop_assert!(thrusts.iter().all(|f| LIMITS.contains(*f)), "{:?}", thrusts);
    }
}
