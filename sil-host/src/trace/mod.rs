//! The trace of a flight as CSV; `docs/trace.md` defines its columns.
//!
//! Numbers are the shortest decimals that read back as the same `f32` (V: `f64`), which keeps a row
//! half as long as in `f64`. Time alone is written with fixed decimals. A `row` reads the numbers from
//! a tick, `text` writes them, and the `writer` does so on a thread of its own.

mod row;
mod text;
mod writer;

pub use writer::TraceWriter;

use sim::quantity::Quantity;
use sim::quantity::table::*;

/// The quantities of a row, in order.
pub const QUANTITIES: [&Quantity; 25] = [
    &TICK,
    &TIME,
    &POSITION,
    &VELOCITY,
    &ATTITUDE,
    &RATE,
    &REFERENCE_POSITION,
    &REFERENCE_VELOCITY,
    &REFERENCE_ACCELERATION,
    &REFERENCE_LEFT,
    &POSITION_ERROR,
    &ATTITUDE_ERROR,
    &THRUST,
    &TORQUE_DEMAND,
    &TORQUE,
    &APPLIED_THRUST,
    &APPLIED_TORQUE,
    &MASS_ESTIMATE,
    &INERTIA_ESTIMATE,
    &GYROSCOPIC_RATIO_ESTIMATE,
    &AUXILIARY_ATTITUDE,
    &AUXILIARY_RATE,
    &LYAPUNOV,
    &LYAPUNOV_PARAMETERS,
    &STATUS,
];

/// Names of the columns, in order.
#[must_use]
pub fn columns() -> Vec<String> {
    QUANTITIES.iter().flat_map(|quantity| quantity.columns()).collect()
}

#[cfg(test)]
mod tests {
    use std::io::{self, Write};

    use super::*;
    use sim::scenario::LoadedScenario;

    /// The first `seconds` of a built-in scenario as CSV text.
    fn trace(name: &str, changes: &[&str], ticks: u64, every: u64) -> String {
        let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
        let loaded = LoadedScenario::open(name, &changes).unwrap();
        let mut writer = TraceWriter::new(Vec::new(), every).unwrap();
        loaded.flight().unwrap().observe(ticks, &mut writer);
        let (bytes, rows) = writer.finish().unwrap();
        assert_eq!(rows, ticks.div_ceil(every));
        String::from_utf8(bytes).unwrap()
    }

    /// Rows as numbers by column.
    fn numbers(text: &str) -> Vec<Vec<f64>> {
        let rows = text.lines().skip(1);
        rows.map(|row| row.split(',').map(|x| x.parse().unwrap()).collect()).collect()
    }

    fn column(name: &str) -> usize {
        columns().iter().position(|column| column == name).unwrap()
    }

    /// The rows of the documented table: unit and meaning beside the first component's name.
    fn documented() -> String {
        let rows = QUANTITIES.iter().flat_map(|it| {
            let first = std::iter::once(format!(" {} ", it.meaning));
            let meanings = first.chain(std::iter::repeat(" ".to_owned()));
            let rows = it.columns().zip(meanings);
            rows.map(|(name, meaning)| format!("| `{name}` | {} |{meaning}|\n", it.unit))
        });
        rows.collect()
    }

    #[test]
    fn the_documented_columns_are_the_written_ones() {
        let document = include_str!("../../../docs/trace.md");
        let rows = documented();
        assert!(
            document.contains(&format!("|---|---|---|\n{rows}\n")),
            "docs/trace.md lacks\n{rows}"
        );
        let text = trace("paper-saturated", &[], 1, 1);
        assert_eq!(text.lines().next().unwrap().split(',').collect::<Vec<_>>(), columns());
    }

    #[test]
    fn the_documented_status_bits_are_the_core_s() {
        let document = include_str!("../../../docs/trace.md");
        let bit = |line: &str| -> Option<u16> {
            let mut cells = line.split('|').map(|cell| cell.trim().parse::<u16>().ok()).skip(1);
            let (bit, value) = (cells.next()??, cells.next()??);
            assert_eq!(value, 1 << bit);
            Some(value)
        };
        let documented: u16 = document.lines().filter_map(bit).sum();
        assert_eq!(documented, ctrl_core::controller::StepStatus::all().bits());
    }

    #[test]
    fn every_row_has_every_column_with_its_value() {
        let text = trace("paper-saturated", &["initial.tilt_deg=60.0"], 50, 1);
        let rows = numbers(&text);
        assert_eq!(rows.len(), 50);
        for (tick, row) in rows.iter().enumerate() {
            assert_eq!(row.len(), columns().len());
            assert_eq!(row[column("tick")], tick as f64);
            assert!((row[column("time")] - 1e-3 * tick as f64).abs() < 1e-6);
            for axis in ["x", "y", "z"] {
                let at = |name: &str| row[column(&format!("{name}_{axis}"))];
                let error = at("position") - at("reference_position");
                assert!((error - at("position_error")).abs() < 2e-5);
                let (torque, demand) = (at("torque"), at("torque_demand"));
                assert!((demand.clamp(-0.05, 0.05) - torque).abs() < 1e-8);
            }
            let eta = row[column("attitude_error_w")];
            assert!(row[column("lyapunov")] - row[column("lyapunov_parameters")] > 2.0 - 2.0 * eta);
        }
        // It starts saturated, with the auxiliary system at rest, and that does not stay so.
        let saturated = f64::from(ctrl_core::controller::StepStatus::TORQUE_SATURATED.bits());
        assert!(rows[0][column("status")] as u16 & saturated as u16 != 0);
        assert_eq!(rows[0][column("auxiliary_rate_x")], 0.0);
        assert!(rows[49][column("auxiliary_rate_x")] != 0.0);
    }

    #[test]
    fn decimation_keeps_the_same_rows() {
        let all = trace("paper-robust-adaptive", &[], 41, 1);
        let some = trace("paper-robust-adaptive", &[], 41, 10);
        let kept: Vec<_> = all.lines().skip(1).step_by(10).collect();
        assert_eq!(some.lines().skip(1).collect::<Vec<_>>(), kept);
    }

    #[test]
    fn the_first_write_error_is_returned() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let error = TraceWriter::new(Full, 1).unwrap().finish().map(|(_, rows)| rows).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    }
}
