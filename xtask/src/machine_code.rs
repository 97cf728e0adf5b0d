//! Forbidden and required instructions in a control step's machine code.

use anyhow::{Result, ensure};

use crate::call_graph::CallGraph;
use crate::sources::Sources;
use crate::step_image::{CONTROLLERS, NONE, STEP, StepImage};
use crate::{allocation, estimator, filter};

/// Parts of function names, and why a step must not reach such a function.
const FORBIDDEN: [(&str, &str); 10] = [
    ("panic", "the step must not be able to panic"),
    ("unwrap_failed", "the step must not be able to panic"),
    ("expect_failed", "the step must not be able to panic"),
    ("slice_", "a slice index that can fail panics"),
    ("__aeabi_d", "software double precision"),
    ("__aeabi_f", "software single precision"),
    ("__aeabi_mem", "a copy loop: hand values over in registers or by reference"),
    ("mem::mem", "a copy loop: hand values over in registers or by reference"),
    ("float::", "a software float routine of compiler_builtins"),
    ("sqrt", "a software square root: use ctrl_core::sqrt"),
];

/// Old names of the soft-float routines end so, `__adddf3` for one.
const SOFT_ENDINGS: [&str; 10] =
    ["df3", "df2", "sf3", "sf2", "dfsi", "sfsi", "sidf", "sisf", "dfdi", "sfdi"];

/// Copies of arrays of fixed sizes, which estimator and allocation may reach.
const COPIES: [&str; 2] = ["__aeabi_mem", "mem::mem"];

/// Reason that the step must not reach a function of this name, if there is one.
fn objection(name: &str) -> Option<&'static str> {
    let part = FORBIDDEN.iter().find(|(part, _)| name.contains(part)).map(|(_, reason)| *reason);
    let soft = name.starts_with("__") && SOFT_ENDINGS.iter().any(|end| name.ends_with(end));
    part.or(soft.then_some("a software float routine"))
}

/// Faults of the machine code that one controller's step can reach, but for functions with an `allowed` part in
/// their names. A step `without_root` needs no hardware square root.
pub fn faults(
    graph: &CallGraph,
    sources: &Sources,
    allowed: &[&str],
    without_root: bool,
) -> Result<Vec<String>> {
    let (mut faults, mut roots) = (Vec::new(), 0);
    for node in graph.nodes() {
        let name = &node.function.name;
        if allowed.iter().any(|part| name.contains(part)) {
            continue;
        }
        if let Some(reason) = objection(name) {
            faults.push(format!("{reason}: the step reaches `{name}`"));
            for caller in graph.callers(node) {
                for frame in sources.frames(caller)? {
                    faults.push(format!("  from {frame}"));
                }
            }
            continue;
        }
        for (address, instruction) in &node.instructions {
            match instruction.name() {
                "vsqrt.f32" => roots += 1,
                "udf" | "bkpt" | "svc" => {
                    faults.push(format!("`{}` at {address:#x} in `{name}`", instruction.mnemonic));
                }
                _ => {}
            }
        }
    }
    if roots == 0 && !without_root {
        faults.push("no vsqrt.f32: the square root is not the hardware's".to_owned());
    }
    Ok(faults)
}

/// The check must be able to fail: an image's own harness has all that a step must not have.
fn detects_bad_code() -> Result<()> {
    let image = StepImage::open(NONE)?;
    let harness = CallGraph::walk(&image.image, &image.listing, "main");
    let refused = harness.err().is_some_and(|error| format!("{error:#}").contains("indirect"));
    ensure!(refused, "the walk follows the harness, which calls through a pointer");
    let faults = faults(&image.graph, &Sources::open(&image.path)?, &[], false)?;
    ensure!(!faults.is_empty(), "no fault found in a step without a square root");
    Ok(())
}

/// Checks every controller's image and reports what its step consists of.
pub fn check_all() -> Result<()> {
    crate::step_image::build()?;
    let mut good = true;
    detects_bad_code()?;
    let steps = CONTROLLERS.map(|controller| (controller, STEP));
    let estimator = estimator::FUNCTIONS.map(|function| (estimator::IMAGE, function));
    let rootless = [
        (filter::IMAGE, filter::FUNCTION),
        (allocation::IMAGE, allocation::FUNCTION),
        (allocation::IMAGE, allocation::LOSE),
    ];
    for (name, function) in steps.into_iter().chain(estimator).chain(rootless) {
        let image = StepImage::open_at(name, function)?;
        let size = image.graph.code_size();
        println!("{name}, {function}: {size} B of code in");
        for node in image.graph.nodes() {
            println!("  {}", node.function.name);
        }
        let copies = [estimator::IMAGE, allocation::IMAGE].contains(&name);
        let allowed: &[&str] = if copies { &COPIES } else { &[] };
        let without_root = rootless.iter().any(|(rootless, _)| *rootless == name);
        let faults = faults(&image.graph, &Sources::open(&image.path)?, allowed, without_root)?;
        faults.iter().for_each(|fault| println!("  ! {fault}"));
        good &= faults.is_empty();
        match image.graph.stack(&image.image) {
            Ok(stack) => println!("  at most {} B of stack", stack.bytes),
            Err(error) => {
                println!("  ! {error}");
                good = false;
            }
        }
    }
    ensure!(good, "the machine code of a control step is not as it must be, see above");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::objection;

    #[test]
    fn names_of_bad_functions_are_known() {
        for name in [
            "core::panicking::panic_fmt",
            "core::panicking::panic_bounds_check",
            "core::option::unwrap_failed",
            "__aeabi_dadd",
            "__aeabi_f2d",
            "__muldf3",
            "compiler_builtins::float::mul::__mulsf3",
            "__aeabi_memcpy4",
            "compiler_builtins::mem::memcpy",
            "libm::math::sqrtf::sqrtf",
        ] {
            assert!(objection(name).is_some(), "{name}");
        }
        assert_eq!(objection("ctrl_core::saturation::tanh"), None);
        assert_eq!(objection("controller_step"), None);
    }
}
