//! The Python package `gyrfalcon`: built as a wheel, installed into clean environments, tested and
//! type-checked there.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::python::environment;
use crate::shell::{cargo, command, run};

/// Folder of the package.
const PACKAGE: &str = "python";
/// Names and versions of what builds, tests and checks the wheel.
const REQUIREMENTS: &str = "python/requirements.txt";
/// Environment with these.
const ENVIRONMENT: &str = "target/python-wheel/tools";
/// Environment with the wheel and what it asks for, nothing else.
const CLEAN: &str = "target/python-wheel/clean";
/// Folder of the wheel.
const WHEELS: &str = "target/python-wheel/wheels";
/// Build directory of the crate, whose flags are not the project's.
const TARGET: &str = "target/python-wheel/build";
/// For any x86-64 processor since about 2009, whatever `.cargo/config.toml` says.
const FLAGS: &str = "-C target-cpu=x86-64-v2";
/// Flights in RotorPy's plant.
const ROTORPY: &str = "tests/rotorpy/flights.py";
/// The program that flights are compared with.
const PROGRAM: &str = "target/release/sil-host";

/// Builds the wheel, installs it, runs its tests and type checks.
pub fn check() -> Result<()> {
    environment(REQUIREMENTS, ENVIRONMENT, &[])?;
    lint()?;
    let wheel = build()?;
    smoke(&wheel)?;
    install(&tool("python3"), &wheel, &["--force-reinstall", "--no-deps"])?;
    types()?;
    run(&mut cargo(["build", "--release", "-p", "sil-host"]))?;
    test()
}

/// Flies the laws in RotorPy's plant, by the installed wheel, and compares with what is recorded.
pub fn rotorpy() -> Result<()> {
    let python = tool("python3");
    ensure!(Path::new(&python).exists(), "{python} is missing: run cargo xtask python first");
    run(&mut command([python.as_str(), ROTORPY]))
}

/// A program of the environment, by its whole path.
fn tool(name: &str) -> String {
    let folder = std::env::current_dir().unwrap_or_default();
    folder.join(ENVIRONMENT).join("bin").join(name).display().to_string()
}

/// The environment's programs before those of the system: maturin looks for `python3 -m ziglang`.
fn path() -> Result<OsString> {
    let own = std::env::current_dir()?.join(ENVIRONMENT).join("bin");
    let others = std::env::var_os("PATH").unwrap_or_default();
    Ok(std::env::join_paths([own].into_iter().chain(std::env::split_paths(&others)))?)
}

/// Format and lints of the crate, which is outside the workspace.
fn lint() -> Result<()> {
    let manifest = "python/Cargo.toml";
    run(&mut cargo(["fmt", "--check", "--manifest-path", manifest]))?;
    let clippy = ["clippy", "--release", "--manifest-path", manifest, "--target-dir", TARGET];
    let mut clippy = cargo(clippy);
    clippy.env("RUSTFLAGS", FLAGS).env("PYO3_PYTHON", tool("python3"));
    run(clippy.args(["--", "-D", "warnings"]))
}

fn build() -> Result<PathBuf> {
    if Path::new(WHEELS).exists() {
        fs::remove_dir_all(WHEELS)?;
    }
    let out = std::env::current_dir()?;
    let (maturin, python) = (tool("maturin"), tool("python3"));
    let mut build = command([maturin.as_str(), "build", "--release"]);
    build.args(["--interpreter", &python]).arg("--out").arg(out.join(WHEELS));
    // Zig links against the C library of old distributions.
    build.args(["--zig", "--compatibility", "manylinux2014"]);
    build.env("RUSTFLAGS", FLAGS).env("CARGO_TARGET_DIR", out.join(TARGET));
    build.env("PATH", path()?);
    run(build.current_dir(PACKAGE))?;
    let wheels: Vec<_> = fs::read_dir(WHEELS)?.collect::<Result<_, _>>()?;
    ensure!(wheels.len() == 1, "{} wheels in {WHEELS}", wheels.len());
    let wheel = wheels[0].path();
    println!("{}: {} KB", wheel.display(), fs::metadata(&wheel)?.len() / 1000);
    Ok(wheel)
}

fn install(python: &str, wheel: &Path, options: &[&str]) -> Result<()> {
    let pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    run(command(pip).args(options).arg(wheel)).context("installing the wheel")
}

/// A flight in an environment that has nothing but the wheel and what it asks for.
fn smoke(wheel: &Path) -> Result<()> {
    run(&mut command(["python3", "-m", "venv", "--clear", CLEAN]))?;
    let python = format!("{CLEAN}/bin/python3");
    install(&python, wheel, &[])?;
    let flight = "import gyrfalcon; assert gyrfalcon.run('lemniscate', every=1000).passed";
    run(&mut command([python.as_str(), "-c", flight]))
}

/// The stubs against the module itself, and the package's own types.
fn types() -> Result<()> {
    let mut stubs = command([tool("stubtest").as_str(), "gyrfalcon._core"]);
    run(stubs.current_dir(Path::new(ENVIRONMENT)))?;
    let mypy = tool("mypy");
    let parts = [mypy.as_str(), "gyrfalcon", "tests", "../tests/rotorpy/flights.py"];
    run(command(parts).current_dir(PACKAGE))
}

fn test() -> Result<()> {
    let program = std::env::current_dir()?.join(PROGRAM);
    let mut tests = command([tool("python3").as_str(), "-m", "pytest", "--quiet"]);
    // The installed package is tested, not the folder beside the tests.
    tests.args(["-c", "python/pyproject.toml", "-p", "no:cacheprovider"]);
    tests.arg("--import-mode=importlib");
    run(tests.arg("python/tests").env("GYRFALCON_PROGRAM", program))
}
