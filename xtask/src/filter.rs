//! Costs of the filters of the body rate in the emulator: instructions of a sample, memory, stack.
//!
//! The image filters samples that the host filters too, with the same bits.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use ctrl_core::filter::RateFilter;
use step_record::filter::{FilterAnswer, SAMPLES, STEP_PERIOD, filters, rates};
use step_record::{Closing, Record};

use crate::step_image::{StepImage, read_words};

/// Name of the image.
pub const IMAGE: &str = "filter";
/// The measured function.
pub const FUNCTION: &str = "rate_filter_step";
const FOLDER: &str = "target/step-samples/filter";

/// Everything that was measured.
pub struct Cost {
    /// Sections of each filter, and the most instructions of a sample, the first left out.
    pub instructions: Vec<(usize, u64)>,
    /// Bytes of RAM: the validated filter and its state.
    pub ram: u64,
    /// Worst-case stack, from the call graph (B).
    pub stack: u64,
    /// Bytes of flash of a sample's code.
    pub flash: u64,
}

impl Cost {
    /// Measures the built image.
    pub fn take() -> Result<Self> {
        let folder = Path::new(FOLDER);
        std::fs::create_dir_all(folder).context(FOLDER)?;
        let image = StepImage::open_at(IMAGE, FUNCTION)?;
        let stack = image.graph.stack(&image.image)?.bytes;
        let flash = image.graph.code_size();
        let counts = image.count(folder)?;
        ensure!(counts.len() == filters().len() * SAMPLES, "{} counted calls", counts.len());
        let closing = agrees_with_host(folder)?;
        let most = |counts: &[u64]| counts.iter().skip(1).copied().max().unwrap_or(0);
        let instructions = filters().into_iter().zip(counts.chunks(SAMPLES));
        Ok(Self {
            instructions: instructions.map(|((n, _), counts)| (n, most(counts))).collect(),
            ram: u64::from(closing.controller_size + closing.state_size),
            stack,
            flash,
        })
    }

    /// Most instructions of the filter with the fewest and with the most sections.
    pub fn extremes(&self) -> (u64, u64) {
        let of = |it: Option<&(usize, u64)>| it.map_or(0, |(_, most)| *most);
        (of(self.instructions.first()), of(self.instructions.last()))
    }

    /// Prints the table.
    pub fn print(&self) {
        println!("\nfilter of the body rate: instructions of a sample, exact, from the emulator");
        for (sections, most) in &self.instructions {
            println!("{sections} sections                   max {most}");
        }
        println!("RAM {} B, stack at most {} B, code {} B", self.ram, self.stack, self.flash);
    }
}

/// Every sample has the bits that the host computes.
fn agrees_with_host(folder: &Path) -> Result<Closing> {
    let mut words = read_words(&folder.join("step-output.bin"))?.into_iter();
    for (sections, config) in filters() {
        let filter = RateFilter::new(&config, STEP_PERIOD)?;
        let mut state = filter.initial_state();
        for (index, rate) in rates().enumerate() {
            let expected = FilterAnswer::new(filter.step(&mut state, rate));
            let found = FilterAnswer::read(|| words.next()).context("too few answers")?;
            ensure!(
                found == expected,
                "{sections} sections, sample {index}: host {expected:x?}, emulator {found:x?}"
            );
        }
    }
    Closing::read(|| words.next()).context("no closing record")
}
