//! Properties of a linked ARM image that the checks use: functions, stack sizes, section sizes.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, bail};
use object::{File, Object, ObjectSection, ObjectSymbol, SectionFlags, SymbolKind};

/// One function of the image.
#[derive(Clone, Debug)]
pub struct Function {
    /// Demangled name; of several at one address the first.
    pub name: String,
    /// Addresses without the Thumb bit.
    pub range: Range<u64>,
}

/// The functions of an image and what is known of their stack.
pub struct Image {
    functions: BTreeMap<u64, Function>,
    stack_sizes: BTreeMap<u64, u64>,
    /// Start and bytes of each section of code.
    code: Vec<(u64, Vec<u8>)>,
    /// Bytes in flash: code, constants and initial values of data.
    pub flash: u64,
    /// Bytes of static RAM.
    pub static_ram: u64,
}

impl Image {
    /// Reads a linked image.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        let file = File::parse(&*bytes).with_context(|| path.display().to_string())?;
        let (flash, static_ram) = sizes(&file);
        Ok(Self {
            functions: functions(&file),
            stack_sizes: stack_sizes(&file)?,
            code: code(&file)?,
            flash,
            static_ram,
        })
    }

    /// An image of functions given by name, addresses and stack frame, for tests.
    #[cfg(test)]
    pub fn of(functions: &[(&str, Range<u64>, Option<u64>)]) -> Self {
        let mut image = Self {
            functions: BTreeMap::new(),
            stack_sizes: BTreeMap::new(),
            code: Vec::new(),
            flash: 0,
            static_ram: 0,
        };
        for (name, range, stack) in functions {
            let function = Function { name: (*name).to_owned(), range: range.clone() };
            image.functions.insert(range.start, function);
            image.stack_sizes.extend(stack.map(|stack| (range.start, stack)));
        }
        image
    }

    /// The function with exactly this name.
    pub fn named(&self, name: &str) -> Result<&Function> {
        let mut functions = self.functions.values();
        functions.find(|function| function.name == name).with_context(|| {
            format!("no function `{name}` in the image: was it inlined or stripped?")
        })
    }

    /// The function whose name contains `part`.
    pub fn containing_name(&self, part: &str) -> Result<&Function> {
        let mut found = self.functions.values().filter(|function| function.name.contains(part));
        let only = found.next().with_context(|| format!("no function `...{part}...`"))?;
        anyhow::ensure!(found.next().is_none(), "several functions `...{part}...` in the image");
        Ok(only)
    }

    /// The function whose name begins so, generic arguments and the like apart.
    pub fn named_like(&self, start: &str) -> Result<&Function> {
        let mut found = self.functions.values().filter(|function| function.name.starts_with(start));
        let only =
            found.next().with_context(|| format!("no function `{start}...` in the image"))?;
        anyhow::ensure!(found.next().is_none(), "several functions `{start}...` in the image");
        Ok(only)
    }

    /// The function that `address` lies in.
    pub fn containing(&self, address: u64) -> Option<&Function> {
        let (_, function) = self.functions.range(..=address).next_back()?;
        function.range.contains(&address).then_some(function)
    }

    /// Stack frame of the function that starts at `address` (B), from the compiler.
    pub fn stack_size(&self, address: u64) -> Option<u64> {
        self.stack_sizes.get(&address).copied()
    }
}

impl Image {
    /// Code at `address`.
    pub fn bytes(&self, address: u64, length: usize) -> Option<&[u8]> {
        let sections = self.code.iter();
        sections
            .filter_map(|(start, bytes)| {
                let from = usize::try_from(address.checked_sub(*start)?).ok()?;
                bytes.get(from..from.checked_add(length)?)
            })
            .next()
    }

    /// Targets of a table at `start` whose offsets count from behind its `tbb` or `tbh` instruction, `base`.
    ///
    /// All of them lie behind the table, so that it ends where the nearest target begins, or before at what leads to
    /// no instruction of the function: constants follow a table that is not beside its jump. A compiler checks
    /// the index before the jump. The byte that fills up an odd table is no entry.
    pub fn jump_table(
        &self,
        (start, base): (u64, u64),
        wide: bool,
        end: u64,
        is_instruction: impl Fn(u64) -> bool,
    ) -> Result<Vec<u64>> {
        let (size, mut limit, mut targets) = (if wide { 2 } else { 1 }, end, Vec::new());
        while start + size * (targets.len() as u64 + 1) <= limit {
            let at = start + size * targets.len() as u64;
            let entry =
                self.bytes(at, size as usize).context("a jump table outside of the code")?;
            let offset = entry.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte));
            let target = base + 2 * offset;
            if start != base && !is_instruction(target) {
                break;
            }
            if target <= at && at + 1 == limit {
                break;
            }
            anyhow::ensure!(target > at, "the jump table at {start:#x} leads back into itself");
            targets.push(target);
            limit = limit.min(target);
        }
        Ok(targets)
    }
}

fn code(file: &File<'_>) -> Result<Vec<(u64, Vec<u8>)>> {
    let sections = file.sections().filter(|section| section.kind() == object::SectionKind::Text);
    sections.map(|section| Ok((section.address(), section.data()?.to_vec()))).collect()
}

fn functions(file: &File<'_>) -> BTreeMap<u64, Function> {
    let mut functions = BTreeMap::new();
    for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text) {
        let start = symbol.address() & !1;
        if symbol.size() == 0 {
            continue;
        }
        let Ok(name) = symbol.name() else { continue };
        let name = format!("{:#}", rustc_demangle::demangle(name));
        let range = start..start + symbol.size();
        functions.entry(start).or_insert(Function { name, range });
    }
    functions
}

fn sizes(file: &File<'_>) -> (u64, u64) {
    let (mut flash, mut ram) = (0, 0);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
        if sh_flags & u64::from(object::elf::SHF_ALLOC) == 0 {
            continue;
        }
        let (in_file, writable) =
            (section.file_range().is_some(), sh_flags & u64::from(object::elf::SHF_WRITE) != 0);
        flash += if in_file { section.size() } else { 0 };
        ram += if writable { section.size() } else { 0 };
    }
    (flash, ram)
}

/// `.stack_sizes`: for every function its address (4 bytes) and its frame (ULEB128).
fn stack_sizes(file: &File<'_>) -> Result<BTreeMap<u64, u64>> {
    let mut sizes = BTreeMap::new();
    let Some(section) = file.section_by_name(".stack_sizes") else { return Ok(sizes) };
    let mut rest = section.data()?;
    while let Some((address, tail)) = rest.split_first_chunk::<4>() {
        let (size, tail) = uleb128(tail)?;
        sizes.insert(u64::from(u32::from_le_bytes(*address) & !1), size);
        rest = tail;
    }
    Ok(sizes)
}

fn uleb128(bytes: &[u8]) -> Result<(u64, &[u8])> {
    let mut value = 0;
    for (index, byte) in bytes.iter().enumerate().take(9) {
        value |= u64::from(byte & 0x7F) << (7 * index);
        if byte & 0x80 == 0 {
            return Ok((value, &bytes[index + 1..]));
        }
    }
    bail!(".stack_sizes is damaged")
}
