//! Installation into a prefix: header, library, pkg-config file, CMake package.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use super::build::Library;
use super::header::HEADER;
use crate::shell::run;
use crate::toolchain::llvm_tool;

const TEMPLATES: &str = "ctrl-c/package";

/// Installs `library` into `prefix`.
pub fn install(library: &Library, prefix: &Path) -> Result<()> {
    let lib = prefix.join("lib");
    let (pkgconfig, cmake) = (lib.join("pkgconfig"), lib.join("cmake/gyrfalcon"));
    for folder in [&prefix.join("include"), &pkgconfig, &cmake] {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    copy(Path::new(HEADER), &prefix.join("include/gyrfalcon.h"))?;
    copy(&library.object, &lib.join("gyrfalcon.o"))?;
    let archive = lib.join("libgyrfalcon.a");
    let _ = fs::remove_file(&archive); // `ar` would add to it
    run(Command::new(llvm_tool("llvm-ar")?).arg("rcsD").arg(&archive).arg(&library.object))?;
    template("gyrfalcon.pc", &pkgconfig)?;
    template("gyrfalcon-config.cmake", &cmake)?;
    template("gyrfalcon-config-version.cmake", &cmake)?;
    println!("installed for {} in {}", library.target, prefix.display());
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::copy(from, to).with_context(|| format!("{} to {}", from.display(), to.display()))?;
    Ok(())
}

/// Copies a template with the version filled in.
fn template(name: &str, folder: &Path) -> Result<()> {
    let text = fs::read_to_string(Path::new(TEMPLATES).join(name)).context(name.to_owned())?;
    let text = text.replace("@VERSION@", env!("CARGO_PKG_VERSION"));
    fs::write(folder.join(name), text).context(name.to_owned())
}
