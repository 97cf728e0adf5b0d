//! Options of `run` and `pil` for logs.

use clap::Args;

use crate::log::format::Format;

/// A tenth of the control rate, as the trace has it; plots look smooth.
const RATE: f64 = 100.0;

/// Which logs to write, and how often.
#[derive(Clone, Debug, Args)]
pub struct LogArguments {
    /// Write logs for other programs, any of: ulog (PlotJuggler, Flight Review), mcap (Foxglove,
    /// Rerun, PlotJuggler; needs a build with `--features mcap`).
    #[arg(long = "log", value_name = "FORMAT", value_delimiter = ',')]
    pub formats: Vec<Format>,
    /// Instants a second in the logs; the nearest rate that is the control rate over a whole number.
    #[arg(long = "log-rate", default_value_t = RATE, value_name = "HZ", value_parser = rate)]
    pub rate: f64,
}

fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "expected a number [Hz]".to_owned())?;
    if rate.is_finite() && rate > 0.0 { Ok(rate) } else { Err("must be above zero [Hz]".into()) }
}
