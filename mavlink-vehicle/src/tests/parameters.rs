//! Parameters: names, list, read, write, refusals.

use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};
use link::Parameters;
use mavlink::dialects::common::{
    MavParamError, MavParamType, PARAM_ERROR_DATA, PARAM_REQUEST_LIST_DATA,
    PARAM_REQUEST_READ_DATA, PARAM_SET_DATA, PARAM_VALUE_DATA,
};
use mavlink::types::CharArray;

use super::*;

fn name(text: &str) -> CharArray<16> {
    let mut bytes = [0; 16];
    bytes[..text.len()].copy_from_slice(text.as_bytes());
    CharArray::new(bytes)
}

fn write(air: &mut Air, text: &str, param_value: f32) -> (Vec<f32>, Vec<MavParamError>) {
    air.send(&PARAM_SET_DATA {
        param_value,
        target_system: 1,
        target_component: 1,
        param_id: name(text),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    });
    air.run(0.05);
    let values = air.take::<PARAM_VALUE_DATA>().iter().map(|value| value.param_value).collect();
    let errors = air.take::<PARAM_ERROR_DATA>().iter().map(|error| error.error).collect();
    (values, errors)
}

#[test]
fn every_parameter_of_the_link_has_one_short_name() {
    let long = RobustAdaptiveConfig::NAMES.iter().copied();
    let long: Vec<_> = long.chain(SaturatedConfig::NAMES.iter().copied()).collect();
    for name in &long {
        let short = short_name(name).unwrap_or_else(|| panic!("{name} has no short name"));
        assert!(short.len() <= 16 && !short.is_empty(), "{short}");
        assert_eq!(long_name(short), Some(*name));
    }
    for (index, name) in NAMES.iter().enumerate() {
        let same = |other: &&ParameterName| other.short == name.short || other.long == name.long;
        assert_eq!(NAMES.iter().filter(same).count(), 1, "{name:?} at {index}");
        let own = parameter::NAVIGATION.contains(&name.long);
        assert!(own || long.contains(&name.long), "{name:?} names nothing");
    }
    let too_long = long.iter().filter(|name| name.len() > 16).count();
    assert!(too_long > 0, "the table is needed");
}

#[test]
fn the_list_has_every_parameter_once_in_order() {
    let mut air = Air::new();
    air.send(&PARAM_REQUEST_LIST_DATA { target_system: 1, target_component: 1 });
    air.run(0.5);
    let values = air.take::<PARAM_VALUE_DATA>();
    let indices: Vec<_> = values.iter().map(|value| value.param_index).collect();
    let count = 2 + parameter::NAVIGATION.len() as u16;
    assert_eq!(indices, (0..count).collect::<Vec<_>>());
    assert!(values.iter().all(|value| value.param_count == count));
    let names: Vec<_> =
        values.iter().map(|value| value.param_id.to_str().unwrap().to_owned()).collect();
    assert_eq!(names[..3], ["CTL_K1", "VEH_DIST_ACC", "MIS_TAKEOFF_ALT"]);
    assert_eq!(values[2].param_value, 2.5);
}

use std::borrow::ToOwned;

#[test]
fn one_is_read_by_index_or_by_name() {
    let mut air = Air::new();
    let mut read = |param_index, text| {
        air.send(&PARAM_REQUEST_READ_DATA {
            param_index,
            target_system: 1,
            target_component: 1,
            param_id: name(text),
        });
        air.run(0.05);
        let value = air.take::<PARAM_VALUE_DATA>().first().map(|v| (v.param_index, v.param_value));
        (value, air.take::<PARAM_ERROR_DATA>().first().map(|error| error.error))
    };
    assert_eq!(read(1, ""), (Some((1, 0.25)), None));
    assert_eq!(read(-1, "VEH_DIST_ACC"), (Some((1, 0.25)), None));
    let unknown = Some(MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST);
    assert_eq!(read(-1, "NO_SUCH"), (None, unknown));
    assert_eq!(read(99, ""), (None, unknown));
    assert_eq!(read(-1, "SIXTEENCHARACTER"), (None, unknown));
}

#[test]
fn a_write_is_answered_by_the_value_in_force_also_when_it_is_refused() {
    let mut air = Air::new();
    assert_eq!(write(&mut air, "CTL_K1", 0.75), (std::vec![0.75], std::vec![]));
    let range = MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE;
    assert_eq!(write(&mut air, "CTL_K1", 7.0), (std::vec![0.75], std::vec![range]));
    assert_eq!(air.texts(), ["CTL_K1 refused: cascade.k1 = 7 is not in [0, 1]"]);
    assert_eq!(write(&mut air, "CTL_K1", f32::NAN).1, [range]);
    let unknown = MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST;
    assert_eq!(write(&mut air, "NO_SUCH", 1.0), (std::vec![], std::vec![unknown]));
    assert_eq!(
        write(&mut air, "CTL_K5", 1.0),
        (std::vec![], std::vec![unknown]),
        "the other law's"
    );
    air.vehicle.mode = Mode::Flying;
    let denied = MavParamError::MAV_PARAM_ERROR_PERMISSION_DENIED;
    assert_eq!(write(&mut air, "CTL_K1", 0.5), (std::vec![0.75], std::vec![denied]));
}

#[test]
fn the_navigations_parameters_are_its_configuration() {
    let mut air = Air::new();
    assert_eq!(write(&mut air, "MIS_TAKEOFF_ALT", 4.0), (std::vec![4.0], std::vec![]));
    assert_eq!(air.vehicle.navigator.config().take_off_altitude, 4.0);
    let range = MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE;
    assert_eq!(write(&mut air, "MPC_LAND_SPEED", 50.0), (std::vec![0.5], std::vec![range]));
    for name in NAMES.iter().filter(|name| name.long.starts_with("navigation")) {
        let (values, errors) = write(&mut air, name.short, 0.7);
        assert_eq!((values, errors.len()), (std::vec![0.7], 0), "{name:?}");
    }
}

#[test]
fn another_type_than_real32_is_refused() {
    let mut air = Air::new();
    air.send(&PARAM_SET_DATA {
        param_value: 1.0,
        target_system: 1,
        target_component: 1,
        param_id: name("CTL_K1"),
        param_type: MavParamType::MAV_PARAM_TYPE_INT32,
    });
    air.run(0.05);
    let errors = air.take::<PARAM_ERROR_DATA>();
    assert_eq!(errors[0].error, MavParamError::MAV_PARAM_ERROR_TYPE_MISMATCH);
    assert_eq!(air.vehicle.gains[0], 0.5);
}
