//! Bounds of loops: derived from the machine code, annotated beside the loop, or given for a library.
//!
//! An annotation is a comment on the line above a statement, or at the end of its line:
//!
//! ```text
//! // wcet: at most 16 iterations
//! // wcet: at most MAX_FRAME iterations        a constant of the same file
//! // wcet: at most 512 iterations in all       over one release of the task, however often it is entered
//! // wcet: at most 96 iterations in all of T::f over one call of the function, however often it is entered
//! // wcet: at most 5 us                        waits for hardware
//! // wcet: at most 48 bytes                    copied or cleared by a routine that is called here
//! ```
//!
//! It holds for every loop in the statement, up to its opening brace or its end, and for those that are
//! inlined into that, unless the inlined source has one of its own. Every one is compared with the largest
//! number that the emulator counts.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};

use super::constants::{Constants, advance};
use super::flow::FlowGraph;
use super::library::{LIBRARY, copies_words};
use super::path::{Limit, Loop};
use crate::disassembly::immediate;
use crate::sources::{Place, Sources};

/// Most rounds of a loop whose bound is derived.
const DERIVED_MAX: u64 = 4096;

/// The loop bounds of an image's sources.
pub struct Limits {
    sources: Sources,
    files: RefCell<BTreeMap<String, Vec<Annotation>>>,
    /// Constants that are smaller in this image than the sources allow.
    constants: Vec<(&'static str, u64)>,
}

/// A comment with a bound.
#[derive(Clone, Debug, PartialEq)]
struct Annotation {
    /// First and last line of the statement.
    lines: (u32, u32),
    unit: Unit,
    most: u64,
    /// Function that an `in all of` names.
    scope: Option<String>,
}

/// Quantity that a comment or a library's entry bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Of a loop, for each entry.
    Iterations,
    /// Of a loop, over one release of the task or one call of a function.
    IterationsInAll,
    /// Of waiting (us).
    Microseconds,
    /// Copied by a call.
    Bytes,
}

impl std::fmt::Display for Unit {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Self::Iterations => "iterations",
            Self::IterationsInAll => "iterations in all",
            Self::Microseconds => "us",
            Self::Bytes => "bytes",
        })
    }
}

impl Unit {
    fn limit(self, most: u64) -> Limit {
        match self {
            Self::IterationsInAll => Limit::InAll(most + 1),
            Self::Microseconds => Limit::Time(most),
            _ => Limit::Each(most + 1),
        }
    }
}

/// A bound and where it comes from.
#[derive(Clone, Debug)]
pub struct Found {
    /// The bound.
    pub limit: Limit,
    /// Part of the name of the function over whose call a limit in all counts; none: over a release of the task.
    pub scope: Option<String>,
    /// Its origin, for reports: a place in the sources, a library, or the code itself.
    pub origin: String,
}

