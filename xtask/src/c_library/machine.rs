//! Machine code of the exported functions on the target: everything that each can reach.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

use super::build::{Library, is_panic, linker};
use crate::call_graph::CallGraph;
use crate::disassembly::disassemble;
use crate::elf::Image;
use crate::machine_code;
use crate::shell::run;
use crate::sources::Sources;
use crate::wcet::{Bounds, Model};

/// The function that is held to the rules of a control step.
pub const STEP: &str = "gyrfalcon_step";

/// Links the object to addresses, and follows every call of every exported function; the stack of each (B).
pub fn check(library: &Library) -> Result<BTreeMap<String, u64>> {
    let path = link(library)?;
    let (image, listing) = (Image::read(&path)?, disassemble(&path)?);
    let mut stacks = BTreeMap::new();
    println!(
        "{}: {} B of code and constants; each function with what it calls",
        library.target,
        library.size()?
    );
    println!("{:>8} {:>8}  function", "code, B", "stack, B");
    for function in &library.functions {
        let graph = CallGraph::walk(&image, &listing, function).context(function.clone())?;
        for node in graph.nodes() {
            let name = &node.function.name;
            ensure!(!is_panic(name), "`{function}` reaches `{name}`");
            let trap = node
                .instructions
                .iter()
                .find(|(_, instruction)| ["udf", "bkpt", "svc"].contains(&instruction.name()));
            ensure!(trap.is_none(), "`{function}` reaches a trap in `{name}`");
        }
        let stack = graph.stack(&image).context(function.clone())?.bytes;
        println!("{:>8} {stack:>8}  {function}", graph.code_size());
        stacks.insert(function.clone(), stack);
    }
    let graph = CallGraph::walk(&image, &listing, STEP)?;
    let faults = machine_code::faults(&graph, &Sources::open(&path)?, &[], false)?;
    ensure!(faults.is_empty(), "`{STEP}`: {}", faults.join("\n"));
    let bound = Bounds::of(STEP, &image, &listing)?.get(Model::Instructions);
    println!("{STEP}: at most {bound} instructions");
    Ok(stacks)
}

fn link(library: &Library) -> Result<PathBuf> {
    let path = library.joined.with_file_name("linked.elf");
    let mut linker = linker()?;
    linker.args(["--gc-sections", "-static", "--entry", STEP]);
    for function in &library.functions {
        linker.args(["--undefined", function]);
    }
    run(linker.arg("-o").arg(&path).arg(&library.joined))?;
    Ok(path)
}
