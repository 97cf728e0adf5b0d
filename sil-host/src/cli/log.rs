//! Options of `run`, `pil` and `campaign` for logs.

use clap::Args;
use sil_host::log::LogOptions;
use sil_host::log::format::Format;

/// A tenth of the usual control rate, as the trace has it; plots look smooth.
const RATE: f64 = 100.0;

/// Formats and rate of the logs.
#[derive(Clone, Debug, Args)]
pub struct LogArguments {
    /// Write logs for other programs, any of: ulog (PlotJuggler, Flight Review), mcap (Foxglove,
    /// Rerun, PlotJuggler; needs a build with `--features mcap`).
    #[arg(long = "log", value_name = "FORMAT", value_delimiter = ',')]
    pub formats: Vec<Format>,
    /// Samples per second in the logs; the nearest rate that is the control rate over a whole number.
    #[arg(long = "log-rate", default_value_t = RATE, value_name = "HZ", value_parser = rate)]
    pub rate: f64,
}

impl LogArguments {
    /// The options of the library.
    pub(super) fn options(&self) -> LogOptions {
        LogOptions { formats: self.formats.clone(), rate: self.rate }
    }
}

fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "expected a rate in Hz, such as 100".to_owned())?;
    if rate.is_finite() && rate > 0.0 {
        Ok(rate)
    } else {
        Err("the rate must be finite and above 0 Hz".into())
    }
}
