//! Counts of tasks that interrupt each other, and rounds of their loops.
//!
//! A stack has the tasks that have begun: an instruction counts for the topmost one, and a loop has a
//! counter for each depth of the stack, so that one task may interrupt another within a loop of a function
//! that both call. Nothing counts below a call of code that is not bounded, such as the emulator's driver of the
//! link, which copies by the same routines.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// What an instruction does to the counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Role {
    /// Begins this task.
    pub begins: Option<usize>,
    /// Ends the topmost task.
    pub ends: bool,
    /// Counts: lies in a range.
    pub counts: bool,
    /// Header of this loop.
    pub header: Option<usize>,
    /// Enters these loops next, if it goes there at all.
    pub enters: Vec<usize>,
    /// Begins the function over whose call these loops are counted.
    pub restarts: Vec<usize>,
    /// Calls code that does not count and returns to this address.
    pub suspends: Option<u64>,
    /// This address, if code that does not count returns there.
    pub resumes: Option<u64>,
}

/// A task that has begun.
#[derive(Debug, Default)]
struct Begun {
    task: usize,
    /// Instructions so far.
    count: u64,
    /// Address behind the call of code that does not count, while that runs.
    suspended: Option<u64>,
}

/// Header of a loop.
#[derive(Clone, Copy, Debug)]
pub struct Header {
    address: u64,
    /// Rounds are counted over a release or a call of some function, however often the loop is entered.
    in_all: bool,
}

/// Executions of a header since its loop was entered; in all, ways back to it.
#[derive(Clone, Copy, Debug, Default)]
struct Rounds {
    count: u64,
    /// The next execution is that of an entry, which does not count in all.
    entering: bool,
}

/// The counts.
#[derive(Debug)]
pub struct Tasks {
    entries: Vec<u64>,
    headers: Vec<Header>,
    stack: Vec<Begun>,
    /// For each depth and each header, its [`Rounds`].
    rounds: Vec<Vec<Rounds>>,
    most_rounds: Vec<u64>,
    most: Vec<u64>,
    all: Vec<u64>,
    calls: Vec<u64>,
}

impl Tasks {
    /// Tasks by their entries, loops by their headers.
    pub fn new(entries: Vec<u64>, headers: Vec<Header>) -> Self {
        let (tasks, loops) = (entries.len(), headers.len());
        Self {
            entries,
            headers,
            stack: Vec::new(),
            rounds: vec![vec![Rounds::default(); loops]; tasks + 1],
            most_rounds: vec![0; loops],
            most: vec![0; tasks],
            all: vec![0; tasks],
            calls: vec![0; tasks],
        }
    }

    /// One executed instruction.
    pub fn executed(&mut self, role: &Role) {
        if let Some(task) = role.begins {
            if self.stack.len() < self.entries.len() {
                self.stack.push(Begun { task, ..Begun::default() });
            }
            self.rounds[self.stack.len()].fill(Rounds::default());
        }
        let Some(begun) = self.stack.last_mut() else { return };
        if role.resumes.is_some() && begun.suspended == role.resumes {
            begun.suspended = None;
        }
        if begun.suspended.is_some() {
            return;
        }
        begun.count += u64::from(role.counts);
        begun.suspended = role.suspends;
        self.went_round(role);
        if role.ends
            && let Some(Begun { task, count, .. }) = self.stack.pop()
        {
            self.most[task] = self.most[task].max(count);
            self.all[task] += count;
            self.calls[task] += 1;
        }
    }

    fn went_round(&mut self, role: &Role) {
        let rounds = &mut self.rounds[self.stack.len()];
        for restarted in &role.restarts {
            rounds[*restarted] = Rounds::default();
        }
        if let Some(header) = role.header {
            let (rounds, most) = (&mut rounds[header], &mut self.most_rounds[header]);
            let entered = core::mem::take(&mut rounds.entering) && self.headers[header].in_all;
            rounds.count += u64::from(!entered);
            *most = rounds.count.max(*most);
        }
        for entered in &role.enters {
            let rounds = &mut rounds[*entered];
            rounds.entering = true;
            if !self.headers[*entered].in_all {
                rounds.count = 0;
            }
        }
    }

    /// Ended calls of all tasks.
    pub fn calls(&self) -> u64 {
        self.calls.iter().sum()
    }

    /// A line `task ENTRY MOST CALLS ALL` for each task and `loop HEADER MOST` for each loop.
    pub fn report(&self) -> String {
        let mut text = String::new();
        for (task, entry) in self.entries.iter().enumerate() {
            let (most, calls, all) = (self.most[task], self.calls[task], self.all[task]);
            let _ = writeln!(text, "task {entry:#x} {most} {calls} {all}");
        }
        for (header, most) in self.headers.iter().zip(&self.most_rounds) {
            let _ = writeln!(text, "loop {:#x} {most}", header.address);
        }
        text
    }
}

