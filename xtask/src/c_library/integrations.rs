//! The apps in other people's firmware, compiled against stubs of our own and tested on the host.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use super::build::{FOLDER, Library};
use super::tests::SANITIZERS;
use crate::shell::{command, output, run};

const CRAZYFLIE: &str = "integrations/crazyflie";
const PX4: &str = "integrations/px4";
/// Options of the app's compilation, as strict as the firmware's.
const STRICT: [&str; 6] = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion", "-g"];
/// The same for C++, without what PX4 does without.
const STRICT_CPP: [&str; 9] = [
    "-std=c++14",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-Wdouble-promotion",
    "-Wshadow",
    "-fno-exceptions",
    "-fno-rtti",
    "-g",
];
/// A processor of PX4's boards.
const M7: [&str; 5] = ["-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-d16", "-Os"];
/// The processor of the Crazyflie 2.x.
const M4: [&str; 7] = [
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfloat-abi=hard",
    "-mfpu=fpv4-sp-d16",
    "-Os",
    "-ffunction-sections",
    "-fdata-sections",
];
/// Linking without start-up code: the program is measured, not run.
const UNHOSTED: [&str; 5] = [
    "-nostartfiles",
    "-Wl,--entry=main",
    "-Wl,--gc-sections",
    "--specs=nosys.specs",
    "-Wl,-z,noexecstack",
];
/// Most flash that the app with the library may take (B).
const FLASH_MAX: u64 = 52 * 1024;
/// Most RAM (B).
const RAM_MAX: u64 = 3 * 1024;
/// The app's settings for the firmware's build, and the one that is the stack of its task (words of 4 B).
const APP_CONFIG: &str = "integrations/crazyflie/app/app-config";
const APP_STACK: &str = "CONFIG_APP_STACKSIZE=";
/// Stack that the app's task leaves to its own frames, to the firmware's and to the registers of a switch (B).
const APP_STACK_RESERVE: u64 = 600;

/// Tests the app for the Crazyflie: on the host, that it links for the target, and that its task has the stack that
/// the library's functions take (`stacks`, B).
pub fn crazyflie(prefix: &Path, target: &Library, stacks: &BTreeMap<String, u64>) -> Result<()> {
    let settings = std::fs::read_to_string(APP_CONFIG).context(APP_CONFIG)?;
    let words =
        settings.lines().find_map(|line| line.strip_prefix(APP_STACK)).context(APP_STACK)?;
    let (stack, taken) =
        (4 * words.parse::<u64>().context(APP_STACK)?, stacks["gyrfalcon_configure"]);
    ensure!(
        taken + APP_STACK_RESERVE <= stack,
        "gyrfalcon_configure takes {taken} B of stack, the app's task has {stack} B ({APP_CONFIG}): \
         {APP_STACK_RESERVE} B must remain"
    );
    let modes = Path::new(FOLDER).join("crazyflie-modes");
    let mut gcc = command(["gcc"]);
    gcc.args(STRICT).args(["-O1", "-pthread"]).args(SANITIZERS).args(["-I", "ctrl-c/tests/c"]);
    gcc.args(sources(prefix, &["firmware.c", "modes.c"])).arg(prefix.join("lib/gyrfalcon.o"));
    run(gcc.arg("-lm").arg("-o").arg(&modes))?;
    run(&mut command([modes.to_str().context("a path in UTF-8")?]))?;
    let linked = Path::new(FOLDER).join("crazyflie-target.elf");
    let mut gcc = command(["arm-none-eabi-gcc"]);
    gcc.args(STRICT).args(M4).args(UNHOSTED).args(sources(prefix, &["target.c"]));
    run(gcc.arg(&target.object).arg("-lm").arg("-o").arg(&linked))?;
    let (flash, ram) = size(&linked)?;
    println!("crazyflie app with the library, for the target: {flash} B of flash, {ram} B of RAM");
    ensure!(flash <= FLASH_MAX, "{flash} B of flash are more than {FLASH_MAX} B");
    ensure!(ram <= RAM_MAX, "{ram} B of RAM are more than {RAM_MAX} B");
    Ok(())
}

/// Tests the module for PX4 on the stubbed platform, and compiles it for the target.
pub fn px4(prefix: &Path) -> Result<()> {
    let module = Path::new(PX4).join("src/modules/gyrfalcon_control");
    let includes = [prefix.join("include"), Path::new(PX4).join("stubs"), module.clone()];
    let includes: Vec<_> = includes.into_iter().flat_map(|path| ["-I".into(), path]).collect();
    let sources = ["gyrfalcon_control.cpp", "law.cpp"].map(|source| module.join(source));
    let program = Path::new(FOLDER).join("px4-module");
    let mut gcc = command(["g++"]);
    gcc.args(STRICT_CPP).arg("-O1").args(SANITIZERS).args(&includes).args(&sources);
    gcc.args(["-I", "ctrl-c/tests/c"]);
    gcc.args(["module.cpp", "platform.cpp"].map(|source| Path::new(PX4).join("test").join(source)));
    run(gcc.arg(prefix.join("lib/libgyrfalcon.a")).arg("-o").arg(&program))?;
    let program = program.to_str().context("a path in UTF-8")?;
    run(command([program]).arg(module.join("module.yaml")))?;
    for source in &sources {
        let mut gcc = command(["arm-none-eabi-g++"]);
        gcc.args(STRICT_CPP).args(M7).args(&includes).arg("-c").arg(source);
        run(gcc.arg("-o").arg(Path::new(FOLDER).join("px4-module.o")))?;
    }
    Ok(())
}

/// Include folders and sources of the app, with those of a test.
fn sources(prefix: &Path, tests: &[&str]) -> Vec<PathBuf> {
    let folder = Path::new(CRAZYFLIE);
    let mut words = Vec::new();
    for include in [prefix.join("include"), folder.join("stubs"), folder.join("app/src")] {
        words.extend([PathBuf::from("-I"), include]);
    }
    words.push(folder.join("app/src/gyrfalcon_app.c"));
    words.extend(tests.iter().map(|test| folder.join("test").join(test)));
    words
}

/// Flash and static RAM of a linked program (B).
fn size(program: &Path) -> Result<(u64, u64)> {
    let text = output(command(["arm-none-eabi-size"]).arg(program))?;
    let line = text.lines().nth(1).context("arm-none-eabi-size")?;
    let mut numbers = line.split_whitespace().map_while(|word| word.parse::<u64>().ok());
    let mut next = || numbers.next().with_context(|| format!("arm-none-eabi-size: {line}"));
    let (text, data, bss) = (next()?, next()?, next()?);
    Ok((text + data, data + bss))
}
