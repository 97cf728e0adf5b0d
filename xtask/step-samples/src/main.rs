//! Writes the flights through which the step images are measured, as `step-record` files:
//! `FOLDER/<controller>/<flight>/step-input.bin`, and beside it what the host computed,
//! `expected.bin`: four words of the wrench and one of the status for every step.

mod flights;
mod random;

use std::path::Path;

use anyhow::{Context, Result};
use ctrl_core::controller::ControllerConfig;
use ctrl_core::controller::StepOutput;
use step_record::{Record, Sample};

use flights::{CONTROLLERS, Recording};

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).context("usage: step-samples FOLDER")?;
    for controller in &CONTROLLERS {
        for (name, recording) in controller.flights()? {
            let folder = Path::new(&folder).join(controller.name).join(name);
            write(&folder, &recording).with_context(|| folder.display().to_string())?;
        }
    }
    Ok(())
}

fn write(folder: &Path, Recording { config, samples, outputs }: &Recording) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut input = Vec::new();
    let mut word = |word: u32| input.extend(word.to_le_bytes());
    match config {
        ControllerConfig::RobustAdaptive(config) => config.write(&mut word),
        ControllerConfig::Saturated(config) => config.write(&mut word),
    }
    samples.iter().for_each(|sample: &Sample| sample.write(&mut word));
    std::fs::write(folder.join("step-input.bin"), input)?;
    let expected: Vec<u8> = outputs.iter().flat_map(words).flat_map(u32::to_le_bytes).collect();
    Ok(std::fs::write(folder.join("expected.bin"), expected)?)
}

fn words(output: &StepOutput) -> [u32; 5] {
    let [x, y, z] = output.wrench.torque_body.to_array().map(f32::to_bits);
    [output.wrench.thrust.to_bits(), x, y, z, u32::from(output.status.bits())]
}
