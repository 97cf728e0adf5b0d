//! Rows as text.

use sim::quantity::Value;

use super::row::{Row, SINGLES, is_single};
use super::{QUANTITIES, columns};

/// The longest text of a number that `zmij` and `itoa` write.
const NUMBER_MAX: usize = 24;
/// A number with its comma, and room to copy a round number of bytes.
const CELL: usize = 32;
/// Bound of the length of a row.
const ROW_MAX: usize = (SINGLES + QUANTITIES.len()) * (NUMBER_MAX + 1) + CELL;

/// Text of rows. A number that repeats the one above it, or its source further left, is copied, not
/// formatted again: this holds for half of them, since not every quantity moves in every flight, no
/// torque saturates for long, and most vehicles apply the command exactly.
#[derive(Debug)]
pub(super) struct Text {
    bytes: Vec<u8>,
    length: usize,
    above: [Cell; SINGLES],
    /// For each column one further left that often has the same number; else itself.
    twin: [usize; SINGLES],
    layout: Vec<Cells>,
}

/// Neighbouring cells of a row that are written alike.
#[derive(Clone, Copy, Debug)]
enum Cells {
    /// Columns in single precision: the first, and the end.
    Singles(usize, usize),
    Double,
    Time,
    Count,
    Bits,
}

/// A number, and its text with a comma.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Of the number; more than 32 before the first one.
    bits: u64,
    length: u8,
    text: [u8; CELL],
}

impl Text {
    /// No text yet.
    pub fn new() -> Self {
        let none = Cell { bits: u64::MAX, length: 0, text: [0; CELL] };
        Self {
            bytes: Vec::new(),
            length: 0,
            above: [none; SINGLES],
            twin: twins(),
            layout: layout(),
        }
    }

    /// The text so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// Discards the text so far.
    pub fn clear(&mut self) {
        self.length = 0;
    }

    /// Writes the names of the columns.
    pub fn heading(&mut self) {
        let names = columns().join(",");
        self.reserve(names.len() + 1);
        self.put(names.as_bytes());
        self.put(b"\n");
    }

    /// Writes a row.
    pub fn row(&mut self, row: &Row) {
        self.reserve(ROW_MAX);
        let mut doubles = row.doubles.into_iter();
        for index in 0..self.layout.len() {
            match self.layout[index] {
                Cells::Singles(first, end) => {
                    for (column, &single) in (first..).zip(&row.singles[first..end]) {
                        self.single(column, single);
                    }
                }
                Cells::Double => {
                    let double = doubles.next().unwrap_or(f64::NAN);
                    self.number(zmij::Buffer::new().format(double));
                }
                Cells::Time => self.seconds(row.time),
                Cells::Count => self.number(itoa::Buffer::new().format(row.tick)),
                Cells::Bits => self.number(itoa::Buffer::new().format(row.status)),
            }
        }
        self.length -= 1;
        self.put(b"\n");
    }

    #[inline]
    fn single(&mut self, column: usize, x: f32) {
        let bits = u64::from(x.to_bits());
        if self.above[column].bits != bits {
            self.above[column] = self.above[self.twin[column]];
        }
        let cell = &mut self.above[column];
        if cell.bits != bits {
            cell.bits = bits;
            let mut buffer = zmij::Buffer::new();
            let text = buffer.format(x).as_bytes();
            copy(text, &mut cell.text);
            cell.text[text.len()] = b',';
            cell.length = text.len() as u8 + 1;
        }
        let (text, length) = (cell.text, cell.length);
        self.bytes[self.length..self.length + CELL].copy_from_slice(&text);
        self.length += usize::from(length);
    }

    /// Six decimals, for times below half a million years.
    fn seconds(&mut self, time: f64) {
        let micros = (time * 1e6).round() as u64;
        self.put(itoa::Buffer::new().format(micros / 1_000_000).as_bytes());
        let fraction = 1_000_000 + micros % 1_000_000;
        let start = self.length;
        self.number(itoa::Buffer::new().format(fraction));
        self.bytes[start] = b'.';
    }

    fn number(&mut self, text: &str) {
        self.put(text.as_bytes());
        self.put(b",");
    }

    fn put(&mut self, text: &[u8]) {
        self.bytes[self.length..self.length + text.len()].copy_from_slice(text);
        self.length += text.len();
    }

    /// Makes room for `more` bytes.
    fn reserve(&mut self, more: usize) {
        if self.bytes.len() < self.length + more {
            self.bytes.resize(2 * (self.length + more), 0);
        }
    }
}

