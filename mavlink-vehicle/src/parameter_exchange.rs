//! Parameters on request: `REAL32` under their short names, and the value in force after every write.

use mavlink::dialects::common::{
    MavParamError, MavParamType, PARAM_ERROR_DATA, PARAM_SET_DATA, PARAM_VALUE_DATA,
};
use mavlink::types::CharArray;

use crate::frame::Frame;
use crate::parameter::{NAVIGATION, SHORT_MAX, long_name, navigation_field, short_name};
use crate::protocol::Protocol;
use crate::status_text::{Part, Severity};
use crate::vehicle::{ParameterRefusal, Vehicle};

/// A name on the wire.
type Name = CharArray<SHORT_MAX>;

impl Protocol<'_> {
    /// Answers with a parameter: the one at `index`, or by name for -1.
    pub(crate) fn read_parameter<V: Vehicle>(
        &mut self,
        name: &Name,
        index: i16,
        station: (u8, u8),
        vehicle: &mut V,
    ) {
        let by_index = u16::try_from(index).ok();
        let found = by_index.or_else(|| index_of(text(name), vehicle));
        match found.and_then(|index| value_of(index, vehicle)) {
            Some(value) => self.answer(&value, &[]),
            None => {
                self.parameter_error(name, MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST, station);
            }
        }
    }

    /// Writes a parameter; answers with the value in force.
    pub(crate) fn set_parameter<V: Vehicle>(
        &mut self,
        data: &PARAM_SET_DATA,
        station: (u8, u8),
        vehicle: &mut V,
    ) {
        let name = text(&data.param_id);
        let Some((long, index)) = long_name(name).zip(index_of(name, vehicle)) else {
            let error = MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST;
            return self.parameter_error(&data.param_id, error, station);
        };
        if data.param_type != MavParamType::MAV_PARAM_TYPE_REAL32 {
            let error = MavParamError::MAV_PARAM_ERROR_TYPE_MISMATCH;
            self.parameter_error(&data.param_id, error, station);
        } else if let Err(refusal) = write(long, data.param_value, vehicle) {
            self.say_refused(name, &refusal);
            let error = match refusal {
                ParameterRefusal::Unknown => MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST,
                ParameterRefusal::NotNow => MavParamError::MAV_PARAM_ERROR_PERMISSION_DENIED,
                ParameterRefusal::Invalid { .. } => {
                    MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
                }
            };
            self.parameter_error(&data.param_id, error, station);
        }
        if let Some(value) = value_of(index, vehicle) {
            self.answer(&value, &[]);
        }
    }

    /// The next parameter of the list that was asked for.
    pub(crate) fn next_parameter<V: Vehicle>(&mut self, vehicle: &mut V) -> Option<Frame> {
        let index = self.listed?;
        let value = value_of(index, vehicle);
        self.listed = value.is_some().then_some(index.saturating_add(1));
        Some(self.frame(&value?, &[]))
    }

    fn say_refused(&mut self, name: &str, refusal: &ParameterRefusal) {
        use Part::{Number, Text};
        let refused = Text(" refused: ");
        let (name, severity) = (Text(name), Severity::Warning);
        match refusal {
            ParameterRefusal::Unknown => {
                self.say(severity, &[name, refused, Text("no such parameter")]);
            }
            ParameterRefusal::NotNow => {
                self.say(severity, &[name, refused, Text("only on the ground, disarmed")]);
            }
            ParameterRefusal::Invalid { parameter, value, bounds: (lower, upper) } => {
                let (what, outside) = (Text(parameter), Text(" is not in ["));
                let (space, value) = (Text(" = "), Number(*value));
                let (lower, to, upper) = (Number(*lower), Text(", "), Number(*upper));
                let all = [name, refused, what, space, value, outside, lower, to, upper, Text("]")];
                self.say(severity, &all);
            }
        }
    }

    fn parameter_error(&mut self, name: &Name, error: MavParamError, station: (u8, u8)) {
        let (target_system, target_component) = station;
        let param_id = CharArray::new(**name);
        let data =
            PARAM_ERROR_DATA { param_index: -1, target_system, target_component, param_id, error };
        self.answer(&data, &[]);
    }
}

/// A name up to its first zero; empty if it is no text.
fn text(name: &Name) -> &str {
    let bytes: &[u8] = &**name;
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    core::str::from_utf8(bytes.get(..end).unwrap_or_default()).unwrap_or_default()
}

/// Number of parameters: the vehicle's, then the navigation's.
fn count<V: Vehicle>(vehicle: &V) -> u16 {
    vehicle.parameter_count() + NAVIGATION.len() as u16
}

/// Long name and value of the parameter at `index`.
fn at<V: Vehicle>(index: u16, vehicle: &mut V) -> Option<(&'static str, f32)> {
    if let Some(found) = vehicle.parameter_at(index) {
        return Some(found);
    }
    let own = usize::from(index.checked_sub(vehicle.parameter_count())?);
    let long = NAVIGATION.get(own)?;
    let mut config = *vehicle.navigator().config();
    Some((long, *navigation_field(&mut config, own)?))
}

fn index_of<V: Vehicle>(short: &str, vehicle: &mut V) -> Option<u16> {
    let long = long_name(short)?;
    // wcet: at most 64 iterations
    // wcet: at most 48 bytes
    (0..count(vehicle)).find(|index| at(*index, vehicle).is_some_and(|(name, _)| name == long))
}

fn value_of<V: Vehicle>(index: u16, vehicle: &mut V) -> Option<PARAM_VALUE_DATA> {
    let (long, param_value) = at(index, vehicle)?;
    let mut name = [0; SHORT_MAX];
    let short = short_name(long).unwrap_or(long);
    // wcet: at most 16 iterations
    name.iter_mut().zip(short.bytes()).for_each(|(place, byte)| *place = byte);
    Some(PARAM_VALUE_DATA {
        param_value,
        param_count: count(vehicle),
        param_index: index,
        param_id: CharArray::new(name),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    })
}

fn write<V: Vehicle>(long: &str, value: f32, vehicle: &mut V) -> Result<(), ParameterRefusal> {
    let mut config = *vehicle.navigator().config();
    // wcet: at most 9 iterations
    // wcet: at most 48 bytes
    let own = NAVIGATION.iter().position(|name| *name == long);
    let Some(field) = own.and_then(|own| navigation_field(&mut config, own)) else {
        return vehicle.write_parameter(long, value);
    };
    *field = value;
    Ok(vehicle.navigator().reconfigure(&config)?)
}
