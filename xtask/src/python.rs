//! The Python packages that the tests read logs with, in a virtual environment of their own.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

use crate::shell::{command, run, succeeds};

/// Names and versions of the packages.
const REQUIREMENTS: &str = "tests/python-requirements.txt";
/// The environment; `sil-host/tests/log_readers.rs` looks for it here.
const ENVIRONMENT: &str = "target/python";

/// Makes the environment, unless it is there with the very packages that are asked for.
pub fn set_up() -> Result<()> {
    let wanted = fs::read_to_string(REQUIREMENTS).context(REQUIREMENTS)?;
    let environment = Path::new(ENVIRONMENT);
    let installed = environment.join("requirements.txt");
    let python = environment.join("bin/python3");
    let python = python.to_str().context("a path in UTF-8")?;
    let same = fs::read_to_string(&installed).is_ok_and(|installed| installed == wanted);
    if same && succeeds(&mut command([python, "--version"])) {
        return Ok(());
    }
    run(&mut command(["python3", "-m", "venv", "--clear", ENVIRONMENT]))?;
    let pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    run(command(pip).args(["--no-deps", "--requirement", REQUIREMENTS]))
        .context("installing the Python packages of the tests")?;
    fs::write(&installed, wanted).with_context(|| format!("{}", installed.display()))
}
