//! The byte streams of a flight, both directions, and the scenario that was flown.
//!
//! A file of lines: `gyrfalcon-recording 1`, the scenario's name, the number of lines of its TOML,
//! these lines, and then a line for each packet: `>` to the vehicle or `<` from it, and its bytes in
//! hex.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

/// First line of a recording.
const HEADING: &str = "gyrfalcon-recording 1";

/// Direction of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the host.
    ToVehicle,
    /// To the host.
    FromVehicle,
}

impl Direction {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::ToVehicle, Self::FromVehicle];
}

/// See the module's documentation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recording {
    /// The scenario's name.
    pub scenario: String,
    /// The scenario as TOML, every change made.
    pub text: String,
    /// Every packet, in order.
    pub packets: Vec<(Direction, Vec<u8>)>,
}

impl Recording {
    /// Of a flight of a scenario that has not begun.
    #[must_use]
    pub fn new(scenario: &str, text: &str) -> Self {
        Self { scenario: scenario.to_owned(), text: text.to_owned(), packets: Vec::new() }
    }

    /// Writes the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, path: &Path) -> io::Result<()> {
        let lines = self.text.lines().count();
        let mut file = format!("{HEADING}\n{}\n{lines}\n", self.scenario);
        for line in self.text.lines() {
            file += line;
            file.push('\n');
        }
        for (direction, bytes) in &self.packets {
            file.push(if *direction == Direction::ToVehicle { '>' } else { '<' });
            for byte in bytes {
                let _ = write!(file, "{byte:02x}");
            }
            file.push('\n');
        }
        fs::write(path, file)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read, or is no recording: the line, and what is wrong with it.
    pub fn load(path: &Path) -> io::Result<Self> {
        Self::parse(&fs::read_to_string(path)?)
            .map_err(|fault| io::Error::new(io::ErrorKind::InvalidData, fault))
    }

    fn parse(file: &str) -> Result<Self, String> {
        let mut lines = file.lines();
        if lines.next() != Some(HEADING) {
            return Err(format!("line 1 is not `{HEADING}`"));
        }
        let scenario = lines.next().ok_or("no name of a scenario")?.to_owned();
        let count = lines.next().and_then(|line| line.parse::<usize>().ok());
        let count = count.ok_or("line 3 is not the length of the scenario")?;
        let text: Vec<_> = lines.by_ref().take(count).collect();
        let packets = lines.enumerate().map(|(index, line)| {
            packet(line).ok_or_else(|| format!("line {} is no packet", index + count + 4))
        });
        Ok(Self { scenario, text: text.join("\n"), packets: packets.collect::<Result<_, _>>()? })
    }
}

fn packet(line: &str) -> Option<(Direction, Vec<u8>)> {
    let direction = match line.as_bytes().first()? {
        b'>' => Direction::ToVehicle,
        b'<' => Direction::FromVehicle,
        _ => return None,
    };
    let digits = line.as_bytes()[1..].chunks(2);
    let bytes = digits.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok());
    Some((direction, bytes.collect::<Option<_>>()?)).filter(|_| line.len() % 2 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording() -> Recording {
        Recording {
            packets: vec![
                (Direction::FromVehicle, vec![0, 0x0f, 0xff]),
                (Direction::ToVehicle, vec![]),
                (Direction::ToVehicle, vec![7]),
            ],
            ..Recording::new("a name", "one = 1\n\n[two]\nthree = 3")
        }
    }

    #[test]
    fn what_is_saved_is_loaded() {
        let file = tempfile::NamedTempFile::new().unwrap();
        recording().save(file.path()).unwrap();
        assert_eq!(Recording::load(file.path()).unwrap(), recording());
    }

    #[test]
    fn a_damaged_file_is_refused_by_line() {
        for (file, fault) in [
            ("", "line 1"),
            ("gyrfalcon-recording 1\nx\ny\n", "line 3"),
            ("gyrfalcon-recording 1\nx\n1\n\n>0\n", "line 5"),
            ("gyrfalcon-recording 1\nx\n0\n>00\n?00\n", "line 5"),
            ("gyrfalcon-recording 1\nx\n0\n<0g\n", "line 4"),
        ] {
            let found = Recording::parse(file).unwrap_err();
            assert!(found.contains(fault), "{found}");
        }
    }
}
