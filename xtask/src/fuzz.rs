//! A short run of each fuzz target, built here as `cargo fuzz` builds them.
//!
//! `cargo install cargo-fuzz` costs as much time again (90 s of processor) and it wants a nightly
//! toolchain; what it does for such a run are these flags. The targets are laid out for it all the
//! same: `cargo +nightly fuzz run TARGET fuzz/corpus/TARGET fuzz/seeds/TARGET`.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::shell::{cargo, run};

/// Coverage counters for libFuzzer, and AddressSanitizer for the `unsafe` code of dependencies.
const FLAGS: [&str; 8] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Ccodegen-units=1",
    "--cfg=fuzzing",
    "-Zsanitizer=address",
];

/// The targets of `fuzz/Cargo.toml`, and how many inputs each gets: some ten seconds.
const TARGETS: [(&str, u32); 4] = [
    ("frame_decoder", 40_000),
    ("mavlink_stream", 4_000),
    ("parameter_writer", 5_000),
    ("trajectory_upload", 40_000),
];

/// The one host: a target of its own keeps the flags off build scripts.
const HOST: &str = "x86_64-unknown-linux-gnu";
const OUT: &str = "target/fuzz";

/// Builds the targets and runs each from its seeds, the same inputs every time.
pub fn check() -> Result<()> {
    let mut build = cargo(["build", "--release", "--bins", "--manifest-path", "fuzz/Cargo.toml"]);
    build.args(["--target", HOST, "--target-dir", OUT]);
    // The sanitizer's flag is for nightly compilers; the pinned one has it too.
    build.env("RUSTC_BOOTSTRAP", "1").env("CARGO_ENCODED_RUSTFLAGS", FLAGS.join("\x1f"));
    run(&mut build)?;
    TARGETS.iter().try_for_each(|(target, inputs)| fuzz(target, *inputs))
}

fn fuzz(target: &str, inputs: u32) -> Result<()> {
    let corpus = Path::new(OUT).join("corpus").join(target);
    if corpus.exists() {
        fs::remove_dir_all(&corpus)?;
    }
    fs::create_dir_all(&corpus)?;
    let output = Command::new(Path::new(OUT).join(HOST).join("release").join(target))
        .args(["-seed=1", "-max_len=1024", "-timeout=10", &format!("-runs={inputs}")])
        .arg(format!("-artifact_prefix={OUT}/"))
        .args([&corpus, &Path::new("fuzz/seeds").join(target)])
        .output()
        .with_context(|| format!("cannot start {target}"))?;
    let log = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{target}:\n{log}");
    println!("{target}: {}", log.lines().last().unwrap_or_default());
    Ok(())
}
