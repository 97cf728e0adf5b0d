//! The numbers of one row.

use sim::quantity::table::*;
use sim::quantity::{Quantity, Value, scalar_first};
use sim::tick::Tick;

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

/// The quantities of a row, and the function that reads them: one statement per quantity, so that the
/// compiler inlines every reader.
macro_rules! quantities_of_a_row {
    ($($quantity:ident,)*) => {
        /// The quantities of a row, in order.
        pub const QUANTITIES: [&Quantity; [$(stringify!($quantity)),*].len()] = [$(&$quantity),*];

        impl Row {
            /// The tick's row.
            pub fn new(tick: &Tick) -> Self {
                let mut filling = Filling::default();
                $(filling.append($quantity.value, tick);)*
                filling.row
            }
        }
    };
}

quantities_of_a_row! {
    TICK,
    TIME,
    POSITION,
    VELOCITY,
    ATTITUDE,
    RATE,
    REFERENCE_POSITION,
    REFERENCE_VELOCITY,
    REFERENCE_ACCELERATION,
    REFERENCE_LEFT,
    POSITION_ERROR,
    ATTITUDE_ERROR,
    THRUST,
    TORQUE_DEMAND,
    TORQUE,
    APPLIED_THRUST,
    APPLIED_TORQUE,
    MODELLED_TORQUE,
    MASS_ESTIMATE,
    INERTIA_ESTIMATE,
    GYROSCOPIC_RATIO_ESTIMATE,
    LASTING_ACCELERATION_ESTIMATE,
    LASTING_TORQUE_ESTIMATE,
    AUXILIARY_ATTITUDE,
    AUXILIARY_RATE,
    LYAPUNOV,
    LYAPUNOV_PARAMETERS,
    STATUS,
}

/// A row with the number of its columns so far.
struct Filling {
    row: Row,
    singles: usize,
    doubles: usize,
}

impl Default for Filling {
    fn default() -> Self {
        let (singles, doubles) = ([0.0; SINGLES], [0.0; DOUBLES]);
        let row = Row { tick: 0, time: 0.0, singles, doubles, status: 0 };
        Self { row, singles: 0, doubles: 0 }
    }
}

impl Filling {
    #[inline(always)]
    fn append(&mut self, value: Value, tick: &Tick) {
        match value {
            Value::Single(read) => self.append_singles([read(tick)]),
            Value::Vector(read) => self.append_singles(read(tick).to_array()),
            Value::Quaternion(read) => self.append_singles(scalar_first(read(tick))),
            Value::Double(read) => {
                self.row.doubles[self.doubles] = read(tick);
                self.doubles += 1;
            }
            Value::Time(read) => self.row.time = read(tick),
            Value::Count(read) => self.row.tick = read(tick),
            Value::Bits(read) => self.row.status = read(tick),
        }
    }

    #[inline(always)]
    fn append_singles<const N: usize>(&mut self, numbers: [f32; N]) {
        self.row.singles[self.singles..self.singles + N].copy_from_slice(&numbers);
        self.singles += N;
    }
}
