//! Any bytes on a MAVLink port, before the pilot, the session and the control group of a vehicle.
//!
//! The first byte chooses: zero or two, and the rest are bytes as they come, ten to a control tick; otherwise
//! records of place in [`MESSAGES`](fuzz::station::MESSAGES), ticks, length and payload, each in a frame with the
//! right checksum. With two or three the vehicle demands signatures, and is never armed. Whatever comes, each reference stays inside `M_p`, each wrench inside its bounds, and the vehicle
//! flies only after it was armed.
#![no_main]

use fuzz::station::{FlightMemory, MESSAGES, PilotedFlight, frame};
use libfuzzer_sys::fuzz_target;
use mavlink_vehicle::SigningKey;

fuzz_target!(|data: &[u8]| {
    let Some((kind, data)) = data.split_first() else { return };
    let mut memory = FlightMemory::default();
    let demands = matches!(*kind, 2 | 3);
    let key = if demands { SigningKey::new([7; 32]) } else { None };
    let mut flight = PilotedFlight::new(&mut memory, key);
    if matches!(*kind, 0 | 2) {
        for bytes in data.chunks(10) {
            flight.receive(bytes);
            flight.tick(1);
        }
        assert!(!(demands && flight.armed()));
        return;
    }
    let mut rest = data;
    while let [place, ticks, length, after @ ..] = rest {
        let (payload, after) = after.split_at(after.len().min(usize::from(*length)));
        let id = MESSAGES[usize::from(*place) % MESSAGES.len()];
        flight.receive(&frame(id, payload));
        flight.tick(u32::from(*ticks));
        rest = after;
    }
    assert!(!(demands && flight.armed()));
});
