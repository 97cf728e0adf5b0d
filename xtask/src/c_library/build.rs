//! The static library: one object that needs nothing but `memcpy` and exports nothing but `gyrfalcon_*`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::disassembly::disassemble;
use crate::shell::{cargo, command, output, run};
use crate::toolchain::llvm_tool;

/// Folder of everything that is built here.
pub const FOLDER: &str = "target/c-library";
/// Beginning of every exported name.
pub const PREFIX: &str = "gyrfalcon_";
/// Functions of the C library that a compiler may call anywhere; every C environment has them.
const ALLOWED: [&str; 4] = ["memcmp", "memcpy", "memmove", "memset"];

/// The library for one target.
pub struct Library {
    /// The target's triple.
    pub target: String,
    /// The one object, with debug information and all names: for the checks.
    pub joined: PathBuf,
    /// The one object as it is installed.
    pub object: PathBuf,
    /// Exported functions.
    pub functions: Vec<String>,
}

impl Library {
    /// Builds the library for `target`.
    pub fn build(target: &str) -> Result<Self> {
        let archive = compile(target)?;
        let folder = Path::new(FOLDER).join(format!("objects-{target}"));
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let library = Self {
            target: target.to_owned(),
            joined: folder.join("joined.o"),
            object: folder.join("gyrfalcon.o"),
            functions: exported(&archive)?,
        };
        library.join(&archive)?;
        library.hide()?;
        library.check_symbols()?;
        if target.starts_with("x86_64") {
            library.check_baseline()?;
        }
        Ok(library)
    }

    /// Joins what the functions reach into one object.
    fn join(&self, archive: &Path) -> Result<()> {
        let mut linker = linker()?;
        linker.arg("-r");
        for function in &self.functions {
            linker.args(["--undefined", function]);
        }
        run(linker.arg("-o").arg(&self.joined).arg(archive))
    }

    /// Makes every name local but the exported ones.
    fn hide(&self) -> Result<()> {
        let mut objcopy = Command::new(llvm_tool("llvm-objcopy")?);
        objcopy.arg("--strip-debug");
        for function in &self.functions {
            objcopy.args(["--keep-global-symbol", function]);
        }
        run(objcopy.arg(&self.joined).arg(&self.object))
    }

    /// Fails unless the object exports the functions of the interface only, and needs next to nothing.
    fn check_symbols(&self) -> Result<()> {
        let exported = symbols(&["--extern-only", "--defined-only"], &self.object)?;
        let expected: BTreeSet<_> = self.functions.iter().cloned().collect();
        ensure!(exported == expected, "the library exports {exported:?}, not {expected:?}");
        let needed = symbols(&["--undefined-only"], &self.object)?;
        let beyond: Vec<_> =
            needed.iter().filter(|name| !ALLOWED.contains(&name.as_str())).collect();
        ensure!(beyond.is_empty(), "the library needs {beyond:?}");
        let panics = symbols(&[], &self.joined)?;
        let panics: Vec<_> = panics.iter().filter(|name| is_panic(name)).collect();
        ensure!(panics.is_empty(), "the library holds {panics:?}: a function can panic");
        println!(
            "{}: {} functions exported, nothing that panics, needs {}",
            self.target,
            exported.len(),
            if needed.is_empty() { "nothing".to_owned() } else { format!("{needed:?}") }
        );
        Ok(())
    }

    /// Fails if the object has instructions beyond the oldest x86-64: those of AVX begin with `v`.
    fn check_baseline(&self) -> Result<()> {
        let listing = disassemble(&self.joined)?;
        let beyond = listing.values().find(|instruction| {
            instruction.mnemonic.starts_with('v') && instruction.operands.contains("mm")
        });
        ensure!(
            beyond.is_none(),
            "the library for x86-64 has `{}`, which not every such processor has",
            beyond.map_or("", |instruction| &instruction.mnemonic)
        );
        Ok(())
    }

    /// Bytes of code and constants.
    pub fn size(&self) -> Result<u64> {
        let text =
            output(Command::new(llvm_tool("llvm-size")?).arg("--format=sysv").arg(&self.object))?;
        let sections = text.lines().filter_map(|line| {
            let mut words = line.split_whitespace();
            let name = words.next()?;
            let kept = name.starts_with(".text") || name.starts_with(".rodata");
            if kept { words.next()?.parse::<u64>().ok() } else { None }
        });
        Ok(sections.sum())
    }
}

/// `true` for the names of panic handlers and of everything that leads to one.
pub fn is_panic(name: &str) -> bool {
    ["panic", "rust_begin_unwind", "unwrap_failed", "expect_failed", "slice_index", "_Unwind_"]
        .iter()
        .any(|part| name.contains(part))
}

/// Compiles the crate; the archive holds all of `core` besides.
fn compile(target: &str) -> Result<PathBuf> {
    let mut build = cargo(["rustc", "--quiet", "-p", "ctrl-c", "--lib"]);
    build.args(["--crate-type", "staticlib", "--features", "static-library"]).args([
        "--profile",
        "c-library",
        "--target",
        target,
        "--target-dir",
        FOLDER,
    ]);
    // Takes the place of the x86-64-v3 that .cargo/config.toml asks for: other people's programs may run
    // on any x86-64, and the bits are the same.
    let flags = if target.starts_with("x86_64") { "-C target-cpu=x86-64" } else { "" };
    if !has_core(target)? {
        // From the toolchain's sources; which is the only unstable thing used.
        build.args(["-Z", "build-std=core"]).env("RUSTC_BOOTSTRAP", "1");
    }
    run(build.env("RUSTFLAGS", flags))?;
    Ok([FOLDER, target, "c-library", "libgyrfalcon.a"].iter().collect())
}

/// `true` if the toolchain has a compiled `core` for `target`.
fn has_core(target: &str) -> Result<bool> {
    let path = output(&mut command(["rustc", "--print", "target-libdir", "--target", target]))?;
    Ok(Path::new(path.trim()).is_dir())
}

fn exported(archive: &Path) -> Result<Vec<String>> {
    let names = symbols(&["--extern-only", "--defined-only", "--quiet"], archive)?;
    let functions: Vec<_> = names.into_iter().filter(|name| name.starts_with(PREFIX)).collect();
    ensure!(!functions.is_empty(), "no function in {}", archive.display());
    Ok(functions)
}

fn symbols(arguments: &[&str], file: &Path) -> Result<BTreeSet<String>> {
    let mut nm = Command::new(llvm_tool("llvm-nm")?);
    let text = output(nm.args(["--format=just-symbols"]).args(arguments).arg(file))?;
    Ok(text
        .lines()
        .filter(|line| !line.is_empty() && !line.ends_with(':'))
        .map(str::to_owned)
        .collect())
}

/// The toolchain's own linker for ELF files.
pub fn linker() -> Result<Command> {
    let mut linker = Command::new(llvm_tool("rust-lld")?);
    linker.args(["-flavor", "gnu"]);
    Ok(linker)
}

#[cfg(test)]
mod tests {
    use super::is_panic;

    #[test]
    fn names_that_lead_to_a_panic_are_known() {
        for name in [
            "_RNvNtCs_4core9panicking18panic_bounds_check",
            "_ZN4core6option13unwrap_failed17hE",
            "rust_begin_unwind",
            "_Unwind_Resume",
        ] {
            assert!(is_panic(name), "{name}");
        }
        assert!(!is_panic("gyrfalcon_step"));
    }
}
