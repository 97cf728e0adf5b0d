//! The input and output files on the host, through semihosting.

use cortex_m_semihosting::syscall;
use step_record::Record;

const READ_BINARY: usize = 1;
const WRITE_BINARY: usize = 5;
const WORDS: usize = 256;

fn open(name: &'static [u8], mode: usize) -> usize {
    // SAFETY: `name` is zero-terminated and outlives the call; the length leaves out the zero.
    let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, name.len() - 1) };
    if handle == usize::MAX { crate::refuse() } else { handle }
}

/// `step-input.bin` in the emulator's working directory.
pub struct Input {
    handle: usize,
    words: [u32; WORDS],
    next: usize,
    end: usize,
}

impl Input {
    /// Opens the file; ends the emulator with an error when there is none.
    #[must_use]
    pub fn open() -> Self {
        let handle = open(b"step-input.bin\0", READ_BINARY);
        Self { handle, words: [0; WORDS], next: 0, end: 0 }
    }

    /// The next record; `None` at the end of the file.
    pub fn record<R: Record>(&mut self) -> Option<R> {
        R::read(|| self.word())
    }

    #[inline(never)]
    fn word(&mut self) -> Option<u32> {
        if self.next == self.end {
            let bytes = size_of_val(&self.words);
            // SAFETY: the buffer has `bytes` bytes; the host writes at most so many.
            let missing = unsafe { syscall!(READ, self.handle, self.words.as_mut_ptr(), bytes) };
            self.next = 0;
            self.end = bytes.saturating_sub(missing) / 4;
        }
        let word = *self.words.get(self.next).filter(|_| self.next < self.end)?;
        self.next += 1;
        Some(word)
    }
}

/// `step-output.bin` in the emulator's working directory.
pub struct Output {
    handle: usize,
    words: [u32; WORDS],
    end: usize,
}

impl Output {
    /// Creates the file.
    #[must_use]
    pub fn create() -> Self {
        let handle = open(b"step-output.bin\0", WRITE_BINARY);
        Self { handle, words: [0; WORDS], end: 0 }
    }

    /// Appends a record.
    pub fn record(&mut self, record: impl Record) {
        record.write(|word| self.word(word));
    }

    #[inline(never)]
    fn word(&mut self, word: u32) {
        if self.end == WORDS {
            self.flush();
        }
        self.words[self.end] = word;
        self.end += 1;
    }

    fn flush(&mut self) {
        // SAFETY: the buffer holds `end` words, which the host only reads.
        let missing = unsafe { syscall!(WRITE, self.handle, self.words.as_ptr(), self.end * 4) };
        if missing != 0 {
            crate::refuse();
        }
        self.end = 0;
    }

    /// Writes what is left.
    pub fn close(mut self) {
        self.flush();
    }
}
