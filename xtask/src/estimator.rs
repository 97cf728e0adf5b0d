//! Costs of the estimator in the emulator: instructions of a prediction and of a correction, memory, stack.
//!
//! The image flies a flight that the host computes too, with the same bits after each call.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use ctrl_core::estimator::Estimator;
use step_record::estimator::{CONFIG, EstimatorAnswer, Event, Events, start};
use step_record::{Closing, Record};

use crate::step_image::{StepImage, read_words};

/// Name of the image.
pub const IMAGE: &str = "estimator";
/// The measured functions: a prediction, a correction.
pub const FUNCTIONS: [&str; 2] = ["estimator_predict", "estimator_correct"];
const FOLDER: &str = "target/step-samples/estimator";

/// Everything that was measured.
pub struct Cost {
    /// Fewest, mean and most instructions of a prediction.
    pub predict: (u64, f64, u64),
    /// Name, numbers and most instructions of each kind of correction.
    pub corrections: Vec<(&'static str, usize, u64)>,
    /// Bytes of RAM: the validated configuration and the state.
    pub ram: u64,
    /// Worst-case stack of either, from the call graph (B).
    pub stack: u64,
    /// Bytes of flash of everything that both reach.
    pub flash: u64,
}

impl Cost {
    /// Measures the built image.
    pub fn take() -> Result<Self> {
        let folder = Path::new(FOLDER);
        std::fs::create_dir_all(folder).context(FOLDER)?;
        let (mut stack, mut flash, mut counts) = (0, 0, Vec::new());
        for function in FUNCTIONS {
            let image = StepImage::open_at(IMAGE, function)?;
            stack = stack.max(image.graph.stack(&image.image)?.bytes);
            flash += image.graph.code_size();
            counts.push(image.count(folder)?);
        }
        let closing = agrees_with_host(folder)?;
        let corrections = by_kind(&counts[1])?;
        let predict = &counts[0];
        let mean = predict.iter().sum::<u64>() as f64 / predict.len() as f64;
        let extremes = predict.iter().min().zip(predict.iter().max()).context("no prediction")?;
        Ok(Self {
            predict: (*extremes.0, mean, *extremes.1),
            corrections,
            ram: u64::from(closing.controller_size + closing.state_size),
            stack,
            flash,
        })
    }

    /// Most instructions of a correction by one number, and of one by three, per number.
    pub fn scalar(&self) -> (u64, f64) {
        let most = |components: usize| {
            let of = self.corrections.iter().filter(|(_, n, _)| *n == components);
            of.map(|(_, _, most)| *most).max().unwrap_or(0)
        };
        (most(1), most(3) as f64 / 3.0)
    }

    /// Prints the table.
    pub fn print(&self) {
        let (least, mean, most) = self.predict;
        println!("\nestimator: instructions, exact, from the emulator");
        println!("{:<28} min {least} mean {mean:.1} max {most}", "prediction");
        for (name, components, most) in &self.corrections {
            println!("{name:<28} max {most} for {components} numbers");
        }
        println!("RAM {} B, stack at most {} B, code {} B", self.ram, self.stack, self.flash);
    }
}

/// The largest count of each kind of correction, in the order of the events.
fn by_kind(counts: &[u64]) -> Result<Vec<(&'static str, usize, u64)>> {
    let mut kinds: Vec<(&'static str, usize, u64)> = Vec::new();
    let measurements = Events::new().filter_map(|event| match event {
        Event::Correct(measurement) => Some(measurement),
        Event::Predict(_) => None,
    });
    let mut flown = 0;
    for (measurement, count) in measurements.zip(counts) {
        let name = measurement.source().name();
        let components = match name {
            "barometer" | "magnetometer" | "rangefinder" => 1,
            "optical_flow" => 2,
            _ => 3,
        };
        match kinds.iter_mut().find(|(known, _, _)| *known == name) {
            Some((_, _, most)) => *most = (*most).max(*count),
            None => kinds.push((name, components, *count)),
        }
        flown += 1;
    }
    ensure!(flown == counts.len(), "{} counted corrections, {flown} in the flight", counts.len());
    Ok(kinds)
}

/// Every state has the bits that the host computes.
fn agrees_with_host(folder: &Path) -> Result<Closing> {
    let words = read_words(&folder.join("step-output.bin"))?;
    let mut words = words.into_iter();
    let estimator = Estimator::new(&CONFIG)?;
    let mut state = estimator.start(&start());
    for (index, event) in Events::new().enumerate() {
        match event {
            Event::Predict(sample) => estimator.predict(&mut state, &sample),
            Event::Correct(measurement) => drop(estimator.correct(&mut state, &measurement)),
        }
        let expected = EstimatorAnswer::new(&state.vehicle(), state.gyro_bias());
        let found = EstimatorAnswer::read(|| words.next()).context("too few answers")?;
        ensure!(found == expected, "event {index}: host {expected:x?}, emulator {found:x?}");
    }
    Closing::read(|| words.next()).context("no closing record")
}
