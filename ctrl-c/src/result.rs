//! Result codes of all functions, and the version of the interface.

use core::ffi::{CStr, c_char};

/// Version of this interface: of the layout of its structs and of the meaning of its codes.
pub const GYRFALCON_ABI_VERSION: u32 = 3;

/// Result codes.
pub mod code {
    /// Done.
    pub const GYRFALCON_OK: i32 = 0;
    /// The step's input or result cannot be used, and the last good wrench was given again:
    /// `status` of the output tells which.
    pub const GYRFALCON_OUTPUT_HELD: i32 = 1;
    /// A pointer that must not be null is null.
    pub const GYRFALCON_NULL_POINTER: i32 = -1;
    /// A pointer is not aligned for its type.
    pub const GYRFALCON_MISALIGNED: i32 = -2;
    /// `struct_size` of a struct is not that of this library.
    pub const GYRFALCON_WRONG_STRUCT_SIZE: i32 = -3;
    /// `abi_version` of the configuration is not that of this library.
    pub const GYRFALCON_WRONG_ABI_VERSION: i32 = -4;
    /// The memory is smaller than a controller.
    pub const GYRFALCON_MEMORY_TOO_SMALL: i32 = -5;
    /// The memory holds no controller.
    pub const GYRFALCON_NOT_CONFIGURED: i32 = -6;
    /// `kind` of the configuration is neither controller.
    pub const GYRFALCON_UNKNOWN_KIND: i32 = -7;
    /// A parameter is outside its bound: the refusal names it.
    pub const GYRFALCON_PARAMETER_REFUSED: i32 = -8;
}

use code::*;

/// A result that is not [`GYRFALCON_OK`], on its way out of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Failure(pub i32);

/// The code of a function that has nothing but success to report.
pub(crate) fn code_of(result: Result<(), Failure>) -> i32 {
    match result {
        Ok(()) => GYRFALCON_OK,
        Err(Failure(code)) => code,
    }
}

/// A sentence for a result code, in static memory; never null.
#[unsafe(no_mangle)]
pub extern "C" fn gyrfalcon_result_text(result: i32) -> *const c_char {
    text(result).as_ptr()
}

fn text(result: i32) -> &'static CStr {
    match result {
        GYRFALCON_OK => c"done",
        GYRFALCON_OUTPUT_HELD => c"input or result unusable, last wrench held: see the status",
        GYRFALCON_NULL_POINTER => c"null pointer",
        GYRFALCON_MISALIGNED => c"pointer not aligned for its type",
        GYRFALCON_WRONG_STRUCT_SIZE => c"struct_size is not that of the library's header",
        GYRFALCON_WRONG_ABI_VERSION => c"abi_version is not that of the library's header",
        GYRFALCON_MEMORY_TOO_SMALL => c"memory smaller than gyrfalcon_controller_size()",
        GYRFALCON_NOT_CONFIGURED => c"no controller in this memory: call gyrfalcon_configure",
        GYRFALCON_UNKNOWN_KIND => c"kind is neither controller",
        GYRFALCON_PARAMETER_REFUSED => c"parameter outside its bound: see the refusal",
        _ => c"not a result code of this library",
    }
}
