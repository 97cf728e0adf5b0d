//! Tests of the installed library, written in C: plain, under valgrind, and with gcc's sanitizers.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::build::FOLDER;
use crate::measurement::{SAMPLES, case_names, write_samples};
use crate::shell::{command, output, run};
use crate::step_image::CONTROLLERS;

/// Sources of the tests.
const SOURCES: &str = "ctrl-c/tests/c";
const EXAMPLE: &str = "ctrl-c/examples/hover.c";
/// Pages with blocks of C.
const PAGES: [&str; 1] = ["docs/how-to/c-library.md"];
/// Largest number of lines of the example.
const EXAMPLE_LINES: usize = 60;
/// Options of every compilation.
const STRICT: [&str; 6] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1", "-g"];
/// Options of gcc that make mistakes end the program.
pub const SANITIZERS: [&str; 2] = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
/// Valgrind with every finding an error, leaks included.
const VALGRIND: [&str; 5] = [
    "valgrind",
    "--quiet",
    "--leak-check=full",
    "--error-exitcode=9",
    "--errors-for-leak-kinds=all",
];

/// The ways in which a test is built and run.
const WAYS: [Way; 3] = [
    Way { name: "plain", compiler: &["gcc", "-std=c11"], launcher: &[] },
    Way {
        name: "sanitized",
        compiler: &["gcc", "-std=c11", SANITIZERS[0], SANITIZERS[1]],
        launcher: &[],
    },
    Way { name: "valgrind", compiler: &["gcc", "-std=c11"], launcher: &VALGRIND },
];
/// The other kind of host, emulated.
const AARCH64: Way = Way {
    name: "aarch64",
    compiler: &["aarch64-linux-gnu-gcc", "-std=c11", "-static"],
    launcher: &["qemu-aarch64"],
};
/// The header in C++.
const CPP: Way = Way { name: "C++", compiler: &["g++", "-std=c++11"], launcher: &[] };

/// One way to build and run a test.
struct Way {
    name: &'static str,
    /// The compiler and its options.
    compiler: &'static [&'static str],
    /// Words in front of the program.
    launcher: &'static [&'static str],
}

/// Runs all tests against the library installed in `prefix`, and those of the steps against the one for
/// aarch64 in `aarch64`.
pub fn run_all(prefix: &Path, aarch64: &Path) -> Result<()> {
    write_samples()?;
    let mut passed = 0;
    for way in &WAYS {
        passed += way.run_each(prefix)?;
    }
    passed += AARCH64.run_each(aarch64)?;
    detects_other_bits(prefix)?;
    CPP.run(prefix, "header.cpp", &[])?;
    pages(prefix)?;
    example(prefix)?;
    println!("C library: {} passed, 0 failed", passed + 4);
    Ok(())
}

impl Way {
    /// Bad input and every recorded flight; returns how many ran.
    fn run_each(&self, prefix: &Path) -> Result<usize> {
        println!("{}:", self.name);
        self.run(prefix, "bad_input.c", &[])?;
        let mut ran = 1;
        for controller in CONTROLLERS {
            for flight in case_names(controller)? {
                let folder = Path::new(SAMPLES).join(controller).join(flight);
                let folder = folder.to_str().context("a path in UTF-8")?;
                self.run(prefix, "recording.c", &[controller, folder])?;
                ran += 1;
            }
        }
        Ok(ran)
    }

    /// Builds one test with the flags that pkg-config gives, and runs it.
    fn run(&self, prefix: &Path, source: &str, arguments: &[&str]) -> Result<()> {
        let program = self.build(prefix, &Path::new(SOURCES).join(source))?;
        let program = program.to_str().context("a path in UTF-8")?;
        let words = self.launcher.iter().copied().chain([program]).chain(arguments.iter().copied());
        run(&mut command(words)).with_context(|| format!("{source}, {}", self.name))
    }

    fn build(&self, prefix: &Path, source: &Path) -> Result<PathBuf> {
        let name = source.file_name().context("a file")?.to_string_lossy();
        let program = Path::new(FOLDER).join(format!("{}-{name}.out", self.name));
        let mut gcc = command(self.compiler.iter().copied());
        gcc.args(STRICT).arg(source).arg("-o").arg(&program);
        let flags = pkg_config(prefix)?;
        run(gcc.args(flags.split_whitespace()).arg("-lm"))?;
        Ok(program)
    }
}

/// Compiler and linker flags of the installed library.
fn pkg_config(prefix: &Path) -> Result<String> {
    let path = std::path::absolute(prefix.join("lib/pkgconfig"))?;
    let mut query = command(["pkg-config", "--cflags", "--libs", "gyrfalcon >= 0.1"]);
    output(query.env("PKG_CONFIG_PATH", path))
}

/// The comparison must be able to fail: one wrong bit in one expected result is found.
fn detects_other_bits(prefix: &Path) -> Result<()> {
    let (good, bad) = (Path::new(SAMPLES).join("saturated/paper"), Path::new(FOLDER).join("wrong"));
    std::fs::create_dir_all(&bad)?;
    std::fs::copy(good.join("step-input.bin"), bad.join("step-input.bin"))?;
    let mut expected = std::fs::read(good.join("expected.bin"))?;
    let middle = expected.len() / 2;
    expected[middle] ^= 1;
    std::fs::write(bad.join("expected.bin"), expected)?;
    let program = WAYS[0].build(prefix, &Path::new(SOURCES).join("recording.c"))?;
    let found = !Command::new(program).arg("saturated").arg(&bad).status()?.success();
    ensure!(found, "a wrong bit in a recorded flight is not found");
    Ok(())
}

/// Every block of C in the pages compiles as it stands.
fn pages(prefix: &Path) -> Result<()> {
    let flags = pkg_config(prefix)?;
    let mut blocks = 0;
    for page in PAGES {
        let text = std::fs::read_to_string(page).context(page)?;
        for block in text.split("```c\n").skip(1) {
            let code = block.split("```").next().unwrap_or_default();
            let source = Path::new(FOLDER).join("page.c");
            std::fs::write(&source, code)?;
            let mut gcc = command(["gcc", "-std=c11", "-fsyntax-only"]);
            run(gcc.args(STRICT).args(flags.split_whitespace()).arg(source)).context(page)?;
            blocks += 1;
        }
    }
    ensure!(blocks > 0, "no block of C in the pages");
    Ok(())
}

/// The example: short, and built by CMake as its reader would.
fn example(prefix: &Path) -> Result<()> {
    let lines = std::fs::read_to_string(EXAMPLE).context(EXAMPLE)?.lines().count();
    ensure!(lines <= EXAMPLE_LINES, "{EXAMPLE} has {lines} lines, at most {EXAMPLE_LINES}");
    let build = format!("{FOLDER}/hover");
    let prefix = std::path::absolute(prefix)?;
    run(command(["cmake", "-S", "ctrl-c/examples", "-B", &build])
        .arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display())))?;
    run(&mut command(["cmake", "--build", &build]))?;
    run(&mut command([format!("{build}/hover").as_str()])).context(EXAMPLE)
}
