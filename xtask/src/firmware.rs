//! The whole firmware, as built for a board and for the emulator.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::shell::{cargo, run};
use crate::toolchain::TARGET;

/// Features of the package `firmware`, one for each outfit.
pub const OUTFITS: [&str; 2] = ["board", "emulator"];

/// Builds both outfits and keeps a copy of each image.
pub fn build() -> Result<()> {
    for outfit in OUTFITS {
        run(cargo(["build", "--release", "-p", "firmware", "--features", outfit])
            .args(["--target", TARGET]))?;
        let built = Path::new("target").join(TARGET).join("release").join("firmware");
        // Both outfits are built to the same place.
        std::fs::copy(&built, image(outfit)).with_context(|| built.display().to_string())?;
    }
    Ok(())
}

/// Where [`build`] leaves the image of an outfit.
pub fn image(outfit: &str) -> PathBuf {
    Path::new("target").join(format!("firmware-{outfit}"))
}
