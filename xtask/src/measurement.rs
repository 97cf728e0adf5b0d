//! Measures each controller's step: instructions, cycles, stack, memory; and that the emulator
//! computed what the host did.

use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::cycles;
use crate::shell::{cargo, run};
use crate::step_image::{Flight, NONE, STEP, StepImage, build, read_words};
use crate::wcet::{self, Bounds, Model};

/// Folder of the flights for the step images.
pub const SAMPLES: &str = "target/step-samples";
/// Largest headroom of the static stack bound above the deepest stack that was seen (B).
const STACK_MARGIN: u64 = 64;

/// Builds images and plugin, and writes the flights.
pub fn prepare() -> Result<()> {
    build()?;
    write_samples()
}

/// Writes the flights.
pub fn write_samples() -> Result<()> {
    run(&mut cargo(["run", "--quiet", "-p", "step-samples", "--", SAMPLES]))
}

/// Instructions a step in one flight.
pub struct Case {
    /// Name of the flight.
    pub name: String,
    /// Steps flown.
    pub steps: usize,
    /// Fewest, mean and most instructions of a step.
    pub instructions: (u64, f64, u64),
    /// Mean cycles of a step, estimated.
    pub cycles: f64,
}

impl Case {
    /// Sums up one flight.
    pub fn new(name: String, image: &StepImage, flight: &Flight) -> Self {
        let counts = &flight.instructions;
        let steps = counts.len();
        let (min, max) = (counts.iter().min(), counts.iter().max());
        let mean = counts.iter().sum::<u64>() as f64 / steps as f64;
        let weighted = flight.executed.iter().map(|(address, executed)| {
            image.listing.get(address).map_or(0, |found| executed * cycles::cycles(found))
        });
        Self {
            name,
            steps,
            instructions: (min.copied().unwrap_or(0), mean, max.copied().unwrap_or(0)),
            cycles: weighted.sum::<u64>() as f64 / steps as f64,
        }
    }
}

/// Everything that was measured of one controller.
pub struct Measurement {
    /// One for each flight; those of the paper are called so.
    pub cases: Vec<Case>,
    /// Bytes of flash of everything that the step reaches, constants included.
    pub flash_step: u64,
    /// Bytes of flash that an image with the controller has more than one without: the step, and
    /// the constructor with its validation and messages.
    pub flash: u64,
    /// Bytes of RAM: the validated controller and its state.
    pub ram: u64,
    /// Worst-case stack of the step from the call graph (B).
    pub stack: u64,
    /// Deepest stack seen in painted memory (B).
    pub painted_stack: u64,
    /// Upper bound on the instructions of a step.
    pub wcet_instructions: u64,
    /// Upper bounds on the cycles of a step: with the flash's accelerator always hit, and without.
    pub wcet_cycles: [u64; 2],
}

impl Measurement {
    /// Flies every case of one controller. [`prepare`] comes first.
    pub fn take(controller: &str) -> Result<Self> {
        let image = StepImage::open(controller)?;
        let empty = StepImage::open(NONE)?;
        let stack = image.graph.stack(&image.image)?.bytes;
        let bounds = Bounds::of(STEP, &image.image, &image.listing).context(STEP)?;
        let wcet_instructions = bounds.get(Model::Instructions);
        let (mut cases, mut painted_stack, mut ram) = (Vec::new(), 0, 0);
        for name in case_names(controller)? {
            let folder = Path::new(SAMPLES).join(controller).join(&name);
            let flight = image.fly(&folder).with_context(|| format!("{controller}, {name}"))?;
            agrees_with_host(&flight, &folder).with_context(|| format!("{controller}, {name}"))?;
            stays_on_paths(&flight, &bounds).with_context(|| format!("{controller}, {name}"))?;
            agrees_with_timer(&flight).with_context(|| format!("{controller}, {name}"))?;
            painted_stack = painted_stack.max(u64::from(flight.closing.stack));
            ram = u64::from(flight.closing.controller_size + flight.closing.state_size);
            cases.push(Case::new(name, &image, &flight));
        }
        ensure!(
            painted_stack <= stack && stack <= painted_stack + STACK_MARGIN,
            "{controller}: the call graph gives {stack} B of stack, painted memory {painted_stack} B"
        );
        let max = cases.iter().map(|case| case.instructions.2).max().unwrap_or(0);
        wcet::judge(wcet_instructions, max).context(controller.to_owned())?;
        let wcet_cycles = [Model::CyclesHit, Model::CyclesMiss].map(|model| bounds.get(model));
        let flash = image.image.flash - empty.image.flash;
        let flash_step = image.graph.code_size();
        Ok(Self {
            cases,
            flash_step,
            flash,
            ram,
            stack,
            painted_stack,
            wcet_instructions,
            wcet_cycles,
        })
    }
}

/// The flights of one controller, in alphabetical order.
pub fn case_names(controller: &str) -> Result<Vec<String>> {
    let folder = Path::new(SAMPLES).join(controller);
    let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
    let names = entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
    let mut names = names.collect::<Result<Vec<_>>>()?;
    names.sort();
    Ok(names)
}

/// Every wrench and status has the bits that the host computed.
pub fn agrees_with_host(flight: &Flight, folder: &Path) -> Result<()> {
    let expected = read_words(&folder.join("expected.bin"))?;
    let (expected, rest) = expected.as_chunks::<5>();
    ensure!(
        rest.is_empty() && expected.len() == flight.answers.len(),
        "expected.bin is incomplete"
    );
    for (step, (answer, expected)) in flight.answers.iter().zip(expected).enumerate() {
        let [x, y, z, w] = answer.wrench;
        let found = [x, y, z, w, answer.status];
        ensure!(found == *expected, "step {step}: host {expected:x?}, emulator {found:x?}");
    }
    Ok(())
}

/// Every executed instruction is on a path that the bound considered.
pub fn stays_on_paths(flight: &Flight, bounds: &Bounds) -> Result<()> {
    for (address, count) in flight.executed.iter().filter(|(_, count)| *count > 0) {
        ensure!(
            bounds.contains(*address),
            "the step executed {address:#x} {count} times, which no path contains"
        );
    }
    Ok(())
}

/// TIM2 counts the same instructions as the plugin, plus the few around the call.
fn agrees_with_timer(flight: &Flight) -> Result<()> {
    let around = |step: usize| u64::from(flight.answers[step].ticks) - flight.instructions[step];
    let first = around(0);
    ensure!(first < 16, "TIM2 counts {first} instructions more than the plugin");
    for step in 0..flight.answers.len() {
        let found = around(step);
        ensure!(found == first, "step {step}: {found} instructions around the call, not {first}");
    }
    Ok(())
}
