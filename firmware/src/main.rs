//! The image: wires the tasks to the library.
//!
//! | task | priority | released by |
//! |---|---|---|
//! | `receive` | 5 | each byte on the link |
//! | `control` | 4 | SysTick |
//! | `state_input`, `telemetry`, `housekeeping` | 3, 2, 1 | `control`, when due |
#![no_std]
#![no_main]

#[cfg(not(feature = "emulator"))]
use defmt_rtt as _;
#[cfg(feature = "emulator")]
use defmt_semihosting as _;

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use core::sync::atomic::Ordering::Relaxed;

    use firmware::board::peripherals::{Peripherals, now, start_control_tick};
    use firmware::board::{Active, Board};
    use firmware::fault::{UPTIME, take_evidence};

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        tick: u32,
    }

    #[init]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        let peripherals = Peripherals::new(cx.device, 4.0);
        if let Some(evidence) = take_evidence() {
            defmt::error!("fault before this boot: {=str}", evidence.cause.name());
            Active::report(&evidence);
        }
        start_control_tick(&mut cx.core.SYST, 1000);
        defmt::info!("up {}", now());
        let _ = peripherals.rotors;
        (Shared {}, Local { tick: 0 })
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }

    #[task(binds = SysTick, priority = 4, local = [tick])]
    fn control(cx: control::Context) {
        *cx.local.tick += 1;
        UPTIME.store(*cx.local.tick, Relaxed);
        Active::exercise(*cx.local.tick);
        if *cx.local.tick % 1000 == 0 {
            defmt::info!("now {}", now());
        }
    }
}
