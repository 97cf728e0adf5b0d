//! `cargo xtask peers`: the cost of our steps beside that of others, whose sources the caller has.
//!
//! Nothing of theirs is in this repository and nothing is fetched. Controllers are flown through the same recorded
//! samples in the emulator, the plant on the host under callgrind. docs/peers.md has the table.

mod crazyflie;
mod flightlib;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use crate::shell::{command, succeeds};

const USAGE: &str = "usage: cargo xtask peers [--crazyflie FOLDER] [--flightlib FOLDER]
  FOLDER holds the sources: of bitcraze/crazyflie-firmware, or of flightlib in uzh-rpg/flightmare";
/// Folder of everything that is built.
const FOLDER: &str = "target/peers";

/// Measures the peers whose sources are named.
pub fn compare(words: &[&str]) -> Result<()> {
    ensure!(!words.is_empty() && words.len().is_multiple_of(2), "{USAGE}");
    for pair in words.chunks(2) {
        match pair {
            ["--crazyflie", folder] => crazyflie::compare(Path::new(folder))?,
            ["--flightlib", folder] => flightlib::compare(Path::new(folder))?,
            _ => bail!("{USAGE}"),
        }
    }
    Ok(())
}

/// Sources of a peer.
struct Sources<'a> {
    folder: &'a Path,
    /// Option that named them.
    option: &'static str,
    /// Place they come from.
    origin: &'static str,
}

impl Sources<'_> {
    /// Paths of `files` below the folder.
    ///
    /// # Errors
    /// When one is missing; all that are missing are named.
    fn files(&self, files: &[&str]) -> Result<Vec<PathBuf>> {
        let Self { folder, option, origin } = self;
        let missing: Vec<_> =
            files.iter().copied().filter(|file| !folder.join(file).exists()).collect();
        ensure!(
            missing.is_empty(),
            "{option} {}: no {}; the folder must hold the sources of {origin}",
            folder.display(),
            missing.join(", ")
        );
        files.iter().map(|file| std::path::absolute(folder.join(file)).context("path")).collect()
    }
}

/// A program that must be installed, and the Debian package that has it.
fn needs(program: &str, package: &str) -> Result<()> {
    let found = succeeds(&mut command([program, "--version"]));
    ensure!(
        found,
        "missing: {program}. Install it, on Debian or Ubuntu: apt-get install {package}"
    );
    Ok(())
}

/// A row of a comparison.
struct Row {
    name: String,
    /// Fewest, mean and most instructions of a step; without extremes where only totals are counted.
    least: Option<u64>,
    mean: f64,
    most: Option<u64>,
}

/// Prints rows with the ratio of each mean to that of the first.
fn print(title: &str, rows: &[Row]) {
    println!("\n{title}");
    println!("{:<44} {:>7} {:>9} {:>7} {:>7}", "", "least", "mean", "most", "ratio");
    let first = rows.first().map_or(1.0, |row| row.mean);
    for Row { name, least, mean, most } in rows {
        let [least, most] = [least, most].map(|end| end.map_or(String::new(), |n| n.to_string()));
        println!("{name:<44} {least:>7} {mean:>9.1} {most:>7} {:>7.2}", mean / first);
    }
}
