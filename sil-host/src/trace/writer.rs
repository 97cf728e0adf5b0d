//! Writer of a trace on a thread of its own: formatting takes longer than flying.

use std::io::{self, Write};
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

use super::row::Row;
use super::text::Text;
use sim::observer::Observer;
use sim::tick::Tick;

/// Rows that are handed over together.
const BATCH: usize = 256;
/// Batches in the queue; a flight that is faster than its trace waits for a place.
const WAITING: usize = 4;
/// Bytes collected before they are written out.
const BUFFER: usize = 1 << 16;

/// Writes every `every`-th tick of a flight, on a thread of its own.
#[derive(Debug)]
pub struct TraceWriter<W> {
    every: u64,
    rows: u64,
    batch: Vec<Row>,
    full: SyncSender<Vec<Row>>,
    /// Batches for reuse.
    empty: Receiver<Vec<Row>>,
    thread: JoinHandle<io::Result<W>>,
    /// The thread has stopped at an error, which [`finish`](Self::finish) returns.
    stopped: bool,
}

impl<W: Write + Send + 'static> TraceWriter<W> {
    /// Writes to `out`, which needs no buffer of its own; `every` is at least 1.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn new(out: W, every: u64) -> io::Result<Self> {
        let (full, rows) = sync_channel(WAITING);
        let (used, empty) = sync_channel(WAITING);
        let thread = Builder::new().name("trace".to_owned());
        Ok(Self {
            every: every.max(1),
            rows: 0,
            batch: Vec::with_capacity(BATCH),
            full,
            empty,
            thread: thread.spawn(move || write(out, &rows, &used))?,
            stopped: false,
        })
    }

    fn hand_over(&mut self) {
        let empty = self.empty.try_recv().unwrap_or_else(|_| Vec::with_capacity(BATCH));
        let batch = core::mem::replace(&mut self.batch, empty);
        self.stopped = self.full.send(batch).is_err();
    }

    /// Writes what is left; returns the writer and the number of rows.
    ///
    /// # Errors
    /// The first error of any write since the start.
    pub fn finish(mut self) -> io::Result<(W, u64)> {
        if !self.stopped {
            self.hand_over();
        }
        drop(self.full);
        let out = self.thread.join().unwrap_or_else(|panic| resume_unwind(panic))?;
        Ok((out, self.rows))
    }
}

impl<W: Write + Send + 'static> Observer for TraceWriter<W> {
    /// Writes the tick if it is due. Errors are kept for [`finish`](TraceWriter::finish).
    #[inline]
    fn observe(&mut self, tick: &Tick) {
        if !tick.tick.is_multiple_of(self.every) || self.stopped {
            return;
        }
        self.batch.push(Row::new(tick));
        self.rows += 1;
        if self.batch.len() == BATCH {
            self.hand_over();
        }
    }
}

/// Writes all `rows` until their sender is gone.
fn write<W: Write>(
    mut out: W,
    rows: &Receiver<Vec<Row>>,
    used: &SyncSender<Vec<Row>>,
) -> io::Result<W> {
    let mut text = Text::new();
    text.heading();
    for mut batch in rows {
        for row in batch.drain(..) {
            text.row(&row);
            if text.bytes().len() >= BUFFER {
                out.write_all(text.bytes())?;
                text.clear();
            }
        }
        // Without room for it, or without a flight, the batch is dropped.
        let _ = used.try_send(batch);
    }
    out.write_all(text.bytes())?;
    out.flush()?;
    Ok(out)
}
