//! Pointers from C, turned into references once they have been checked.

use crate::result::Failure;
use crate::result::code::{
    GYRFALCON_MISALIGNED, GYRFALCON_NULL_POINTER, GYRFALCON_WRONG_STRUCT_SIZE,
};

/// A C struct whose first field is its own size as the caller's header has it (B).
pub(crate) trait Sized32: Sized {
    /// Size in this library (B).
    const SIZE: u32 = size_of::<Self>() as u32;
}

/// Refuses null pointers and pointers that are not aligned for their type.
#[inline(always)]
fn check<T>(pointer: *const T) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure(GYRFALCON_NULL_POINTER));
    }
    if !pointer.is_aligned() {
        return Err(Failure(GYRFALCON_MISALIGNED));
    }
    Ok(())
}

/// Refuses, besides, structs of another size than this library's.
///
/// # Safety
/// `pointer` is null or points to at least the `struct_size` of a struct.
#[inline(always)]
unsafe fn check_size<T: Sized32>(pointer: *const T) -> Result<(), Failure> {
    check(pointer)?;
    // SAFETY: not null, aligned, and the first four bytes are the caller's `struct_size`.
    let size = unsafe { pointer.cast::<u32>().read() };
    if size == T::SIZE { Ok(()) } else { Err(Failure(GYRFALCON_WRONG_STRUCT_SIZE)) }
}

/// The value behind an input pointer.
///
/// # Safety
/// `pointer` is null or points to a value that nobody changes meanwhile.
#[inline(always)]
pub(crate) unsafe fn input<'a, T: Sized32>(pointer: *const T) -> Result<&'a T, Failure> {
    // SAFETY: the caller's promise.
    unsafe { check_size(pointer)? };
    // SAFETY: not null, aligned, and of the size that the caller's `struct_size` confirms.
    Ok(unsafe { &*pointer })
}

/// The value behind an output pointer.
///
/// # Safety
/// `pointer` is null or points to a value that nobody else uses meanwhile.
#[inline(always)]
pub(crate) unsafe fn output<'a, T: Sized32>(pointer: *mut T) -> Result<&'a mut T, Failure> {
    // SAFETY: the caller's promise.
    unsafe { check_size(pointer.cast_const())? };
    // SAFETY: not null, aligned, and of the size that the caller's `struct_size` confirms.
    Ok(unsafe { &mut *pointer })
}

/// The value behind an output pointer that may be null: then nothing is written.
///
/// # Safety
/// As for [`output`].
#[inline(always)]
pub(crate) unsafe fn optional<'a, T: Sized32>(
    pointer: *mut T,
) -> Result<Option<&'a mut T>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    unsafe { output(pointer).map(Some) }
}

/// The plain value behind an input pointer, of a type without `struct_size`.
///
/// # Safety
/// `pointer` is null or points to a value.
#[inline(always)]
pub(crate) unsafe fn plain<T: Copy>(pointer: *const T) -> Result<T, Failure> {
    check(pointer)?;
    // SAFETY: not null and aligned.
    Ok(unsafe { pointer.read() })
}

/// Refuses null pointers to memory and such that are not aligned for `T`.
#[inline(always)]
pub(crate) fn memory<T>(pointer: *mut T) -> Result<*mut T, Failure> {
    check(pointer.cast_const())?;
    Ok(pointer)
}
