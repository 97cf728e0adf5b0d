//! Crazyflie's controllers on the emulated Cortex-M4, through the samples of our own step images.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use ctrl_core::config::RobustAdaptiveConfig;
use step_record::{Record, Sample};

use super::{FOLDER, Row, Sources, needs, print};
use crate::measurement::{SAMPLES, prepare};
use crate::shell::{command, run};
use crate::step_image::{CONTROLLERS, STEP, StepImage};

const COMPILER: &str = "arm-none-eabi-gcc";
/// Our drivers.
const DRIVERS: &str = "xtask/peers";
/// The controllers, as their functions are named.
const PEERS: [&str; 2] = ["Lee", "Mellinger"];
/// Sources that are compiled, and a header that tells the right folder.
const FILES: [&str; 3] = [
    "src/modules/src/controller/controller_lee.c",
    "src/modules/src/controller/controller_mellinger.c",
    "src/modules/interface/stabilizer_types.h",
];
/// Folders of headers.
const HEADERS: [&str; 7] = [
    "src/modules/interface",
    "src/modules/interface/controller",
    "src/hal/interface",
    "src/utils/interface",
    "src/utils/interface/lighthouse",
    "src/config",
    "src/platform/interface",
];
/// The processor, and the optimisation that is fastest there.
const FLAGS: [&str; 8] = [
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfpu=fpv4-sp-d16",
    "-mfloat-abi=hard",
    "-O3",
    "-ffunction-sections",
    "-fno-strict-aliasing", // as Crazyflie's own build
    "-DNDEBUG",
];

/// Flies both controllers and ours, and prints the table.
pub fn compare(folder: &Path) -> Result<()> {
    needs(COMPILER, "gcc-arm-none-eabi libnewlib-arm-none-eabi")?;
    let origin = "github.com/bitcraze/crazyflie-firmware";
    let sources = Sources { folder, option: "--crazyflie", origin };
    let (files, headers) = (sources.files(&FILES)?, sources.files(&HEADERS)?);
    prepare()?;
    let mut rows = Vec::new();
    for controller in CONTROLLERS {
        let flight = Path::new(SAMPLES).join(controller).join("paper");
        let counts = StepImage::open(controller)?.count(&flight)?;
        rows.push(row(format!("{controller}, the paper's flight"), &counts)?);
    }
    for peer in PEERS {
        let work = Path::new(FOLDER).join(peer);
        fs::create_dir_all(&work).with_context(|| work.display().to_string())?;
        write_input(&work)?;
        let image = build(peer, &work, &files, &headers)?;
        let counts = StepImage::open_file(image, STEP)?.count(&work)?;
        rows.push(row(format!("Crazyflie {peer}, the same samples"), &counts)?);
    }
    print("instructions of a step on the emulated Cortex-M4, exact", &rows);
    Ok(())
}

fn row(name: String, counts: &[u64]) -> Result<Row> {
    ensure!(!counts.is_empty(), "{name}: no step was counted");
    let mean = counts.iter().sum::<u64>() as f64 / counts.len() as f64;
    Ok(Row { name, least: counts.iter().min().copied(), mean, most: counts.iter().max().copied() })
}

/// The samples of controller 1's flight, without its configuration.
fn write_input(work: &Path) -> Result<()> {
    let from = Path::new(SAMPLES).join(CONTROLLERS[0]).join("paper/step-input.bin");
    let all = fs::read(&from).with_context(|| from.display().to_string())?;
    let (configuration, sample) = (words(&RobustAdaptiveConfig::zero()), words(&Sample::zero()));
    let samples = all.get(4 * configuration..).context("no configuration in the samples")?;
    ensure!(samples.len().is_multiple_of(4 * sample), "{} is incomplete", from.display());
    fs::write(work.join("peer-input.bin"), samples).context("peer-input.bin")
}

fn words(record: &impl Record) -> usize {
    let mut words = 0;
    record.write(|_| words += 1);
    words
}

fn build(peer: &str, work: &Path, files: &[PathBuf], headers: &[PathBuf]) -> Result<PathBuf> {
    // What Crazyflie's configuration would generate: the vehicle, whose mass is a default.
    fs::write(work.join("autoconf.h"), "#define CONFIG_PLATFORM_CF2 1\n").context("autoconf.h")?;
    let image = work.join("image.elf");
    let mut compiler = command([COMPILER]);
    compiler.args(FLAGS).arg(format!("-DPEER={peer}")).arg("-I").arg(work).args(["-I", DRIVERS]);
    for folder in headers {
        compiler.arg("-isystem").arg(folder);
    }
    let script = Path::new(DRIVERS).join("image.ld");
    compiler.args(["-nostartfiles", "-Wl,--gc-sections", "-w", "-T"]).arg(script);
    compiler
        .arg("-o")
        .arg(&image)
        .args(["start.c", "crazyflie.c"].map(|c| Path::new(DRIVERS).join(c)));
    compiler.args(files.iter().filter(|file| file.extension().is_some_and(|it| it == "c")));
    run(compiler.args(["-lm", "-lc", "-lnosys"]))?;
    Ok(image)
}
