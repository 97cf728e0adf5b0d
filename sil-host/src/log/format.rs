//! The formats of a log.

use std::str::FromStr;

/// A format that this build can write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// ULog, for PlotJuggler, Flight Review and `pyulog`.
    Ulog,
    /// MCAP, for Foxglove, Rerun and PlotJuggler.
    #[cfg(feature = "mcap")]
    Mcap,
}

impl Format {
    /// Name of its file in the directory of results.
    #[must_use]
    pub const fn file_name(self) -> &'static str {
        match self {
            Self::Ulog => "flight.ulg",
            #[cfg(feature = "mcap")]
            Self::Mcap => "flight.mcap",
        }
    }
}

impl FromStr for Format {
    type Err = &'static str;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        match name {
            "ulog" => Ok(Self::Ulog),
            #[cfg(feature = "mcap")]
            "mcap" => Ok(Self::Mcap),
            #[cfg(not(feature = "mcap"))]
            "mcap" => Err("built without feature `mcap`: \
                cargo run --release -p sil-host --features mcap -- ..."),
            _ => Err("the formats are ulog and mcap"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Format;

    #[test]
    fn ulog_is_in_every_build() {
        assert_eq!("ulog".parse::<Format>().map(Format::file_name), Ok("flight.ulg"));
        assert!("csv".parse::<Format>().is_err_and(|error| error.contains("ulog and mcap")));
    }

    #[test]
    fn mcap_is_there_or_its_error_names_the_feature() {
        let mcap = "mcap".parse::<Format>().map(Format::file_name);
        if cfg!(feature = "mcap") {
            assert_eq!(mcap, Ok("flight.mcap"));
        } else {
            assert!(mcap.is_err_and(|error| error.contains("built without feature `mcap`")));
        }
    }
}
