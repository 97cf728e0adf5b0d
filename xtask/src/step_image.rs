//! The images that hold one controller each: building them, flying them in the emulator.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use step_record::{Answer, Closing, Record};

use crate::call_graph::CallGraph;
use crate::disassembly::{self, Listing};
use crate::elf::Image;
use crate::shell::{cargo, run, run_within};
use crate::toolchain::TARGET;

/// The measured function of every image.
pub const STEP: &str = "controller_step";
/// The controllers, as their folders, images and budgets are named.
pub const CONTROLLERS: [&str; 2] = ["robust-adaptive", "saturated"];
/// The image without a controller.
pub const NONE: &str = "none";

/// The linker's script of cortex-m-rt, and the size of every stack frame in the image.
const FLAGS: &str = "-C link-arg=-Tlink.x -C link-arg=--nmagic -Z emit-stack-sizes";
const FOLDER: &str = "target/step-image";

/// Builds the images and QEMU's counting plugin.
pub fn build() -> Result<()> {
    run(&mut cargo(["build", "--release", "--quiet", "-p", "insn-count"]))?;
    build_images(&["--bins"])
}

/// Builds the images behind the C interface.
pub fn build_c_interface() -> Result<()> {
    let bins = ["--bin", "step-c-robust-adaptive", "--bin", "step-c-saturated"];
    build_images(&[&["--features", "c-interface"], &bins[..]].concat())
}

fn build_images(selection: &[&str]) -> Result<()> {
    run(cargo(["build", "--release", "--quiet", "-p", "step-image"])
        .args(["--target", TARGET, "--target-dir", FOLDER])
        .args(selection)
        // -Z emit-stack-sizes is the only unstable thing used; it changes no code.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("RUSTFLAGS", FLAGS)
        .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "rust-lld"))
}

/// Where [`build`] leaves the image of a controller, [`NONE`] or mutants.
pub fn path(name: &str) -> PathBuf {
    Path::new(FOLDER).join(TARGET).join("release").join(format!("step-{name}"))
}

/// A built image with what the machine-code tools know of it.
pub struct StepImage {
    /// Its path.
    pub path: PathBuf,
    /// Functions and sizes.
    pub image: Image,
    /// All instructions.
    pub listing: Listing,
    /// The measured function and all it can reach.
    pub graph: CallGraph,
    /// Name of the measured function.
    pub root: &'static str,
}

impl StepImage {
    /// Opens the built image of one controller.
    pub fn open(controller: &str) -> Result<Self> {
        Self::open_at(controller, STEP)
    }

    /// Opens a built image, to measure its function `root`.
    pub fn open_at(name: &str, root: &'static str) -> Result<Self> {
        Self::open_file(path(name), root)
    }

    /// Opens any image of the same machine, to measure its function `root`.
    pub fn open_file(path: PathBuf, root: &'static str) -> Result<Self> {
        let image = Image::read(&path)?;
        let listing = disassembly::disassemble(&path)?;
        let graph = CallGraph::walk(&image, &listing, root)?;
        Ok(Self { path, image, listing, graph, root })
    }

    /// Flies the image through `folder/step-input.bin`.
    pub fn fly(&self, folder: &Path) -> Result<Flight> {
        self.emulate(folder)?;
        Flight::read(folder)
    }

    /// Runs the image in `folder`, and counts the instructions of each call of its root.
    pub fn count(&self, folder: &Path) -> Result<Vec<u64>> {
        self.emulate(folder)?;
        Ok(read_counts(&folder.join("counts.txt"))?.0)
    }

    fn emulate(&self, folder: &Path) -> Result<()> {
        let path = |relative: &Path| {
            std::path::absolute(relative).with_context(|| relative.display().to_string())
        };
        let plugin = path(Path::new("target/release/libinsn_count.so"))?;
        let image = path(&self.path)?;
        let mut arguments = format!("{},out=counts.txt", plugin.display());
        arguments += &format!(",entry={:#x}", self.image.named(self.root)?.range.start);
        for node in self.graph.nodes() {
            let range = &node.function.range;
            arguments += &format!(",range={:#x}-{:#x}", range.start, range.end);
        }
        let mut emulator = crate::shell::command(["qemu-system-arm", "-machine", "netduinoplus2"]);
        emulator
            .args(["-display", "none", "-serial", "none", "-monitor", "none"])
            // One instruction takes a nanosecond, which is a tick of TIM2.
            .args(["-icount", "shift=0", "-semihosting-config", "enable=on,target=native"])
            .args(["-plugin", &arguments, "-kernel"])
            .arg(image)
            .current_dir(folder);
        run_within(&mut emulator, Duration::from_secs(120)).context(
            "the emulator flies only configurations that the controller's constructor accepts",
        )
    }
}

/// Results of one flight in the emulator.
pub struct Flight {
    /// Instructions of every step, from the plugin.
    pub instructions: Vec<u64>,
    /// Executions of each instruction inside steps.
    pub executed: Executed,
    /// Output of each step.
    pub answers: Vec<Answer>,
    /// Stack and sizes.
    pub closing: Closing,
}

impl Flight {
    fn read(folder: &Path) -> Result<Self> {
        let (instructions, executed) = read_counts(&folder.join("counts.txt"))?;
        let (answers, closing) = read_answers(&folder.join("step-output.bin"))?;
        ensure!(
            !answers.is_empty() && instructions.len() == answers.len(),
            "{} counted calls, {} answers",
            instructions.len(),
            answers.len()
        );
        Ok(Self { instructions, executed, answers, closing })
    }
}

/// Addresses of instructions, and how often each was executed.
type Executed = Vec<(u64, u64)>;

fn read_counts(path: &Path) -> Result<(Vec<u64>, Executed)> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let (mut calls, mut executed) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match (words.next(), words.next(), words.next()) {
            (Some("call"), Some(count), None) => calls.push(count.parse()?),
            (Some("pc"), Some(pc), Some(count)) => {
                executed.push((u64::from_str_radix(&pc[2..], 16)?, count.parse()?));
            }
            _ => anyhow::bail!("{}: {line}", path.display()),
        }
    }
    Ok((calls, executed))
}

/// Reads the answers of a flight; the closing record is the last thing in the file.
fn read_answers(path: &Path) -> Result<(Vec<Answer>, Closing)> {
    let words = read_words(path)?;
    let (answer, closing) = (length::<Answer>(), length::<Closing>());
    ensure!(
        words.len() >= closing && (words.len() - closing).is_multiple_of(answer),
        "{} is incomplete",
        path.display()
    );
    let (answers, closing) = words.split_at(words.len() - closing);
    Ok((answers.chunks(answer).filter_map(record).collect(), record(closing).context("closing")?))
}

/// The words of a file.
pub fn read_words(path: &Path) -> Result<Vec<u32>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let (words, rest) = bytes.as_chunks::<4>();
    ensure!(rest.is_empty(), "{} is not a whole number of words", path.display());
    Ok(words.iter().map(|word| u32::from_le_bytes(*word)).collect())
}

fn record<R: Record>(words: &[u32]) -> Option<R> {
    let mut words = words.iter().copied();
    R::read(|| words.next())
}

fn length<R: Record>() -> usize {
    let mut words = 0;
    R::zero().write(|_| words += 1);
    words
}
