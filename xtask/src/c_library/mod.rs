//! `cargo xtask c-library`: the C library, its header, its tests and its installation.

mod build;
mod cost;
mod header;
mod install;
mod integrations;
mod machine;
mod tests;

use std::path::Path;

use anyhow::{Context, Result};

pub use cost::rows as cost_rows;
pub use header::write as write_header;

use build::Library;

use crate::budgets::Row;
use crate::measurement::prepare;
use crate::toolchain::{TARGET, host};

/// Prefix into which the checks install the library for this machine.
const PREFIX: &str = "target/c-library/prefix";

/// The other kind of host, and the prefix of its library.
const AARCH64: &str = "aarch64-unknown-linux-gnu";
const AARCH64_PREFIX: &str = "target/c-library/prefix-aarch64";

/// Everything that must hold of the C library.
pub fn check() -> Result<()> {
    header::check()?;
    let library = Library::build(&host()?)?;
    let target = Library::build(TARGET)?;
    let stacks = machine::check(&target)?;
    install::install(&library, Path::new(PREFIX))?;
    let aarch64 = Path::new(AARCH64_PREFIX);
    install::install(&Library::build(AARCH64)?, aarch64)?;
    tests::run_all(Path::new(PREFIX), aarch64)?;
    integrations::crazyflie(Path::new(PREFIX), &target, &stacks)?;
    integrations::px4(Path::new(PREFIX))
}

/// Measures the cost of the interface alone, without the other budgets.
pub fn print_cost() -> Result<()> {
    prepare()?;
    for Row { subject, quantity, unit, value } in cost_rows()? {
        println!("{subject:<18} {quantity:<18} {value:>9.1} {unit}");
    }
    Ok(())
}

/// Builds the library for `target` (this machine's unless given) and installs it into `prefix`.
pub fn install(prefix: &str, target: Option<&str>) -> Result<()> {
    let target = target.map_or_else(host, |target| Ok(target.to_owned()))?;
    let library = Library::build(&target).with_context(|| format!("the library for {target}"))?;
    install::install(&library, Path::new(prefix))
}
