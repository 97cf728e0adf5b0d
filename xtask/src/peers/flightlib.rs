//! flightlib's plant on the host, under callgrind, beside ours.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use super::{FOLDER, Row, Sources, needs, print};
use crate::shell::{cargo, command, output, run, succeeds};

const COMPILER: &str = "g++";
const DRIVER: &str = "xtask/peers/flightlib.cpp";
/// Sources of the plant.
const FILES: [&str; 8] = [
    "src/common/integrator_base.cpp",
    "src/common/integrator_euler.cpp",
    "src/common/integrator_rk4.cpp",
    "src/common/logger.cpp",
    "src/common/math.cpp",
    "src/common/quad_state.cpp",
    "src/dynamics/dynamics_base.cpp",
    "src/dynamics/quadrotor_dynamics.cpp",
];
/// Ours is built for the same instructions.
const FLAGS: [&str; 6] =
    ["-std=c++17", "-O3", "-march=x86-64-v3", "-fno-fast-math", "-DNDEBUG", "-w"];
/// Includes of the libraries that flightlib needs, for which the compiler is asked.
const LIBRARIES: &str = "printf '#include <eigen3/Eigen/Eigen>\\n#include <yaml-cpp/yaml.h>\\n' | g++ -std=c++17 -fsyntax-only -xc++ -";
/// Steps of two runs, whose difference leaves out the start.
const STEPS: [u64; 2] = [1_000, 6_000];

/// Counts both plants and prints the table.
pub fn compare(folder: &Path) -> Result<()> {
    needs(COMPILER, "g++")?;
    needs("valgrind", "valgrind")?;
    ensure!(
        succeeds(&mut command(["sh", "-c", LIBRARIES])),
        "missing: Eigen or yaml-cpp. Install them, on Debian or Ubuntu: apt-get install libeigen3-dev libyaml-cpp-dev"
    );
    let origin = "flightlib, a folder of github.com/uzh-rpg/flightmare";
    let sources = Sources { folder, option: "--flightlib", origin };
    let files = sources.files(&FILES)?;
    let headers = sources.files(&["include"])?;
    let program = build(&files, &headers)?;
    let mut rows = vec![Row {
        name: "Gyrfalcon: rigid body, RK4 in f64".to_owned(),
        least: None,
        mean: ours()?,
        most: None,
    }];
    let name = "flightlib: rigid body, RK4 in f32".to_owned();
    rows.push(Row { name, least: None, mean: theirs(&program)?, most: None });
    print("instructions of a plant's step of 1 ms on this host, under callgrind", &rows);
    Ok(())
}

fn build(files: &[PathBuf], headers: &[PathBuf]) -> Result<PathBuf> {
    fs::create_dir_all(FOLDER).context(FOLDER)?;
    let program = Path::new(FOLDER).join("flightlib");
    let mut compiler = command([COMPILER]);
    compiler.args(FLAGS).args(["-isystem", "/usr/include/eigen3"]);
    for folder in headers {
        compiler.arg("-isystem").arg(folder);
    }
    run(compiler.arg("-o").arg(&program).arg(DRIVER).args(files).arg("-lyaml-cpp"))?;
    Ok(program)
}

/// Instructions of a step, from two runs.
fn theirs(program: &Path) -> Result<f64> {
    let mut counts = [0.0; 2];
    for (count, steps) in counts.iter_mut().zip(STEPS) {
        let log = Path::new(FOLDER).join("callgrind.txt");
        let mut valgrind =
            command(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]);
        valgrind.arg(format!("--log-file={}", log.display())).arg(program);
        run(valgrind.arg(steps.to_string()))?;
        let report = fs::read_to_string(&log).with_context(|| log.display().to_string())?;
        let total = report.split("Collected :").nth(1).and_then(|it| it.split_whitespace().next());
        *count = total.context("callgrind reports no total")?.parse::<f64>().context("total")?;
    }
    Ok((counts[1] - counts[0]) / (STEPS[1] - STEPS[0]) as f64)
}

/// Instructions of a step of our plant, as the host's benchmark counts them.
fn ours() -> Result<f64> {
    let bench = ["bench", "-p", "sil-host", "--bench", "instructions", "--", "plant"];
    let report = output(&mut cargo(bench))?;
    let count = report
        .lines()
        .find(|line| line.starts_with("plant"))
        .and_then(|line| line.split_whitespace().nth(2));
    count.context("the benchmark has no row of the plant")?.parse().context("count of the plant")
}
