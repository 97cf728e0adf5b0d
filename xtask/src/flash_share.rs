//! Flash that a part of an image's code takes with the constants that it refers to.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result};
use object::{File, Object, ObjectSection, ObjectSymbol};

use crate::call_graph::CallGraph;
use crate::disassembly::{Instruction, immediate};
use crate::elf::Image;

/// The constants of an image, each between two symbols; what merged constants take is one between their neighbours.
pub struct Constants {
    start: u64,
    bytes: Vec<u8>,
    /// End of each by its start.
    objects: BTreeMap<u64, u64>,
}

impl Constants {
    /// Reads them from a linked image.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        let file = File::parse(&*bytes)?;
        let section = file.section_by_name(".rodata").context("no constants")?;
        let (start, bytes) = (section.address(), section.data()?.to_vec());
        let end = start + bytes.len() as u64;
        let symbols = file.symbols().filter(|symbol| symbol.size() > 0);
        let places = symbols.map(|symbol| (symbol.address(), symbol.address() + symbol.size()));
        let mut objects = BTreeMap::new();
        for (from, to) in places.filter(|(from, _)| (start..end).contains(from)) {
            let longest = objects.entry(from).or_insert(to);
            *longest = to.max(*longest);
        }
        let (mut at, mut gaps) = (start, Vec::new());
        for (from, to) in objects.iter().map(|(from, to)| (*from, *to)).chain([(end, end)]) {
            if at < from {
                gaps.push((at, from));
            }
            at = at.max(to);
        }
        objects.extend(gaps);
        Ok(Self { start, bytes, objects })
    }

    /// Those that `pointers` lead to, from one to the next: starts and ends.
    pub fn reached(&self, pointers: impl IntoIterator<Item = u64>) -> BTreeMap<u64, u64> {
        let (mut reached, mut open) = (BTreeMap::new(), pointers.into_iter().collect::<Vec<_>>());
        while let Some(pointer) = open.pop() {
            let Some((from, to)) = self.objects.range(..=pointer).next_back() else { continue };
            if pointer >= *to || reached.insert(*from, *to).is_some() {
                continue;
            }
            let inside = (from - self.start) as usize..(to - self.start) as usize;
            // A pointer is a word at a multiple of four.
            let aligned = inside.start.next_multiple_of(4).min(inside.end)..inside.end;
            let (words, _) = self.bytes[aligned].as_chunks::<4>();
            open.extend(words.iter().map(|word| u64::from(u32::from_le_bytes(*word))));
        }
        reached
    }
}

/// Functions with their code and constants.
#[derive(Clone, Default)]
pub struct Share {
    code: BTreeMap<u64, u64>,
    pointers: BTreeSet<u64>,
}

impl Share {
    /// Adds the functions of a call graph.
    pub fn add(&mut self, graph: &CallGraph, image: &Image) {
        for node in graph.nodes() {
            self.code.insert(node.function.range.start, node.function.range.end);
            self.pointers.extend(pointers(&node.instructions, image));
        }
    }

    /// Bytes of code and constants.
    pub fn bytes(&self, constants: &Constants) -> u64 {
        let reached = constants.reached(self.pointers.iter().copied());
        self.code.iter().chain(&reached).map(|(start, end)| end - start).sum()
    }
}

/// Numbers that instructions put into registers: by halves (`movw`, `movt`), or from a word beside the code.
fn pointers(instructions: &[(u64, Instruction)], image: &Image) -> Vec<u64> {
    let (mut halves, mut found) = (BTreeMap::new(), Vec::new());
    for (address, instruction) in instructions {
        let Some((register, operand)) = instruction.operands.split_once(',') else { continue };
        match (instruction.name(), immediate(operand)) {
            ("movw", Some(low)) => {
                halves.insert(register, low);
            }
            ("movt", Some(high)) => {
                found.extend(halves.get(register).map(|low| high << 16 | low));
            }
            ("ldr", None) => {
                let offset = operand.trim().strip_prefix("[pc, ");
                let offset = offset.and_then(|rest| immediate(rest.trim_end_matches(']')));
                let place = offset.map(|offset| ((address + 4) & !3) + offset);
                let word = place.and_then(|place| image.bytes(place, 4));
                found.extend(word.map(|word| {
                    word.iter().rev().fold(0, |all, byte| all << 8 | u64::from(*byte))
                }));
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::{Constants, pointers};
    use crate::disassembly::Instruction;
    use crate::elf::Image;

    #[test]
    fn constants_lead_to_constants_and_others_do_not_count() {
        // At 0x100 a pointer to 0x110, at 0x104 nothing, from 0x108 on merged ones, at 0x110 a text.
        let mut bytes = vec![0; 0x18];
        bytes[..4].copy_from_slice(&0x113_u32.to_le_bytes());
        let objects = [(0x100, 0x104), (0x104, 0x108), (0x108, 0x110), (0x110, 0x118)].into();
        let constants = Constants { start: 0x100, bytes, objects };
        assert_eq!(constants.reached([0x100]), [(0x100, 0x104), (0x110, 0x118)].into());
        assert_eq!(constants.reached([0x109, 0x10c, 0x200, 0]), [(0x108, 0x110)].into());
    }

    #[test]
    fn numbers_by_halves_are_pointers() {
        let line = |mnemonic: &str, operands: &str| {
            (0, Instruction { mnemonic: mnemonic.into(), operands: operands.into() })
        };
        let code = [
            line("movw", "r0, #0x1234"),
            line("movw", "r1, #0x1"),
            line("movt", "r0, #0x803"),
            line("movt", "r2, #0x803"),
        ];
        assert_eq!(pointers(&code, &Image::of(&[])), [0x803_1234]);
    }
}