impl Limits {
    /// Opens the debug information of an image.
    pub fn open(image: &Path, constants: Vec<(&'static str, u64)>) -> Result<Self> {
        Ok(Self { sources: Sources::open(image)?, files: RefCell::default(), constants })
    }

    /// The bound of a loop in the function `name`, which copies or clears `bytes` if it is a routine for that.
    pub fn of(
        &self,
        found: &Loop,
        graph: &FlowGraph,
        constants: &Constants,
        name: &str,
        bytes: Option<u64>,
    ) -> Result<Found> {
        if let Some(bytes) = bytes {
            let limit = Limit::Each(copy_rounds(found, graph, name, bytes));
            let origin = format!("{name}: bytes of its argument");
            return Ok(Found { limit, scope: None, origin });
        }
        if let Some(rounds) = derived(found, graph, constants) {
            let limit = Limit::Each(rounds);
            return Ok(Found { limit, scope: None, origin: "derived".into() });
        }
        let own = [&found.latches[..], &[found.header]].concat();
        for places in [&own[..], &found.nodes.iter().copied().collect::<Vec<_>>()] {
            let mut best: Option<Found> = None;
            for address in places {
                if let Some(found) = self.at(*address)?
                    && best.as_ref().is_none_or(|best| larger(found.limit, best.limit))
                {
                    best = Some(found);
                }
            }
            if let Some(best) = best {
                return Ok(best);
            }
        }
        bail!(
            "`{name}` has a loop without a bound at {:#x}; annotate it: {}",
            found.header,
            self.place(found.latches[0])
        )
    }

    /// Bytes that a routine copies at most when it is called at `address`.
    pub fn bytes(&self, address: u64) -> Result<Option<u64>> {
        let mut least: Option<u64> = None;
        for place in self.sources.places(address)? {
            let own = self.annotation(&place, |unit| unit == Unit::Bytes)?;
            let known = LIBRARY
                .iter()
                .filter(|known| known.unit == Unit::Bytes && place.function.contains(known.part));
            let all = known.map(|known| known.most).chain(own.map(|(found, _)| found.most));
            least = all.chain(least).min();
        }
        Ok(least)
    }

    /// Shows where `address` comes from: the innermost function, and the innermost line of our own.
    pub fn place(&self, address: u64) -> String {
        let places = self.sources.places(address).unwrap_or_default();
        let inner = places.first().map_or("?", |place| &place.function);
        let root = std::env::current_dir().unwrap_or_default();
        let own = places.iter().find_map(|place| {
            let file = Path::new(&place.file).strip_prefix(&root).ok()?;
            Some(format!("{}:{}", file.display(), place.line))
        });
        format!("{}, {inner}", own.unwrap_or_else(|| "in a library".into()))
    }

    fn at(&self, address: u64) -> Result<Option<Found>> {
        for place in self.sources.places(address)? {
            let mut known = LIBRARY.iter().filter(|known| known.unit != Unit::Bytes);
            if let Some(known) = known.find(|known| place.function.contains(known.part)) {
                let limit = known.unit.limit(known.most);
                return Ok(Some(Found { limit, scope: None, origin: known.part.to_owned() }));
            }
            let found = self.annotation(&place, |unit| unit != Unit::Bytes)?;
            if let Some((annotation, origin)) = found {
                let Annotation { unit, most, scope, .. } = annotation;
                return Ok(Some(Found { limit: unit.limit(most), scope, origin }));
            }
        }
        Ok(None)
    }

    fn annotation(
        &self,
        place: &Place,
        wanted: impl Fn(Unit) -> bool,
    ) -> Result<Option<(Annotation, String)>> {
        let root = std::env::current_dir()?;
        let Ok(own) = Path::new(&place.file).strip_prefix(&root) else { return Ok(None) };
        let own = own.to_string_lossy().into_owned();
        let mut files = self.files.borrow_mut();
        if !files.contains_key(&own) {
            let text = std::fs::read_to_string(&own).unwrap_or_default();
            files.insert(own.clone(), annotations(&text, &self.constants).context(own.clone())?);
        }
        let here = files[&own].iter().find(|annotation| {
            let (first, last) = annotation.lines;
            wanted(annotation.unit) && (first..=last).contains(&place.line)
        });
        Ok(here.map(|found| (found.clone(), format!("{own}:{}", found.lines.0))))
    }
}

fn larger(a: Limit, b: Limit) -> bool {
    let rounds = |limit| match limit {
        Limit::Each(most) | Limit::InAll(most) => most,
        Limit::Time(us) => us * 168,
    };
    rounds(a) > rounds(b)
}

fn annotations(text: &str, constants: &[(&str, u64)]) -> Result<Vec<Annotation>> {
    let lines: Vec<_> = text.lines().collect();
    let mut found = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let Some((code, comment)) = line.split_once("// wcet: ") else { continue };
        let place = || format!("line {}: `{}`", index + 1, line.trim());
        let words: Vec<_> = comment.split_whitespace().collect();
        let ["at", "most", number, rest @ ..] = &words[..] else {
            bail!("{}: `at most N ...` is expected", place())
        };
        let mut scope = None;
        let unit = match rest {
            ["iterations", "in", "all", "of", function, ..] => {
                scope = Some((*function).to_owned());
                Unit::IterationsInAll
            }
            ["iterations", "in", "all", ..] => Unit::IterationsInAll,
            ["iterations", ..] => Unit::Iterations,
            ["us", ..] => Unit::Microseconds,
            ["bytes", ..] => Unit::Bytes,
            _ => bail!("{}: iterations, iterations in all, us or bytes are expected", place()),
        };
        let given = constants.iter().find(|(name, _)| name == number);
        let most = match (number.parse(), given) {
            (Ok(most), _) => most,
            (_, Some((_, most))) => *most,
            _ => constant(number, text).with_context(place)?,
        };
        let first = if code.trim().is_empty() { next_statement(&lines, index) } else { index };
        let last = end(&lines, first);
        found.push(Annotation { lines: (first as u32 + 1, last as u32 + 1), unit, most, scope });
    }
    Ok(found)
}

