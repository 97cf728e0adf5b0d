//! What the ground station's task takes of the image: code that nothing else reaches, statics, and stack.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{File, Object, ObjectSymbol};

use crate::call_graph::CallGraph;
use crate::disassembly::{Listing, disassemble};
use crate::elf::Image;
use crate::image_stack::vectors;
use crate::preemption::EXCEPTION_FRAME;

/// Interrupts that the task and its receiver are bound to.
pub const OWN: [&str; 2] = ["FSMC", "USART3"];
/// Parts of the names of its statics.
const STATICS: [&str; 5] =
    ["mavlink_queue", "pilot_memory", "station_memory", "protocol_memory", "mavlink_"];

/// What the pilot and the estimator are called, by parts of the names of their functions.
const WITH_IT: [&str; 4] =
    ["pilot::Pilot", "OnboardNavigation::", "estimator::", "navigation::Navigator"];

/// What the task takes (B).
pub struct Cost {
    /// Code that no other task reaches.
    pub flash: u64,
    /// Code that neither the tasks without it reach nor `init`, if nobody calls the pilot or the estimator.
    pub with_pilot_and_estimator: u64,
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
        let (mut others, mut core, mut all) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        for address in vectors(path)? {
            all.extend(reached(&image, &listing, address, &[])?);
            if !own.contains(&address) {
                others.extend(reached(&image, &listing, address, &[])?);
                core.extend(reached(&image, &listing, address, &WITH_IT)?);
            }
        }
        let bytes = |kept: &BTreeSet<(u64, u64)>| -> u64 {
            all.difference(kept).map(|(start, end)| end - start).sum()
        };
        let graph = CallGraph::walk_from(&image, &listing, own[0])?;
        Ok(Self {
            flash: bytes(&others),
            with_pilot_and_estimator: bytes(&core),
            ram: statics(path)?,
            stack: graph.stack(&image)?.bytes + EXCEPTION_FRAME,
        })
    }
}

/// Addresses of the functions that a handler reaches, but for those whose names contain one of `apart`.
fn reached(
    image: &Image,
    listing: &Listing,
    address: u64,
    apart: &[&str],
) -> Result<Vec<(u64, u64)>> {
    let graph = CallGraph::walk_without(image, listing, address, apart)?;
    Ok(graph.nodes().map(|node| (node.function.range.start, node.function.range.end)).collect())
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
