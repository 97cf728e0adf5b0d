//! The part of QEMU's plugin interface that is used here (`qemu-plugin.h`, version 1).

use core::ffi::{c_char, c_int, c_uint, c_void};

/// Handle that QEMU gives a plugin.
pub type PluginId = u64;

/// A block of guest instructions under translation.
#[repr(C)]
pub struct Block {
    _opaque: [u8; 0],
}

/// One guest instruction under translation.
#[repr(C)]
pub struct Instruction {
    _opaque: [u8; 0],
}

/// QEMU's information about itself; not used.
#[repr(C)]
pub struct Info {
    _opaque: [u8; 0],
}

/// The callback reads and writes no guest register.
pub const NO_REGISTERS: c_int = 0;

/// Called when an instruction is executed: virtual CPU, user data.
pub type ExecCallback = extern "C" fn(c_uint, *mut c_void);

unsafe extern "C" {
    pub fn qemu_plugin_register_vcpu_tb_trans_cb(
        id: PluginId,
        callback: extern "C" fn(PluginId, *mut Block),
    );
    pub fn qemu_plugin_register_atexit_cb(
        id: PluginId,
        callback: extern "C" fn(PluginId, *mut c_void),
        user: *mut c_void,
    );
    pub fn qemu_plugin_tb_n_insns(block: *const Block) -> usize;
    pub fn qemu_plugin_tb_get_insn(block: *const Block, index: usize) -> *mut Instruction;
    pub fn qemu_plugin_insn_vaddr(instruction: *const Instruction) -> u64;
    pub fn qemu_plugin_register_vcpu_insn_exec_cb(
        instruction: *mut Instruction,
        callback: ExecCallback,
        flags: c_int,
        user: *mut c_void,
    );
}

/// The arguments of `-plugin file,name=value,...` as strings.
///
/// # Safety
/// `argv` points at `argc` zero-terminated strings, as QEMU passes them.
pub unsafe fn arguments(argc: c_int, argv: *const *const c_char) -> Vec<String> {
    (0..usize::try_from(argc).unwrap_or(0))
        .map(|index| {
            // SAFETY: the caller promises `argc` valid strings.
            let text = unsafe { core::ffi::CStr::from_ptr(*argv.add(index)) };
            text.to_string_lossy().into_owned()
        })
        .collect()
}
