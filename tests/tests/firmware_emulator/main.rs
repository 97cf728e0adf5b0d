//! The firmware in QEMU's STM32F405: the same bits as on the host, in replay and in closed loop;
//! arming, failsafe and faults of the whole image.
//!
//! Needs `qemu-system-arm` and the target `thumbv7em-none-eabihf`; the images are built here.

mod closed_loop;
mod emulator;
mod in_the_loop;
mod line_faults;
mod lock_step;
mod logs;
mod replay;
mod serial_link;
mod stored_parameters;
mod whole_image;

/// The paper's two simulations.
const PAPER: [&str; 2] = ["paper-robust-adaptive", "paper-saturated"];

/// Ten seconds at 1 kHz.
const TICKS: u64 = 10_000;
