//! Tests of the link.

mod damage;
mod documented;
mod frames;
mod million;
mod parameters;
mod sizes;
mod uploads;

use std::vec::Vec;

use glam::{Quat, Vec3};

use super::*;
use ctrl_core::mode::navigation::NavigationMode;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;

/// A message as a frame of a fresh encoder.
fn frame_of<M: Message>(message: &M) -> Vec<u8> {
    Encoder::default().encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec()
}

/// Feeds bytes and collects what is delivered.
fn feed<M: Message>(decoder: &mut Decoder<M>, bytes: &[u8]) -> Vec<Received<M>> {
    bytes.iter().filter_map(|byte| decoder.push(*byte)).collect()
}

fn example_state() -> Uplink {
    let state = VehicleState {
        position_world: Vec3::new(98.0, -2.0, 0.0),
        velocity_world: Vec3::new(0.5, 0.25, -1.0),
        attitude: Quat::IDENTITY,
        rate_body: Vec3::new(0.0, 0.125, 0.0),
    };
    Uplink::State { tick: 1000, state }
}

fn guidance() -> Guidance {
    let reference = Reference::hover(Vec3::new(1.0, 2.0, 3.0));
    Guidance { law_changes: u32::MAX, navigation: NavigationMode::Land, reference }
}

fn example_reference(tick: u64) -> Uplink {
    Uplink::Reference { tick, reference: Reference::hover(Vec3::new(1.0, 2.0, 3.0)) }
}
