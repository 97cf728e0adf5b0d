//! The place of an emulator's threads on this machine.
//!
//! QEMU has a thread that runs the image and a main loop, which has nothing to do for an image with FIFOs alone, yet
//! is woken whenever an emulated timer expires: more than once in a control tick. On a processor of its own that costs
//! as much as the tick. On the same processor, and as the least urgent thread there, it costs next to nothing.

use std::process::Child;

#[cfg(target_os = "linux")]
use rustix::process::{Pid, setpriority_process};
#[cfg(target_os = "linux")]
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// Keeps an emulator that has just been started on one processor, another for each emulator of this process as long as
/// there are more. Without success the emulator is only slower.
#[cfg(target_os = "linux")]
pub fn keep_on_one_processor(emulator: &Child) {
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
    static STARTED: AtomicUsize = AtomicUsize::new(0);
    let Ok(allowed) = sched_getaffinity(None) else { return };
    let processors: Vec<_> = (0..CpuSet::MAX_CPU).filter(|one| allowed.is_set(*one)).collect();
    // Emulators of other processes begin elsewhere.
    let started = STARTED.fetch_add(1, Relaxed) + std::process::id() as usize;
    let mut chosen = CpuSet::new();
    if let Some(one) = processors.get(started % processors.len().max(1)) {
        chosen.set(*one);
        let _ = sched_setaffinity(pid(emulator), &chosen);
    }
}

/// Makes the main loop of an emulator whose image runs the least urgent thread.
#[cfg(target_os = "linux")]
pub fn main_loop_last(emulator: &Child) {
    // On Linux a priority is that of the one thread whose number the process has, the main loop.
    let _ = setpriority_process(pid(emulator), 19);
}

#[cfg(target_os = "linux")]
fn pid(emulator: &Child) -> Option<Pid> {
    Pid::from_raw(emulator.id().cast_signed())
}

/// Does nothing: only Linux has priorities of threads.
#[cfg(not(target_os = "linux"))]
pub fn keep_on_one_processor(_: &Child) {}

/// Does nothing: only Linux has priorities of threads.
#[cfg(not(target_os = "linux"))]
pub fn main_loop_last(_: &Child) {}
