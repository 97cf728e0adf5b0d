//! QEMU plugin: how many instructions each call of one function executes, and how often each
//! instruction of it is executed.
//!
//! ```text
//! -plugin libinsn_count.so,entry=0x8000400,range=0x8000400-0x8000900,out=counts.txt
//! ```
//!
//! Or, with tasks that interrupt each other: `tasks=FILE`, a description as `tasks::parse` reads it, and `out`.
//!
//! Counting starts when `entry` is executed and ends with the first instruction outside all
//! `range`s (the function and everything it can call). The file `out` then has a line
//! `call COUNT` for every call in order, and a line `pc ADDRESS COUNT` for every instruction.

mod qemu;
mod tasks;

use core::ffi::{c_char, c_int, c_uint, c_void};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

use qemu::{Block, Info, PluginId};

/// Read by QEMU when it loads the plugin.
#[unsafe(no_mangle)]
pub static qemu_plugin_version: c_int = 1;

struct Settings {
    entry: u64,
    ranges: Vec<Range<u64>>,
    out: String,
}

/// One guest instruction and how often it was executed while counting.
struct Site {
    executed: AtomicU64,
}

struct Plugin {
    settings: Settings,
    sites: BTreeMap<u64, &'static Site>,
    calls: Vec<u64>,
}

static PLUGIN: Mutex<Option<Plugin>> = Mutex::new(None);
static COUNTING: AtomicBool = AtomicBool::new(false);
static EXECUTED: AtomicU64 = AtomicU64::new(0);

/// Called by QEMU once; non-zero refuses to start.
///
/// # Safety
/// Called by QEMU, with its own valid arguments.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn qemu_plugin_install(
    id: PluginId,
    _info: *const Info,
    argc: c_int,
    argv: *const *const c_char,
) -> c_int {
    // SAFETY: QEMU passes `argc` strings.
    let arguments = unsafe { qemu::arguments(argc, argv) };
    if let Some((described, out)) = tasks_and_out(&arguments) {
        // SAFETY: `id` is QEMU's.
        return unsafe { install_tasks(id, &described, out) };
    }
    let Some(settings) = parse(&arguments) else {
        eprintln!("insn-count: need entry=, range= and out=, got {arguments:?}");
        return 1;
    };
    let plugin = Plugin { settings, sites: BTreeMap::new(), calls: Vec::new() };
    *PLUGIN.lock().expect("single-threaded start") = Some(plugin);
    // SAFETY: `id` is QEMU's; both callbacks live as long as the library.
    unsafe {
        qemu::qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
        qemu::qemu_plugin_register_atexit_cb(id, on_exit, core::ptr::null_mut());
    }
    0
}

fn tasks_and_out(arguments: &[String]) -> Option<(String, String)> {
    let value = |key: &str| arguments.iter().find_map(|argument| argument.strip_prefix(key));
    Some((value("tasks=")?.to_owned(), value("out=")?.to_owned()))
}

/// Tasks under measurement.
struct Measured {
    tasks: tasks::Tasks,
    roles: BTreeMap<u64, tasks::Role>,
    ranges: Vec<Range<u64>>,
    out: String,
}

/// Calls of tasks after which the counts are written.
const WRITTEN_EVERY: u64 = 250;

static MEASURED: Mutex<Option<Measured>> = Mutex::new(None);

/// # Safety
/// `id` is that of QEMU.
unsafe fn install_tasks(id: PluginId, file: &str, out: String) -> c_int {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let Some((tasks, roles, ranges)) = tasks::parse(&text) else {
        eprintln!("insn-count: {file} is no description of tasks");
        return 1;
    };
    *MEASURED.lock().expect("single-threaded start") = Some(Measured { tasks, roles, ranges, out });
    // SAFETY: `id` is QEMU's; both callbacks live as long as the library.
    unsafe {
        qemu::qemu_plugin_register_vcpu_tb_trans_cb(id, on_task_translation);
        qemu::qemu_plugin_register_atexit_cb(id, on_tasks_exit, core::ptr::null_mut());
    }
    0
}

extern "C" fn on_task_translation(_id: PluginId, block: *mut Block) {
    let measured = MEASURED.lock().expect("no callback panics");
    let Some(measured) = measured.as_ref() else { return };
    // SAFETY: `block` is valid during this call, the index is below the count it reports, and the user data
    // is a leaked role.
    unsafe {
        for index in 0..qemu::qemu_plugin_tb_n_insns(block) {
            let instruction = qemu::qemu_plugin_tb_get_insn(block, index);
            let pc = qemu::qemu_plugin_insn_vaddr(instruction);
            let mut role = measured.roles.get(&pc).cloned().unwrap_or_default();
            role.counts = measured.ranges.iter().any(|range| range.contains(&pc));
            if role == tasks::Role::default() {
                continue;
            }
            let role: &'static tasks::Role = Box::leak(Box::new(role));
            qemu::qemu_plugin_register_vcpu_insn_exec_cb(
                instruction,
                on_task_instruction,
                qemu::NO_REGISTERS,
                core::ptr::from_ref(role).cast_mut().cast(),
            );
        }
    }
}

