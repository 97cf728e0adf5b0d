//! Memory of a controller: configuration, and the way back to the initial state.

use ctrl_core::controller::{AnyController, AnyControllerState, TrackingController};

use crate::access;
use crate::config::GyrfalconConfig;
use crate::refusal::{GyrfalconRefusal, refused};
use crate::result::code::{GYRFALCON_MEMORY_TOO_SMALL, GYRFALCON_NOT_CONFIGURED};
use crate::result::{Failure, GYRFALCON_ABI_VERSION, code_of};

/// Words of eight bytes in a controller's memory.
pub const GYRFALCON_CONTROLLER_WORDS: usize = 88;
/// Bytes of a controller's memory.
pub const GYRFALCON_CONTROLLER_SIZE: usize = 704;

/// A controller with its state. The caller provides the memory, set to zero before first use, and
/// leaves its content to the library; a copy of it is another controller in the same state.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct GyrfalconController {
    /// Not for the caller.
    pub words: [u64; GYRFALCON_CONTROLLER_WORDS],
}

impl GyrfalconController {
    /// Memory before the first configuration.
    pub const EMPTY: Self = Self { words: [0; GYRFALCON_CONTROLLER_WORDS] };
}

/// First word of memory with a controller: `GYF` and the version.
const CONFIGURED: u32 = 0x4759_4600 | GYRFALCON_ABI_VERSION;

/// Content of a controller's memory.
pub(crate) struct Content {
    /// [`CONFIGURED`], else the rest means nothing.
    mark: u32,
    /// Steps since the start or the point of resumption.
    pub steps: u32,
    /// Time at the start (s): zero, or that of the checkpoint.
    pub started: f32,
    pub controller: AnyController,
    pub state: AnyControllerState,
}

const _: () = assert!(size_of::<Content>() <= GYRFALCON_CONTROLLER_SIZE);
const _: () = assert!(size_of::<GyrfalconController>() == GYRFALCON_CONTROLLER_SIZE);
const _: () = assert!(align_of::<Content>() <= align_of::<GyrfalconController>());
const _: () = assert!(core::mem::offset_of!(Content, mark).is_multiple_of(4));

impl Content {
    /// Begins at `state`, `started` seconds after a first step.
    pub fn begin(&mut self, state: AnyControllerState, started: f32) {
        (self.state, self.started, self.steps) = (state, started, 0);
    }

    /// Time since the first step (s).
    pub fn elapsed(&self) -> f32 {
        self.started + self.steps as f32 * self.controller.step_period()
    }
}

/// The content of configured memory.
///
/// # Safety
/// `controller` is null or points to memory that is zero, or that `gyrfalcon_configure` filled, and that
/// nobody else uses meanwhile.
#[inline(always)]
pub(crate) unsafe fn content<'a>(
    controller: *mut GyrfalconController,
) -> Result<&'a mut Content, Failure> {
    let content = access::memory(controller)?.cast::<Content>();
    // SAFETY: not null, aligned, and large enough; the field is read without a reference to the rest.
    let mark = unsafe { (&raw const (*content).mark).read() };
    if mark != CONFIGURED {
        return Err(Failure(GYRFALCON_NOT_CONFIGURED));
    }
    // SAFETY: the mark says that the content was written as a whole.
    Ok(unsafe { &mut *content })
}

/// As [`content`], to be read only.
///
/// # Safety
/// As for [`content`], but others may read meanwhile.
#[inline(always)]
pub(crate) unsafe fn content_of<'a>(
    controller: *const GyrfalconController,
) -> Result<&'a Content, Failure> {
    let content = access::memory(controller.cast_mut())?.cast_const().cast::<Content>();
    // SAFETY: not null, aligned, and large enough; the field is read without a reference to the rest.
    let mark = unsafe { (&raw const (*content).mark).read() };
    if mark != CONFIGURED {
        return Err(Failure(GYRFALCON_NOT_CONFIGURED));
    }
    // SAFETY: the mark says that the content was written as a whole.
    Ok(unsafe { &*content })
}

/// Version of the interface that the library was built with.
#[unsafe(no_mangle)]
pub extern "C" fn gyrfalcon_abi_version() -> u32 {
    GYRFALCON_ABI_VERSION
}

/// Bytes of a controller's memory.
#[unsafe(no_mangle)]
pub extern "C" fn gyrfalcon_controller_size() -> usize {
    size_of::<GyrfalconController>()
}

/// Alignment of a controller's memory (B).
#[unsafe(no_mangle)]
pub extern "C" fn gyrfalcon_controller_alignment() -> usize {
    align_of::<GyrfalconController>()
}

/// Validates `config` and puts the controller into `controller`, at its initial state.
///
/// `memory_size` is the size of that memory (B). On `GYRFALCON_PARAMETER_REFUSED` `refusal`, unless it
/// is null, tells the parameter, its value and its bound. After any failure the memory is as before.
///
/// # Safety
/// Each pointer is null or points to a value of its type; none overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyrfalcon_configure(
    controller: *mut GyrfalconController,
    memory_size: usize,
    config: *const GyrfalconConfig,
    refusal: *mut GyrfalconRefusal,
) -> i32 {
    // SAFETY: the caller's promise.
    code_of(unsafe { configure(controller, memory_size, config, refusal) })
}

unsafe fn configure(
    controller: *mut GyrfalconController,
    memory_size: usize,
    config: *const GyrfalconConfig,
    refusal: *mut GyrfalconRefusal,
) -> Result<(), Failure> {
    let memory = access::memory(controller)?;
    if memory_size < GYRFALCON_CONTROLLER_SIZE {
        return Err(Failure(GYRFALCON_MEMORY_TOO_SMALL));
    }
    // SAFETY: the caller's promise.
    let (config, refusal) = unsafe { (access::input(config)?, access::optional(refusal)?) };
    let content = memory.cast::<Content>();
    // Field by field, so that the whole is not put together on the stack first.
    // SAFETY: not null, aligned, and large enough for the content (asserted above).
    unsafe {
        put_controller(config, refusal, &raw mut (*content).controller)?;
        (&raw mut (*content).state).write((*content).controller.initial_state());
        (&raw mut (*content).started).write(0.0);
        (&raw mut (*content).steps).write(0);
        (&raw mut (*content).mark).write(CONFIGURED);
    }
    Ok(())
}

/// Writes the controller of `config` to `place`, once every condition holds. Not inlined: its copies leave the
/// stack before the state is made.
///
/// # Safety
/// `place` may be written.
#[inline(never)]
unsafe fn put_controller(
    config: &GyrfalconConfig,
    refusal: Option<&mut GyrfalconRefusal>,
    place: *mut AnyController,
) -> Result<(), Failure> {
    match config.core_config()?.build() {
        // SAFETY: the caller's promise.
        Ok(controller) => unsafe { place.write(controller) },
        Err(error) => return Err(refused(&error, refusal)),
    }
    Ok(())
}

/// Puts the controller back to its initial state.
///
/// # Safety
/// `controller` is null or points to a controller.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyrfalcon_reset(controller: *mut GyrfalconController) -> i32 {
    // SAFETY: the caller's promise.
    let reset = unsafe { content(controller) }.map(|content| {
        content.begin(content.controller.initial_state(), 0.0);
    });
    code_of(reset)
}
