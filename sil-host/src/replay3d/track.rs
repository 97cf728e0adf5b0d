//! Ticks as columns of rounded numbers, which a page reads.

use serde::ser::{Serialize, SerializeMap, Serializer};
use sim::quantity::Quantity;
use sim::quantity::table::*;
use sim::tick::Tick;

/// Decimals of the shown numbers; finer differences cannot be seen.
const MILLI: i32 = 3;
const TENTH_MILLI: i32 = 4;

/// The columns: key on the page, quantity, and decimals.
const COLUMNS: [(&str, &Quantity, i32); 6] = [
    ("time", &TIME, MILLI),
    ("position", &POSITION, MILLI),
    ("attitude", &ATTITUDE, TENTH_MILLI),
    ("reference", &REFERENCE_POSITION, MILLI),
    ("thrust", &THRUST, MILLI),
    ("tilt_error", &TILT_ERROR, TENTH_MILLI),
];

/// A flight as columns with one value per kept tick. As JSON, a quantity with several components is an
/// array of columns.
#[derive(Clone, Debug)]
pub struct Track {
    /// For each of [`COLUMNS`] its components.
    columns: Vec<Vec<Vec<f64>>>,
}

impl Track {
    /// The columns of `ticks`.
    #[must_use]
    pub fn new(ticks: &[Tick]) -> Self {
        let columns = COLUMNS.iter().map(|(_, quantity, decimals)| {
            let mut components = vec![Vec::with_capacity(ticks.len()); quantity.width()];
            for tick in ticks {
                let mut component = components.iter_mut();
                quantity.components(tick, |value| {
                    component.next().into_iter().for_each(|it| it.push(rounded(value, *decimals)));
                });
            }
            components
        });
        Self { columns: columns.collect() }
    }
}

impl Serialize for Track {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(COLUMNS.len()))?;
        for ((key, ..), components) in COLUMNS.iter().zip(&self.columns) {
            match &components[..] {
                [column] => map.serialize_entry(key, column)?,
                columns => map.serialize_entry(key, columns)?,
            }
        }
        map.end()
    }
}

/// `value` to so many decimals.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3, Vec3};
    use sim::guarantee::test_flight::{both, sample};

    #[test]
    fn columns_are_rounded_and_the_scalar_comes_first() {
        let mut tick = sample(&both(1e-3)[0]);
        tick.time = 0.1;
        tick.truth.position_world = DVec3::new(1.23456, -2.0, 1e-9);
        tick.truth.attitude = DQuat::from_xyzw(0.6, 0.0, 0.0, 0.8);
        tick.reference = ctrl_core::reference::Reference::hover(Vec3::ZERO);
        tick.output.wrench.thrust = 8.33333;
        let track = serde_json::to_string(&Track::new(&[tick])).expect("plain numbers");
        assert_eq!(
            track,
            "{\"time\":[0.1],\"position\":[[1.235],[-2.0],[0.0]],\
             \"attitude\":[[0.8],[0.6],[0.0],[0.0]],\"reference\":[[0.0],[0.0],[0.0]],\
             \"thrust\":[8.333],\"tilt_error\":[1.287]}"
        );
    }
}