/// The cells of a row in order, with neighbours in single precision joined.
fn layout() -> Vec<Cells> {
    let (mut layout, mut singles) = (Vec::new(), 0);
    for quantity in QUANTITIES {
        let cells = match quantity.value {
            Value::Single(_) | Value::Vector(_) | Value::Quaternion(_) => {
                let first = singles;
                singles += quantity.width();
                if let Some(Cells::Singles(_, end)) = layout.last_mut() {
                    *end = singles;
                    continue;
                }
                Cells::Singles(first, singles)
            }
            Value::Double(_) => Cells::Double,
            Value::Time(_) => Cells::Time,
            Value::Count(_) => Cells::Count,
            Value::Bits(_) => Cells::Bits,
        };
        layout.push(cells);
    }
    layout
}

/// The names of the columns in single precision.
fn single_columns() -> Vec<String> {
    QUANTITIES.iter().filter(|it| is_single(it)).flat_map(|it| it.columns()).collect()
}

/// The twin of each column in single precision.
fn twins() -> [usize; SINGLES] {
    let names = single_columns();
    core::array::from_fn(|column| {
        let name = &names[column];
        let acting = name.strip_prefix("applied_").or(name.strip_prefix("modelled_"));
        let original = match (acting, name.strip_prefix("torque_")) {
            (Some(commanded), _) => commanded.to_owned(),
            (None, Some(axis)) => format!("torque_demand_{axis}"),
            (None, None) => return column,
        };
        names.iter().position(|name| *name == original).unwrap_or(column)
    })
}

/// Copies a short text by a few moves of fixed size, which overlap: faster than a call for any length.
#[inline]
fn copy(text: &[u8], to: &mut [u8; CELL]) {
    let length = text.len();
    if let (Some(first), Some(last)) = (text.first_chunk::<8>(), text.last_chunk::<8>()) {
        if let Some(first) = text.first_chunk::<16>() {
            to[..16].copy_from_slice(first);
        } else {
            to[..8].copy_from_slice(first);
        }
        to[length - 8..length].copy_from_slice(last);
    } else if let (Some(first), Some(last)) = (text.first_chunk::<3>(), text.last_chunk::<4>()) {
        to[..3].copy_from_slice(first);
        to[length - 4..length].copy_from_slice(last);
    } else {
        to[..length].copy_from_slice(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(singles: [f32; SINGLES]) -> Row {
        Row { tick: 12, time: 0.012, singles, doubles: [0.1, -2.5e-300], status: 65_535 }
    }

    #[test]
    fn numbers_of_every_length_come_back_whether_they_repeat_or_not() {
        let numbers: Vec<f32> = (-45..39)
            .flat_map(|e| [1.0, -1.25, 1.234_567_8, -9.876_543].map(|m| (m * 10f64.powi(e)) as f32))
            .chain([0.0, -0.0, f32::MAX, f32::MIN_POSITIVE, f32::INFINITY, f32::NEG_INFINITY])
            .collect();
        let mut text = Text::new();
        for window in numbers.windows(SINGLES) {
            let singles: [f32; SINGLES] = window.try_into().unwrap();
            text.clear();
            text.row(&row(singles));
            let once = text.bytes().to_vec();
            text.clear();
            text.row(&row(singles));
            assert_eq!(text.bytes(), once);
            let line = String::from_utf8(once).unwrap();
            let cells: Vec<&str> = line.trim_end().split(',').collect();
            assert_eq!(cells.len(), columns().len());
            for (cell, single) in cells[2..].iter().zip(singles) {
                assert_eq!(cell.parse::<f32>().unwrap().to_bits(), single.to_bits());
                assert_eq!(*cell, zmij::Buffer::new().format(single));
            }
            assert_eq!(cells[..2], ["12", "0.012000"]);
            assert_eq!(cells[2 + SINGLES..], ["0.1", "-2.5e-300", "65535"]);
        }
    }

    #[test]
    fn the_applied_wrench_is_copied_from_the_command_and_that_from_the_demand() {
        let (names, twins) = (single_columns(), twins());
        let differing = (0..SINGLES).filter(|&column| twins[column] != column);
        let pairs: Vec<_> = differing.map(|it| (&*names[it], &*names[twins[it]])).collect();
        let expected = [
            ("torque_x", "torque_demand_x"),
            ("torque_y", "torque_demand_y"),
            ("torque_z", "torque_demand_z"),
            ("applied_thrust", "thrust"),
            ("applied_torque_x", "torque_x"),
            ("applied_torque_y", "torque_y"),
            ("applied_torque_z", "torque_z"),
            ("modelled_torque_x", "torque_x"),
            ("modelled_torque_y", "torque_y"),
            ("modelled_torque_z", "torque_z"),
        ];
        assert_eq!(pairs, expected);
    }

    #[test]
    fn times_have_six_decimals() {
        let mut text = Text::new();
        text.reserve(ROW_MAX);
        for time in [0.0, 0.000_001, 1.05, 199.999_999_7] {
            text.seconds(time);
        }
        assert_eq!(text.bytes(), b"0.000000,0.000001,1.050000,200.000000,");
    }
}
