//! The formats of a log.

use std::str::FromStr;

/// A format that this build can write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// ULog, for PlotJuggler, Flight Review and `pyulog`.
    Ulog,
}

impl Format {
    /// Name of its file in the directory of results.
    #[must_use]
    pub const fn file_name(self) -> &'static str {
        match self {
            Self::Ulog => "flight.ulg",
        }
    }
}

impl FromStr for Format {
    type Err = &'static str;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        match name {
            "ulog" => Ok(Self::Ulog),
            _ => Err("the format is ulog"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Format;

    #[test]
    fn ulog_is_in_every_build() {
        assert_eq!("ulog".parse::<Format>().map(Format::file_name), Ok("flight.ulg"));
        assert!("csv".parse::<Format>().is_err_and(|error| error.contains("format is ulog")));
    }
}
