//! The allocation alone: wrenches that host and image both allocate, to three vehicles; and a hexarotor that loses a rotor, found and left out.
#![no_std]
#![no_main]

use core::mem::size_of;

use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use ctrl_core::allocation::{Allocation, Allocator, RotorWatch, RotorWatchState};
use ctrl_core::vehicle::Wrench;
use glam::Vec3;
use step_image::{Output, refuse};
use step_record::Closing;
use step_record::allocation::{
    AllocationAnswer, LOSSES, VEHICLES, command_after_loss, commands, fly_through_loss, geometry,
};

#[unsafe(no_mangle)]
#[inline(never)]
fn allocation_allocate(allocator: &Allocator, wrench: &Wrench) -> Allocation {
    allocator.allocate(wrench)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn allocation_lose(allocator: &mut Allocator, rotor: usize) -> bool {
    allocator.lose(rotor).is_ok()
}

#[unsafe(no_mangle)]
#[inline(never)]
fn rotor_watch_step(
    watch: &RotorWatch,
    state: &mut RotorWatchState,
    rate_body: Vec3,
    thrusts: &[f32],
) -> Option<usize> {
    watch.step(state, Some(rate_body), thrusts)
}

#[entry]
fn main() -> ! {
    let mut output = Output::create();
    for vehicle in 0..VEHICLES {
        let geometry = core::hint::black_box(geometry(vehicle));
        let Ok(allocator) = Allocator::new(&geometry) else { refuse() };
        for wrench in commands(geometry.rotors.len()) {
            let allocation = allocation_allocate(&allocator, &core::hint::black_box(wrench));
            output.record(AllocationAnswer::new(&allocation));
        }
    }
    for (vehicle, rotor) in LOSSES {
        let geometry = core::hint::black_box(geometry(vehicle));
        let Ok(mut allocator) = Allocator::new(&geometry) else { refuse() };
        if !allocation_lose(&mut allocator, core::hint::black_box(rotor)) {
            refuse();
        }
        let command = command_after_loss(geometry.rotors.len());
        let allocation = allocation_allocate(&allocator, &core::hint::black_box(command));
        output.record(AllocationAnswer::new(&allocation));
    }
    if fly_through_loss(rotor_watch_step, |answer| output.record(answer)).is_err() {
        refuse();
    }
    output.record(Closing {
        stack: 0,
        controller_size: size_of::<Allocator>() as u32,
        state_size: 0,
    });
    output.close();
    debug::exit(debug::EXIT_SUCCESS);
    refuse()
}
