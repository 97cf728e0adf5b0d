//! The process that emulates the board: QEMU's STM32F405 with an image of the firmware.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::PilError;
use super::cost::CostUnit;

/// Name of the emulator's program.
pub const QEMU: &str = "qemu-system-arm";
/// Path of the image from the root of the repository, as the firmware's build leaves it.
pub const IMAGE: &str = "target/thumbv7em-none-eabihf/release/firmware";

/// Default of the emulator's clock: an instruction takes `2^SHIFT` ns.
pub const SHIFT: u8 = 3;

/// An emulator and the image that it runs.
#[derive(Clone, Debug)]
pub struct Emulator {
    /// The emulator: a path, or a name that is looked up in `PATH`.
    pub program: PathBuf,
    /// The image (ELF).
    pub image: PathBuf,
    /// An instruction takes `2^shift` ns of virtual time.
    pub shift: u8,
    /// Virtual time is counted in instructions. Otherwise it is the clock on the wall, which suits the link's lock
    /// step alone: faster, but what the image measures is then this machine's time.
    pub counted: bool,
}

/// 8 ns per instruction, near the real processor: the firmware's unit of cost.
pub const NATURAL_SHIFT: u8 = 3;

impl Emulator {
    /// Unit of the image's cost of a tick: 8 ns of virtual time.
    #[must_use]
    pub fn cost_unit(&self) -> CostUnit {
        CostUnit::Instructions { counts: 1 << self.shift.saturating_sub(NATURAL_SHIFT) }
    }

    /// Starts the image; `directives` are its command line, `serial` is the character device of QEMU
    /// behind USART2, the link (`null` for none). Standard error is piped.
    ///
    /// # Errors
    /// When image or emulator are missing.
    pub fn start(&self, directives: &[String], serial: &str) -> Result<Child, PilError> {
        self.start_with(directives, serial, "null")
    }

    /// As [`start`](Self::start), with `mavlink` as the character device behind USART3.
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn start_with(
        &self,
        directives: &[String],
        serial: &str,
        mavlink: &str,
    ) -> Result<Child, PilError> {
        if !self.image.is_file() {
            return Err(PilError::ImageMissing(self.image.clone()));
        }
        let mut command = Command::new(&self.program);
        command
            .args(["-machine", "netduinoplus2", "-nodefaults", "-display", "none"])
            .args(["-monitor", "none", "-serial", "null", "-serial", serial, "-serial", mavlink])
            .args(["-semihosting-config", &semihosting(&self.image, directives)])
            .args([OsString::from("-kernel"), self.image.clone().into()])
            .stdin(Stdio::null())
            .stdout(Stdio::null()) // the log, encoded
            .stderr(Stdio::piped());
        if self.counted {
            command.args(["-icount", &format!("shift={},sleep=off", self.shift)]);
        }
        command.spawn().map_err(|error| PilError::Emulator(self.program.clone(), error.to_string()))
    }
}

/// The image's command line as an option of QEMU, which takes a doubled comma for one.
fn semihosting(image: &Path, directives: &[String]) -> String {
    let name = image.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut option = "enable=on,target=native".to_owned();
    for argument in [name].iter().chain(directives) {
        option += &format!(",arg={}", argument.replace(',', ",,"));
    }
    option
}
