//! Logs of flights: their list, and their bytes in parts.

use mavlink::dialects::common::{LOG_DATA_DATA, LOG_ENTRY_DATA};

use crate::frame::Frame;
use crate::protocol::Protocol;
use crate::vehicle::{LogEntry, Vehicle};

/// Bytes of a log in one message.
const PART: usize = 90;
/// Shortest time between two parts (us).
const PACE: u64 = 400;

/// Transfers on their way.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LogTransfer {
    /// Next entry of the list, and the last one that is wanted.
    listed: Option<(u16, u16)>,
    sent: Option<Part>,
    due: u64,
}

/// The rest of a log that is to be sent.
#[derive(Clone, Copy, Debug)]
struct Part {
    id: u16,
    offset: u32,
    end: u32,
}

impl Protocol<'_> {
    /// Begins to send the entries `first` to `last` of the list.
    pub(crate) fn list_logs<V: Vehicle>(&mut self, first: u16, last: u16, vehicle: &mut V) {
        self.logs.sent = None;
        let count = vehicle.log_count();
        if count == 0 {
            // One entry that says that there is none.
            self.answer(&LOG_ENTRY_DATA::DEFAULT, &[]);
        } else {
            self.logs.listed = Some((first, last.min(count - 1)));
        }
    }

    /// Begins to send `count` bytes of a log from `offset` on.
    pub(crate) fn send_log<V: Vehicle>(
        &mut self,
        id: u16,
        offset: u32,
        count: u32,
        vehicle: &mut V,
    ) {
        let size = vehicle.log(id).unwrap_or_default().size;
        let end = offset.saturating_add(count).min(size);
        self.logs.sent = Some(Part { id, offset, end: end.max(offset) });
    }

    /// The next message of a transfer.
    pub(crate) fn next_log_frame<V: Vehicle>(&mut self, vehicle: &mut V) -> Option<Frame> {
        let time = vehicle.view().time;
        if (self.logs.listed.is_none() && self.logs.sent.is_none()) || time < self.logs.due {
            return None;
        }
        self.logs.due = self.logs.due.max(time.saturating_sub(20 * PACE)) + PACE;
        if let Some((id, last)) = self.logs.listed {
            self.logs.listed = (id < last).then_some((id + 1, last));
            let LogEntry { size, time_utc } = vehicle.log(id)?;
            let num_logs = vehicle.log_count();
            let last_log_num = num_logs.saturating_sub(1);
            return Some(
                self.frame(&LOG_ENTRY_DATA { time_utc, size, id, num_logs, last_log_num }, &[]),
            );
        }
        let Part { id, offset, end } = self.logs.sent?;
        let mut data = [0; PART];
        let wanted = PART.min(end.saturating_sub(offset) as usize);
        let read = match data.get_mut(..wanted) {
            Some(room) if wanted > 0 => vehicle.read_log(id, offset, room).min(wanted),
            _ => 0,
        };
        let after = offset.saturating_add(read as u32);
        let more = after < end && read > 0;
        self.logs.sent = more.then_some(Part { id, offset: after, end });
        Some(self.frame(&LOG_DATA_DATA { ofs: offset, id, count: read as u8, data }, &[]))
    }
}
