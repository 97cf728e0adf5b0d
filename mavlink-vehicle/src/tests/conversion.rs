//! Frames and the globe, against facts that need no formula.

use core::f32::consts::{FRAC_PI_2, PI};

use glam::Quat;
use proptest::prelude::*;

use super::*;
use coordinates::{Origin, attitude_ned, euler, frd, ned, yaw_ned};

const ZURICH: Origin = Origin { latitude: 473_977_420, longitude: 85_455_940, altitude: 0.0 };

#[test]
fn east_north_up_becomes_north_east_down() {
    assert_eq!(ned(Vec3::new(1.0, 2.0, 3.0)), Vec3::new(2.0, 1.0, -3.0));
    assert_eq!(frd(Vec3::new(1.0, 2.0, 3.0)), Vec3::new(1.0, -2.0, -3.0));
}

#[test]
fn facing_east_is_a_heading_of_90_degrees_and_north_of_none() {
    let facing = |yaw: f32| euler(attitude_ned(Quat::from_rotation_z(yaw)));
    assert!((facing(0.0) - FRAC_PI_2 * Vec3::Z).length() < 1e-6);
    assert!(facing(FRAC_PI_2).length() < 1e-6);
    assert!((yaw_ned(0.0) - FRAC_PI_2).abs() < 1e-6);
    assert!(yaw_ned(FRAC_PI_2).abs() < 1e-6);
}

#[test]
fn nose_down_in_the_core_is_negative_pitch_and_leaning_right_is_positive_roll() {
    // About body y (left) a positive turn takes the nose down; about body x it lifts the left side.
    let north = Quat::from_rotation_z(FRAC_PI_2);
    let nose_down = euler(attitude_ned(north * Quat::from_rotation_y(0.2)));
    assert!((nose_down - Vec3::new(0.0, -0.2, 0.0)).length() < 1e-6, "{nose_down}");
    let right_down = euler(attitude_ned(north * Quat::from_rotation_x(0.3)));
    assert!((right_down - Vec3::new(0.3, 0.0, 0.0)).length() < 1e-6, "{right_down}");
}

#[test]
fn a_degree_of_latitude_is_111_km_and_longitude_shrinks_with_it() {
    let (latitude, longitude, altitude) = ZURICH.global(Vec3::new(0.0, 11_131.949, 7.0));
    assert!((latitude - ZURICH.latitude - 1_000_000).abs() < 50, "{latitude}");
    assert_eq!((longitude, altitude), (ZURICH.longitude, 7.0));
    let (_, longitude, _) = ZURICH.global(Vec3::new(1_000.0, 0.0, 0.0));
    let expected = 1_000.0 / 111_319.49 / libm::cosf(47.397_742_f32.to_radians());
    assert!(((longitude - ZURICH.longitude) as f32 * 1e-7 - expected).abs() < 1e-6);
}

#[test]
fn across_the_date_line_the_way_is_short() {
    let fiji = Origin { latitude: -180_000_000, longitude: 1_799_999_000, altitude: 0.0 };
    let east = fiji.world(-180_000_000, -1_799_999_000, 0.0);
    assert!(east.x > 0.0 && east.x < 30.0, "{east}");
    assert!(fiji.world(i32::MAX, i32::MIN, f32::NAN).x.is_finite());
}

proptest! {
    #[test]
    fn places_come_back_from_the_globe(x in -5e3f32..5e3, y in -5e3f32..5e3, z in -50f32..500.0) {
        let place = Vec3::new(x, y, z);
        let (latitude, longitude, altitude) = ZURICH.global(place);
        let back = ZURICH.world(latitude, longitude, altitude);
        prop_assert!((back - place).length() < 0.02, "{} {}", place, back);
    }

    #[test]
    fn the_attitude_maps_body_to_ned(
        axis in (-1f32..1.0, -1f32..1.0, 0.1f32..1.0), angle in -PI..PI, v in (-1f32..1.0, -1f32..1.0, -1f32..1.0)
    ) {
        let attitude = Quat::from_axis_angle(Vec3::from(axis).normalize(), angle);
        let body = Vec3::from(v);
        let (direct, mapped) = (ned(attitude * body), attitude_ned(attitude) * frd(body));
        prop_assert!((direct - mapped).length() < 1e-5);
        prop_assert!(attitude_ned(attitude).w >= 0.0);
    }
}
