//! Costs of the allocation in the emulator: instructions, memory, stack.
//!
//! The image allocates wrenches that the host allocates too, with the same bits.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use ctrl_core::allocation::Allocator;
use step_record::allocation::{
    AllocationAnswer, EACH, LOSS_TICKS, LOSSES, LossAnswer, VEHICLES, command_after_loss, commands,
    fly_through_loss, geometry,
};
use step_record::{Closing, Record};

use crate::step_image::{StepImage, read_words};

/// Name of the image.
pub const IMAGE: &str = "allocation";
/// The measured function.
pub const FUNCTION: &str = "allocation_allocate";
/// The function that takes a rotor out in flight.
pub const LOSE: &str = "allocation_lose";
/// The function that looks for a rotor that has failed.
pub const WATCH: &str = "rotor_watch_step";
const FOLDER: &str = "target/step-samples/allocation";
const NAMES: [&str; VEHICLES] = ["quadrotor", "hexarotor", "octorotor"];

/// Everything that was measured.
pub struct Cost {
    /// Mean near hover, mean and most beyond the limits, of each vehicle.
    vehicles: Vec<(f64, f64, u64)>,
    /// Most for the loss of a rotor.
    lose: u64,
    /// Mean and most of a step of the detection.
    watch: (f64, u64),
    /// Bytes of an allocator.
    ram: u64,
    /// Worst-case stack, from the call graph (B).
    stack: u64,
    /// Bytes of flash of everything that it reaches.
    flash: u64,
}

impl Cost {
    /// Measures the built image.
    pub fn take() -> Result<Self> {
        let folder = Path::new(FOLDER);
        std::fs::create_dir_all(folder).context(FOLDER)?;
        let image = StepImage::open_at(IMAGE, FUNCTION)?;
        let counts = image.count(folder)?;
        let allocations = 2 * EACH * VEHICLES;
        let all = allocations + LOSSES.len();
        ensure!(counts.len() == all, "{} allocations counted", counts.len());
        let losses = StepImage::open_at(IMAGE, LOSE)?.count(folder)?;
        ensure!(losses.len() == LOSSES.len(), "{} losses counted", losses.len());
        let watches = StepImage::open_at(IMAGE, WATCH)?.count(folder)?;
        ensure!(watches.len() == LOSS_TICKS, "{} steps of the detection counted", watches.len());
        let mean = |counts: &[u64]| counts.iter().sum::<u64>() as f64 / counts.len() as f64;
        let vehicles = counts[..allocations].chunks_exact(2 * EACH).map(|counts| {
            let (near, beyond) = counts.split_at(EACH);
            (mean(near), mean(beyond), beyond.iter().copied().max().unwrap_or(0))
        });
        Ok(Self {
            vehicles: vehicles.collect(),
            watch: (mean(&watches), watches.iter().copied().max().unwrap_or(0)),
            lose: losses.into_iter().max().unwrap_or(0),
            ram: u64::from(agrees_with_host(folder)?.controller_size),
            stack: image.graph.stack(&image.image)?.bytes,
            flash: image.graph.code_size(),
        })
    }

    /// The budgeted quantities: name, unit, value.
    pub fn quantities(&self) -> Vec<(&'static str, &'static str, f64)> {
        let (quad, octo) = (self.vehicles[0], self.vehicles[VEHICLES - 1]);
        vec![
            ("quadrotor_instructions_mean", "", quad.0),
            ("quadrotor_instructions_max", "", quad.2 as f64),
            ("octorotor_instructions_mean", "", octo.0),
            ("octorotor_instructions_max", "", octo.2 as f64),
            ("lose_rotor_instructions_max", "", self.lose as f64),
            ("rotor_watch_instructions_max", "", self.watch.1 as f64),
            ("flash", "B", self.flash as f64),
            ("ram", "B", self.ram as f64),
            ("stack", "B", self.stack as f64),
        ]
    }

    /// Prints the table.
    pub fn print(&self) {
        println!("\nallocation: instructions, exact, from the emulator");
        for ((near, beyond, most), name) in self.vehicles.iter().zip(NAMES) {
            println!(
                "{name:<28} near hover mean {near:.1}, beyond the limits mean {beyond:.1} max {most}"
            );
        }
        println!("{:<28} at most {}", "loss of a rotor", self.lose);
        let (mean, most) = self.watch;
        println!("{:<28} mean {mean:.1} max {most}", "look for a failed rotor");
        println!("RAM {} B, stack at most {} B, code {} B", self.ram, self.stack, self.flash);
    }
}

/// Every allocation has the bits that the host computes.
fn agrees_with_host(folder: &Path) -> Result<Closing> {
    let words = read_words(&folder.join("step-output.bin"))?;
    let mut words = words.into_iter();
    for (vehicle, name) in NAMES.iter().enumerate() {
        let geometry = geometry(vehicle);
        let allocator = Allocator::new(&geometry)?;
        for (index, wrench) in commands(geometry.rotors.len()).enumerate() {
            let expected = AllocationAnswer::new(&allocator.allocate(&wrench));
            let found = AllocationAnswer::read(|| words.next()).context("too few answers")?;
            ensure!(found == expected, "{name} {index}: host {expected:?}, emulator {found:?}");
        }
    }
    for (vehicle, rotor) in LOSSES {
        let geometry = geometry(vehicle);
        let mut allocator = Allocator::new(&geometry)?;
        allocator.lose(rotor)?;
        let wrench = command_after_loss(geometry.rotors.len());
        let expected = AllocationAnswer::new(&allocator.allocate(&wrench));
        let found = AllocationAnswer::read(|| words.next()).context("too few answers")?;
        ensure!(found == expected, "loss of {vehicle} {rotor}: {expected:?}, emulator {found:?}");
    }
    let (mut differs, mut found) = (None, None);
    fly_through_loss(
        |watch, state, rate, thrusts| watch.step(state, Some(rate), thrusts),
        |expected| {
            let answer = LossAnswer::read(|| words.next());
            found = found.or(expected.found);
            if answer != Some(expected) {
                differs.get_or_insert(format!("host {expected:?}, emulator {answer:?}"));
            }
        },
    )?;
    ensure!(differs.is_none(), "flight that loses a rotor: {}", differs.unwrap_or_default());
    ensure!(found.is_some(), "the lost rotor was not found");
    Closing::read(|| words.next()).context("no closing record")
}
