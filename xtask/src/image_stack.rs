//! Worst-case stack of a whole image: the main program, and on top of it every interrupt handler.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{File, Object, ObjectSection};

use crate::call_graph::CallGraph;
use crate::disassembly::disassemble;
use crate::elf::Image;

/// Bytes that the processor pushes before a handler: 26 words with the floating-point registers, aligned
/// to 8 bytes.
pub const EXCEPTION_FRAME: u64 = 112;
/// Handler of unused entries of the vector table: an endless loop.
const UNUSED: &str = "DefaultHandler";

/// Prints and returns the worst case (B).
///
/// Every handler of the vector table is taken to interrupt the one before, as if each had a
/// priority of its own, fault handlers included: an upper bound.
pub fn worst_case(path: &Path) -> Result<u64> {
    let (image, listing) = (Image::read(path)?, disassemble(path)?);
    let mut total = 0;
    for (index, address) in vectors(path)?.into_iter().enumerate() {
        let function = image.containing(address).with_context(|| {
            format!("the vector table leads to {address:#x}, where no function is")
        })?;
        if function.name.starts_with(UNUSED) {
            continue;
        }
        let name = &function.name;
        let graph = CallGraph::walk_from(&image, &listing, address)
            .with_context(|| format!("stack of `{name}`"))?;
        let stack = graph.stack(&image).with_context(|| format!("stack of `{name}`"))?;
        let pushed = if index == 0 { 0 } else { EXCEPTION_FRAME };
        println!("  {:>6} B  {name}", stack.bytes + pushed);
        for (name, bytes) in stack.frames.iter().rev().filter(|(_, bytes)| *bytes > 256) {
            println!("           {bytes:>6} B of it in {name}");
        }
        total += stack.bytes + pushed;
    }
    Ok(total)
}

/// The distinct entries of the vector table, reset first.
pub fn vectors(path: &Path) -> Result<Vec<u64>> {
    let bytes = std::fs::read(path)?;
    let file = File::parse(&*bytes)?;
    let table = file.section_by_name(".vector_table").context("no vector table")?;
    let (words, _) = table.data()?.as_chunks::<4>();
    ensure!(words.len() > 15, "the vector table is too short");
    let mut entries = Vec::new();
    // The first word is the initial stack pointer; entries have the Thumb bit set.
    for word in &words[1..] {
        let entry = u64::from(u32::from_le_bytes(*word) & !1);
        if entry != 0 && !entries.contains(&entry) {
            entries.push(entry);
        }
    }
    Ok(entries)
}
