//! The program, run as the documentation says but for less time.
//!
//! Each page has a folder of its own, in which its commands run in order: a file that one command writes
//! is there for the next. What is added to a command:
//!
//! | command | addition |
//! |---|---|
//! | `run` | `--quiet --set duration=0.5` |
//! | `campaign`, but `--list` and `--show` | `--quiet --set duration=0.1 --threads 2`; `--runs 8` unless it is a grid |
//! | `fly` | `--duration 0.5`, and a free port for TCP |
//! | `consistency` | `--quiet --seconds 1`; `--flights 2` unless they are given |
//! | `merge` | `--quiet` |
//! | `tune` | `--no-check`, since its check flies for minutes |
//! | `pil` | `--quiet --set duration=0.5`; an image that is missing, without the feature `emulator-tests` |
//!
//! A shortened flight may violate a guarantee (status 1), since it ends before it has settled.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::shell;

/// Exit statuses of the program.
const HELD: i32 = 0;
const VIOLATED: i32 = 1;
const VEHICLE_FAILED: i32 = 4;

/// Image of the firmware for the emulator, where `cargo xtask ci` leaves it.
const IMAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/firmware-emulator");

/// A folder to run the program in.
pub struct Program {
    folder: PathBuf,
}

impl Program {
    /// An empty folder for the commands of a page.
    pub fn for_page(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("documentation").join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder");
        Self { folder }
    }

    /// Runs a documented command with what makes it short; an error if it does not end as it may.
    pub fn run(&self, arguments: &[String], command: &shell::Command) -> Result<(), String> {
        if command.needs_missing_feature() {
            return Ok(());
        }
        let mut arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
        let (added, allowed) = self.shortened(&arguments)?;
        arguments.extend(added);
        let output = self.ended(&arguments, allowed)?;
        if let Some(file) = &command.output {
            fs::write(self.folder.join(file), output.stdout)
                .map_err(|error| format!("{file}: {error}"))?;
        }
        Ok(())
    }

    /// Additions to a command, and its permitted exit statuses.
    fn shortened(&self, arguments: &[&str]) -> Result<(&[&'static str], &[i32]), String> {
        let has = |word: &str| arguments.contains(&word);
        Ok(match arguments.first() {
            Some(&"run") => (&["--quiet", "--set", "duration=0.5"], &[HELD, VIOLATED]),
            Some(&"campaign") if has("--list") || has("--show") => (&[], &[HELD]),
            Some(&"campaign") if has("--runs") || has("--only") || self.is_grid(arguments)? => {
                (&["--quiet", "--set", "duration=0.1"], &[HELD, VIOLATED])
            }
            Some(&"campaign") => {
                (&["--quiet", "--set", "duration=0.1", "--runs", "8"], &[HELD, VIOLATED])
            }
            Some(&"fly") => (&["--duration", "0.5", "--tcp", "127.0.0.1:0"], &[HELD]),
            Some(&"consistency") if has("--flights") => {
                (&["--quiet", "--seconds", "1"], &[HELD, VIOLATED])
            }
            Some(&"consistency") => {
                (&["--quiet", "--seconds", "1", "--flights", "2"], &[HELD, VIOLATED])
            }
            Some(&"merge") => (&["--quiet"], &[HELD, VIOLATED]),
            Some(&"tune") if has("--no-check") => (&[], &[HELD]),
            Some(&"tune") => (&["--no-check"], &[HELD]),
            Some(&"pil") if cfg!(feature = "emulator-tests") && !has("--port") => {
                (&["--quiet", "--set", "duration=0.5", "--image", IMAGE], &[HELD, VIOLATED])
            }
            Some(&"pil") if has("--port") => (&["--quiet"], &[VEHICLE_FAILED]),
            Some(&"pil") => (&["--quiet", "--image", "missing"], &[VEHICLE_FAILED]),
            _ => (&[], &[HELD]),
        })
    }

    fn is_grid(&self, arguments: &[&str]) -> Result<bool, String> {
        let name = arguments.get(1).ok_or("which campaign?")?;
        let shown = self.ended(&["campaign", name, "--show"], &[HELD])?;
        Ok(String::from_utf8_lossy(&shown.stdout).contains("sampling = \"grid\""))
    }

    fn ended(&self, arguments: &[&str], allowed: &[i32]) -> Result<Output, String> {
        let mut program = Command::new(env!("CARGO_BIN_EXE_sil-host"));
        let output = program.args(arguments).current_dir(&self.folder).output().expect("it starts");
        let status = output.status.code();
        let fine = status.is_some_and(|status| allowed.contains(&status));
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        let run = arguments.join(" ");
        fine.then_some(output).ok_or(format!("sil-host {run}: status {status:?}: {error}"))
    }

    /// A built-in scenario as the program shows it.
    pub fn built_in(&self, name: &str) -> Result<String, String> {
        let output = self.ended(&["show", name], &[HELD])?;
        String::from_utf8(output.stdout).map_err(|error| error.to_string())
    }

    /// Reads `text` as a scenario, by flying a tick of it.
    pub fn read_scenario(&self, text: &str) -> Result<(), String> {
        let read = ["run", "block.toml", "--quiet", "--set", "duration=0.1"];
        self.read(text, &read, &[HELD, VIOLATED])
    }

    /// Reads `text` as a campaign.
    pub fn read_campaign(&self, text: &str) -> Result<(), String> {
        self.read(text, &["campaign", "block.toml", "--show"], &[HELD])
    }

    /// Reads `text` as a vehicle for `tune`, which must find gains for it.
    pub fn read_vehicle(&self, text: &str) -> Result<(), String> {
        self.read(text, &["tune", "block.toml", "--no-check", "--quiet"], &[HELD])
    }

    fn read(&self, text: &str, arguments: &[&str], allowed: &[i32]) -> Result<(), String> {
        fs::write(self.folder.join("block.toml"), text).map_err(|error| error.to_string())?;
        self.ended(arguments, allowed).map(drop)
    }
}
