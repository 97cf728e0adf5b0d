//! Set-up: the pinned Rust toolchain's parts, the emulator, and the tests' Python packages.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::python;
use crate::shell::{command, output, run, succeeds};

/// The one embedded target.
pub const TARGET: &str = "thumbv7em-none-eabihf";
const COMPONENTS: [&str; 4] = ["llvm-tools", "rust-src", "rustfmt", "clippy"];
/// Command that succeeds if a program is there, and the Debian package that holds it.
const PROGRAMS: [(&[&str], &str); 13] = [
    (&["qemu-system-arm", "--version"], "qemu-system-arm"),
    (&["valgrind", "--version"], "valgrind"),
    (&["python3", "--version"], "python3"),
    (&["python3", "-c", "import ensurepip, venv"], "python3-venv"),
    (&["g++", "--version"], "g++"),           // libFuzzer
    (&["chromium", "--version"], "chromium"), // reports in a browser
    (&["cmake", "--version"], "cmake"),       // from here on: the C library and its integrations
    (&["pkg-config", "--version"], "pkg-config"),
    (&["arm-none-eabi-gcc", "--version"], "gcc-arm-none-eabi"),
    (&["sh", "-c", NEWLIB], "libnewlib-arm-none-eabi"),
    (&["aarch64-linux-gnu-gcc", "--version"], "gcc-aarch64-linux-gnu"),
    (&["sh", "-c", LIBC_AARCH64], "libc6-dev-arm64-cross"),
    (&["qemu-aarch64", "--version"], "qemu-user"),
];

/// Succeeds if C sources for the target find the headers of a C library.
const NEWLIB: &str = "echo '#include <math.h>' | arm-none-eabi-gcc -fsyntax-only -xc -";

/// The same for hosts with an aarch64 processor.
const LIBC_AARCH64: &str = "echo '#include <math.h>' | aarch64-linux-gnu-gcc -fsyntax-only -xc -";

/// Installs missing programs, or returns an error with the command to do so.
pub fn set_up() -> Result<()> {
    if succeeds(&mut command(["rustup", "--version"])) {
        run(&mut command(["rustup", "target", "add", TARGET]))?;
        run(command(["rustup", "component", "add"]).args(COMPONENTS))?;
    }
    llvm_tool("llvm-objdump")?;
    let missing: Vec<_> = PROGRAMS
        .iter()
        .filter(|(shown_by, _)| !succeeds(&mut command(shown_by.iter().copied())))
        .map(|(_, package)| *package)
        .collect();
    if !missing.is_empty() {
        install(&missing)?;
    }
    python::set_up()
}

fn install(packages: &[&str]) -> Result<()> {
    let wanted = packages.join(" ");
    let root = output(&mut command(["id", "-u"])).is_ok_and(|id| id.trim() == "0");
    let sudo = succeeds(&mut command(["sudo", "-n", "true"]));
    if !succeeds(&mut command(["apt-get", "--version"])) || !(root || sudo) {
        bail!("missing: {wanted}. Install it, on Debian or Ubuntu: sudo apt-get install {wanted}");
    }
    let prefix: &[&str] = if root { &[] } else { &["sudo", "-n"] };
    let apt = |arguments: &[&str]| {
        let words = prefix.iter().chain(&["apt-get"]).chain(arguments);
        run(command(words.copied()).env("DEBIAN_FRONTEND", "noninteractive"))
    };
    apt(&["update"])?;
    apt(&[&["install", "-y", "--no-install-recommends"], packages].concat())
        .with_context(|| format!("installing {wanted}"))
}

/// Path of one of the toolchain's own LLVM tools.
pub fn llvm_tool(name: &str) -> Result<PathBuf> {
    let sysroot = output(rustc().args(["--print", "sysroot"]))?;
    let host = host()?;
    let tool = [sysroot.trim(), "lib", "rustlib", &host, "bin", name].iter().collect::<PathBuf>();
    if !tool.exists() {
        bail!("missing: {name}. Install it: rustup component add llvm-tools");
    }
    Ok(tool)
}

/// The triple of this machine.
pub fn host() -> Result<String> {
    let version = output(rustc().arg("-vV"))?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.context("rustc names no host")?.to_owned())
}

fn rustc() -> Command {
    Command::new("rustc")
}
