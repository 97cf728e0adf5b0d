//! What the ground station's task takes of the image: code that nothing else reaches, statics, and stack.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{File, Object, ObjectSymbol};

use crate::call_graph::CallGraph;
use crate::disassembly::disassemble;
use crate::elf::Image;
use crate::flash_share::{Constants, Share};
use crate::image_stack::vectors;
use crate::preemption::EXCEPTION_FRAME;

/// Interrupts that the task and its receiver are bound to.
pub const OWN: [&str; 2] = ["FSMC", "USART3"];
/// Parts of the names of its statics.
const STATICS: [&str; 5] =
    ["mavlink_queue", "pilot_memory", "station_memory", "protocol_memory", "mavlink_"];

/// What the pilot, the estimator and the signatures are called, by parts of the names of their functions.
const WITH_IT: [&str; 7] = [
    "pilot::Pilot",
    "OnboardNavigation::",
    "estimator::",
    "navigation::Navigator",
    "mavlink_vehicle",
    "GroundStation::",
    "StartedSigning::",
];

/// What the task takes (B).
pub struct Cost {
    /// Code and constants that no other task reaches.
    pub flash: u64,
    /// The image without it, the pilot and the estimator: code and constants that the other tasks and `init` reach if nobody calls
    /// these, with the vector table and the initial values of statics.
    pub core: u64,
    /// Statics.
    pub ram: u64,
    /// Worst-case stack of the task, with what the processor pushes.
    pub stack: u64,
}

impl Cost {
    /// Measures an image.
    pub fn take(path: &Path) -> Result<Self> {
        let (image, listing) = (Image::read(path)?, disassemble(path)?);
        let own = OWN.map(|name| image.named(name).map(|function| function.range.start));
        let own: Vec<_> = own.into_iter().collect::<Result<_>>()?;
        let (mut others, mut core, mut all) =
            (Share::default(), Share::default(), Share::default());
        for address in vectors(path)? {
            let graph = CallGraph::walk_from(&image, &listing, address)?;
            all.add(&graph, &image);
            if !own.contains(&address) {
                others.add(&graph, &image);
                let without = CallGraph::walk_without(&image, &listing, address, &WITH_IT)?;
                core.add(&without, &image);
            }
        }
        let constants = Constants::read(path)?;
        let bytes = |share: &Share| share.bytes(&constants);
        // What else is in the flash belongs to all of it.
        let rest = image.flash.checked_sub(bytes(&all)).context("more is reached than there is")?;
        ensure!(rest * 20 < image.flash, "{rest} B of the flash are reached by nothing");
        let graph = CallGraph::walk_from(&image, &listing, own[0])?;
        Ok(Self {
            flash: bytes(&all) - bytes(&others),
            core: bytes(&core) + rest,
            ram: statics(path)?,
            stack: graph.stack(&image)?.bytes + EXCEPTION_FRAME,
        })
    }
}

/// Bytes of the task's statics.
fn statics(path: &Path) -> Result<u64> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let file = File::parse(&*bytes)?;
    let of_task = |name: &str| {
        name.contains("rtic_internal") && STATICS.iter().any(|part| name.contains(part))
    };
    let symbols = file.symbols().filter(|symbol| symbol.name().is_ok_and(of_task));
    let size: u64 = symbols.map(|symbol| symbol.size()).sum();
    ensure!(size > 10_000, "the statics of the MAVLink task are called otherwise: {size} B");
    Ok(size)
}
