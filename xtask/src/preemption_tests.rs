//! Two tasks of which one keeps the other out while it goes deep.

use super::{Layer, TaskStack, deepest, sum};
use crate::call_graph::CallGraph;
use crate::disassembly::{Instruction, Listing};
use crate::elf::Image;

/// A listing of instructions of 4 B from `start` on.
fn code(start: u64, lines: &[&str]) -> Listing {
    let parsed = lines.iter().map(|line| {
        let (mnemonic, operands) = line.split_once(' ').unwrap_or((line, ""));
        Instruction { mnemonic: mnemonic.into(), operands: operands.into() }
    });
    (start..).step_by(4).zip(parsed).collect()
}

/// A handler of priority 1 with a frame of 100 B, whose callees take 1000 and 2000 B; the first of them runs `callee`.
fn task(handler: &[&str], callee: &[&str]) -> anyhow::Result<TaskStack> {
    let ends = [0x100 + 4 * handler.len() as u64, 0x200 + 4 * callee.len() as u64];
    let image = Image::of(&[
        ("handler", 0x100..ends[0], Some(100)),
        ("deep", 0x200..ends[1], Some(1000)),
        ("deeper", 0x300..0x304, Some(2000)),
    ]);
    let mut listing = code(0x100, handler);
    listing.extend(code(0x200, callee));
    listing.extend(code(0x300, &["bx lr"]));
    let graph = CallGraph::walk(&image, &listing, "handler")?;
    TaskStack::of("handler", 1, &graph, &image, &listing)
}

/// Deepest stack with a task of priority 3 that takes 500 B.
fn bound(handler: &[&str], callee: &[&str]) -> anyhow::Result<u64> {
    let other = TaskStack { handler: "other".into(), priority: 3, depths: [(0, 500)].into() };
    Ok(sum(&deepest(&[task(handler, callee)?, other], 0)))
}

/// A section whose ceiling is the priority 16 less a sixteenth of `level`.
fn section(level: &str) -> [String; 4] {
    let raise = format!("movs r1, #{level}");
    [raise, "msr basepri_max, r1".into(), "bl 0x200".into(), "msr basepri, r0".into()]
}

#[test]
fn what_a_section_keeps_out_is_not_on_top_of_it() {
    let plain = ["bl 0x200", "bx lr"];
    assert_eq!(bound(&plain, &["bx lr"]).unwrap(), 112 + 1100 + 500);
    // 0xd0 is the level of priority 3, 0xe0 that of priority 2, which does not keep it out.
    for (level, above) in [("0xd0", 0), ("0xc0", 0), ("0xe0", 500)] {
        let section = section(level);
        let mut handler: Vec<_> = section.iter().map(String::as_str).collect();
        handler.push("bx lr");
        let shallow = 112 + 100 + 500;
        let found = bound(&handler, &["bx lr"]).unwrap();
        assert_eq!(found, shallow.max(112 + 1100 + above), "{level}");
        // The same call behind the section.
        handler.insert(4, "bl 0x200");
        assert_eq!(bound(&handler, &["bx lr"]).unwrap(), 112 + 1100 + 500, "{level}");
        // Deeper outside of it.
        handler[4] = "bl 0x300";
        assert_eq!(bound(&handler, &["bx lr"]).unwrap(), 112 + 2100 + 500, "{level}");
    }
}

#[test]
fn a_section_holds_for_all_that_is_called_in_it_until_it_ends() {
    let off = ["cpsid i", "bl 0x200", "cpsie i", "bx lr"];
    assert_eq!(bound(&off, &["bl 0x300", "bx lr"]).unwrap(), 112 + 3100);
    // The callee lets interrupts in.
    let early = ["cpsie i", "bl 0x300", "bx lr"];
    assert_eq!(
        bound(&off[..2].iter().chain(&off[3..]).copied().collect::<Vec<_>>(), &early).unwrap(),
        112 + 3100 + 500
    );
}

#[test]
fn a_level_that_is_not_known_or_not_ones_own_is_refused() {
    for (handler, callee, reason) in [
        (
            &["msr basepri_max, r1", "bl 0x200", "msr basepri, r0", "bx lr"][..],
            &["bx lr"][..],
            "not known",
        ),
        (
            &["movs r1, #0xd0", "msr basepri_max, r1", "bl 0x200", "msr basepri, r0", "bx lr"],
            &["msr basepri, r0", "bx lr"],
            "of its caller",
        ),
    ] {
        let error = format!("{:#}", bound(handler, callee).unwrap_err());
        assert!(error.contains(reason), "{error}");
    }
}

#[test]
fn what_cannot_be_followed_must_reach_no_section() {
    let section = section("0xd0");
    let mut handler: Vec<_> = section.iter().map(String::as_str).collect();
    handler.push("bx lr");
    let lost = ["tbh [r1, r0, lsl #1]", "bl 0x300", "bx lr"];
    assert_eq!(bound(&handler, &lost).unwrap(), 112 + 3100);
    let error =
        format!("{:#}", bound(&handler, &["tbh [r1, r0]", "cpsie i", "bx lr"]).unwrap_err());
    assert!(error.contains("jump table"), "{error}");
}

#[test]
fn only_higher_priorities_interrupt_and_equal_ones_do_not() {
    let task = |handler: &str, priority, bytes| TaskStack {
        handler: handler.into(),
        priority,
        depths: [(0, bytes)].into(),
    };
    let tasks = [task("low", 1, 100), task("a", 2, 300), task("b", 2, 200), task("top", 3, 50)];
    let nesting = deepest(&tasks, 0);
    assert_eq!(sum(&nesting), 450);
    let names: Vec<_> = nesting.iter().map(|Layer { handler, .. }| handler.as_str()).collect();
    assert_eq!(names, ["low", "a", "top"]);
}