extern "C" fn on_task_instruction(_cpu: c_uint, user: *mut c_void) {
    // SAFETY: registered with a leaked role, see `on_task_translation`.
    let role = unsafe { &*user.cast::<tasks::Role>() };
    if let Some(measured) = MEASURED.lock().expect("no callback panics").as_mut() {
        measured.tasks.executed(role);
        // The emulator may be killed, which leaves no time for a callback at its end.
        if role.ends && measured.tasks.calls().is_multiple_of(WRITTEN_EVERY) {
            write(measured);
        }
    }
}

extern "C" fn on_tasks_exit(_id: PluginId, _user: *mut c_void) {
    let measured = MEASURED.lock().expect("no callback panics");
    if let Some(measured) = measured.as_ref() {
        write(measured);
    }
}

fn write(measured: &Measured) {
    if let Err(error) = std::fs::write(&measured.out, measured.tasks.report()) {
        eprintln!("insn-count: {}: {error}", measured.out);
    }
}

fn parse(arguments: &[String]) -> Option<Settings> {
    let (mut entry, mut ranges, mut out) = (None, Vec::new(), None);
    for argument in arguments {
        match argument.split_once('=')? {
            ("entry", value) => entry = Some(address(value)?),
            ("range", value) => {
                let (start, end) = value.split_once('-')?;
                ranges.push(address(start)?..address(end)?);
            }
            ("out", value) => out = Some(value.to_owned()),
            _ => return None,
        }
    }
    Some(Settings { entry: entry?, ranges, out: out? })
}

fn address(text: &str) -> Option<u64> {
    u64::from_str_radix(text.strip_prefix("0x")?, 16).ok()
}

extern "C" fn on_translation(_id: PluginId, block: *mut Block) {
    let mut plugin = PLUGIN.lock().expect("no callback panics");
    let Some(plugin) = plugin.as_mut() else { return };
    // SAFETY: `block` is valid during this call, the index is below the count it reports, and the
    // user data is null or a leaked `Site`.
    unsafe {
        for index in 0..qemu::qemu_plugin_tb_n_insns(block) {
            let instruction = qemu::qemu_plugin_tb_get_insn(block, index);
            let pc = qemu::qemu_plugin_insn_vaddr(instruction);
            let inside = plugin.settings.ranges.iter().any(|range| range.contains(&pc));
            let (callback, user): (qemu::ExecCallback, _) = if inside {
                let site = *plugin
                    .sites
                    .entry(pc)
                    .or_insert_with(|| Box::leak(Box::new(Site { executed: AtomicU64::new(0) })));
                let entry = pc == plugin.settings.entry;
                (if entry { on_entry } else { on_inside }, core::ptr::from_ref(site))
            } else {
                (on_outside, core::ptr::null())
            };
            let user = user.cast_mut().cast();
            qemu::qemu_plugin_register_vcpu_insn_exec_cb(
                instruction,
                callback,
                qemu::NO_REGISTERS,
                user,
            );
        }
    }
}

extern "C" fn on_entry(cpu: c_uint, user: *mut c_void) {
    COUNTING.store(true, Relaxed);
    EXECUTED.store(0, Relaxed);
    on_inside(cpu, user);
}

extern "C" fn on_inside(_cpu: c_uint, user: *mut c_void) {
    if !COUNTING.load(Relaxed) {
        return;
    }
    EXECUTED.store(EXECUTED.load(Relaxed) + 1, Relaxed);
    // SAFETY: registered with a leaked `Site`, see `on_translation`.
    let executed = unsafe { &(*user.cast::<Site>()).executed };
    executed.store(executed.load(Relaxed) + 1, Relaxed);
}

extern "C" fn on_outside(_cpu: c_uint, _user: *mut c_void) {
    if !COUNTING.swap(false, Relaxed) {
        return;
    }
    if let Some(plugin) = PLUGIN.lock().expect("no callback panics").as_mut() {
        plugin.calls.push(EXECUTED.load(Relaxed));
    }
}

extern "C" fn on_exit(_id: PluginId, _user: *mut c_void) {
    let plugin = PLUGIN.lock().expect("no callback panics");
    let Some(plugin) = plugin.as_ref() else { return };
    let mut text = String::new();
    for count in &plugin.calls {
        let _ = writeln!(text, "call {count}");
    }
    for (pc, site) in &plugin.sites {
        let _ = writeln!(text, "pc {pc:#x} {}", site.executed.load(Relaxed));
    }
    if let Err(error) = std::fs::write(&plugin.settings.out, text) {
        eprintln!("insn-count: {}: {error}", plugin.settings.out);
    }
}