/// A constant of the same file.
fn constant(name: &str, text: &str) -> Result<u64> {
    let start = format!("const {name}: ");
    let line = text.lines().find(|line| line.trim_start_matches("pub ").trim().starts_with(&start));
    let value = line.and_then(|line| line.split_once('='));
    let value = value.map(|(_, value)| value.trim().trim_end_matches(';').replace('_', ""));
    let value = value.with_context(|| format!("no constant `{name}` in this file"))?;
    value.parse().with_context(|| format!("`{name}` is no plain number"))
}

fn next_statement(lines: &[&str], comment: usize) -> usize {
    let code = |line: &&str| {
        let line = line.trim();
        !line.is_empty() && !line.starts_with("//") && !line.starts_with("#[")
    };
    lines.iter().skip(comment + 1).position(code).map_or(comment, |skipped| comment + 1 + skipped)
}

/// Last line of the head of the statement that begins at `first`.
fn end(lines: &[&str], first: usize) -> usize {
    let mut depth = 0_i32;
    for (index, line) in lines.iter().enumerate().skip(first) {
        let code = line.split("//").next().unwrap_or_default();
        depth += code.matches(['(', '[']).count() as i32;
        depth -= code.matches([')', ']']).count() as i32;
        if depth <= 0 && code.trim_end().ends_with(['{', ';', '}', ',']) {
            return index;
        }
    }
    lines.len().saturating_sub(1)
}

/// `true` if every node has one way on inside the loop.
fn is_chain(found: &Loop, graph: &FlowGraph) -> bool {
    found.nodes.iter().all(|node| {
        let edges = &graph.nodes[node].edges;
        edges.iter().filter(|edge| found.nodes.contains(&edge.to)).count() == 1
    })
}

/// Executions of the header of a copy routine's loop that moves a pointer through `bytes`.
fn copy_rounds(found: &Loop, graph: &FlowGraph, name: &str, bytes: u64) -> u64 {
    let mut advances = BTreeMap::new();
    if is_chain(found, graph) {
        for address in &found.nodes {
            let node = &graph.nodes[address];
            if let (false, Some((register, step))) = (node.conditional, advance(node)) {
                *advances.entry(register).or_insert(0) += step;
            }
        }
    }
    let moved = advances.into_values().min().unwrap_or(1).max(1);
    // No byte of the destination is written twice, wherever the pointers are kept.
    let stride = if is_chain(found, graph) { moved.max(stored(found, graph)) } else { moved };
    let words = found.nodes.iter().any(|address| {
        let name = graph.nodes[address].instruction.name();
        ["ldr", "str", "ldm", "stm", "ldrd", "strd"].contains(&name)
    });
    // Less than a threshold of 16 bytes is copied byte by byte, and what leads to or follows whole words.
    let covered = if words || !copies_words(name) { bytes } else { bytes.min(15) };
    covered.div_ceil(stride) + 1
}

/// Bytes that every round of a loop stores, but for those on the stack.
fn stored(found: &Loop, graph: &FlowGraph) -> u64 {
    let widths = found.nodes.iter().map(|address| {
        let node = &graph.nodes[address];
        let on_stack = node.instruction.operands.contains("[sp");
        match node.instruction.name() {
            _ if node.conditional || on_stack => 0,
            "strb" => 1,
            "strh" => 2,
            "str" => 4,
            "strd" => 8,
            _ => 0,
        }
    });
    widths.sum()
}

