//! Upload of a path.

use proptest::prelude::*;

use super::*;
use ctrl_core::error::{Bound, ConfigError};
use ctrl_core::trajectory::{Leg, MAX_LEGS, Trajectory};

fn leg(x: f32) -> Leg {
    Leg::to(Vec3::new(x, 0.0, 1.0), 3.0)
}

#[test]
fn a_complete_path_flies() {
    let mut upload = PathUpload::default();
    upload.begin(Vec3::Z, 0.5, 2).unwrap();
    upload.leg(0, leg(1.0)).unwrap();
    assert_eq!(upload.finish(1e-3), Err(UploadError::Incomplete));
    upload.leg(1, leg(2.0)).unwrap();
    let path = upload.finish(1e-3).unwrap().build();
    assert_eq!(path.reference(0).position_world, Vec3::Z);
    assert_eq!(path.reference(100_000).position_world, Vec3::new(2.0, 0.0, 1.0));
}

#[test]
fn legs_come_in_order_and_may_be_repeated() {
    let mut upload = PathUpload::default();
    assert_eq!(upload.leg(0, leg(1.0)), Err(UploadError::Order { expected: 0 }), "not begun");
    upload.begin(Vec3::Z, 0.0, 2).unwrap();
    assert_eq!(upload.leg(1, leg(2.0)), Err(UploadError::Order { expected: 0 }));
    upload.leg(0, leg(9.0)).unwrap();
    upload.leg(0, leg(1.0)).unwrap();
    upload.leg(1, leg(2.0)).unwrap();
    assert_eq!(upload.leg(2, leg(3.0)), Err(UploadError::Order { expected: 2 }), "announced two");
    let middle = upload.finish(1e-3).unwrap().build().reference(3000).position_world;
    assert!((middle - Vec3::new(1.0, 0.0, 1.0)).length() < 1e-5, "the repeated leg counts");
}

#[test]
fn a_new_beginning_forgets_the_old_path() {
    let mut upload = PathUpload::default();
    upload.begin(Vec3::Z, 0.0, 1).unwrap();
    upload.leg(0, leg(1.0)).unwrap();
    upload.begin(Vec3::Z, 0.0, 1).unwrap();
    assert_eq!(upload.finish(1e-3), Err(UploadError::Incomplete));
    for legs in [0, MAX_LEGS as u8 + 1, u8::MAX] {
        assert_eq!(upload.begin(Vec3::Z, 0.0, legs), Err(UploadError::Count(legs)));
        assert_eq!(upload.finish(1e-3), Err(UploadError::Incomplete));
    }
}

#[test]
fn what_cannot_be_flown_is_refused_with_the_reason() {
    let mut upload = PathUpload::default();
    upload.begin(Vec3::Z, 0.0, 1).unwrap();
    upload.leg(0, leg(1000.0)).unwrap();
    let error = upload.finish(1e-3).unwrap_err();
    let UploadError::Invalid(ConfigError { parameter, .. }) = error else { panic!("{error}") };
    assert_eq!(parameter, "waypoint_path.acceleration_bound");
    let Rejection::Invalid { parameter, upper, .. } = error.into() else { panic!() };
    assert_eq!((parameter.as_str(), upper), ("waypoint_path.acceleration_bound", 9.81));
}

#[test]
fn rejections_name_the_parameter_as_far_as_it_fits() {
    let parameter = "a name that is much longer than the forty-eight bytes of a frame's field";
    let error = ConfigError::new(parameter, 1.0, Bound::Positive, "");
    let Rejection::Invalid { parameter: cut, lower, .. } = error.into() else { panic!() };
    assert_eq!((cut.as_str(), lower), (&parameter[..NAME_MAX], 0.0));
}

proptest! {
    #[test]
    fn any_sequence_of_uploads(
        events in proptest::collection::vec((any::<u8>(), 0u8..20, any::<[u32; 4]>()), 0..60)
    ) {
        let mut upload = PathUpload::default();
        for (kind, index, bits) in events {
            let [x, y, z, w] = bits.map(f32::from_bits);
            if kind < 30 {
                let _ = upload.begin(Vec3::new(x, y, z), w, index);
            } else {
                let position = if kind < 200 { leg(f32::from(index)).position_world } else { Vec3::new(x, y, z) };
                let _ = upload.leg(index, Leg { duration: w.abs().clamp(2.0, 9.0), ..Leg::to(position, 1.0) });
            }
            if let Ok(path) = upload.finish(1e-3).map(|checked| checked.build()) {
                prop_assert!(path.acceleration_bound().is_finite());
                for tick in [0, 777, 5000, u64::MAX] {
                    prop_assert!(path.reference(tick).position_world.is_finite());
                    prop_assert!(path.reference(tick).left_world.is_finite());
                }
            }
        }
    }
}
