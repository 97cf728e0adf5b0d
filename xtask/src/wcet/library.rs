//! Bounds inside libraries, whose sources cannot be annotated, and the routines that copy and clear.

use super::limit::Unit;

/// A bound inside a library.
pub struct Known {
    /// Part of the demangled name of the function.
    pub part: &'static str,
    /// The bound.
    pub most: u64,
    /// Its unit.
    pub unit: Unit,
    /// Why it holds.
    pub reason: &'static str,
}

const fn known(part: &'static str, most: u64, unit: Unit, reason: &'static str) -> Known {
    Known { part, most, unit, reason }
}

/// All of them; the innermost function decides for a loop, the least for a length.
pub const LIBRARY: &[Known] = &[
    known("remove_trailing_zeroes", 255, Unit::Iterations, "bytes of a payload of MAVLink"),
    known("mavlink_core::MessageData", 255, Unit::Bytes, "bytes of a payload of MAVLink"),
    known("mavlink_core::calculate_crc", 280, Unit::Iterations, "bytes of a frame of MAVLink"),
    known("floor_char_boundary", 4, Unit::Iterations, "bytes of a character"),
    known("u64_div_rem", 64, Unit::Iterations, "bits of the quotient"),
    known("varint_u16", 3, Unit::Iterations, "7 bits of 16 per byte"),
    known("varint_u32", 5, Unit::Iterations, "7 bits of 32 per byte"),
    known("varint_u64", 10, Unit::Iterations, "7 bits of 64 per byte"),
    known("varint_usize", 5, Unit::Iterations, "7 bits of 32 per byte"),
    known("try_push_varint", 10, Unit::Bytes, "the longest varint"),
    known("postcard::ser::", 96, Unit::Bytes, "the longest text of a message, link::TEXT_MAX"),
    known("VecInner", 96, Unit::Bytes, "the longest text of a message, link::TEXT_MAX"),
    known("Serialize for [T; 4]", 4, Unit::Iterations, "elements of the array"),
    known("Serialize for [T; 14]", 14, Unit::Iterations, "elements of the array"),
    known("crc::crc32::", 199, Unit::Iterations, "bytes of a frame, link::MAX_PAYLOAD"),
    known(
        "run_utf8_validation",
        48,
        Unit::IterationsInAll,
        "one name of link::NAME_MAX bytes: a release handles one message that has any",
    ),
    known("defmt_rtt::channel::Channel", 1, Unit::Bytes, "written byte by byte"),
    known("atomic_compare_exchange", 4, Unit::Iterations, "again only behind an interrupt"),
    known("defmt::encoding::inner::Encoder::write", 8, Unit::Iterations, "an argument, no text"),
];

/// Routines that copy, clear or compare, and the register that has the number of bytes.
const ROUTINES: &[(&str, u8)] = &[
    ("memcpy", 2),
    ("memmove", 2),
    ("memset", 2),
    ("memcmp", 2),
    ("__aeabi_memcpy", 2),
    ("__aeabi_memmove", 2),
    ("__aeabi_memset", 1),
    ("__aeabi_memclr", 1),
];

/// Register with the number of bytes, for a routine that copies, clears or compares.
pub fn routine(name: &str) -> Option<u8> {
    let bare = name.rsplit("::").next().unwrap_or(name).trim_end_matches(['4', '8']);
    let known = |library: &str| name == library || name.starts_with("compiler_builtins::");
    let found = ROUTINES.iter().find(|(routine, _)| *routine == bare)?;
    (known(name.trim_start_matches("compiler_builtins::mem::")) || bare == name).then_some(found.1)
}

/// `true` for routines that copy whole words once there are 16 bytes.
pub fn copies_words(name: &str) -> bool {
    !name.contains("memcmp")
}

/// `true` for the name of a function that ends the program.
pub fn aborts(name: &str) -> bool {
    [
        "core::panicking::",
        "core::slice::index::slice_",
        "_defmt_panic",
        "firmware::fault::fail",
        "firmware::board::emulator::end_run",
    ]
    .iter()
    .any(|part| name.starts_with(part))
}