/// Executions of the header of a loop that counts a register by a constant from one constant to another.
fn derived(found: &Loop, graph: &FlowGraph, constants: &Constants) -> Option<u64> {
    if !is_chain(found, graph) || found.latches.len() != 1 {
        return None;
    }
    let latch = &graph.nodes[&found.latches[0]];
    let condition =
        latch.instruction.name().strip_prefix('b').filter(|_| latch.edges.len() == 2)?;
    let mut order = vec![found.header];
    while let Some(last) = order.last().filter(|last| **last != found.latches[0]) {
        let edges = graph.nodes[last].edges.iter();
        order.push(edges.map(|edge| edge.to).find(|to| found.nodes.contains(to))?);
    }
    // The flags are those of the last comparison, or of the count itself.
    let sets_flags = |name: &str| name == "cmp" || name == "subs" || name == "adds";
    let place = order.iter().rposition(|at| {
        let name = graph.nodes[at].instruction.mnemonic.split('.').next().unwrap_or_default();
        sets_flags(name) || name.ends_with('s') || ["tst", "teq", "cmn"].contains(&name)
    })?;
    let flags = &graph.nodes[&order[place]];
    let operands: Vec<_> = flags.instruction.operands.split(',').map(str::trim).collect();
    let register = super::constants::number(operands[0])?;
    let step = |at: &u64| {
        let node = &graph.nodes[at];
        let down = node.instruction.mnemonic.starts_with("sub").then(|| {
            let mut added = node.instruction.clone();
            added.mnemonic = added.mnemonic.replacen("sub", "add", 1);
            let copy = super::flow::Node { instruction: added, edges: Vec::new(), ..*node };
            advance(&copy).map(|(register, step)| (register, -(step as i64)))
        });
        down.unwrap_or_else(|| advance(node).map(|(register, step)| (register, step as i64)))
    };
    let writes: Vec<_> = order
        .iter()
        .enumerate()
        .filter(|(_, at)| super::constants::written(&graph.nodes[at]).contains(&register))
        .collect();
    let [(counted, at)] = writes[..] else { return None };
    let (moved, step) = step(at)?;
    if moved != register || graph.nodes[at].conditional || counted > place {
        return None;
    }
    let limit = match (flags.instruction.name(), &operands[..]) {
        ("cmp", [_, limit]) => i64::try_from(immediate(limit)?).ok()?,
        ("subs", _) if counted == place => 0,
        _ => return None,
    };
    let outside = graph.nodes.iter().filter(|(at, node)| {
        !found.nodes.contains(at) && node.edges.iter().any(|edge| edge.to == found.header)
    });
    let starts: Vec<_> = outside.map(|(at, node)| constants.behind(*at, node, register)).collect();
    let start = i64::try_from((*starts.first()?)?).ok()?;
    if starts.iter().any(|other| *other != starts[0]) {
        return None;
    }
    let taken = latch.edges.iter().find(|edge| edge.taken)?.to == found.header;
    let mut value = start;
    for rounds in 1..=DERIVED_MAX {
        value += step;
        let goes_on = match condition {
            "ne" => value != limit,
            "eq" => value == limit,
            "lo" | "lt" if value >= 0 => value < limit,
            "ls" | "le" if value >= 0 => value <= limit,
            "hi" | "gt" if value >= 0 => value > limit,
            "hs" | "ge" if value >= 0 => value >= limit,
            _ => return None,
        };
        if goes_on != taken {
            return Some(rounds);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::{Annotation, Unit, annotations};

    #[test]
    fn annotations_cover_the_statement_behind_them() {
        let text = "const N: usize = 1_6;\n\
                    // wcet: at most N iterations (why)\n\
                    for x in [\n    1,\n] {\n    body();\n}\n\
                    a.b(|x| {\n    c\n}); // wcet: at most 48 bytes\n\
                    // wcet: at most 5 us\nwhile busy() {}\n\
                    // wcet: at most 512 iterations in all\nwhile more() {\n}\n\
                    // wcet: at most 96 iterations in all of T::push\nwhile more() {\n";
        let expected = [
            ((3, 5), Unit::Iterations, 16, None),
            ((10, 10), Unit::Bytes, 48, None),
            ((12, 12), Unit::Microseconds, 5, None),
            ((14, 14), Unit::IterationsInAll, 512, None),
            ((17, 17), Unit::IterationsInAll, 96, Some("T::push".to_owned())),
        ];
        let expected =
            expected.map(|(lines, unit, most, scope)| Annotation { lines, unit, most, scope });
        assert_eq!(annotations(text, &[]).unwrap(), expected);
    }

    #[test]
    fn what_is_no_bound_is_refused() {
        for line in [
            "// wcet: no more than 5 iterations",
            "// wcet: at most 5 rounds",
            "// wcet: at most UNKNOWN iterations",
            "const A: usize = B;\n// wcet: at most A iterations",
        ] {
            assert!(annotations(line, &[]).is_err(), "{line}");
        }
    }
}