/// Reads a description: lines `task ENTRY EXIT...`, `loop HEADER ENTERED_FROM...`, `total HEADER ENTERED_FROM...`, `over
/// FUNCTION` for the loop of the line before, `apart CALL RETURN` and `range START END`, all numbers in hexadecimal. Returns the counts, the roles of single instructions, and the ranges.
#[allow(clippy::type_complexity, reason = "one caller")]
pub fn parse(text: &str) -> Option<(Tasks, BTreeMap<u64, Role>, Vec<core::ops::Range<u64>>)> {
    let (mut entries, mut headers, mut ranges) = (Vec::new(), Vec::new(), Vec::new());
    let mut roles: BTreeMap<u64, Role> = BTreeMap::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let kind = words.next()?;
        let numbers = words.map(|word| u64::from_str_radix(word.strip_prefix("0x")?, 16).ok());
        let numbers = numbers.collect::<Option<Vec<_>>>()?;
        match (kind, &numbers[..]) {
            ("task", [entry, exits @ ..]) => {
                roles.entry(*entry).or_default().begins = Some(entries.len());
                exits.iter().for_each(|exit| roles.entry(*exit).or_default().ends = true);
                entries.push(*entry);
            }
            ("loop" | "total", [header, from @ ..]) => {
                roles.entry(*header).or_default().header = Some(headers.len());
                for from in from {
                    roles.entry(*from).or_default().enters.push(headers.len());
                }
                headers.push(Header { address: *header, in_all: kind == "total" });
            }
            ("over", [function]) => {
                let header = headers.len().checked_sub(1)?;
                roles.entry(*function).or_default().restarts.push(header);
            }
            ("apart", [call, back]) => {
                roles.entry(*call).or_default().suspends = Some(*back);
                roles.entry(*back).or_default().resumes = Some(*back);
            }
            ("range", [start, end]) => ranges.push(*start..*end),
            _ => return None,
        }
    }
    Some((Tasks::new(entries, headers), roles, ranges))
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn tasks_that_interrupt_each_other_are_counted_apart() {
        let (mut tasks, roles, ranges) = parse(
            "task 0x10 0x13\ntask 0x20 0x22\nloop 0x12 0x11\nrange 0x10 0x14\nrange 0x20 0x23\n\
             apart 0x21 0x22",
        )
        .unwrap();
        let run = |tasks: &mut super::Tasks, pcs: &[u64]| {
            for pc in pcs {
                let mut role = roles.get(pc).cloned().unwrap_or_default();
                role.counts = ranges.iter().any(|range| range.contains(pc));
                tasks.executed(&role);
            }
        };
        // Task 0x10 is interrupted in its loop; 0x30 is no code of either.
        run(&mut tasks, &[0x10, 0x11, 0x12, 0x20, 0x12, 0x30, 0x22, 0x12, 0x12, 0x13]);
        // A shorter call, and instructions of no task.
        run(&mut tasks, &[0x12, 0x10, 0x11, 0x12, 0x13]);
        assert_eq!(tasks.report(), "task 0x10 6 2 10\ntask 0x20 3 1 3\nloop 0x12 3\n");
        // Code that does not count, called by task 0x20, goes round the loop; the task itself took three.
        run(&mut tasks, &[0x20, 0x21, 0x12, 0x12, 0x12, 0x12, 0x22]);
        assert_eq!(tasks.report(), "task 0x10 6 2 10\ntask 0x20 3 2 6\nloop 0x12 3\n");
        assert!(parse("task").is_none() && parse("loop 12").is_none());
    }

    #[test]
    fn loops_in_all_count_their_ways_back_over_a_release_or_a_call() {
        let (mut tasks, roles, _) =
            parse("task 0x10 0x19\ntotal 0x12 0x11\ntotal 0x15 0x14\nover 0x13\nloop 0x17 0x16")
                .unwrap();
        let round = [0x11, 0x12, 0x12, 0x13, 0x14, 0x15, 0x15, 0x15, 0x14, 0x15, 0x16, 0x17, 0x17];
        let release = [&[0x10], &round[..], &round, &[0x19]].concat();
        for pc in release.iter().chain(&release) {
            tasks.executed(&roles.get(pc).cloned().unwrap_or_default());
        }
        // Of each release two ways back to 0x12; of each call of 0x13 two to 0x15; of each entry two of 0x17.
        assert_eq!(tasks.report(), "task 0x10 0 2 0\nloop 0x12 2\nloop 0x15 2\nloop 0x17 2\n");
        assert!(parse("over 0x10").is_none());
    }
}
