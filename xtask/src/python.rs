//! Virtual environments of Python packages: those that the tests read logs with, and others.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

use crate::shell::{command, run, succeeds};

/// Names and versions of the packages.
const REQUIREMENTS: &str = "tests/python-requirements.txt";
/// The environment; `sil-host/tests/log_readers.rs` looks for it here.
const ENVIRONMENT: &str = "target/python";

/// Makes the environment that the tests read logs with.
pub fn set_up() -> Result<()> {
    environment(REQUIREMENTS, ENVIRONMENT, &["--no-deps"])
}

/// Makes the environment `folder`, unless it is there with the very packages that the file `requirements`
/// asks for; `options` are those of pip.
pub fn environment(requirements: &str, folder: &str, options: &[&str]) -> Result<()> {
    let wanted = fs::read_to_string(requirements).context(requirements.to_owned())?;
    let environment = Path::new(folder);
    let installed = environment.join("requirements.txt");
    let python = environment.join("bin/python3");
    let python = python.to_str().context("a path in UTF-8")?;
    let same = fs::read_to_string(&installed).is_ok_and(|installed| installed == wanted);
    if same && succeeds(&mut command([python, "--version"])) {
        return Ok(());
    }
    run(&mut command(["python3", "-m", "venv", "--clear", folder]))?;
    let pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    run(command(pip).args(options).args(["--requirement", requirements]))
        .with_context(|| format!("installing the packages of {requirements}"))?;
    fs::write(&installed, wanted).with_context(|| format!("{}", installed.display()))
}
