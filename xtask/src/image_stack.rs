//! Worst-case stack of a whole image: the main program, and on top of it the tasks that interrupt each other.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{File, Object, ObjectSection};

use crate::call_graph::CallGraph;
use crate::disassembly::{Listing, disassemble};
use crate::elf::{Function, Image};
use crate::preemption::{EXCEPTION_FRAME, Layer, TaskStack, deepest, sum};
use crate::wcet;

/// Handler of unused entries of the vector table: an endless loop.
const UNUSED: &str = "DefaultHandler";

/// Stack of `Reset` below `main` (B): none is used, eight are allowed for.
const RESET: u64 = 8;
/// Function of RTIC's that calls `init` and ends by letting interrupts in.
const START: &str = "__rtic_init_resources";

/// Worst-case stacks of an image (B).
pub struct WorstCase {
    /// All of it.
    pub all: u64,
    /// The same without the handlers named.
    pub without: u64,
}

/// Prints and returns the worst case, and that without the handlers `apart`.
///
/// Tasks interrupt each other as their priorities and critical sections let them; a fault interrupts all of them. Below
/// them is what is left of the main program once interrupts are let in; before that it can go deeper, with
/// nothing on top of it but a fault.
pub fn worst_case(path: &Path, apart: &[&str]) -> Result<WorstCase> {
    let (image, listing) = (Image::read(path)?, disassemble(path)?);
    let declared = wcet::declared_tasks()?;
    let (mut start, mut fault, mut tasks) = (0, 0, Vec::new());
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
        let bytes = stack.bytes + pushed;
        let task = declared.iter().find(|task| task.handler == *name);
        match (name.as_str(), task) {
            _ if index == 0 => start = bytes,
            // Any other handler may interrupt all others.
            (_, None) => fault += bytes,
            (_, Some(task)) => {
                tasks.push(TaskStack::of(name, task.priority, &graph, &image, &listing)?);
            }
        }
    }
    ensure!(tasks.len() == declared.len(), "a task of `main.rs` is not in the vector table");
    let below = below_tasks(&image, &listing)?;
    println!(
        "  {below:>6} B of the main program below the tasks; interrupts are off while it has more"
    );
    let most = |nesting: &[Layer]| (start + fault).max(below + sum(nesting) + fault);
    let (all, others): (_, Vec<_>) = (
        deepest(&tasks, 0),
        tasks.into_iter().filter(|task| !apart.contains(&&*task.handler)).collect(),
    );
    println!("  deepest nesting:");
    for Layer { handler, ceiling, bytes } in &all {
        println!("  {bytes:>6} B  {handler}, under the ceiling {ceiling}");
    }
    Ok(WorstCase { all: most(&all), without: most(&deepest(&others, 0)) })
}

/// Stack of the main program from where interrupts are let in (B), after a check that they are off before.
fn below_tasks(image: &Image, listing: &Listing) -> Result<u64> {
    let main = image.named("main")?;
    let start = image.containing_name(START)?;
    let first = |function: &Function, mnemonic: &str, operand: &str| {
        let mut all = listing.range(function.range.clone());
        let found = all.find(|(_, it)| it.name() == mnemonic && it.operands.starts_with(operand));
        found.map(|(address, _)| *address)
    };
    let off = first(main, "cpsid", "i").context("`main` does not turn interrupts off")?;
    let call = listing
        .range(main.range.clone())
        .find(|(_, it)| it.name() == "bl" && it.target() == Some(start.range.start))
        .map(|(address, _)| *address)
        .with_context(|| format!("`main` does not call `{START}`"))?;
    ensure!(off < call, "`main` turns interrupts off after `init`");
    let on = first(start, "cpsie", "i").with_context(|| format!("`{START}` lets none in"))?;
    // From there on it only returns.
    let mut rest = listing.range(on..start.range.end).skip(1);
    let returns = rest.find(|(_, it)| {
        !(it.name().starts_with("add")
            || it.name().starts_with("vpop")
            || it.name().starts_with("pop"))
            || it.operands.contains("pc")
    });
    let returns =
        returns.is_some_and(|(_, it)| it.name().starts_with("pop") && it.operands.contains("pc"));
    ensure!(returns, "`{START}` does more once interrupts are on than to return");
    let idle = CallGraph::walk_without(image, listing, main.range.start, &[START])?;
    // Every name contains the empty one: nothing is called.
    let frame = |function: &Function| {
        let alone = CallGraph::walk_without(image, listing, function.range.start, &[""])?;
        Ok::<_, anyhow::Error>(alone.stack(image)?.bytes)
    };
    Ok((frame(main)? + frame(start)?).max(idle.stack(image)?.bytes) + RESET)
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
