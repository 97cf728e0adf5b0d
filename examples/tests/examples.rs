//! Every example runs, holds its assertions and prints; none is longer than a reader likes.

use std::process::Command;

fn run(program: &str, source: &str) {
    let output = Command::new(program).output().expect("the example starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert!(!output.stdout.is_empty(), "nothing was printed");
    let lines = source.lines().count();
    assert!(lines < 100, "{lines} lines: an example has fewer than 100");
}

macro_rules! examples {
    ($($name:ident),*) => {
        $(#[test]
        fn $name() {
            let program = env!(concat!("CARGO_BIN_EXE_", stringify!($name)));
            run(program, include_str!(concat!("../", stringify!($name), ".rs")));
        })*
    };
}

examples!(own_controller, own_disturbance, own_monitor, own_trajectory);
