//! m
#![no_std]
#![no_main]

use defmt_semihosting as _;
use stm32f4xx_hal as _;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    semihosting::process::exit(1)
}

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use stm32f4xx_hal::{pac, prelude::*, rcc};
    #[shared]
    struct Shared {}
    #[local]
    struct Local {
        n: u32,
    }
    #[init]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        defmt::info!("hello");
        let rcc = cx.device.RCC.freeze(rcc::Config::hsi());
        cx.core.SYST.set_reload(168_000 - 1);
        cx.core.SYST.clear_current();
        cx.core.SYST.enable_counter();
        cx.core.SYST.enable_interrupt();
        defmt::info!("up {}", rcc.clocks.sysclk().raw());
        rtic::pend(pac::Interrupt::SPI1);
        (Shared {}, Local { n: 0 })
    }
    #[task(binds = SysTick, priority = 4, local=[n])]
    fn control(cx: control::Context) {
        *cx.local.n += 1;
        if *cx.local.n == 1000 {
            defmt::info!("bye");
            semihosting::process::exit(0);
        }
    }
    #[task(binds = SPI1, priority = 1)]
    fn low(_cx: low::Context) {
        defmt::info!("low");
    }
}
