//! Messages that are sent again and again: which, and when each is due.

/// Shortest interval that can be asked for (us): 200 a second.
pub(crate) const INTERVAL_MIN: u32 = 5_000;

/// Number and default interval (us) of every stream; zero for one that must be asked for.
const DEFAULTS: [(u32, u32); STREAMS] = [
    (0, 1_000_000),   // HEARTBEAT
    (1, 1_000_000),   // SYS_STATUS
    (2, 1_000_000),   // SYSTEM_TIME
    (24, 200_000),    // GPS_RAW_INT
    (30, 20_000),     // ATTITUDE
    (31, 20_000),     // ATTITUDE_QUATERNION
    (32, 20_000),     // LOCAL_POSITION_NED
    (33, 20_000),     // GLOBAL_POSITION_INT
    (42, 1_000_000),  // MISSION_CURRENT
    (74, 100_000),    // VFR_HUD
    (85, 0),          // POSITION_TARGET_LOCAL_NED
    (147, 1_000_000), // BATTERY_STATUS
    (242, 1_000_000), // HOME_POSITION
    (245, 200_000),   // EXTENDED_SYS_STATE
    (DEBUG_VECT, 100_000),
    (436, 1_000_000), // CURRENT_MODE
];
const STREAMS: usize = 16;

/// Number of the message with the integral action's estimates: not sent without integral action.
pub(crate) const DEBUG_VECT: u32 = 250;

#[derive(Clone, Copy, Debug)]
struct Stream {
    id: u32,
    /// Zero while it is off (us).
    interval: u32,
    /// Time at which it is due (us).
    due: u64,
}

/// Every stream with its rate.
#[derive(Clone, Debug)]
pub(crate) struct Streams {
    streams: [Stream; STREAMS],
    /// Start of the search for one that is due: none starves the others.
    next: usize,
}

impl Streams {
    /// The default rates, each interval times `stretch`.
    pub(crate) fn new(stretch: u32) -> Self {
        let stream = |(id, interval): (u32, u32)| Stream {
            id,
            interval: interval.saturating_mul(stretch.max(1)),
            due: 0,
        };
        let mut streams = DEFAULTS.map(stream);
        let [heartbeat, ..] = &mut streams;
        heartbeat.interval = 1_000_000; // a station waits for no slower one
        Self { streams, next: 0 }
    }

    /// Sets the interval (us): zero for the default, negative for off. `false` if there is no such stream
    /// or it cannot be that fast.
    pub(crate) fn set(&mut self, id: u32, interval: f32) -> bool {
        // wcet: at most STREAMS iterations
        let default = DEFAULTS.iter().find(|stream| stream.0 == id).map(|stream| stream.1);
        // wcet: at most STREAMS iterations
        let Some(stream) = self.streams.iter_mut().find(|stream| stream.id == id) else {
            return false;
        };
        stream.interval = if interval < 0.0 {
            0
        } else if interval == 0.0 {
            default.unwrap_or(0)
        } else if interval >= INTERVAL_MIN as f32 {
            interval as u32 // saturates
        } else {
            return false;
        };
        stream.due = 0;
        true
    }

    /// The interval (us): -1 while it is off; none if there is no such stream.
    pub(crate) fn interval(&self, id: u32) -> Option<i32> {
        // wcet: at most STREAMS iterations
        let stream = self.streams.iter().find(|stream| stream.id == id)?;
        Some(if stream.interval == 0 {
            -1
        } else {
            i32::try_from(stream.interval).unwrap_or(i32::MAX)
        })
    }

    /// A stream that is due at `time` (us), once; [`DEBUG_VECT`] only with `lasting` estimates.
    pub(crate) fn take_due(&mut self, time: u64, lasting: bool) -> Option<u32> {
        // wcet: at most STREAMS iterations
        for step in 0..STREAMS {
            let index = (self.next + step) % STREAMS;
            let Some(stream) = self.streams.get_mut(index) else { continue };
            let sent = stream.id != DEBUG_VECT || lasting;
            if sent && stream.interval > 0 && time >= stream.due {
                let interval = u64::from(stream.interval);
                // What is late is not sent twice.
                stream.due = (stream.due + interval).max(time.saturating_sub(interval / 2));
                self.next = index + 1;
                return Some(stream.id);
            }
        }
        None
    }
}
