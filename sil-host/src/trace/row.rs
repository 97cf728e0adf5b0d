//! The numbers of one row.

use sim::quantity::{Quantity, Value, scalar_first};
use sim::tick::Tick;

use super::QUANTITIES;

/// Columns in single precision.
pub(super) const SINGLES: usize = {
    let (mut width, mut index) = (0, 0);
    while index < QUANTITIES.len() {
        if is_single(QUANTITIES[index]) {
            width += QUANTITIES[index].width();
        }
        index += 1;
    }
    width
};
/// Columns in double precision.
const DOUBLES: usize = 2;

/// `true` if the quantity's columns are in single precision.
pub(super) const fn is_single(quantity: &Quantity) -> bool {
    matches!(quantity.value, Value::Single(_) | Value::Vector(_) | Value::Quaternion(_))
}

/// One row; the numbers of each type in the order of their columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub tick: u64,
    pub time: f64,
    pub singles: [f32; SINGLES],
    pub doubles: [f64; DOUBLES],
    pub status: u16,
}

impl Row {
    /// The tick's row.
    pub fn new(tick: &Tick) -> Self {
        let mut row = Self {
            tick: 0,
            time: 0.0,
            singles: [0.0; SINGLES],
            doubles: [0.0; DOUBLES],
            status: 0,
        };
        let (mut singles, mut doubles) = (&mut row.singles[..], row.doubles.iter_mut());
        for quantity in QUANTITIES {
            match quantity.value {
                Value::Single(read) => singles = filled(singles, [read(tick)]),
                Value::Vector(read) => singles = filled(singles, read(tick).to_array()),
                Value::Quaternion(read) => singles = filled(singles, scalar_first(read(tick))),
                Value::Double(read) => doubles.next().into_iter().for_each(|it| *it = read(tick)),
                Value::Time(read) => row.time = read(tick),
                Value::Count(read) => row.tick = read(tick),
                Value::Bits(read) => row.status = read(tick),
            }
        }
        row
    }
}

/// Writes `numbers` to the start of `to`; returns the rest.
#[inline(always)]
fn filled<const N: usize>(to: &mut [f32], numbers: [f32; N]) -> &mut [f32] {
    let (start, rest) = to.split_at_mut(N);
    start.copy_from_slice(&numbers);
    rest
}
