//! Sectors 1 and 2 of the chip's flash, 16 KiB each: the region `PARAMETERS` of `memory.x`.
//!
//! While a byte is programmed (16 us, at most 100 us) or a sector erased (400 ms, at most 800 ms;
//! datasheet, programming 8 bits at a time) every fetch from flash waits, interrupt handlers' too.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use stm32f4xx_hal::flash::{FlashExt, LockedFlash};
use stm32f4xx_hal::pac::FLASH;

/// Bytes of one of the sectors.
const SECTOR: u32 = 16 * 1024;
/// Number of the first sector: as many of the same size are before it.
const FIRST_SECTOR: u32 = 1;
/// Bytes of both.
const SIZE: u32 = 2 * SECTOR;

/// See the module's documentation.
pub struct ParameterFlash(LockedFlash);

impl ParameterFlash {
    /// Takes the flash's registers.
    pub fn new(flash: FLASH) -> Self {
        Self(LockedFlash::new(flash))
    }
}

/// Place in the whole flash of `length` bytes at `offset` here.
fn place(offset: u32, length: usize) -> Result<u32, NorFlashErrorKind> {
    let end = u32::try_from(length).ok().and_then(|length| offset.checked_add(length));
    match end {
        Some(end) if end <= SIZE => Ok(FIRST_SECTOR * SECTOR + offset),
        _ => Err(NorFlashErrorKind::OutOfBounds),
    }
}

impl ErrorType for ParameterFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for ParameterFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let place = place(offset, bytes.len())? as usize;
        let stored = FlashExt::read(&self.0).get(place..).ok_or(NorFlashErrorKind::OutOfBounds)?;
        for (byte, stored) in bytes.iter_mut().zip(stored) {
            *byte = *stored;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE as usize
    }
}

impl NorFlash for ParameterFlash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        if !from.is_multiple_of(SECTOR) || !to.is_multiple_of(SECTOR) || to > SIZE {
            return Err(NorFlashErrorKind::NotAligned);
        }
        let mut flash = self.0.unlocked();
        for sector in from / SECTOR..to / SECTOR {
            let erased = flash.erase((FIRST_SECTOR + sector) as u8);
            erased.map_err(|_| NorFlashErrorKind::Other)?;
        }
        drop(flash);
        forget_cached_data();
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let place = place(offset, bytes.len())?;
        NorFlash::write(&mut self.0.unlocked(), place, bytes).map_err(|_| NorFlashErrorKind::Other)
    }
}

/// The data cache does not see an erasure (RM0090, 3.5.2); it may only be reset while it is off.
fn forget_cached_data() {
    // SAFETY: the bits of the data cache are nobody else's once the clocks are set up.
    let flash = unsafe { FLASH::steal() };
    let enabled = flash.acr().read().dcen().bit();
    flash.acr().modify(|_, w| w.dcen().clear_bit());
    flash.acr().modify(|_, w| w.dcrst().set_bit());
    flash.acr().modify(|_, w| w.dcrst().clear_bit());
    flash.acr().modify(|_, w| w.dcen().bit(enabled));
}
