//! The whole firmware, as built for a board and for the emulator.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use anyhow::{Context, Result};

use crate::shell::{cargo, command, run};
use crate::toolchain::TARGET;

/// Features of the package `firmware`, one per build variant.
pub const VARIANTS: [&str; 2] = ["board", "emulator"];

/// Builds both variants and keeps a copy of each image.
pub fn build() -> Result<()> {
    for variant in VARIANTS {
        run(cargo(["build", "--release", "-p", "firmware", "--features", variant])
            .args(["--target", TARGET]))?;
        let built = Path::new("target").join(TARGET).join("release").join("firmware");
        // Both variants are built to the same place.
        std::fs::copy(&built, image(variant)).with_context(|| built.display().to_string())?;
    }
    Ok(())
}

/// Path at which [`build`] leaves the image of a variant.
pub fn image(variant: &str) -> PathBuf {
    Path::new("target").join(format!("firmware-{variant}"))
}

/// Deepest stack that the emulated image finds in its painted memory after 3 s (B).
pub fn painted_stack() -> Result<u64> {
    let output = command(["timeout", "60", "qemu-system-arm", "-machine", "netduinoplus2"])
        .args(["-nodefaults", "-display", "none", "-monitor", "none"])
        .args(["-serial", "null", "-serial", "null", "-icount", "shift=3,sleep=off"])
        .args(["-semihosting-config", "enable=on,target=native,arg=firmware,arg=ticks=3000"])
        .arg("-kernel")
        .arg(image("emulator"))
        .stdin(Stdio::null())
        .output()
        .context("qemu-system-arm")?;
    let text = String::from_utf8_lossy(&output.stderr);
    let used = text.lines().find_map(|line| line.strip_prefix("stack: ")?.split(' ').next());
    let used = used.with_context(|| format!("the image reported no stack: {text}"))?;
    used.parse().with_context(|| format!("stack of {used} B"))
}
