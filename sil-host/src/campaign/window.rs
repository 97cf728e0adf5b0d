//! Puts what threads finish in any order back into order, in bounded memory.

use std::collections::BTreeMap;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use super::error::CampaignError;

/// Results of runs on their way to the table: at most `size` runs beyond the next one to be written.
#[derive(Debug)]
pub struct Window<T, W> {
    state: Mutex<State<T, W>>,
    moved: Condvar,
    size: u32,
}

#[derive(Debug)]
struct State<T, W> {
    /// Number of the run that is written next.
    next: u32,
    waiting: BTreeMap<u32, T>,
    write: W,
    failed: bool,
}

impl<T, W: FnMut(Vec<T>) -> Result<(), CampaignError>> Window<T, W> {
    /// Begins with run `first`; `write` is given the results of one or more runs, in order.
    pub fn new(first: u32, size: u32, write: W) -> Self {
        let state = State { next: first, waiting: BTreeMap::new(), write, failed: false };
        Self { state: Mutex::new(state), moved: Condvar::new(), size: size.max(1) }
    }

    /// Waits until run `index` is near enough to the next one to be written; whether to fly it, which
    /// is not so after a failure to write.
    ///
    /// Runs must be claimed in order: then the next one is always being flown, and nobody waits for
    /// ever.
    pub fn admit(&self, index: u32) -> bool {
        let far = |state: &mut State<T, W>| !state.failed && index - state.next >= self.size;
        let waited = self.moved.wait_while(self.lock(), far);
        !waited.unwrap_or_else(PoisonError::into_inner).failed
    }

    /// Takes the result of run `index`, and writes all that are next.
    ///
    /// # Errors
    /// Those of `write`; every later run is then refused.
    pub fn finish(&self, index: u32, result: T) -> Result<(), CampaignError> {
        let mut state = self.lock();
        let state = &mut *state;
        state.waiting.insert(index, result);
        let mut ready = Vec::new();
        while let Some(result) = state.waiting.remove(&state.next) {
            ready.push(result);
            state.next += 1;
        }
        if ready.is_empty() || state.failed {
            return Ok(());
        }
        let written = (state.write)(ready);
        state.failed = written.is_err();
        self.moved.notify_all();
        written
    }

    fn lock(&self) -> MutexGuard<'_, State<T, W>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    #[test]
    fn what_comes_in_any_order_is_written_in_order() {
        let mut written = String::new();
        let window = Window::new(3, 8, |lines: Vec<String>| {
            written += &lines.concat();
            Ok(())
        });
        for index in [5, 4, 6, 3, 8, 7] {
            assert!(window.admit(index));
            window.finish(index, format!("{index};")).unwrap();
        }
        drop(window);
        assert_eq!(written, "3;4;5;6;7;8;");
    }

    #[test]
    fn a_run_far_ahead_waits_for_the_next_one() {
        let window = Window::new(0, 2, |_: Vec<String>| Ok(()));
        thread::scope(|scope| {
            let ahead = scope.spawn(|| window.admit(2));
            window.finish(1, "1".to_owned()).unwrap();
            assert!(!ahead.is_finished());
            window.finish(0, "0".to_owned()).unwrap();
            assert!(ahead.join().unwrap());
        });
    }

    #[test]
    fn after_a_failure_nobody_waits_and_nothing_is_written() {
        let mut calls = 0;
        let window = Window::new(0, 1, |_: Vec<String>| {
            calls += 1;
            Err(CampaignError::Usage("full".to_owned()))
        });
        thread::scope(|scope| {
            let ahead = scope.spawn(|| window.admit(1));
            assert!(window.finish(0, "0".to_owned()).is_err());
            assert!(!ahead.join().unwrap());
        });
        assert!(window.finish(1, "1".to_owned()).is_ok());
        drop(window);
        assert_eq!(calls, 1);
    }
}
